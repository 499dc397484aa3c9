"""Kinks of the torques that follow from the motion itself: where the speed, or a torque, passes a value on its way.

A motor's table has a kink at each of its rows; a torque with losses by its direction, where its sign changes; a formula
of a load, where a comparison, abs, max or the like of the speed switches. Unlike jumps and kinks over the angle, their
places are known only once the motion is, so that each attempt at a case says where the next one is to be cut.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.decomposition import Decomposition
from sprag_study.engine.machine_shaft.machine import Fields, Machine
from sprag_study.engine.machine_shaft.motor import Characteristic, characteristic, motor_torque
from sprag_study.engine.machine_shaft.motor_tables import MotorTable
from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.pieces import courses
from sprag_study.engine.machine_shaft.roots import bracketed_roots, switches
from sprag_study.engine.machine_shaft.speed_course import follows_speed

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bools = NDArray[np.bool_]
#: A quantity of a block of cases at angles and at the speeds there, all of shape (cases, panels, nodes).
Course = Callable[[Machine, Floats, Floats], Floats]

#: How near a cut is to the kink for which it was made: as a share of the cycle, or by the speed there as a share of it.
_PLACED, _SAME_SPEED = 3e-11, 1e-11
#: Size of a torque, as a share of the largest, up to which its sign is rounding error, and how many neighbouring nodes
#: may have such values where the sign changes; a longer stretch has no torque.
_ROUNDING, _NODES_AT_ZERO = 1e-12, 2
#: Halvings of the distance of two nodes down to the rounding of an angle.
_HALVINGS = 48
#: Most kinks of a case per revolution that are cut at.
_MOST = 300


@dataclass(frozen=True, slots=True)
class _Watched:
    """A course with the values at which a torque has a kink when the course passes them, ascending.

    ``known`` are its values at the nodes, where the last attempt has them.
    """

    course: Course
    levels: Floats
    signed: bool = False
    known: Floats | None = None


def _motor(motor: Characteristic) -> tuple[Course, Course]:
    """The torque of a motor at the main shaft, and its speed as its table counts it."""

    def torque(machine: Machine, _phi: Floats, omega: Floats) -> Floats:
        return motor_torque(motor, machine.motor, omega)[0]

    def speed(machine: Machine, _phi: Floats, omega: Floats) -> Floats:
        return np.asarray(omega / machine.motor.get("unit_speed", np.ones(1)))

    return torque, speed


def _drive(machine: Machine, phi: Floats, omega: Floats) -> Floats:
    return machine.fields(phi, omega).drive


def _load(place: int) -> Course:
    """The torque of the operation of a part."""
    return lambda machine, phi, omega: machine.parts[place].fields(phi, omega).operation


def _switch(place: int, index: int) -> Course:
    """A switch of the formula of the operation of a part."""
    return lambda machine, phi, omega: machine.parts[place].switch(index, phi, omega)


def _watched(machine: Machine, fields: Fields) -> list[_Watched]:
    """Every course that makes kinks in the torques of ``machine``, whose last attempt had the ``fields``."""
    spec, zero = machine.spec, np.zeros(1)
    found: list[_Watched] = []
    losing = bool((machine.train.efficiency != 1.0).any())
    if spec.balance == "motor":
        motor = characteristic(spec.drive)
        torque, speed = _motor(motor)
        if isinstance(motor, MotorTable):
            found.append(_Watched(speed, motor.kinks))
        if losing:
            found.append(_Watched(torque, zero, signed=True))
    elif losing and spec.drive.form != "constant" and not (spec.balance == "constant" and spec.balance_side == "drive"):
        found.append(_Watched(_drive, zero, signed=True, known=fields.drive))
    if spec.balance == "constant" and spec.balance_side == "operation":
        return found
    follows = follows_speed(machine)
    known = None if follows or len(machine.parts) > 1 else fields.operation
    for place, part in enumerate(machine.parts):
        if part.loses:
            found.append(_Watched(_load(place), zero, signed=True, known=known))
        if follows and part.follows_speed:
            found += [_Watched(_switch(place, index), zero) for index in range(part.switch_count)]
    return found


def motion_kinks(machine: Machine, d: Decomposition) -> tuple[Floats, Bools]:
    """Where the motion of each case makes kinks, and which panels have one within them.

    Parameters
    ----------
    machine : Machine
    d : Decomposition
        Of the last attempt; a case without motion has kinks of torques that do not follow the speed.

    Returns
    -------
    array, shape (cases, n)
        Angles in rad, NaN where a case has fewer.
    bool array, shape (cases, panels)
        Panels that are still to be cut.
    """
    panels = d.panels
    with np.errstate(invalid="ignore"):
        omega = np.sqrt(d.squares)
    cut = np.zeros(omega.shape[:2], dtype=np.bool_)
    found = [_crossings(machine, panels, omega, own) for own in _watched(machine, d.fields)]
    if not found:
        return np.empty((len(omega), 0)), cut
    case, angle, near = (np.concatenate(parts) for parts in zip(*found, strict=True))
    # A case with more kinks than are cut at is computed as if it had none.
    count = np.bincount(case, minlength=len(omega))
    kept = (count <= _MOST * machine.spec.cycle)[case]
    case, angle, near = case[kept], angle[kept], near[kept]
    order = np.lexsort((angle, case))
    case, angle, near = case[order], angle[order], near[order]
    kinks = np.full((len(omega), int(np.bincount(case, minlength=1).max())), np.nan)
    kinks[case, np.arange(len(case)) - np.searchsorted(case, case)] = angle
    for own in np.unique(case):
        mine = case == own
        cuts = panels.cuts[own if len(panels.cuts) > 1 else 0]
        panel = panels.locate(int(own), angle[mine]).panel
        apart = np.minimum(np.abs(angle[mine] - cuts[panel]), np.abs(angle[mine] - cuts[panel + 1]))
        cut[own, panel[apart > near[mine]]] = True
    return kinks, cut


def _none() -> tuple[Integers, Floats, Floats]:
    return np.empty(0, dtype=np.int64), np.empty(0), np.empty(0)


def _crossings(machine: Machine, panels: Panels, omega: Floats, watched: _Watched) -> tuple[Integers, Floats, Floats]:
    """Cases, angles and distances within which a cut is as good as one there, of all crossings; each shape (n,)."""
    cycle, most = machine.cycle, _MOST * machine.spec.cycle
    phi = np.broadcast_to(panels.angles, omega.shape)
    with np.errstate(all="ignore"):
        values = watched.known if watched.known is not None else watched.course(machine, phi, omega)
    values = np.broadcast_to(values, omega.shape)
    real = np.broadcast_to((panels.half > 0.0)[..., None], omega.shape)
    known = real & np.isfinite(values)
    size = np.zeros(len(omega))
    if watched.signed:
        size = np.abs(np.where(known, values, 0.0)).max(axis=(1, 2))
        known &= np.abs(values) > _ROUNDING * size[:, None, None]
    # In order of case and angle; the last node of a case's cycle is followed by its first one, a cycle later.
    case, rank = np.nonzero(known)[0], np.cumsum(real)[known.ravel()]
    if not len(case):
        return _none()
    first, last = np.searchsorted(case, case), np.searchsorted(case, case, side="right") - 1
    own = np.arange(len(case))
    following = np.where(own == last, first, own + 1)
    value, angle = values[known], phi[known]
    end = angle[following] + np.where(own == last, cycle, 0.0)
    nodes = rank[following] - rank + np.where(own == last, real.sum(axis=(1, 2))[case], 0)
    step = np.searchsorted(watched.levels, value)
    low, high = np.minimum(step, step[following]), np.maximum(step, step[following])
    count = np.where(nodes <= 1 + _NODES_AT_ZERO, high - low, 0)
    count[np.bincount(case, count)[case] > most] = 0
    at = np.repeat(own, count)
    if not at.size:
        return _none()
    level = watched.levels[low[at] + np.arange(len(at)) - np.searchsorted(at, at)]
    rows, there = Machine(machine.spec, machine.columns.take(case[at])), following[at]

    def course(angles: Floats, faster: float = 1.0) -> Floats:
        places = np.mod(angles, cycle)[:, None, None]
        found = watched.course(rows, places, faster * courses(panels, omega, case[at], places))
        return np.asarray(np.broadcast_to(found, places.shape)[:, 0, 0])

    before, after = value[at] - level, value[there] - level
    with np.errstate(all="ignore"):
        if watched.signed:
            # The slope of a torque with losses jumps where its sign changes, near which false positions come slowly.
            root = switches(course, angle[at], end[at], iterations=_HALVINGS)
        else:
            root = bracketed_roots(lambda angles: course(angles) - level, angle[at], end[at], before, after)
        rounding = np.abs(course(angle[at], 1.0 + _SAME_SPEED) - value[at])
        rounding = np.where(np.isfinite(rounding), rounding, 0.0) + _ROUNDING * size[case[at]]
        near = np.maximum(_PLACED * cycle, rounding * (end[at] - angle[at]) / np.abs(after - before))
    # A level that is passed by rounding errors alone is no kink.
    passed = np.abs(after - before) > 0.1 * rounding
    return case[at][passed], np.mod(root, cycle)[passed], near[passed]
