"""The rows of a batch of drives, place by place: a place is a point of the axes, at which every drive has a case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import plural
from sprag_study.service.faults import refused
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.results.curve_cases import select
from sprag_study.service.results.curves import CurveQuery, Fetch, Pairs, not_run
from sprag_study.service.results.defaults import main_query
from sprag_study.service.results.refined import Line
from sprag_study.service.results.regimes import kind_columns
from sprag_study.service.results.selection import axis_name, held_texts, locate_axes
from sprag_study.worker import models
from sprag_study.worker.codes import PENDING
from sprag_study.worker.spread import DRIVE
from sprag_study.worker.study import without_drives

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.storage.studies.records import CaseColumns
    from sprag_study.worker.arrays import Bools, Floats, Ints
    from sprag_study.worker.study import Study

#: Cases whose rows are in memory at one time, unless a single place has more.
BLOCK_CASES: Final = 50_000


@dataclass(frozen=True, slots=True)
class Asked:
    """Which places: a line of them over ``x`` for each combination of ``by``, other axes held ``at`` values.

    Without ``x`` there is a single place, or the axis that curves are drawn over where one is left open.
    """

    x: str | None = None
    by: tuple[str, ...] = ()
    at: Pairs = ()


@dataclass(frozen=True, slots=True)
class Places:
    """The places that were asked for.

    Attributes
    ----------
    x : path of the axis along each line; None where each line is a single place
    units, names : unit and name for display of every path of lines
    held : the fixed parameters with their values, for display
    lines : their ``cases`` are those of the nominal drive
    """

    study: Study
    x: str | None
    units: dict[str, str]
    names: dict[str, str]
    held: tuple[str, ...]
    lines: tuple[Line, ...]


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows of all drives at some neighbouring places; drive 0 is the nominal one.

    Attributes
    ----------
    at : where its places are in their line
    cases : int64 array, shape (places, drives + 1); -1 where a drive has no case
    values : by result, shape (places, drives + 1); NaN for a case that is not run yet, has failed or is unsettled
    done : bool array, shape (places, drives + 1): which cases were run
    """

    at: slice
    cases: Ints
    values: dict[str, Floats]
    done: Bools


def places_of(study: Study, asked: Asked) -> Places:
    """The places of a study with tolerances.

    Raises
    ------
    SelectionError
        For a study without tolerances, an unknown path, a value that is not on its axis, an open axis.
    """
    if study.spread is None:
        raise refused("x", "not-used", "the study has no tolerances", allowed="a study with `tolerances`")
    if study.plan is not None:
        raise refused("x", "not-used", "the study chooses its own cases", allowed="a study whose axes are given")
    for parameter, paths in (("x", (asked.x,)), ("by", asked.by), ("at", [path for path, _ in asked.at])):
        if DRIVE in paths:
            raise refused(parameter, "not-an-axis", "every drive counts", DRIVE, allowed="another axis")
    asked = _completed(study, asked)
    nominal = (*asked.at, (DRIVE, "0"))
    if asked.x is not None:
        chosen = select(study, CurveQuery(asked.x, tuple(models.results_by_name(study))[:1], asked.by, nominal))
        x, lines = asked.x, chosen.lines
    else:
        x, lines = None, (_single(study, nominal),)
    lines = tuple(replace(line, at={path: value for path, value in line.at.items() if path != DRIVE}) for line in lines)
    paths = [*([x] if x else []), *lines[0].by, *lines[0].at]
    return Places(
        study,
        x,
        {path: unit_of(study, path) for path in paths},
        {path: axis_name(study, path) for path in paths},
        held_texts(study, lines[0].at),
        lines,
    )


def _completed(study: Study, asked: Asked) -> Asked:
    """The request with an x where it has none and an axis is open; then other open axes have their usual values."""
    if asked.x is not None:
        return asked
    taken = {study.axis_of(path) for path in (*asked.by, *(path for path, _ in asked.at))}
    main = main_query(study)
    if main is None:
        return asked
    roles = [path for path in (main.x, *main.by) if path != DRIVE and study.axis_of(path) not in taken]
    held = tuple(pair for pair in main.at if pair[0] != DRIVE and study.axis_of(pair[0]) not in taken)
    if not roles:
        open_axis = next((path for path, _ in held), None)
        return Asked(open_axis, asked.by, (*asked.at, *held[1:]))
    return Asked(roles[0], (*asked.by, *roles[1:]), (*asked.at, *held))


def _single(study: Study, at: Pairs) -> Line:
    """The one place at these values."""
    fixed = locate_axes(study, at)
    values = {path: study.axes[axis].value(index) for axis, (path, index) in fixed.items()}
    cases = study.cases_at(values)
    if cases.size != 1:
        message = plural("{count} place has these values", "{count} places have these values", int(cases.size))
        raise refused("at", "not-fixed" if cases.size else "unknown-value", message, allowed="values of a single place")
    return Line({}, values, (), cases)


def read(places: Places, line: Line, names: Sequence[str], fetch: Fetch) -> Iterator[Rows]:
    """The rows of a line, some places at a time, so that memory does not grow with the number of places."""
    drives = places.study.drives + 1
    regime, needed = models.regime_info(models.study_results(places.study)), list(dict.fromkeys(names))
    at_once = max(BLOCK_CASES // drives, 1)
    for first in range(0, line.cases.size, at_once):
        part = slice(first, min(first + at_once, line.cases.size))
        cases = drive_cases(places.study, line.cases[part])
        present = cases >= 0
        columns = fetch(cases[present], needed)
        endings = np.full(cases.shape, PENDING, dtype=object)
        endings[present] = [ending or PENDING for ending in columns.endings]
        values = {name: np.full(cases.shape, np.nan) for name in needed}
        for name, column in columns.values.items():
            values[name][present] = column
        missing = np.zeros(cases.shape, dtype=np.bool_)
        missing[present] = ~models.usable(places.study.model, columns.endings, columns.flags)
        for name in set(names) - {*kind_columns(regime)}:
            values[name][missing] = np.nan
        yield Rows(part, cases, {name: values[name] for name in names}, ~not_run(endings.tolist()))


def drive_cases(study: Study, nominal: Ints) -> Ints:
    """The cases of every drive at the places of these nominal cases, shape (places, drives + 1); -1 for none."""
    numbers = study.axes[-1].array.astype(np.int64)
    drives = study.drives + 1
    whole = np.arange(drives)
    if study.combine == "grid" and np.array_equal(numbers, whole):
        return np.asarray(nominal[:, None] + whole)
    if study.combine == "grid":  # some drives only
        found = np.full((nominal.size, drives), -1, dtype=np.int64)
        place = nominal - int(np.flatnonzero(numbers == 0)[0])
        found[:, numbers] = place[:, None] + np.arange(numbers.size)
        return found
    points = np.stack([axis.array for axis in study.axes[:-1]], axis=1) if len(study.axes) > 1 else None
    group = np.zeros(study.cases, dtype=np.int64)
    if points is not None:
        group = np.unique(points, axis=0, return_inverse=True)[1].reshape(-1)
    table = np.full((int(group.max()) + 1, drives), -1, dtype=np.int64)
    table[group, numbers] = np.arange(study.cases)
    return np.asarray(table[group[nominal]])


def nominal_only(study: Study, fetch: Fetch) -> tuple[Study, Fetch]:
    """The study of the nominal drive, and what fetches the rows of its cases; both unchanged without tolerances."""
    if study.spread is None:
        return study, fetch
    nominal = study.cases_at({DRIVE: 0.0})

    def fetch_nominal(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        return fetch(nominal[cases], names)

    return without_drives(study), fetch_nominal


def deviations(study: Study) -> NDArray[np.float64]:
    """How far each drive is from the nominal one, shape (drives, tolerances): a share of the value, or SI."""
    if study.spread is None:
        raise ValueError("the study has no tolerances")
    nominal = [
        1.0 if one.change == "scale" else 0.0 if one.change == "offset" else study.base[one.paths[0]]
        for one in study.tolerances
    ]
    return np.asarray(study.spread.array - np.array(nominal))
