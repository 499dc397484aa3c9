"""Running machines: a batch of cases in, results and endings out; the tables of one case over the angle."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft import resolution
from sprag_study.engine.machine_shaft.balance import balanced
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.decomposition import Decomposition, characteristics
from sprag_study.engine.machine_shaft.drive_train import Train
from sprag_study.engine.machine_shaft.flywheel import flywheel_results, required_inertia
from sprag_study.engine.machine_shaft.kinks import motion_kinks
from sprag_study.engine.machine_shaft.load_results import couplings_of, infos_of
from sprag_study.engine.machine_shaft.loads import Moving, loads, operation_factor
from sprag_study.engine.machine_shaft.machine import Fields, Machine, check_structure
from sprag_study.engine.machine_shaft.motor import characteristic, limit_cycle
from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.pieces import Pieces, pieces
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.engine.machine_shaft.speed_course import follows_speed, speed_course
from sprag_study.engine.machine_shaft.stability import Stability
from sprag_study.engine.machine_shaft.start import Shape, Stop, least_mean_speed, start_energy
from sprag_study.engine.machine_shaft.torsion import torsion_results
from sprag_study.engine.outcome import Batch

Floats = NDArray[np.float64]
Codes = NDArray[np.int8]
Bools = NDArray[np.bool_]

#: Initial panels per revolution, and the number at which a case is abandoned.
PANELS, MAX_PANELS = 16, 600
MAX_ATTEMPTS = 48
#: Attempts after which panels are halved although the motion has a kink in them, and after which a kink alone makes no
#: further attempt: near a speed that is only touched, kinks may come and go.
_KINKS_FIRST, _MOST_CUTS = 3, 10
#: Cases computed together, few enough for their arrays to stay in the processor's cache, and the revolutions of a cycle
#: up to which they are as many.
BLOCK, _BLOCK_CYCLE = 64, 12

_NAMES = tuple(info.name for info in result_infos())
_OF_TIME = np.array([
    _NAMES.index(name)
    for name in (
        "omega.mean_time", "irregularity.time", "motor.torque.rms", "motor.power.rms", "motor.torque.margin"
    )
])  # fmt: skip
#: Prefixes of results that a case without motion does not have.
_OF_MOTION = (
    "omega.", "omega_squared.", "irregularity", "acceleration.", "s1.", "s2.", "s3.share", "s4.share", "power.",
    "energy.m", "motor.s", "motor.p", "motor.torque.rms", "motor.torque.margin", "flywheel.s", "flywheel.margin",
)  # fmt: skip
#: The same for a motor that has no steady torque.
_OF_MOTOR = (
    "drive_torque.", "torque.", "motor.", "work.drive", "work.resistance.", "balance.work", "energy.", "s3.", "s4.",
    "phi_c",
)  # fmt: skip
_CODE = {ending: np.int8(code) for code, ending in enumerate(ENDINGS)}


@dataclass(frozen=True, slots=True)
class Solved:
    """One attempt at a block of cases.

    Attributes
    ----------
    decomposition : Decomposition
    results : dict
        Every result but the angle of assembly by name, each (cases,).
    endings : int8 array, shape (cases,)
    rough, slow, rough_pace : arrays of bool, shape (cases, panels)
        Panels that do not resolve their torques or inertia; those in which the shaft is too close to rest to resolve
        the speed, or its mean over time where that is required; and those that do not resolve 1/omega.
    unknown : array of bool, shape (cases,)
        Cases with a formula that cannot be enclosed and may have hidden features between any two angles, or for whose
        loads no speed was found.
    unstable : array of bool, shape (cases,)
        Cases whose motion does not last.
    omega : array, shape (cases, panels, nodes), or None
        The speeds in rad/s at which loads that follow the speed were evaluated.
    """

    decomposition: Decomposition
    results: dict[str, Floats]
    endings: Codes
    rough: Bools
    slow: Bools
    rough_pace: Bools
    unknown: Bools
    unstable: Bools
    omega: Floats | None = None


def attempts(spec: MachineSpec, columns: Columns) -> Iterator[tuple[NDArray[np.int64], Solved]]:
    """Solve assembled cases repeatedly, halving the panels that are too rough and cutting where the motion has kinks.

    Yields case numbers with their attempts; the last attempt of a case counts.
    """
    rows = np.arange(columns.cases)
    cuts = kinks = np.empty((rows.size, 0))
    found: list[Pieces] | None = None
    for number in range(MAX_ATTEMPTS):
        if not rows.size:
            return
        machine = Machine(spec, columns.take(rows))
        solved = _attempt(machine, np.concatenate([cuts, kinks], axis=1))
        _mark_unreached(spec, machine.columns, solved)
        panels = solved.decomposition.panels
        first = found is None
        if found is None:
            found = [pieces(formula, panels, 2.0 * np.pi * spec.cycle) for formula in Machine(spec, columns).formulas()]
        for own in found:
            solved.unknown[...] |= np.broadcast_to(own.unknown, (columns.cases,))[rows]
        resolution.compare(spec, columns, rows, found, solved.decomposition, solved.rough, solved.omega)
        yield rows, solved
        kinks, cut = motion_kinks(machine, solved.decomposition)
        chosen = solved.rough | solved.slow | solved.rough_pace
        if number < _KINKS_FIRST:
            chosen &= ~cut
        cut &= number < _MOST_CUTS
        real = np.broadcast_to((panels.half > 0.0).sum(axis=1), rows.shape)
        again = np.nonzero((chosen | cut).any(axis=1) & (real <= MAX_PANELS * spec.cycle) & ~solved.unknown)[0]
        more = [panels.take(again).middles(chosen[again])]
        if first:
            more += [np.broadcast_to(own.breaks, (columns.cases, own.breaks.shape[1]))[again] for own in found]
        rows, kinks, cuts = rows[again], kinks[again], np.concatenate([cuts[again], *more], axis=1)


def _mark_unreached(spec: MachineSpec, columns: Columns, solved: Solved) -> None:
    """Mark cases whose mean speed on these panels differs from the required one.

    A low mean over time can require the shaft to come closer to rest than doubles can resolve.
    """
    if spec.balance == "motor":
        return
    wanted = columns.row("mean_speed")
    far = ~(np.abs(solved.results["omega.mean"] - wanted) <= 1e-6 * wanted)
    far &= solved.endings == _CODE[Ending.OK]
    _stop(solved, far)


def _stop(solved: Solved, cases: Bools) -> None:
    """End ``cases`` for insufficient inertia, without the results of a motion."""
    _end(solved, cases, Ending.INERTIA_INSUFFICIENT, (*_OF_MOTION, "cycle."))


def _end(solved: Solved, cases: Bools, ending: Ending, without: tuple[str, ...]) -> None:
    """Give ``cases`` an ending, and no results whose names begin as those ``without``."""
    solved.endings[cases] = _CODE[ending]
    for name, values in solved.results.items():
        if name.startswith(without):
            solved.results[name] = np.where(cases, np.nan, values)


def settle(spec: MachineSpec, columns: Columns, solved: Solved) -> Bools:
    """Set the endings of the cases whose last attempt this was; True for those that were not resolved.

    Where torques and inertia are resolved, only a shaft that nearly stops has an unresolved speed. A formula for the
    inertia with a jump allows no motion.
    """
    ok = solved.endings == _CODE[Ending.OK]
    slow = ok & solved.slow.any(axis=1)
    lost = solved.rough.any(axis=1) | solved.unknown | (slow & (spec.balance == "motor"))
    if any(part.mechanism.kind == "formula" for _, part in spec.every_part()):
        for jumps in Machine(spec, columns).inertia_jumps():
            lost |= ~np.isnan(jumps.angle)
    negative = solved.endings == _CODE[Ending.NEGATIVE_INERTIA]
    singular = np.zeros_like(lost)
    if (lost | negative).any():
        # Close to a singular position the inertia is so large that any other looks like rounding error.
        singular = resolution.near_singular(Machine(spec, columns), solved.decomposition, solved.rough)
        # No panels were halved for unknown formulas, whose variation may come from the linkage.
        rows = np.nonzero(solved.unknown)[0]
        if rows.size:
            panels = solved.decomposition.panels.take(rows)
            machine = Machine(spec, columns.take(rows))
            singular[rows] = resolution.linkage_unresolved(machine, panels, rows.size, MAX_PANELS * spec.cycle)
    lost = (lost & ~negative) | singular
    _stop(solved, slow & ~lost)
    unstable = solved.unstable & (solved.endings == _CODE[Ending.OK])
    _end(solved, unstable, Ending.UNSTABLE, _OF_MOTION + (_OF_MOTOR if spec.balance == "motor" else ()))
    solved.endings[lost] = _CODE[Ending.QUADRATURE_NOT_REACHED]
    solved.endings[singular] = _CODE[Ending.NEAR_SINGULAR]
    return np.asarray(lost)


def _attempt(machine: Machine, cuts: Floats) -> Solved:
    spec, columns, cycle = machine.spec, machine.columns, machine.cycle
    panels = Panels.over(cycle, [*machine.breaks(), cuts], PANELS * spec.cycle, machine.given_breaks())
    with np.errstate(all="ignore"):
        fields = machine.fields(panels.angles)
    endings = np.full(columns.cases, _CODE[Ending.OK])
    least_inertia = panels.extremes(fields.inertia).lowest
    # With an inertia at rounding level the speed is arbitrary.
    negative = ~(least_inertia > 1e-12 * panels.largest(fields.inertia))
    endings[negative] = _CODE[Ending.NEGATIVE_INERTIA]
    moved = _moved(machine, columns, panels, fields, endings)
    fields, drive, resistance = moved.fields, moved.drive, moved.resistance
    start = np.where(endings == _CODE[Ending.OK], moved.start, np.nan)
    d = Decomposition(panels, cycle, fields, drive, resistance, start)
    results = characteristics(d, spec.phi_c)
    results["work.drive"], results["work.resistance"] = d.drive.ends[:, -1], d.resistance.ends[:, -1]
    results["least_mean_speed"], results["balance.factor"] = moved.least, moved.factor
    results["resisting_torque.mean"] = d.resistance.ends[:, -1] / cycle
    results["cycle.multiplier"] = np.where(np.isnan(start), np.nan, moved.stability.multiplier)
    for name in ("omega.angle_at_max", "omega.angle_at_min"):
        results[name] = np.where(np.isnan(start), np.nan, results[name])
    results["inertia.min"] = np.where(negative, least_inertia, results["inertia.min"])
    _by_definition(spec, d, results)
    results |= machine.train.results(panels, d.drive.torque, results)
    rated = columns.row("drive.motor.rated_torque") if spec.balance == "motor" else np.inf
    results |= machine.train.heating(panels, d.drive.torque, np.sqrt(d.squares), np.asarray(rated))
    fixed = spec.balance != "motor" and moved.omega is None
    results["required_inertia"] = _required(spec, columns, d, endings, fixed=fixed)
    results |= flywheel_results(machine.train.flywheel, columns, results, fixed=fixed)
    no_cycle = (endings == _CODE[Ending.MOTOR_STALLED]) | (endings == _CODE[Ending.MOTOR_OVERRUN])
    if no_cycle.any():
        for name, values in results.items():
            if name.startswith(_OF_MOTOR):
                results[name] = np.where(no_cycle, np.nan, values)
    (rough, slow), pace = resolution.rough_panels(d), resolution.rough_pace(d)
    slow = slow | pace if spec.mean_speed_is == "time" else slow
    # Where the load is stiff, shorter panels may bring the speed that was not found.
    lost, unstable = moved.lost | resolution.lost_by_rounding(machine, d), moved.stability.unstable
    return Solved(d, results, endings, rough | moved.stiff, slow, pace, lost, unstable, moved.omega)


class _Moved(NamedTuple):
    """The torques of a block of cases, the energy at the start, and what the balance gives; ``Solved`` has the rest."""

    fields: Fields
    drive: Floats
    resistance: Floats
    start: Floats
    least: Floats
    factor: Floats
    omega: Floats | None
    lost: Bools
    stiff: Bools
    stability: Stability


def _moved(machine: Machine, columns: Columns, panels: Panels, fields: Fields, endings: Codes) -> _Moved:
    """Balance the works and find the speed; marks ``endings``, of which those that are not ok stay as they are."""
    spec, cycle = machine.spec, machine.cycle
    none, omega = np.full(columns.cases, np.nan), None
    lost, stiff = np.zeros(columns.cases, dtype=np.bool_), np.zeros(fields.inertia.shape[:2], dtype=np.bool_)
    ok = endings == _CODE[Ending.OK]
    law = machine.speed_law(panels.angles) if follows_speed(machine) else None
    if law is not None:
        with np.errstate(all="ignore"):
            fields = fields.less(law(np.broadcast_to(machine.pace, fields.inertia.shape))[0])
    if spec.balance == "motor":
        found = limit_cycle(
            characteristic(spec.drive), machine.motor, panels, cycle, fields.inertia, fields.resistance, law
        )
        endings[found.stalled & ok] = _CODE[Ending.MOTOR_STALLED]
        endings[found.overrun & ok] = _CODE[Ending.MOTOR_OVERRUN]
        if law is not None:
            fields, omega = replace(fields, resistance=found.resistance), found.omega
        return _Moved(
            fields, found.drive, found.resistance, found.start, none, none, omega, lost, stiff, found.stability
        )
    stability = Stability.neutral(columns.cases)
    if law is not None:
        course = speed_course(machine, columns, panels, fields, law)
        endings[course.stopped & ok] = _CODE[Ending.INERTIA_INSUFFICIENT]
        omega, lost, stiff = course.omega, course.lost & ok & ~course.stiff.any(axis=1), course.stiff & ok[:, None]
        with np.errstate(all="ignore"):
            fields = fields.less(-law(omega)[0])
            stability = Stability.of(panels, course.slope)
    balance = balanced(
        spec.balance, spec.balance_side, panels, cycle, fields.drive, fields.resistance, fields.operation
    )
    drive, resistance = balance.drive, balance.resistance
    endings[balance.wrong & (endings == _CODE[Ending.OK])] = _CODE[Ending.UNBALANCED_WORK]
    start, least = _started(spec, columns, panels, cycle, fields.inertia, drive + resistance, endings)
    # The least speed of a load that follows the speed is another than at these torques.
    least = none if law is not None else least
    return _Moved(fields, drive, resistance, start, least, balance.factor, omega, lost, stiff, stability)


def _started(
    spec: MachineSpec, columns: Columns, panels: Panels, cycle: float, inertia: Floats, torques: Floats, endings: Codes
) -> tuple[Floats, Floats]:
    """Energy at the start for the required mean speed, and the least feasible mean speed; marks ``endings``."""
    wanted, kind = columns.row("mean_speed"), spec.mean_speed_is
    start, least = np.full(columns.cases, np.nan), np.full(columns.cases, np.nan)
    rows = np.nonzero(endings == _CODE[Ending.OK])[0]
    if rows.size == 0:
        return start, least
    own = panels.take(rows)
    with np.errstate(all="ignore"):
        torque = torques[rows]
        shape = Shape(own, cycle, inertia[rows], own.running(torque)[0])
        stop = Stop.of(shape)
        least[rows] = least_mean_speed(shape, stop, kind, torque)
        feasible = wanted[rows] > least[rows]
        endings[rows[~feasible]] = _CODE[Ending.INERTIA_INSUFFICIENT]
        going = np.nonzero(feasible)[0]
        if going.size:
            start[rows[going]] = start_energy(shape.take(going), stop.take(going), kind, wanted[rows[going]])
    return start, least


def _by_definition(spec: MachineSpec, d: Decomposition, out: dict[str, Floats]) -> None:
    """Results that depend on the definition of the mean, and the balance of works."""
    kind = spec.mean_speed_is
    out["omega.mean"] = out["omega.midrange" if kind == "midrange" else f"omega.mean_{kind}"]
    out["irregularity"] = out[f"irregularity.{kind}"]
    out["power.mean"] = out["drive_torque.mean"] * out["omega.mean"]
    left = d.total.ends[:, -1]
    out["balance.work"] = np.abs(left) / np.where(d.most_work > 0.0, d.most_work, 1.0)


def _required(spec: MachineSpec, columns: Columns, d: Decomposition, endings: Codes, *, fixed: bool) -> Floats:
    """The required flywheel inertia, (cases,), which does not depend on the drive's given inertia.

    It is not known unless the torques are ``fixed``, the same at any speed.
    """
    required = np.full(columns.cases, np.nan)
    wanted = columns.row("wanted_irregularity")
    known = (endings == _CODE[Ending.OK]) | (endings == _CODE[Ending.INERTIA_INSUFFICIENT])
    rows = np.nonzero(np.isfinite(wanted) & known)[0]
    if rows.size and fixed:
        drive = Train.of(spec.drive, columns.values).inertia
        mechanism = d.fields.inertia[rows] - (drive[rows] if len(drive) > 1 else drive)
        with np.errstate(all="ignore"):
            required[rows] = required_inertia(
                Shape(d.panels.take(rows), d.cycle, mechanism, d.total.nodes[rows]), d.total.torque[rows],
                spec.mean_speed_is, columns.row("mean_speed")[rows], wanted[rows],
            )  # fmt: skip
    return required


def _with_last(
    attempted: Iterator[tuple[NDArray[np.int64], Solved]],
) -> Iterator[tuple[NDArray[np.int64], Solved, Bools]]:
    """Each attempt with the cases whose last it is."""
    before = next(attempted, None)
    while before is not None:
        following = next(attempted, None)
        rows, solved = before
        yield rows, solved, ~np.isin(rows, () if following is None else following[0])
        before = following


def _block(spec: MachineSpec, columns: Columns, further: Floats | None) -> tuple[Floats, Codes]:
    """Results and endings of a block of cases: finer panels for those that need them; writes ``further`` loads."""
    values = np.full((columns.cases, len(_NAMES)), np.nan)
    endings = np.full(columns.cases, _CODE[Ending.CANNOT_ASSEMBLE])
    angle = Machine(spec, columns).unassembled()
    values[:, _NAMES.index("assembly.angle")] = angle
    assembled = np.nonzero(np.isnan(angle))[0]
    for found, solved, last in _with_last(attempts(spec, columns.take(assembled))):
        rows = assembled[found]
        own = columns.take(rows)
        lost = settle(spec, own, solved)
        vibrating = last & (solved.endings == _CODE[Ending.OK])
        chain = Train.of(spec.drive, own.values).chain if couplings_of(spec) else None
        solved.results.update(torsion_results(chain, solved.decomposition, solved.results, vibrating))
        for position, name in enumerate(_NAMES):
            if name != "assembly.angle":
                values[rows, position] = solved.results[name]
        values[np.ix_(rows[solved.rough_pace.any(axis=1)], _OF_TIME)] = np.nan
        endings[rows] = solved.endings
        values[rows[lost]] = np.nan
        if further is not None:
            machine = Machine(spec, own)
            factor = operation_factor(machine, solved.results["balance.factor"])
            further[rows] = loads(
                Moving(machine, solved.decomposition, solved.omega, factor), solved.endings, solved.results
            )
    values[~np.isfinite(values)] = np.nan
    return values, endings


def simulate(model: MachineSpec, columns: Mapping[str, ArrayLike], *, cases: int, with_loads: bool = False) -> Batch:
    """Run a batch of cases.

    The bits of a case's results do not depend on its batch or order.

    Parameters
    ----------
    model : MachineSpec
        The structure all cases share.
    columns : mapping
        Paths in a spec (``parameters(model)``) to scalars or arrays of shape (cases,), SI units. Missing ones take the
        catalogue's default.
    cases : int
        Number of cases, at least 0.
    with_loads : bool
        Whether the results of ``infos_of`` follow those of ``result_infos``.

    Returns
    -------
    Batch

    Raises
    ------
    MachineError
        If the structure is not a valid machine (a table that does not close, an unreadable formula).
    ValueError
        If a parameter is missing, unknown, or of the wrong shape.
    """
    check_structure(model)
    block = Columns.of(model, columns, cases)
    values = np.empty((cases, len(_NAMES)))
    endings = np.empty(cases, dtype=np.int8)
    count = len(infos_of(model)) if with_loads else 0
    further = np.full((cases, count), np.nan)
    size = BLOCK * _BLOCK_CYCLE // max(model.cycle, _BLOCK_CYCLE)
    for first in range(0, cases, size):
        part = slice(first, min(first + size, cases))
        # Unbounded formulas and torques overflow to infinity, which the endings and empty results report.
        with np.errstate(all="ignore"):
            own = further[part] if with_loads else None
            values[part], endings[part] = _block(model, block.take(part), own)
    return Batch(np.hstack([values, further]) if with_loads else values, endings)
