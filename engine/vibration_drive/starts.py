"""Each case from many starts, and the regimes to which these come (docs/theory.md, "Coexisting motions")."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Basin
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.cases import case_matrix, default_of, of_cases, pendulum_count
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.same_motions import Motions
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.start_results import REGIME_INFOS, started_infos
from sprag_study.engine.vibration_drive.strobes import PENDULUM_WIDTH, SHAFT_WIDTH, width

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: How many times as long starts without an orbit are run where their case seems to have several regimes, and then those
#: that are left where others came to an orbit by that.
LONGER = (4, 16)
#: Starts that are run together: this bounds the memory, and changes no result.
TOGETHER = 4096
#: Periods that starts are run again together, for the same reason.
PERIODS_TOGETHER = 4000 * TOGETHER
#: 97.5 % point of the normal distribution.
_NORMAL = 1.959963984540054
_OK = ENDINGS.index(Ending.OK)


@dataclass(frozen=True, slots=True)
class StartedBatch:
    """Regimes of a batch of cases with many starts.

    Attributes
    ----------
    values : array, shape (cases, results)
        The most frequent regime of each case, in the order of ``started_infos(pendulums)``.
    endings : int8 array, shape (cases,)
        Index into ``sprag_study.engine.endings.ENDINGS``: ok if any start ends ok, otherwise that of the case's own
        start.
    further : int64 array, shape (regimes,)
        Row in ``values`` of the case of each further regime, ascending.
    further_values : array, shape (regimes, results)
        The further regimes, those of a case by falling share.
    members : int64 array, shape (cases, starts)
        Number of the regime to which each start comes; -1 where it did not end ok.
    points, further_points : arrays, shapes (cases, strobes.width(n)) and (regimes, strobes.width(n))
        States at strobes of these motions, as of a ``SettledBatch``.
    """

    values: Floats
    endings: NDArray[np.int8]
    further: Ints
    further_values: Floats
    members: Ints
    points: Floats
    further_points: Floats

    def motions(self, *, further: bool) -> SettledBatch:
        """The most frequent regime of each case, or the further regimes, as ``settle`` gives settled motions."""
        values, points = (self.further_values, self.further_points) if further else (self.values, self.points)
        n = (points.shape[1] - SHAFT_WIDTH) // PENDULUM_WIDTH
        names = [info.name for info in settled_infos(n)]
        regimes = np.nan_to_num(values[:, names.index("regime")]).astype(np.int8)
        endings = np.full(len(values), _OK, dtype=np.int8) if further else self.endings
        return SettledBatch(values[:, : len(names)], endings, regimes, points, np.zeros(len(values)))


def wilson(reached: ArrayLike, starts: int) -> tuple[Floats, Floats]:
    """95 % interval of the share ``reached / starts`` (Wilson, J. Am. Stat. Assoc. 22 (1927) 209)."""
    share = np.asarray(reached, dtype=np.float64) / starts
    square = np.square(_NORMAL)
    middle = (share + square / (2 * starts)) / (1 + square / starts)
    half = _NORMAL / (1 + square / starts) * np.sqrt(share * (1 - share) / starts + square / (4 * np.square(starts)))
    # Without rounding errors the ends of a share of 0 or 1 are 0 or 1.
    return np.clip(middle - half, 0.0, share), np.clip(middle + half, share, 1.0)


def settle_starts(
    columns: Mapping[str, ArrayLike], settings: SettledRun, starts: Mapping[str, ArrayLike], *, cases: int
) -> StartedBatch:
    """Find the regimes to which each case comes from its own start and from further ones.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``.
    settings : SettledRun
    starts : mapping
        Paths of initial values to those of the further starts, shape (starts - 1,), SI: the same for all cases.
    cases : int

    Returns
    -------
    StartedBatch
        Of a case, the same bits in any batch.

    Raises
    ------
    ValueError
        As ``settle``, and where the starts differ in number.
    """
    own = {path: np.asarray(values, dtype=np.float64).reshape(-1) for path, values in starts.items()}
    counts = {len(values) for values in own.values()} or {0}
    if len(counts) > 1:
        raise ValueError("every initial value needs the same number of starts")
    count = 1 + counts.pop()
    parts: list[StartedBatch] = []
    step = max(1, TOGETHER // count)
    for first in range(0, cases, step):
        some = of_cases(columns, slice(first, first + step))
        parts.append(_settle_together(some, settings, own, count, min(step, cases - first)))
    if len(parts) == 1:
        return parts[0]
    n = pendulum_count(columns)
    infos = len(started_infos(n))
    nothing = StartedBatch(
        np.empty((0, infos)),
        np.empty(0, np.int8),
        np.empty(0, np.int64),
        np.empty((0, infos)),
        np.empty((0, count), np.int64),
        np.empty((0, width(n))),
        np.empty((0, width(n))),
    )
    parts = parts or [nothing]
    return StartedBatch(
        np.concatenate([part.values for part in parts]),
        np.concatenate([part.endings for part in parts]),
        np.concatenate([part.further + k * step for k, part in enumerate(parts)]),
        np.concatenate([part.further_values for part in parts]),
        np.concatenate([part.members for part in parts]),
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.further_points for part in parts]),
    )


def started_columns(
    columns: Mapping[str, ArrayLike], starts: Mapping[str, Floats], count: int, cases: int
) -> dict[str, Floats]:
    """The columns of every start of every case: those of a case side by side, its own start first."""
    spread: dict[str, Floats] = {}
    for path, value in columns.items():
        column = np.asarray(value, dtype=np.float64)
        spread[path] = np.repeat(column, count) if column.ndim else column
    for path, values in starts.items():
        own = np.broadcast_to(np.asarray(columns.get(path, default_of(path)), dtype=np.float64), (cases,))
        rows = np.column_stack([own, np.broadcast_to(values, (cases, count - 1))])
        spread[path] = rows.reshape(-1)
    return spread


def _settle_together(
    columns: Mapping[str, ArrayLike], settings: SettledRun, starts: Mapping[str, Floats], count: int, cases: int
) -> StartedBatch:
    """The same for cases that are run together."""
    spread = started_columns(columns, starts, count, cases)
    settled = settle(spread, settings, cases=cases * count)
    module = kernel_of(columns, settings.tolerance)
    matrix = case_matrix(spread, settings.run, cases * count)
    motions = Motions(module, matrix, settings, settled)
    going = _without_orbit(motions, count)
    for times in LONGER:
        if len(going):
            _run_again(spread, replace(settings, at_most=times * settings.at_most), settled, going)
            motions = Motions(module, matrix, settings, settled)
            arrived = going[motions.repeats[going]] // count
            going = _without_orbit(motions, count)
            going = going[np.isin(going // count, arrived)]
    own: list[Floats] = []
    further: list[Floats] = []
    firsts: list[int] = []
    later: list[int] = []
    rows: list[int] = []
    members = np.full((cases, count), -1, dtype=np.int64)
    endings = np.empty(cases, dtype=np.int8)
    for case in range(cases):
        lanes = np.arange(case * count, (case + 1) * count)
        endings[case] = _OK if motions.ok[lanes].any() else settled.endings[lanes[0]]
        groups = motions.regimes(lanes)
        for number, group in enumerate(groups):
            members[case, group - lanes[0]] = number
        found = _rows(settled.values, groups, lanes)
        own.append(found[0])
        further.append(found[1:])
        rows += [case] * (len(found) - 1)
        begun = [int(group[0]) for group in groups] or [int(lanes[0])]
        firsts.append(begun[0])
        later += begun[1:]
    return StartedBatch(
        np.stack(own), endings, np.array(rows, dtype=np.int64), np.concatenate(further), members,
        settled.points[firsts], settled.points[later],
    )  # fmt: skip


def _without_orbit(motions: Motions, count: int) -> Ints:
    """The starts without an orbit of the cases that seem to have several regimes.

    Chaotic transients last for a random time: an irregular motion beside another one is a transient more often than
    not, and one that some starts have left will be left by the others.
    """
    found = [np.empty(0, dtype=np.int64)]
    for first in range(0, len(motions.ok), count):
        lanes = np.arange(first, first + count)
        if len(motions.regimes(lanes)) > 1:
            found.append(lanes[motions.ok[lanes] & ~motions.repeats[lanes]])
    return np.concatenate(found)


def _run_again(columns: Mapping[str, Floats], settings: SettledRun, settled: SettledBatch, rows: Ints) -> None:
    """Run some starts from their beginning; replaces what they came to."""
    step = max(1, PERIODS_TOGETHER // settings.at_most)
    for first in range(0, len(rows), step):
        some = rows[first : first + step]
        longer = settle(of_cases(columns, some), settings, cases=len(some))
        settled.values[some], settled.endings[some] = longer.values, longer.endings
        settled.regimes[some], settled.points[some] = longer.regimes, longer.points


def _rows(values: Floats, groups: list[Ints], lanes: Ints) -> Floats:
    """A row for each regime of a case, by falling share, and those of equal shares by their first start."""
    failed = len(lanes) - sum(map(len, groups))
    if not groups:
        return np.full((1, values.shape[1] + len(REGIME_INFOS)), math.nan)
    reached = np.array([len(group) for group in groups])
    share = reached / len(lanes)
    low, high = wilson(reached, len(lanes))
    first = np.array([group[0] for group in groups])
    regime = np.column_stack(
        [
            np.arange(len(groups)), np.full(len(groups), len(groups)), share, low, high,
            np.full(len(groups), share.min()), first - lanes[0], np.full(len(groups), failed),
        ]
    )  # fmt: skip
    return np.column_stack([values[first], regime])


def basin(
    columns: Mapping[str, ArrayLike], settings: SettledRun, paths: tuple[str, str], x: Floats, y: Floats
) -> Basin:
    """The regimes to which one case comes from every pair of the initial values ``x`` and ``y`` of two ``paths``.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    settings : SettledRun
    paths : tuple of two str
    x, y : arrays, shapes (k,) and (m,), SI
    """
    across, along = (part.reshape(-1) for part in np.meshgrid(x, y))
    first = {**columns, paths[0]: across[0], paths[1]: along[0]}
    found = settle_starts(first, settings, {paths[0]: across[1:], paths[1]: along[1:]}, cases=1)
    names = tuple(info.name for info in started_infos(pendulum_count(columns)))
    ok = ENDINGS[int(found.endings[0])] is Ending.OK
    values = np.concatenate([found.values if ok else found.values[:0], found.further_values])
    return Basin(x, y, found.members.reshape(len(y), len(x)), names, values)
