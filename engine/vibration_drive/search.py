"""The search for settled motions of a batch: continue the runs, look for orbits, certify them by Newton's method.

Every decision about a case follows from that case alone, so its numbers do not depend on the batch.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import Run, SettledRun
from sprag_study.engine.vibration_drive import newton, orbits
from sprag_study.engine.vibration_drive.automaton import Clutch, Shaft
from sprag_study.engine.vibration_drive.cases import Column, swings, turns_freely, with_lengths
from sprag_study.engine.vibration_drive.characteristics import of_orbits, tied_clutches
from sprag_study.engine.vibration_drive.integration import Integration, integrate
from sprag_study.engine.vibration_drive.kernel import Kernel
from sprag_study.engine.vibration_drive.layout import OUT_ENDING, OUT_EVENTS, OUT_STEPS
from sprag_study.engine.vibration_drive.regimes import angles_without_meaning
from sprag_study.engine.vibration_drive.strobes import (
    BEGIN,
    CLUTCH,
    FRACTION,
    NOT_GIVEN,
    PENDULUM_WIDTH,
    SHAFT,
    SHAFT_WIDTH,
    TURN,
    from_rest,
    width,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

#: Periods before each of the first searches for an orbit; later rounds have `ROUND` periods.
FIRST_ROUNDS = (12, 8, 10, 10, 15, 15, 20, 20, 30, 30, 30)
ROUND = 40
#: Periods of the longer batches of motions that change slowly (`irregular`).
LONG = 80
#: Strobes this close to those one orbit earlier, and approaching them, justify Newton's method.
NEAR = 0.01
#: The same, divided by the order: irregular motions return by chance, and trying a long orbit is expensive.
SHARED = 0.035
#: Strobes over which a run must have approached the orbit.
WINDOW = 6
#: Distance of an orbit from the run beyond which the run need not approach it.
AWAY = 0.005
#: The same for runs whose kept strobes demonstrably come nearer to the orbit, and the periods before such a run counts.
SLOWLY_AWAY = 0.05
SLOWLY_FROM = 300
#: Scaled disturbance for the finite differences of the derivative, and the accepted residual of an orbit.
DISTURBANCE = 1e-7
RESIDUAL = 1e-10
#: A multiplier up to this is stable; with a residual below the second number an unstable one ends Newton's method.
STABLE = 1.0 - 1e-4
#: The same for orbits of slow shafts (`slow`), which disturbances leave within thousands of periods.
STABLE_SLOWLY = 1.0 - 1e-6
_TELLING = 1e-2
_STEPS = 8
#: Steps after which an orbit with a small residual is accepted although rounding prevents its steps from shrinking.
_ENOUGH_STEPS = 5
#: After an unsuccessful search a case is continued by this factor before the next one.
_BACK = 1.25
#: Above this multiplier an orbit's point is off by many times the error of a turn: it takes further steps with finer
#: integration: at most so many, until one is smaller than this.
_SENSITIVE = 0.95
_FINE_STEPS = 3
_EXACT = 1e-12
#: Parts of an orbit closer than this are equal, so that its order is smaller.
_SAME = 1e-7
#: Where in the period strobes are moved to when no orbit was found with those at its end; exact in binary, so that
#: whole periods later are too.
MOVED = 0.375

#: Step budgets of a run that the runs of a search may take together.
RUNS = 2.0

_OK = ENDINGS.index(Ending.OK)
_FREE, _HELD = float(Clutch.FREE), float(Shaft.HELD)


@dataclass(slots=True)
class Orbits:
    """Certified orbits, one per row: case numbers, points at the strobe, orders, whole turns of each pendulum in that
    many periods, and the report of Newton's method.
    """

    cases: Ints
    points: Floats
    orders: Ints
    #: Shape (orbits, pendulums).
    windings: Ints
    multipliers: Floats
    residuals: Floats
    #: The least period in the orbit's own strobes.
    least: Ints
    #: Scales of the strobes' columns.
    units: Floats

    def take(self, rows: Ints | Flags) -> "Orbits":
        """Some of them."""
        return Orbits(
            self.cases[rows], self.points[rows], self.orders[rows], self.windings[rows], self.multipliers[rows],
            self.residuals[rows], self.least[rows], self.units[rows],
        )  # fmt: skip


@dataclass(slots=True)
class Search:
    """The current state of the cases of a batch.

    A search has a multiple of the step budget of a run as long as it: the budgets in ``matrix`` are what is left, and
    every run for the search, disturbed ones too, takes from them. ``steady_shaft`` leaves the shaft's speed out of the
    orbits: nothing changes it where no clutch transmits.
    """

    kernel: Kernel
    matrix: Floats
    settings: SettledRun
    steady_shaft: bool = False
    #: States at which cases begin (`strobes.continued`, or `from_rest`); None: all at their own initial values.
    given: Floats | None = None
    starts: Floats = field(init=False)
    #: The last strobes of each case, the newest last, those of a batch at least, and how many of them are there for
    #: those that still go on, as far as orbits are looked for in them.
    history: Floats = field(init=False)
    count: int = 0
    periods: Ints = field(init=False)
    #: Turn of the shaft in each period, from the start.
    turns: Floats = field(init=False)
    steps: Floats = field(init=False)
    events: Floats = field(init=False)
    endings: NDArray[np.int8] = field(init=False)
    #: Periods before which no orbit is looked for again, shape (2, cases): one along which no pendulum turns over, and
    #: one along which some pendulum does.
    waits: Floats = field(init=False)
    #: Pendulums that no spring holds, shape (cases, pendulums): their angles matter only up to whole turns.
    free: Flags = field(init=False)
    #: Total periods computed for each case, including disturbed runs.
    spent: Floats = field(init=False)
    #: Steps that a search may take.
    budget: Floats = field(init=False)

    def __post_init__(self) -> None:
        if np.any(swings(self.matrix)):
            raise ValueError("a load that swings with the angle of the shaft does not repeat with the excitation")
        cases, n = len(self.matrix), self.kernel.LAYOUT.n
        self.matrix = self.matrix.copy()
        self.budget = RUNS * self.matrix[:, Column.MOST_STEPS]
        self.matrix[:, Column.MOST_STEPS] = self.budget
        self.starts = from_rest(cases, n) if self.given is None else self.given.copy()
        self.history = np.zeros((cases, max(self._looked_at, LONG), width(n)))
        self.periods = np.zeros(cases, dtype=np.int64)
        self.turns = np.zeros((cases, self.settings.at_most))
        self.steps, self.events, self.spent = (np.zeros(cases) for _ in range(3))
        self.waits = np.zeros((2, cases))
        self.free = turns_freely(self.matrix, n)
        self.endings = np.full(cases, _OK, dtype=np.int8)

    @property
    def _looked_at(self) -> int:
        """Most strobes in which orbits are looked for."""
        return 3 * max(self.settings.max_period, WINDOW) + 1

    @property
    def from_stop(self) -> Flags:
        """Which cases begin at their own initial values with the shaft at rest, shape (cases,): they run up."""
        own = True if self.given is None else self.given[:, SHAFT] == NOT_GIVEN
        return np.asarray(own & (self.matrix[:, Column.SPEED] == 0.0), dtype=np.bool_)

    @property
    def run(self) -> Run:
        """Accuracy and budgets."""
        return self.settings.run

    def whole(self, cases: Ints) -> Floats:
        """The matrix of cases with the whole budget, for what is computed of a motion that was found."""
        matrix = self.matrix[cases]
        matrix[:, Column.MOST_STEPS] = self.budget[cases]
        return matrix

    def pay(self, cases: Ints, steps: Floats) -> None:
        """Take steps from the budgets; cases may stand in it several times."""
        left = self.matrix[:, Column.MOST_STEPS]
        np.subtract.at(left, cases, steps)
        np.maximum(left, 0.0, out=left)

    def units(self, active: Ints, *, rotating: bool = False) -> Floats:
        """Scales of the strobes' columns; with ``rotating`` angles of pendulums without a spring count without whole
        turns.
        """
        units = np.empty((len(active), self.history.shape[2]))
        orbits.find_units(
            self.history,
            active,
            self.count,
            self.settings.max_period,
            self.matrix[active, Column.NU],
            self.steady_shaft,
            self.free[active] & rotating,
            units,
        )
        return units

    def advance(self, active: Ints, periods: int, *, windowed: bool, before: Floats | None = None) -> Floats:
        """Run cases on by the same number of periods; the kernel's sums of each, with the extrema of those ``before``.

        The cases are those of the calls before or some of them. The ending of cases that do not end ok is recorded.
        """
        starts = self.starts[active]
        # A case whose strobes are moved, or were elsewhere where its start comes from, begins before its first strobe
        # and ends at one.
        begin = np.where(starts[:, SHAFT] == NOT_GIVEN, 0.0, starts[:, BEGIN])
        extra = np.where(starts[:, FRACTION] < 1.0, starts[:, FRACTION], 0.0) - begin
        matrix = with_lengths(self.matrix[active], begin, periods + extra, windowed=windowed)
        done = integrate(self.kernel, matrix, self.run, starts=starts, before=before, strobes=periods)
        self.endings[active] = done.sums[:, OUT_ENDING].astype(np.int8)
        first = self.periods[active[0]]
        turned = done.strobes[:, :, TURN].copy()
        turned[:, 1:] -= done.strobes[:, :-1, TURN]
        self.turns[active, first : first + periods] = turned
        self.periods[active] += periods
        self.spent[active] += periods
        self.steps[active] += done.sums[:, OUT_STEPS]
        self.pay(active, done.sums[:, OUT_STEPS])
        self.events[active] += done.sums[:, OUT_EVENTS]
        orbits.keep_strobes(self.history, active, done.strobes)
        self.count = min(self.count + periods, self._looked_at)
        self.starts[active] = done.strobes[:, -1]
        self.starts[active, TURN] = 0.0
        return done.sums

    def look(self, active: Ints) -> Orbits:
        """Orbits that cases approach, among the cases that seem to approach one."""
        # First those along which pendulums turn over: the more turns there are in the angles, the less they tell
        # strobes apart unless they are left out.
        rotating = self._look(active[np.any(self.free[active], axis=1)], rotating=True)
        others = active[~np.isin(active, rotating.cases)]
        return joined([rotating, self._look(others, rotating=False)], self)

    def _look(self, active: Ints, *, rotating: bool) -> Orbits:
        """Orbits that cases approach, with or without a pendulum that turns over."""
        active = active[self.periods[active] >= self.waits[int(rotating), active]]
        if not len(active):
            return joined([], self)
        units = self.units(active, rotating=rotating)
        found, free = np.zeros(len(active), dtype=np.int64), self.free[active] & rotating
        windings = np.zeros(free.shape, dtype=np.int64)
        orbits.find_candidates(
            self.history, active, self.count, units, NEAR, SHARED, WINDOW, self.settings.max_period, free, windings,
            found,
        )  # fmt: skip
        rows = np.flatnonzero(found)
        # The longest runs first, because the last ones leave lanes idle.
        rows = rows[np.argsort(-found[rows], kind="stable")]
        points = self.starts[active[rows]]
        orbits.without_turns(points[:, None], free[rows])
        return self.of_least_order(self.certify(active[rows], points, found[rows], units[rows], windings[rows]))

    def rotates(self, cases: Ints, windings: Ints) -> Flags:
        """Pendulums whose angles matter only up to whole turns on orbits with these windings, shape (orbits,
        pendulums): all without a spring where one of them turns over, otherwise none.
        """
        rotates: Flags = self.free[cases] & np.any(windings != 0, axis=1)[:, None]
        return rotates

    def certify(
        self, cases: Ints, points: Floats, orders: Ints, units: Floats, windings: Ints | None = None, *,
        slaved: bool = False,
    ) -> Orbits:  # fmt: skip
        """Newton's method from points near orbits of those orders; the stable ones that the runs are near.

        With ``windings`` (shape (orbits, pendulums)) the pendulums make so many whole turns along the orbits. With
        ``slaved`` the points are those to which the speeds of slow shafts were moved (`slow.march`): these must be
        within ``AWAY``, and multipliers may be closer to 1.
        """
        begun = points
        if windings is None:
            windings = np.zeros((len(cases), self.kernel.LAYOUT.n), dtype=np.int64)
        run, stable = (self.settings.fine, STABLE_SLOWLY) if slaved else (self.run, STABLE)
        certified: list[Orbits] = []
        for number in range(_STEPS):
            if not len(cases):
                break
            moved, told, turns = self._step(cases, points, orders, units, windings, run)
            away = np.empty(len(cases))
            orbits.distances(moved, begun, units, np.zeros(windings.shape, dtype=np.bool_), away)
            residual, size, multiplier = told[:, newton.RESIDUAL], told[:, newton.STEP], told[:, newton.MULTIPLIER]
            close = away < np.where(slaved | (self.periods[cases] < SLOWLY_FROM), AWAY, SLOWLY_AWAY)
            converged = (residual < RESIDUAL) & ((size < RESIDUAL) | (number >= _ENOUGH_STEPS))
            accepted = converged & (multiplier < stable) & close
            slow = np.flatnonzero(accepted & (away >= AWAY))
            if len(slow):
                accepted[slow] = self._approaches(
                    cases[slow], turns[slow], orders[slow], units[slow], windings[slow], multiplier[slow]
                )
            if np.any(accepted):
                least = np.empty(len(cases), dtype=np.int64)
                orbits.find_least(points, turns, orders, windings, units, _SAME, least)
                # The last step brings the orbit closer still, unless it is mere rounding.
                better = np.where((size < RESIDUAL)[:, None], moved, points)
                every = Orbits(cases, better, orders, windings, multiplier, residual, least, units)
                certified.append(every.take(accepted))
            fails = converged | (told[:, newton.AGREES] == 0.0) | ~(size < 1.0) | ~close
            fails |= (residual < _TELLING) & (multiplier >= stable)
            self._failed(cases[fails & ~accepted], windings[fails & ~accepted])
            left = np.flatnonzero(~(fails | accepted))
            cases, orders, windings = cases[left], orders[left], windings[left]
            points, begun, units = moved[left], begun[left], units[left]
        self._failed(cases, windings)
        return joined(certified, self)

    def _approaches(
        self, cases: Ints, turns: Floats, orders: Ints, units: Floats, windings: Ints, multipliers: Floats
    ) -> Flags:
        """Whether the strobes of cases come nearer to orbits, given by the strobes of a turn from their points on."""
        found = np.zeros(len(cases), dtype=np.bool_)
        free = self.rotates(cases, windings)
        orbits.find_approaching(self.history, cases, self.count, turns, orders, units, multipliers, free, found)
        return found

    def _step(
        self, cases: Ints, points: Floats, orders: Ints, units: Floats, windings: Ints, run: Run
    ) -> tuple[Floats, Floats, Floats]:
        """A step of Newton's method: the points after it, its report, and the strobes of the turn before it."""
        disturbed, first, done = self._disturbed_runs(cases, points, orders, units, run)
        ends = np.ascontiguousarray(done.strobes[np.arange(len(disturbed)), orders[disturbed] - 1])
        tied = self._tied(cases, points, orders, done.sums[first[:-1]])
        moved, told = np.empty_like(points), np.empty((len(cases), 4))
        newton.step(points, ends, first, units, DISTURBANCE, self.steady_shaft, tied, windings, moved, told)
        return moved, told, done.strobes[first[:-1]]

    def refined(self, found: Orbits, *, slaved: bool = False) -> Orbits:
        """The same orbits, the sensitive ones of them after further steps with finer integration."""
        stable = STABLE_SLOWLY if slaved else STABLE
        rows = np.flatnonzero(found.multipliers > _SENSITIVE)
        for _ in range(_FINE_STEPS):
            if not len(rows):
                break
            some = found.take(rows)
            moved, told, _ = self._step(
                some.cases, some.points, some.orders, some.units, some.windings, self.settings.fine
            )
            good = (told[:, newton.RESIDUAL] < RESIDUAL) & (told[:, newton.MULTIPLIER] < stable)
            rows, moved, told = rows[good], moved[good], told[good]
            found.points[rows] = moved
            found.residuals[rows], found.multipliers[rows] = told[:, newton.RESIDUAL], told[:, newton.MULTIPLIER]
            rows = rows[told[:, newton.STEP] >= _EXACT]
        return found

    def _disturbed_runs(
        self, cases: Ints, points: Floats, orders: Ints, units: Floats, run: Run
    ) -> tuple[Ints, Ints, Integration]:
        """Run the points, and those disturbed in each free column, once around: whose run, first runs, the runs."""
        rows = np.empty((len(cases) * (2 + 3 * self.kernel.LAYOUT.n), points.shape[1]))
        first = np.zeros(len(cases) + 1, dtype=np.int64)
        count = newton.disturb(points, units, DISTURBANCE, self.steady_shaft, rows, first)
        of_row = np.repeat(np.arange(len(cases)), np.diff(first))
        self.spent[cases] += orders * np.diff(first)
        # The sums, which cost time, show clutches that never release a held shaft.
        windowed = np.zeros(count, dtype=bool)
        windowed[first[:-1]] = points[:, SHAFT] == _HELD
        matrix = with_lengths(
            self.matrix[cases[of_row]], points[of_row, BEGIN], orders[of_row].astype(float), windowed=windowed
        )
        done = integrate(self.kernel, matrix, run, starts=rows[:count], strobes=int(orders.max()))
        self.pay(cases[of_row], done.sums[:, OUT_STEPS])
        return of_row, first, done

    def _tied(self, cases: Ints, points: Floats, orders: Ints, sums: Floats) -> Flags:
        """Clutches of orbits that never release a held shaft, shape (orbits, pendulums)."""
        tied = np.zeros((len(cases), self.kernel.LAYOUT.n), dtype=np.bool_)
        held = np.flatnonzero(points[:, SHAFT] == _HELD)
        if len(held):
            lengths = orders[held].astype(float)
            matrix = with_lengths(self.matrix[cases[held]], points[held, BEGIN], lengths, windowed=True)
            interacts = points[held, SHAFT_WIDTH + CLUTCH :: PENDULUM_WIDTH] != _FREE
            tied[held] = interacts & tied_clutches(self.kernel.LAYOUT, matrix, sums[held])
        return tied

    def over_one_turn(self, found: Orbits) -> Floats:
        """Characteristics of orbits over one turn of each, shape (orbits, results); the angles of a pendulum that turns
        over have no mean, no extremes and no amplitude.
        """
        cases = found.cases
        matrix = with_lengths(self.whole(cases), found.points[:, BEGIN], found.orders.astype(float), windowed=True)
        sums = integrate(self.kernel, matrix, self.settings.fine, starts=found.points).sums
        self.spent[cases] += found.orders
        self.steps[cases] += sums[:, OUT_STEPS]
        self.events[cases] += sums[:, OUT_EVENTS]
        values = of_orbits(self.kernel.LAYOUT, matrix, sums)
        values[angles_without_meaning(found.windings)] = np.nan
        return values

    def _failed(self, cases: Ints, windings: Ints) -> None:
        """Let cases continue before the next search for such an orbit."""
        self.waits[np.any(windings != 0, axis=1).astype(np.int64), cases] = _BACK * self.periods[cases]

    def move_strobes(self, active: Ints) -> None:
        """Move the strobes within the period, in case an event coincides with them."""
        self.starts[active, FRACTION] = MOVED
        self.count = 0

    def of_least_order(self, found: Orbits, *, slaved: bool = False) -> Orbits:
        """The same orbits with their least orders."""
        again = np.flatnonzero(found.least < found.orders)
        if not len(again):
            return found
        cases = found.cases[again]
        least = found.least[again]
        windings = found.windings[again] * least[:, None] // found.orders[again, None]
        better = self.certify(cases, found.points[again], least, found.units[again], windings, slaved=slaved)
        kept = ~np.isin(found.cases, better.cases)
        return joined([found.take(kept), better], self)


def joined(parts: list[Orbits], search: Search) -> Orbits:
    """The orbits of several searches."""
    if not parts:
        none, numbers, rows = np.empty(0), np.empty(0, dtype=np.int64), np.empty((0, search.history.shape[2]))
        windings = np.empty((0, search.kernel.LAYOUT.n), dtype=np.int64)
        return Orbits(numbers, rows, numbers, windings, none, none, numbers, rows)
    return Orbits(*(np.concatenate([getattr(part, name) for part in parts]) for name in Orbits.__slots__))


def transient_rounds(periods: int) -> list[int]:
    """Periods of each round of a search that is to run that many in all before it takes means."""
    plan: list[int] = []
    for length in (*FIRST_ROUNDS, *[ROUND] * math.ceil(periods / ROUND)):
        if periods <= sum(plan):
            break
        plan.append(min(length, periods - sum(plan)))
    return plan
