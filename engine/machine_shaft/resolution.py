"""Whether panels resolve torques, inertia and speed."""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.balance import largest_work
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.decomposition import Decomposition
from sprag_study.engine.machine_shaft.machine import Machine
from sprag_study.engine.machine_shaft.panels import GIVEN, Panels
from sprag_study.engine.machine_shaft.parts import ShaftPart
from sprag_study.engine.machine_shaft.pieces import Part, Pieces, courses, missed
from sprag_study.engine.machine_shaft.spec import MachineSpec

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


def rough_panels(d: Decomposition) -> tuple[Bools, Bools]:
    """Panels that do not resolve their torques or inertia, and those that do not resolve a speed near to rest."""
    panels, still = d.panels, np.isnan(d.start)[:, None]
    # A case without motion is judged by the given torques and inertia.
    drive = np.where(still[..., None], d.fields.drive, d.drive.torque)
    resistance = np.where(still[..., None], d.fields.resistance, d.resistance.torque)
    torque = panels.roughness(drive) + panels.roughness(resistance)
    work = largest_work(panels, drive, resistance) if still.any() else d.most_work
    # The torques of an idle motor are rounding errors, which no panel resolves.
    idle = work <= 1e-9 * d.start
    scale = np.where(idle, 1e-6 * d.start, work)[:, None]
    fine = (torque * panels.half <= 1e-10 * scale) & _resolved(panels, d.fields.inertia, 1e-11)
    with np.errstate(invalid="ignore"):
        square = _resolved(panels, d.squares, 1e-10) | still
        speed = _resolved(panels, np.sqrt(d.squares), 1e-6) | still
        resting = (d.square_extremes.lowest <= 1e-6 * panels.largest(d.squares))[:, None]
    fine &= square | resting
    return np.asarray(~fine), np.asarray(~(square & speed))


def rough_pace(d: Decomposition) -> Bools:
    """Panels in which the shaft turns too slowly for the time to be resolved."""
    with np.errstate(invalid="ignore", divide="ignore"):
        fine = _resolved(d.panels, 1.0 / np.sqrt(d.squares), 1e-6)
    return np.asarray(~(fine | np.isnan(d.start)[:, None]))


def lost_by_rounding(machine: Machine, d: Decomposition) -> Bools:
    """Cases with given angles so near to each other that the work between them is lost in rounding, (cases,).

    Neither may the work between angles that count as one be more than 1e-10 of the largest, nor may a rounding of the
    angle by 1e-15 rad, as that of a part's crank angle, move more than 1e-8 of it.
    """
    cases, panels = len(d.start), d.panels
    lost = np.zeros(cases, dtype=np.bool_)
    given = [part for part in machine.given_breaks() if part.size]
    if not given:
        return lost
    rows = max(len(part) for part in given)
    known = np.sort(np.concatenate([np.broadcast_to(part, (rows, part.shape[1])) for part in given], axis=1), axis=1)
    gaps = np.diff(known, axis=1)
    merged = (gaps > 0.0) & (gaps < GIVEN * machine.cycle)
    if merged.any():
        between = np.where(merged, known[:, :-1] + 0.5 * gaps, 0.0)[:, None, :]
        fields = machine.fields(between)
        size = np.abs(fields.drive) + np.abs(fields.resistance)
        lost |= (np.where(merged[:, None, :], size * gaps[:, None, :], 0.0).sum(axis=(1, 2))) > 1e-10 * d.most_work
    if any(part.turned for part in machine.parts):
        lost |= 1e-15 * panels.largest(d.fields.operation) > 1e-8 * d.most_work
    return lost


def near_singular(machine: Machine, d: Decomposition, rough: Bools) -> Bools:
    """Cases with a panel among the ``rough`` ones in which the linkage's own motion is not resolved, (cases,).

    Away from its singular positions a linkage moves smoothly: panels that were halved for anything else resolve it.
    """
    if not _linkages(machine):
        return np.zeros(len(rough), dtype=np.bool_)
    wild = _wild_panels(machine, d.panels, len(rough))
    return np.asarray((wild & rough & (d.panels.half > 0.0)).any(axis=1))


def linkage_unresolved(machine: Machine, panels: Panels, cases: int, most: float) -> Bools:
    """Cases whose linkage motion ``most`` panels do not resolve, (cases,); for formulas that cannot be enclosed.

    The panels are halved for the linkage alone; in other cases they are halved for everything.
    """
    if not _linkages(machine):
        return np.zeros(cases, dtype=np.bool_)
    cuts = np.broadcast_to(panels.cuts, (cases, panels.cuts.shape[1]))
    while True:
        panels = Panels.over(machine.cycle, [cuts], 1)
        wild = _wild_panels(machine, panels, cases) & (panels.half > 0.0)
        few = (panels.half > 0.0).sum(axis=1) <= most
        going = wild.any(axis=1) & few
        if not going.any():
            return np.asarray(wild.any(axis=1))
        cuts = np.concatenate([panels.cuts, panels.middles(wild & going[:, None])], axis=1)


def _linkages(machine: Machine) -> list[ShaftPart]:
    """The parts whose mechanism has singular positions."""
    return [part for part in machine.parts if part.mechanism is not None and part.mechanism.has_singular_positions]


def _wild_panels(machine: Machine, panels: Panels, cases: int) -> Bools:
    """Panels that do not resolve the own motion of every linkage, (cases, panels)."""
    shape = (cases, *panels.angles.shape[1:])
    wild = np.zeros(shape[:2], dtype=np.bool_)
    for part in _linkages(machine):
        with np.errstate(all="ignore"):
            motion = part.motion(panels.angles)
            assert motion is not None
            for values in (np.broadcast_to(motion.inertia, shape), np.broadcast_to(motion.way_slope, shape)):
                wild |= ~_resolved(panels, values, 1e-11)
    return wild


def _resolved(panels: Panels, values: Floats, limit: float) -> Bools:
    return np.asarray(panels.roughness(values) <= limit * panels.largest(values)[:, None])


def compare(
    spec: MachineSpec,
    columns: Columns,
    rows: NDArray[np.int64],
    found: list[Pieces],
    d: Decomposition,
    rough: Bools,
    omega: Floats | None,
) -> None:
    """Mark in ``rough`` (cases, panels) the panels of the cases ``rows`` that miss features of a formula.

    Cases that already have rough panels are checked once these are refined. ``omega`` (cases, panels, nodes) are the
    speeds in rad/s at which loads that follow the speed were evaluated, if there are any.
    """
    ready = np.nonzero(~rough.any(axis=1))[0]
    panels = d.panels.take(ready)
    for own in found if ready.size else []:
        part = own.formula.part

        def exact(place: NDArray[np.int64], phi: Floats, part: Part = part) -> Floats:
            speeds = None if omega is None else courses(panels, omega[ready], place, phi)
            with np.errstate(all="ignore"):
                fields = Machine(spec, columns.take(rows[ready[place]])).fields(phi, speeds)
            return np.asarray(getattr(fields, part))

        values: Floats = getattr(d.fields, part)[ready]
        works = (d.fields.drive[ready], d.fields.resistance[ready])
        largest = panels.largest(values) if part == "inertia" else largest_work(panels, *works)
        rough[ready] |= missed(own, rows[ready], panels, values, exact, largest)
