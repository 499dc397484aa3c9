"""Every steady cycle of a machine whose torques follow the speed, and from which speeds the shaft comes to each."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import Ending
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Machine, check_structure
from sprag_study.engine.machine_shaft.panels import NODES, Panels
from sprag_study.engine.machine_shaft.return_map import ReturnMap
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.engine.machine_shaft.speed_course import follows_speed
from sprag_study.engine.machine_shaft.transient_bench import Bench, Cycle, bench_of, cycle_of

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

#: Speeds of the scan at the angle 0, over the speed of the motor without load or the required one.
_SCAN = np.concatenate([np.geomspace(1e-4, 0.02, 8), np.linspace(0.025, 3.0, 120), np.geomspace(3.1, 20.0, 36)])
_REFINEMENTS, _EDGES = 10, 6
#: Places between two speeds at which the change over a cycle is interpolated, and the share of the smaller change at
#: the ends below which it may pass zero between them.
_PLACES, _NEAR = np.linspace(0.0, 1.0, 17)[1:-1], 0.3
_HALVINGS, _ITERATIONS = 20, 80
#: Relative difference of the energies at the angle 0 up to which a cycle is that of the case.
_SAME = 1e-6


@dataclass(frozen=True, slots=True)
class SteadyCycle:
    """A steady cycle.

    Attributes
    ----------
    panels : Panels
        They resolve it.
    course : Cycle
        Its energy at their nodes, mean speed and irregularity.
    start, largest, smallest : float
        Its speed in rad/s at the angle 0, and the extremes.
    multiplier : float
        Factor by which a small deviation grows in a cycle.
    low, high : float
        Speeds in rad/s at the angle 0 from which the shaft comes to it: above ``low``, which is 0 where it comes from
        rest, and below ``high``, which may be infinite; NaN where it is unstable.
    """

    panels: Panels
    course: Cycle
    start: float
    largest: float
    smallest: float
    multiplier: float
    low: float
    high: float

    @property
    def stable(self) -> bool:
        """Whether deviations die away."""
        return self.multiplier < 1.0


@dataclass(frozen=True, slots=True)
class SteadyCycles:
    """The steady cycles of a case.

    Attributes
    ----------
    cycles : tuple of SteadyCycle
        By their speed at the angle 0, which orders them at every angle.
    case : int or None
        Which of them the results of the case are about.
    stops_below : float
        Speed in rad/s at the angle 0 up to which the shaft comes to a standstill, at most the fastest of ``speeds``; 0
        where it never does.
    runs_away_above : float
        Speed from which it becomes faster and faster; infinite where it does not.
    speeds, changes : arrays, shape (n,)
        Speeds in rad/s at the angle 0, and by how much the shaft is faster a cycle later: minus the speed where it
        stops.
    whole : bool
        Whether the motion could be followed from every speed.
    ending : Ending
        Of the case.
    """

    cycles: tuple[SteadyCycle, ...]
    case: int | None
    stops_below: float
    runs_away_above: float
    speeds: Floats
    changes: Floats
    whole: bool
    ending: Ending

    @property
    def stable(self) -> tuple[SteadyCycle, ...]:
        """Those to which the shaft comes."""
        return tuple(cycle for cycle in self.cycles if cycle.stable)

    def reached_from(self, angle: float, energy: float) -> SteadyCycle | None:
        """The stable cycle to which the shaft comes from an energy (J) at an angle (rad); None: to none of them."""
        below = [cycle for cycle in self.cycles if _energy_at(cycle, angle) <= energy]
        above = self.cycles[len(below) :]
        if below and below[-1].stable:
            return below[-1]
        return above[0] if above and above[0].stable else None


def _energy_at(cycle: SteadyCycle, angle: float) -> float:
    panels, where = cycle.panels, np.array([angle])
    return float(panels.at_rows(cycle.course.energy, np.zeros(1, dtype=np.int64), panels.locate(0, where))[0])


class _Scan(NamedTuple):
    """Starts with what becomes of them: energies and changes of the energy in a cycle, (n,)."""

    energy: Floats
    change: Floats
    growth: Floats
    stopped: Bools
    lost: Bools

    @classmethod
    def of(cls, returns: ReturnMap, energy: Floats) -> "_Scan":
        after = returns.follow(energy)
        return cls(energy, after.energy - energy, after.growth, after.stopped, after.lost)

    def with_starts(self, returns: ReturnMap, energy: Floats) -> "_Scan":
        """This scan with further starts, in their order."""
        other = _Scan.of(returns, energy)
        order = np.argsort(np.concatenate([self.energy, other.energy]), kind="stable")
        return _Scan(
            np.concatenate([self.energy, other.energy]), np.concatenate([self.change, other.change]),
            np.concatenate([self.growth, other.growth]), np.concatenate([self.stopped, other.stopped]),
            np.concatenate([self.lost, other.lost]),
        ).take(order)  # fmt: skip

    def take(self, chosen: Bools | NDArray[np.int64]) -> "_Scan":
        """Some of the starts, or all in another order."""
        return _Scan(
            self.energy[chosen], self.change[chosen], self.growth[chosen], self.stopped[chosen], self.lost[chosen]
        )

    def unclear(self) -> Bools:
        """Whether the change may pass zero between two neighbours otherwise than their signs say, (n - 1,)."""
        x, y, slope = np.sqrt(self.energy), self.change, 2.0 * np.sqrt(self.energy) * (self.growth - 1.0)
        width = np.diff(x)[:, None]
        u = _PLACES
        with np.errstate(all="ignore"):
            cubic = (
                (1.0 + 2.0 * u) * np.square(1.0 - u) * y[:-1, None] + u * np.square(1.0 - u) * width * slope[:-1, None]
                + u * u * (3.0 - 2.0 * u) * y[1:, None] - u * u * (1.0 - u) * width * slope[1:, None]
            )  # fmt: skip
            signs = np.sign(np.concatenate([y[:-1, None], cubic, y[1:, None]], axis=1))
            passes = (np.diff(signs, axis=1) != 0.0).sum(axis=1)
            same = np.sign(y[:-1]) == np.sign(y[1:])
            least = np.minimum(np.abs(y[:-1]), np.abs(y[1:]))
            near = same & (np.abs(cubic).min(axis=1) < _NEAR * least)
        regular = ~(self.stopped[:-1] | self.stopped[1:])
        return np.asarray(regular & (near | (passes > np.where(same, 0, 1))))

    def edges(self) -> Bools:
        """Whether the shaft stops from one of two neighbours only, (n - 1,)."""
        return np.asarray(self.stopped[:-1] != self.stopped[1:])


def _scanned(returns: ReturnMap, inertia: float, pace: float) -> tuple[_Scan, bool]:
    """The scan, refined where it is not clear, and whether every motion was followed."""
    scan, whole = _Scan.of(returns, 0.5 * inertia * np.square(pace * _SCAN)), True
    for number in range(_REFINEMENTS):
        whole = whole and not scan.lost.any()
        scan = scan.take(~scan.lost)
        if len(scan.energy) < 2:
            break
        chosen = scan.unclear()
        if number < _EDGES:
            chosen |= scan.edges()
        root = np.sqrt(scan.energy)
        middle = np.square(0.5 * (root[:-1] + root[1:]))
        if not chosen.any():
            break
        scan = scan.with_starts(returns, middle[chosen])
    return scan.take(~scan.lost), whole


def _roots(returns: ReturnMap, low: Floats, high: Floats, *, backward: bool) -> Floats:
    """Energies at the angle 0 of the cycles between ``low`` and ``high``, (n,), by Newton's method within them.

    An unstable cycle attracts motions that are followed back in the angle. NaN where they are lost or come from rest.
    """
    low, high = low.copy(), high.copy()
    x = 0.5 * (low + high)
    active = np.arange(len(x))
    for _ in range(_ITERATIONS):
        if not active.size:
            break
        after = returns.follow(x[active], backward=backward)
        change = after.energy - x[active]
        low[active] = np.where(change >= 0.0, x[active], low[active])
        high[active] = np.where(change <= 0.0, x[active], high[active])
        with np.errstate(all="ignore"):
            step = x[active] + change / (1.0 - after.growth)
        inside = (step > low[active]) & (step < high[active])
        following = np.where(inside, step, 0.5 * (low[active] + high[active]))
        moved = np.abs(following - x[active])
        x[active] = np.where(after.lost | (after.stopped & backward), np.nan, following)
        active = active[(moved > 1e-14 * following) & (change != 0.0) & np.isfinite(x[active])]
    return x


def _edge(returns: ReturnMap, low: float, high: float) -> float:
    """The energy at the angle 0 above which the shaft does not stop within a cycle, by bisection."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if returns.follow(np.array([middle])).stopped[0] else (low, middle)
    return high


def _cycle(bench: Bench, returns: ReturnMap, energy: float, *, stable: bool, low: float, high: float) -> SteadyCycle:
    """The cycle with an ``energy`` at the angle 0."""
    trace: list[tuple[float, Floats]] = []
    after = returns.follow(np.array([energy]), backward=not stable, trace=trace)
    trace.sort(key=lambda part: part[0])
    ends = [end for end, _ in trace]
    cuts = np.array([[*([0.0, *ends] if stable else [*ends, bench.cycle])]])
    panels = Panels(cuts)
    nodes = np.concatenate([nodes for _, nodes in trace]).reshape(1, -1, NODES)
    inertia = bench.at(bench.fields.inertia, panels.angles.ravel()).reshape(nodes.shape)
    course = cycle_of(panels, inertia, np.array([energy]), nodes - energy, bench.model.mean_speed_is)
    square = panels.extremes(2.0 * nodes / inertia)
    growth = float(after.growth[0])
    return SteadyCycle(
        panels, course, _speed(bench, energy), float(np.sqrt(square.highest[0])), float(np.sqrt(square.lowest[0])),
        growth if stable else 1.0 / growth, low if stable else np.nan, high if stable else np.nan,
    )  # fmt: skip


def _speed(bench: Bench, energy: float) -> float:
    """Speed at the angle 0 for an energy there."""
    return float(np.sqrt(2.0 * energy / bench.at(bench.fields.inertia, np.zeros(1))[0]))


def cycles_on(bench: Bench, ending: Ending, load: float = 1.0) -> SteadyCycles:
    """The steady cycles of a machine on its bench, with a factor on the torque of its operations."""
    returns = ReturnMap(bench, load)
    inertia = float(bench.at(bench.fields.inertia, np.zeros(1))[0])
    pace = float(bench.machine.pace[0, 0, 0])
    if np.isfinite(bench.start):
        pace = max(pace, _speed(bench, bench.start))
    scan, whole = _scanned(returns, inertia, pace)
    root, rises = np.sqrt(2.0 * scan.energy / inertia), scan.change > 0.0
    if not root.size:
        return SteadyCycles((), None, 0.0, np.inf, root, root, False, ending)
    at = np.nonzero(rises[:-1] != rises[1:])[0]
    stable, edge = rises[at], scan.edges()[at]
    energies = np.empty(len(at))
    for chosen, backward in ((stable, False), (~stable, True)):
        if chosen.any():
            energies[chosen] = _roots(returns, scan.energy[at[chosen]], scan.energy[at[chosen] + 1], backward=backward)
    # Above a speed at which the shaft just does not stop it may become faster, without a cycle between.
    edge &= np.isnan(energies)
    whole = whole and not np.isnan(energies[~edge]).any()
    for place in np.nonzero(edge)[0]:
        energies[place] = _edge(returns, scan.energy[at[place]], scan.energy[at[place] + 1])
    starts = np.sqrt(2.0 * energies / inertia)
    bounds = starts[~stable & np.isfinite(starts)]
    kept = ~edge & np.isfinite(starts)
    energies, starts, stable = energies[kept], starts[kept], stable[kept]
    cycles = []
    for energy, start, attracts in zip(energies.tolist(), starts.tolist(), stable.tolist(), strict=True):
        low = max(bounds[bounds < start], default=0.0)
        high = min(bounds[bounds > start], default=np.inf)
        cycles.append(_cycle(bench, returns, energy, stable=attracts, low=float(low), high=float(high)))
    case = None
    if np.isfinite(bench.start) and load == 1.0 and energies.size:
        nearest = int(np.argmin(np.abs(energies - bench.start)))
        case = nearest if abs(energies[nearest] - bench.start) <= _SAME * bench.start else None
    stops = 0.0 if rises[0] else float(min(bounds, default=root[-1]))
    away = float(max(bounds, default=0.0)) if rises[-1] else np.inf
    after = np.sqrt(2.0 * (scan.energy + scan.change) / inertia)
    return SteadyCycles(tuple(cycles), case, stops, away, root, after - root, whole, ending)


def steady_cycles(model: MachineSpec, columns: Mapping[str, ArrayLike], load: float = 1.0) -> SteadyCycles | None:
    """Every steady cycle of one case; None where its torques do not follow the speed.

    Without a motor the drive is the one that balances the case. Where it has none, there are no cycles.

    Parameters
    ----------
    model : MachineSpec
    columns : mapping
        As for ``simulate``, scalars only.
    load : float
        Factor on the torque of all operations.

    Raises
    ------
    MachineError
        If the structure is not a valid machine.
    ValueError
        If a parameter is missing or unknown.
    """
    check_structure(model)
    row = Columns.of(model, columns, 1)
    if not _follows_speed(model, row):
        return None
    bench, ending = bench_of(model, row)
    none = np.empty(0)
    if bench is None:
        return SteadyCycles((), None, 0.0, np.inf, none, none, True, ending)
    return cycles_on(bench, ending, load)


def _follows_speed(model: MachineSpec, row: Columns) -> bool:
    """Whether a torque follows the speed, which is known before the case is solved."""
    return model.balance == "motor" or follows_speed(Machine(model, row))


def other_speed(model: MachineSpec, columns: Mapping[str, ArrayLike]) -> float:
    """The slowest other speed in rad/s at which an even shaft would be held besides that of the case; NaN for none.

    It is one at which the mean torque over the cycle falls through zero: a guess of a further stable cycle at the cost
    of a few cases. Parameters and errors are those of ``steady_cycles``.
    """
    check_structure(model)
    row = Columns.of(model, columns, 1)
    if not _follows_speed(model, row):
        return np.nan
    bench, ending = bench_of(model, row)
    if bench is None or ending not in {Ending.OK, Ending.UNSTABLE}:
        return np.nan
    speeds = float(bench.machine.pace[0, 0, 0]) * _SCAN
    with np.errstate(all="ignore"):
        torque = ReturnMap(bench).mean_torque(speeds)
    held = np.nonzero((torque[:-1] > 0.0) & (torque[1:] <= 0.0))[0]
    share = torque[held] / (torque[held] - torque[held + 1])
    found = speeds[held] + share * (speeds[held + 1] - speeds[held])
    if ending is Ending.OK and found.size:
        steady = bench.steady(1.0)
        found = np.delete(found, int(np.argmin(np.abs(found - (steady.mean if steady else np.inf)))))
    return float(found[0]) if found.size else np.nan
