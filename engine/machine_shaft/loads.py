"""Loads of a block of cases: motion and force of each working part, forces in the joints, torques in the couplings.

(docs/theory-machine-shaft.md, "Loads".) They are those of the table over the angle; extremes and means are those of the
continuous functions.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.decomposition import Decomposition, wrapped
from sprag_study.engine.machine_shaft.load_results import infos_of
from sprag_study.engine.machine_shaft.machine import Machine
from sprag_study.engine.machine_shaft.parts import ShaftPart

Floats = NDArray[np.float64]

_OK = ENDINGS.index(Ending.OK)


class Moving(NamedTuple):
    """A steady motion whose loads are computed.

    Attributes
    ----------
    machine : Machine
    decomposition : Decomposition
        Its motion.
    omega : array, shape (cases, panels, nodes), or None
        The speeds in rad/s at which loads that follow the speed were evaluated.
    factor : array, shape (cases,)
        Factor of the balance on the operations (``operation_factor``).
    """

    machine: Machine
    decomposition: Decomposition
    omega: Floats | None
    factor: Floats


def operation_factor(machine: Machine, balance_factor: Floats) -> Floats:
    """Factor of the balance on the operations, shape (cases,): 0 where a constant load is in their place."""
    if machine.spec.balance_side != "operation":
        return np.ones(machine.columns.cases)
    return np.nan_to_num(balance_factor, nan=0.0)


def loads(moving: Moving, endings: NDArray[np.int8], known: Mapping[str, Floats]) -> Floats:
    """Loads of every case that ended ok.

    Parameters
    ----------
    moving : Moving
    endings : int8 array, shape (cases,)
    known : mapping
        Results by name, each (cases,), with those of the couplings (``torsion_results``).

    Returns
    -------
    array, shape (cases, results)
        In the order of ``infos_of`` the machine; NaN where a case did not end ok, and
        where a value does not exist.
    """
    machine, d = moving.machine, moving.decomposition
    spec, cases = machine.spec, machine.columns.cases
    infos = infos_of(spec)
    values = {info.name: known[info.name] for info in infos if info.name in known} | _of_shaft(machine, d)
    with np.errstate(all="ignore"):
        shaped = _Shaped(d)
        joints = 0
        for number, part in enumerate(machine.parts):
            values |= {f"parts.{number}.{name}": value for name, value in _of_part(part, moving, shaped).items()}
            for x, y in _joint_forces(part, moving):
                force = _of_force(shaped(x), shaped(y), d)
                values |= {f"joints.{joints}.force.{name}": value for name, value in force.items()}
                joints += 1
    rows = np.full((cases, len(infos)), np.nan)
    for column, info in enumerate(infos):
        if info.name in values:
            rows[:, column] = values[info.name]
    rows[endings != _OK] = np.nan
    rows[~np.isfinite(rows)] = np.nan
    return rows


class _Shaped:
    """Gives values at the nodes the shape (cases, panels, nodes)."""

    def __init__(self, d: Decomposition) -> None:
        self._shape = d.squares.shape

    def __call__(self, values: Floats) -> Floats:
        return np.ascontiguousarray(np.broadcast_to(values, self._shape))


def _of_shaft(machine: Machine, d: Decomposition) -> dict[str, Floats]:
    drive = machine.train.inertia
    mechanism = np.ascontiguousarray(d.fields.inertia - drive)
    most = d.panels.extremes(mechanism).highest
    of_drive = np.broadcast_to(drive[:, 0, 0], most.shape)
    with np.errstate(all="ignore"):
        return {"energy.start": d.start, "inertia.mechanism.max": most, "inertia.ratio": most / of_drive}


def _of_part(part: ShaftPart, moving: Moving, shaped: Callable[[Floats], Floats]) -> dict[str, Floats]:
    """Of the working part of a mechanism with dimensions."""
    d, motion, stroke = moving.decomposition, part.motion(moving.decomposition.panels.angles), part.stroke
    if motion is None or stroke is None or not part.works:
        return {}
    slope = shaped(motion.way_slope)
    acceleration = d.panels.slope(slope) * d.squares + slope * d.acceleration()
    values = {
        "stroke": np.broadcast_to(stroke.length[:, 0, 0], (len(slope),)),
        "speed.max": _largest(slope * np.sqrt(d.squares), d),
        "acceleration.max": _largest(acceleration, d),
    }
    if part.choice.operation.quantity not in {"none", "torque"}:
        push = part.push(d.panels.angles, slope, moving.omega, moving.factor[:, None, None])
        values["force.max"] = _largest(shaped(push), d)
    return values


def _largest(values: Floats, d: Decomposition) -> Floats:
    extremes = d.panels.extremes(values)
    return np.asarray(np.maximum(np.abs(extremes.highest), np.abs(extremes.lowest)))


def _joint_forces(part: ShaftPart, moving: Moving) -> list[tuple[Floats, Floats]]:
    """Forces in the joints of a part, along x and y at the nodes, in the order of ``joints_of``."""
    d, factor = moving.decomposition, moving.factor[:, None, None]
    asked = (d.panels.angles, d.squares, d.acceleration(), moving.omega, factor)
    if part.choice.mechanism.linkage is not None:
        return [(force.x, force.y) for force in part.reactions(*asked).forces.values()]
    if part.choice.mechanism.kind == "slider_crank":
        forces = part.joint_forces(*asked)
        return [(forces.pin_x, forces.pin_y), (np.zeros((1, 1, 1)), forces.guide)]
    return []


def _of_force(x: Floats, y: Floats, d: Decomposition) -> dict[str, Floats]:
    """What is told of a force whose parts along two axes are ``x`` and ``y``."""
    squares = np.square(x) + np.square(y)
    most = d.panels.extremes(squares)
    there = most.at_highest
    return {
        "max": np.sqrt(most.highest),
        "rms": np.sqrt(d.panels.integral(squares) / d.cycle),
        "direction": elementary.arctan2(d.panels.at(y, there), d.panels.at(x, there)),
        "angle_at_max": wrapped(there.angle, d.cycle),
    }
