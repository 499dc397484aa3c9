"""The tables of one case over the angle."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.decomposition import Decomposition
from sprag_study.engine.machine_shaft.joints import reaction_columns
from sprag_study.engine.machine_shaft.loads import operation_factor
from sprag_study.engine.machine_shaft.machine import Machine, check_structure
from sprag_study.engine.machine_shaft.panels import Points
from sprag_study.engine.machine_shaft.simulate import Solved, attempts, settle
from sprag_study.engine.machine_shaft.spec import LINKED, MachineSpec
from sprag_study.engine.outcome import Trajectory

Floats = NDArray[np.float64]

#: Name and SI unit of each column.
COLUMNS: tuple[tuple[str, str], ...] = (
    ("time", "s"),
    ("omega", "rad/s"),
    ("acceleration", "rad/s^2"),
    ("energy", "J"),
    ("inertia", "kg*m^2"),
    ("inertia.slope", "kg*m^2/rad"),
    ("drive_torque", "N*m"),
    ("resisting_torque", "N*m"),
    ("power", "W"),
    ("s1", "rad^2/s^2"),
    ("s2", "rad^2/s^2"),
    ("s3", "rad^2/s^2"),
    ("s4", "rad^2/s^2"),
)


#: Columns of each part of a machine of several, after its prefix ``parts.0.``; ``way`` where it has dimensions.
_PART_COLUMNS: tuple[tuple[str, str], ...] = (("way", "m"), ("inertia", "kg*m^2"), ("resisting_torque", "N*m"))


#: Columns of each slider-crank, after the prefix of its part: forces in its joints.
_JOINT_COLUMNS: tuple[tuple[str, str], ...] = (
    ("crank_pin.force", "N"), ("crank_pin.x", "N"), ("crank_pin.y", "N"), ("guide.force", "N"),
)  # fmt: skip


def columns_of(model: MachineSpec) -> tuple[tuple[str, str], ...]:
    """Name and SI unit of each column of the tables of a machine."""
    own = (
        (f"{prefix}{name}", unit)
        for prefix, part in model.every_part() if prefix
        for name, unit in _PART_COLUMNS if name != "way" or part.mechanism.kind in LINKED
    )  # fmt: skip
    joints = (
        (f"{prefix}{name}", unit)
        for prefix, part in model.every_part() if part.mechanism.kind == "slider_crank"
        for name, unit in _JOINT_COLUMNS
    )  # fmt: skip
    linkages = (
        (f"{prefix}joints.{name}", unit)
        for prefix, part in model.every_part() if part.mechanism.linkage is not None
        for name, unit in reaction_columns(part.mechanism.linkage)
    )  # fmt: skip
    return (*COLUMNS, *own, *joints, *linkages)


def trajectory(model: MachineSpec, columns: Mapping[str, ArrayLike], angles: ArrayLike) -> Trajectory:
    """Solve one case and tabulate it.

    Parameters
    ----------
    model : MachineSpec
    columns : mapping
        As for ``simulate``, scalars only.
    angles : array, shape (m,)
        Angles of the shaft in rad, within 0 .. cycle. At a jump the value before it is given.

    Returns
    -------
    Trajectory
        s1 + s2 + s3 + s4 = omega^2 at every angle.

    Raises
    ------
    MachineError
        If the structure is not a valid machine.
    ValueError
        If an angle is outside the cycle, or a parameter is missing or unknown.
    """
    check_structure(model)
    described = columns_of(model)
    names, units = tuple(name for name, _ in described), tuple(unit for _, unit in described)
    asked = np.ascontiguousarray(angles, dtype=np.float64)
    cycle = 2.0 * np.pi * model.cycle
    if asked.size and not (asked.min() >= 0.0 and asked.max() <= cycle * (1.0 + 1e-12)):
        raise ValueError(f"angles must be within 0 .. {cycle:g} rad")
    row = Columns.of(model, columns, 1)

    def trajectory(angles: Floats, values: Floats, ending: Ending, phi_c: tuple[float, ...] = ()) -> Trajectory:
        return Trajectory(angles, names, units, values, {}, ending, "angle", "rad", phi_c)

    nothing = np.empty((0, len(names)))
    if not np.isnan(Machine(model, row).unassembled()[0]):
        return trajectory(nothing[:, 0], nothing, Ending.CANNOT_ASSEMBLE)
    with np.errstate(all="ignore"):
        *_, (_, solved) = attempts(model, row)
        settle(model, row, solved)
    ending = ENDINGS[int(solved.endings[0])]
    if ending is not Ending.OK:
        return trajectory(nothing[:, 0], nothing, ending)
    table = _table(solved.decomposition, model.phi_c, np.minimum(asked, cycle))
    machine, places = Machine(model, row), np.minimum(asked, cycle)
    if model.parts:
        table |= _part_table(machine, solved, places)
    table |= _joint_table(machine, solved, places)
    values = np.column_stack([table[name] for name in names])
    every = np.sort(np.mod(solved.decomposition.crossings.angle, cycle))
    return trajectory(asked, values, ending, tuple(float(angle) for angle in every))


def _table(d: Decomposition, chosen: int | None, angles: Floats) -> dict[str, Floats]:
    panels, cases = d.panels, np.zeros(len(angles), dtype=np.int64)
    points = panels.locate(0, angles)

    def at(values: Floats) -> Floats:
        return panels.at_rows(values, cases, points)

    phi_c, _ = d.reference(chosen)
    works = []
    for work in (d.drive, d.resistance):
        before = panels.running_at(work.torque, work.ends, phi_c)
        since = panels.running_at_rows(work.torque, work.ends, cases, points)
        works.append(since - np.where(np.isnan(phi_c.angle), np.nan, before))
    inertia, slope, drive, resistance = (
        at(d.fields.inertia),
        at(d.fields.slope),
        at(d.drive.torque),
        at(d.resistance.torque),
    )
    energy = d.start + panels.running_at_rows(d.total.torque, d.total.ends, cases, points)
    square = 2.0 * energy / inertia
    omega = np.sqrt(square)
    return {
        "time": np.where(angles == 0.0, 0.0, _time(d, cases, points)),  # without the rounding at the start
        "omega": omega,
        "acceleration": (drive + resistance - 0.5 * square * slope) / inertia,
        "energy": energy,
        "inertia": inertia,
        "inertia.slope": slope,
        "drive_torque": drive,
        "resisting_torque": resistance,
        "power": drive * omega,
        "s1": 2.0 * d.least_energy / inertia,
        "s2": 2.0 * (d.mean_energy - d.least_energy) / inertia,
        "s3": 2.0 * works[0] / inertia,
        "s4": 2.0 * works[1] / inertia,
    }


def _joint_table(machine: Machine, solved: Solved, angles: Floats) -> dict[str, Floats]:
    """Forces in the joints of slider-cranks and linkages."""
    d = solved.decomposition
    table: dict[str, Floats] = {}
    points, cases = d.panels.locate(0, angles), np.zeros(len(angles), dtype=np.int64)
    acceleration = d.acceleration()
    factor = float(operation_factor(machine, solved.results["balance.factor"])[0])

    def along(values: Floats) -> Floats:
        shaped = np.ascontiguousarray(np.broadcast_to(values, d.panels.angles.shape))
        return d.panels.at_rows(shaped, cases, points)

    for part in machine.parts:
        if part.choice.mechanism.linkage is not None:
            own = part.reactions(d.panels.angles, d.squares, acceleration, solved.omega, factor).table(along)
            table |= {f"{part.prefix}joints.{name}": values for name, values in own.items()}
        if part.choice.mechanism.kind != "slider_crank":
            continue
        forces = part.joint_forces(d.panels.angles, d.squares, acceleration, solved.omega, factor)
        x, y, guide = (d.panels.at_rows(np.ascontiguousarray(force), cases, points) for force in forces)
        pin = np.sqrt(np.square(x) + np.square(y))
        own = {
            "crank_pin.force": pin,
            "crank_pin.x": x,
            "crank_pin.y": y,
            "guide.force": guide,
        }
        table |= {f"{part.prefix}{name}": values for name, values in own.items()}
    return table


def _part_table(machine: Machine, solved: Solved, angles: Floats) -> dict[str, Floats]:
    """Travel, inertia and torque of each part; a constant load in place of the operations belongs to none."""
    panels, cases = solved.decomposition.panels, np.zeros(len(angles), dtype=np.int64)
    points = panels.locate(0, angles)
    factor = float(operation_factor(machine, solved.results["balance.factor"])[0])
    table = {}
    for part in machine.parts:
        fields, motion = part.fields(panels.angles, solved.omega), part.motion(panels.angles)
        resistance = fields.resistance if factor == 1.0 else fields.resistance + (factor - 1.0) * fields.operation
        own = {"inertia": fields.inertia, "resisting_torque": resistance}
        if motion is not None:
            own["way"] = motion.way
        for name, values in own.items():
            shaped = np.ascontiguousarray(np.broadcast_to(values, panels.angles.shape))
            table[f"{part.prefix}{name}"] = panels.at_rows(shaped, cases, points)
    return table


def _time(d: Decomposition, cases: NDArray[np.int64], points: Points) -> Floats:
    pace = 1.0 / np.sqrt(d.squares)
    # No time has passed at the angle 0, regardless of the polynomial's rounding error.
    return np.maximum(d.panels.running_at_rows(pace, d.panels.running(pace)[1], cases, points), 0.0)
