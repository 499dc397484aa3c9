"""Settled motions of a batch of cases: which regime each comes to from its own start, and its characteristics there."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import MEANS_FROM_PERIODS, SettledRun
from sprag_study.engine.vibration_drive.cases import Column, case_matrix, inertia_ratio, pendulum_count, unloaded
from sprag_study.engine.vibration_drive.irregular import BATCHES, Batches, Means
from sprag_study.engine.vibration_drive.kernel import Kernel, kernel_of
from sprag_study.engine.vibration_drive.lanes import RUNUP_SHARE
from sprag_study.engine.vibration_drive.no_load import limit_of
from sprag_study.engine.vibration_drive.orbits import distances, settling_periods
from sprag_study.engine.vibration_drive.regimes import Regime, means, settled_infos, winding
from sprag_study.engine.vibration_drive.results import STEADY_SHAFT, result_infos
from sprag_study.engine.vibration_drive.search import LONG, ROUND, RUNS, Orbits, Search, joined, transient_rounds
from sprag_study.engine.vibration_drive.sensitive_starts import sensitive
from sprag_study.engine.vibration_drive.slow import march
from sprag_study.engine.vibration_drive.strobes import (
    ANGLE,
    FRACTION,
    PENDULUM_WIDTH,
    SHAFT_SPEED,
    SHAFT_WIDTH,
    SPEED,
    width,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Periods before the strobes of a case without an orbit are moved.
_MOVE_AFTER = 140
#: Speed in rad/s of a shaft that no pendulum reaches.
_OUT_OF_REACH = 1e6
#: Periods in which the speed of an unloaded shaft must not change.
_UNCHANGED = 40
#: How far (relative) below the limit speed a shaft may be that still rises to it, and how far (scaled) its pendulums
#: may be from their contact-free orbit.
_CREEPS, _FREELY = 0.01, 0.01
#: A shaft with so many times the inertia of its pendulums may change its speed slowly.
_HEAVY = 10.0
#: How often cases whose search gave up get as many longer batches again.
_LATER = 2
#: Periods before them.
_TRANSIENT = 200
_OK = ENDINGS.index(Ending.OK)
_REPEATING = [regime for regime in Regime if regime.repeats]


@dataclass(frozen=True, slots=True)
class SettledBatch:
    """Settled motions of a batch.

    Attributes
    ----------
    values : array, shape (cases, results)
        Results in the order of ``settled_infos(pendulums)``; NaN where a value could not be computed.
    endings : int8 array, shape (cases,)
        Index into ``sprag_study.engine.endings.ENDINGS``.
    regimes : int8 array, shape (cases,)
        Members of ``Regime``.
    points : array, shape (cases, strobes.width(n))
        State at a strobe on the orbit, or where the search ended, from which it can be continued.
    spent : array, shape (cases,)
        Total excitation periods computed for each case, including disturbed runs.
    sensitive : bool array, shape (cases,), or None
        Whether a sensitive transient decided the motion of each case; None where that was not asked for.
    """

    values: Floats
    endings: NDArray[np.int8]
    regimes: NDArray[np.int8]
    points: Floats
    spent: Floats
    sensitive: NDArray[np.bool_] | None = None

    @property
    def repeats(self) -> NDArray[np.bool_]:
        """Whether the motion of each case has an orbit, shape (cases,)."""
        return np.isin(self.regimes, _REPEATING)

    @property
    def orders(self) -> Ints:
        """Excitation periods in one turn of the orbit of each case, shape (cases,); 0 where there is none."""
        names = [info.name for info in settled_infos((self.points.shape[1] - SHAFT_WIDTH) // PENDULUM_WIDTH)]
        orders: Ints = np.nan_to_num(self.values[:, names.index("regime.order")]).astype(np.int64)
        return orders

    @property
    def windings(self) -> Ints:
        """Whole turns of each pendulum in one turn of the orbit of each case, shape (cases, pendulums); 0 without an
        orbit.
        """
        pendulums = (self.points.shape[1] - SHAFT_WIDTH) // PENDULUM_WIDTH
        names = [info.name for info in settled_infos(pendulums)]
        columns = [names.index(winding(i)) for i in range(pendulums)]
        turns: Ints = np.nan_to_num(self.values[:, columns]).astype(np.int64)
        return turns

    def of_case(self, case: int) -> "SettledBatch":
        """The batch with one of the cases only."""
        rows = slice(case, case + 1)
        sensitive = None if self.sensitive is None else self.sensitive[rows]
        return SettledBatch(
            self.values[rows], self.endings[rows], self.regimes[rows], self.points[rows], self.spent[rows], sensitive
        )


class _Results:
    """The columns of a batch's results by name, filled as cases are settled."""

    def __init__(self, cases: int, pendulums: int, width: int, *, examined: bool = False) -> None:
        self.names = [info.name for info in settled_infos(pendulums)]
        self.plain = len(result_infos(pendulums))
        self.means = list(means(pendulums))
        self.values = np.full((cases, len(self.names)), np.nan)
        self.regimes = np.zeros(cases, dtype=np.int8)
        self.endings = np.full(cases, _OK, dtype=np.int8)
        self.points = np.full((cases, width), np.nan)
        self.sensitive = np.zeros(cases, dtype=np.bool_) if examined else None

    def column(self, name: str) -> int:
        return self.names.index(name)

    def put(self, cases: Ints, name: str, values: ArrayLike) -> None:
        self.values[cases, self.column(name)] = values


def settle(
    columns: Mapping[str, ArrayLike],
    settings: SettledRun,
    *,
    cases: int,
    starts: Floats | None = None,
    examine_starts: bool = False,
) -> SettledBatch:
    """Find the settled motion of each case, from its own start or from a given state.

    Each run is continued while its strobes are examined. Where they seem to approach an orbit, Newton's method finds
    it. The orbit is accepted if its multipliers show that it is stable and the run is close to it (docs/theory.md,
    "Settled motion"). Results are those of whole turns, started on the orbit. A case without an orbit up to
    ``settings.max_period`` has means over the last 800 periods, with intervals.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``.
    settings : SettledRun
    cases : int
        Number of cases, at least 0.
    starts : array, shape (cases, strobes.width(n)), optional
        The state at which each case begins: a row of ``strobes.continued``, whose numbers may come from a case with
        other parameters, or of ``strobes.from_rest`` for its own initial values. A case that begins at a given state
        has no run-up; without a load, ``shaft.speed.from_rest`` is the speed that it reaches from there.
    examine_starts : bool
        Whether to find out which motions a sensitive transient decided.

    Returns
    -------
    SettledBatch

    Raises
    ------
    ValueError
        If a required parameter is missing, the number of pendulums or coefficients is out of range, or ``starts`` has
        another shape or a number that is not finite.
    """
    n = pendulum_count(columns)
    module = kernel_of(columns, settings.tolerance)
    matrix = case_matrix(columns, settings.run, cases)
    if starts is not None and (starts.shape != (cases, width(n)) or not np.isfinite(starts).all()):
        raise ValueError(f"starts must be finite numbers in the shape {(cases, width(n))}, not {starts.shape}")
    search = Search(module, matrix, settings, given=starts)
    results = _Results(cases, n, search.starts.shape[1], examined=examine_starts)
    if cases:
        free = unloaded(matrix, n)
        _settle(search, np.flatnonzero(~free), results)
        _unloaded(module, search, np.flatnonzero(free), results)
        results.values[results.endings != _OK] = np.nan
        results.regimes[results.endings != _OK] = Regime.NONE
        if results.sensitive is not None:
            results.sensitive &= results.endings == _OK
        settled = np.flatnonzero(results.endings == _OK)
        results.put(settled, "regime", results.regimes[settled])
    return SettledBatch(
        results.values, results.endings, results.regimes, results.points, search.spent, results.sensitive
    )


def _settle(search: Search, active: Ints, results: _Results) -> None:
    """Bring cases to their settled motion, and write their results."""
    found: list[Orbits] = []
    batches, active = _search(search, active, found, results)
    # All together, because a few cases leave lanes idle.
    orbits = joined(found, search)
    if len(orbits.cases):
        _write(search, search.refined(orbits), results)
        if results.sensitive is not None:
            plan, count, moves = _rounds(search.settings)
            results.sensitive[orbits.cases] = sensitive(search, orbits, [*plan, *[ROUND] * count], moves)
    if len(active):
        irregular = batches.finish(active)
        _write_irregular(search, active, irregular, search.starts[active], results)
        slow = inertia_ratio(search.matrix[active], search.kernel.LAYOUT.n) >= _HEAVY
        slow &= (irregular.regimes == Regime.UNSETTLED) & (batches.count == BATCHES) & (not search.steady_shaft)
        if np.any(slow):
            _settle_slowly(search, active[slow], results)


def _settle_slowly(search: Search, cases: Ints, results: _Results) -> None:
    """Write the results of heavy shafts whose search gave up, where their motions settle over thousands of periods.

    Their speeds are brought to where they do not change. Motions without an orbit there take longer batches. Where
    these tell no steady mean either, the results stay as they are.
    """
    slaved, points = march(search, cases)
    if len(slaved.cases):
        _write(search, search.refined(slaved, slaved=True), results, slaved=True)
    rest = ~np.isin(cases, slaved.cases)
    cases, points = cases[rest], points[rest]
    if not len(cases):
        return
    matrix = search.matrix[cases].copy()
    matrix[:, Column.MOST_STEPS] /= RUNS
    at_most = _TRANSIENT + _LATER * BATCHES * LONG
    later = Search(search.kernel, matrix, replace(search.settings, at_most=at_most), given=points)
    batches, ends = Batches(later, 0, LONG), _Results(len(cases), search.kernel.LAYOUT.n, points.shape[1])
    active, found = np.arange(len(cases)), list[Orbits]()
    for periods in transient_rounds(_TRANSIENT):
        if len(active):
            later.advance(active, periods, windowed=False)
            active = _take_settled(later, active, found, ends)
    for number in range(_LATER):
        if number:
            found.append(march(later, active)[0])
            active = active[~np.isin(active, found[-1].cases)]
        batches.count += BATCHES
        while len(active) and len(batches.sums) < batches.count:
            batches.advance(active)
            active = _take_settled(later, active, found, ends)
        if not len(active):
            break
        irregular = batches.finish(active)
        steady = irregular.regimes == Regime.IRREGULAR
        _write_irregular(search, cases[active[steady]], irregular.take(steady), later.starts[active[steady]], results)
        active = active[~steady]
    search.spent[cases] += later.spent
    orbits = joined(found, later)
    if len(orbits.cases):
        orbits.cases = cases[orbits.cases]
        _write(search, search.refined(orbits, slaved=True), results, slaved=True)


def _write_irregular(search: Search, cases: Ints, irregular: Means, points: Floats, results: _Results) -> None:
    """Write the means of cases without an orbit, whose runs ended at ``points``."""
    results.values[cases, : results.plain] = irregular.values
    results.values[cases, -len(results.means) :] = irregular.half_widths
    results.put(cases, "regime.exponent", irregular.exponents)
    results.regimes[cases] = irregular.regimes
    results.points[cases] = points
    _whole_run(search, cases, results)


def _rounds(settings: SettledRun) -> tuple[list[int], int, int]:
    """Periods of each round of a search before its batches, the number of batches, and that of the round after which
    its strobes move; beyond the last one where they do not.
    """
    count = BATCHES
    if settings.at_most < MEANS_FROM_PERIODS:
        count = max(1, (2 * settings.at_most // 3) // ROUND)
    plan = transient_rounds(settings.at_most - count * ROUND)
    # Not before the batches: their windows begin at a strobe.
    late = (number for number in range(len(plan) - 1) if sum(plan[: number + 1]) >= _MOVE_AFTER)
    return plan, count, next(late, len(plan) + count)


def _search(search: Search, active: Ints, found: list[Orbits], results: _Results) -> tuple[Batches, Ints]:
    """Add the orbits that cases come to; the batches of the other cases, and these cases."""
    plan, count, moves = _rounds(search.settings)
    batches = Batches(search, count)
    for number, periods in enumerate(plan):
        if not len(active):
            return batches, active
        search.advance(active, periods, windowed=False)
        active = _take_settled(search, active, found, results)
        if number == moves:
            search.move_strobes(active)
    for _ in range(count):
        if not len(active):
            break
        batches.advance(active)
        active = _take_settled(search, active, found, results)
    return batches, active


def _take_settled(search: Search, active: Ints, found: list[Orbits], results: _Results) -> Ints:
    """Add the orbits that are found and record cases that have ended; returns the other cases."""
    ended = search.endings[active] != _OK
    results.endings[active[ended]] = search.endings[active[ended]]
    active = active[~ended]
    if not len(active):
        return active
    found.append(search.look(active))
    return active[~np.isin(active, found[-1].cases)]


def _write(search: Search, found: Orbits, results: _Results, *, slaved: bool = False) -> None:
    cases = found.cases
    results.values[cases] = np.nan
    results.values[cases, : results.plain] = search.over_one_turn(found)
    results.put(cases, "regime.order", found.orders)
    for i in range(search.kernel.LAYOUT.n):
        results.put(cases, winding(i), found.windings[:, i])
    results.put(cases, "regime.multiplier", found.multipliers)
    results.put(cases, "regime.residual", found.residuals)
    results.put(cases, "regime.settled_after", _settled_after(search, found, slaved=slaved))
    results.points[cases] = found.points
    held = results.values[cases, results.column("fraction.rotating")] == 0.0
    results.points[cases[held], SHAFT_SPEED] = 0.0
    results.regimes[cases] = np.where(held, Regime.HELD, Regime.PERIODIC)
    _whole_run(search, cases, results)


def _settled_after(search: Search, found: Orbits, *, slaved: bool) -> Floats:
    """Periods from the start until a run is within the settled distance of its orbit, by the orbit's multiplier.

    Where the pendulums are ``slaved`` to a slow shaft, its speed alone counts.
    """
    cases = found.cases
    apart, periods = np.empty(len(cases)), np.empty(len(cases))
    if slaved:
        apart = np.abs(search.starts[cases] - found.points)[:, SHAFT_SPEED] / found.units[:, SHAFT_SPEED]
    else:
        rotates = search.rotates(cases, found.windings)
        distances(search.starts[cases], found.points, found.units, rotates, apart)
    settling_periods(apart, found.orders, found.multipliers, search.settings.settled, periods)
    return search.periods[cases] + periods


def _whole_run(search: Search, cases: Ints, results: _Results) -> None:
    """Write what belongs to the whole run from its start: steps, events, run-up."""
    results.put(cases, "run.steps", search.steps[cases])
    results.put(cases, "run.events", search.events[cases])
    period = search.matrix[cases, Column.PERIOD]
    wanted = RUNUP_SHARE * results.values[cases, results.column("shaft.speed.mean")] * period
    runup = _runup(search.turns[cases], wanted)
    results.put(cases, "runup.time", np.where(search.from_stop[cases], period * runup, math.nan))


def _runup(turns: Floats, wanted: Floats) -> Floats:
    """Periods until the turn in a period first reaches ``wanted``, linearly between whole periods; NaN where never.

    ``turns`` (shape (cases, periods)) is 0 after a case's last period.
    """
    reached = (turns >= wanted[:, None]) & (wanted[:, None] > 0.0)
    k = np.argmax(reached, axis=1)
    rows = np.arange(len(turns))
    before = np.where(k > 0, turns[rows, k - 1], 0.0)
    gained = np.where(reached[rows, k], turns[rows, k] - before, np.nan)
    runup: Floats = k + (wanted - before) / gained
    return runup


def _unloaded(module: Kernel, search: Search, cases: Ints, results: _Results) -> None:
    """Write the results of cases without a load: the limit of a vanishing one, and the speed from rest."""
    if not len(cases):
        return
    results.put(cases, "shaft.speed.from_rest", _speed_from_rest(search, cases))
    free = search.matrix[cases].copy()
    free[:, Column.MOST_STEPS] = search.budget[cases] / RUNS
    free[:, Column.SPEED] = _OUT_OF_REACH
    apart = Search(module, free, search.settings, steady_shaft=True)
    own = _Results(len(cases), module.LAYOUT.n, apart.starts.shape[1], examined=results.sensitive is not None)
    _settle(apart, np.arange(len(cases)), own)
    search.spent[cases] += apart.spent
    if results.sensitive is not None and own.sensitive is not None:
        results.sensitive[cases] = own.sensitive
    steps, events = (results.column(name) for name in ("run.steps", "run.events"))
    for row, case in enumerate(cases.tolist()):
        if search.endings[case] != _OK or own.endings[row] != _OK:
            results.endings[case] = search.endings[case] if search.endings[case] != _OK else own.endings[row]
            continue
        results.values[case] = np.where(np.isnan(results.values[case]), own.values[row], results.values[case])
        results.values[case, steps], results.values[case, events] = search.steps[case], search.events[case]
        results.points[case], results.regimes[case] = own.points[row], own.regimes[row]
        speed = math.nan
        if own.regimes[row] == Regime.PERIODIC:
            order = int(own.values[row, own.column("regime.order")])
            speed = limit_of(apart, row, own.points[row], order)
            results.regimes[case] = Regime.HELD if math.isnan(speed) else Regime.COASTING
            speed = 0.0 if math.isnan(speed) else speed
            if _rises_to(speed, search, case, apart.history[row, -order:]):
                results.values[case, results.column("shaft.speed.from_rest")] = speed
        _steady_shaft(search, case, speed, results)


def _rises_to(limit: float, search: Search, case: int, orbit: Floats) -> bool:
    """Whether an unloaded shaft still rises at the end of its search, towards the limit speed.

    Near it every engagement is weaker than the one before: the speed misses the limit by A/k^2 after k periods, and
    no search ever sees the end. ``orbit`` has the strobes of the contact-free orbit, shape (order, columns).
    """
    own = search.history[case, -_UNCHANGED:]
    speed = own[-1, SHAFT_SPEED]
    if np.all(own[:, SHAFT_SPEED] == speed) or not 0.0 < limit - speed < _CREEPS * limit:
        return False
    apart = np.abs(orbit - own[-1]) / search.units(np.array([case]))
    columns = [SHAFT_WIDTH + i * PENDULUM_WIDTH + k for i in range(search.kernel.LAYOUT.n) for k in (ANGLE, SPEED)]
    same_phase = orbit[0, FRACTION] == own[-1, FRACTION]
    return bool(same_phase and np.any(np.all(apart[:, columns] < _FREELY, axis=1)))


def _steady_shaft(search: Search, case: int, speed: float, results: _Results) -> None:
    """Write the results of an unloaded shaft at a steady speed that no clutch changes."""
    at = np.array([case])
    period = search.matrix[case, Column.PERIOD]
    time = results.values[case, results.column("regime.order")] * period
    for name, value in STEADY_SHAFT.items():
        results.put(at, name, value(speed, time))
    results.points[case, SHAFT_SPEED] = speed
    rest = results.values[case, results.column("shaft.speed.from_rest")]
    runup = _runup(search.turns[at], np.array([RUNUP_SHARE * rest * period]))
    results.put(at, "runup.time", period * runup if search.from_stop[case] else math.nan)


def _speed_from_rest(search: Search, cases: Ints) -> Floats:
    """Speed of the unloaded shaft at the end of the search, from the case's own start; it never falls, and is final
    once no clutch drives.
    """
    active = cases
    while len(active):
        before = search.starts[active, SHAFT_SPEED].copy()
        search.advance(active, _UNCHANGED, windowed=False)
        going = (search.starts[active, SHAFT_SPEED] != before) | (search.periods[active] == _UNCHANGED)
        going &= (search.endings[active] == _OK) & (search.periods[active] + _UNCHANGED <= search.settings.at_most)
        active = active[going]
    speed: Floats = search.starts[cases, SHAFT_SPEED]
    return speed
