"""A motor whose torque depends on its speed, and the resulting limit cycle of a machine."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.motor_tables import MotorTable, motor_table
from sprag_study.engine.machine_shaft.operations import SpeedLaw
from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.spec import Drive
from sprag_study.engine.machine_shaft.stability import Stability

Floats = NDArray[np.float64]

_MAX_ITERATIONS = 80
#: Cycles of the simulation that decides whether a shaft stops: load peaks stop it within the first few.
_CYCLES = 20
#: Guesses of the speed at which a load that follows it needs what the motor gives.
_GUESSES = 4


#: What gives a motor's torque by its speed: a formula, or a table.
Characteristic = Literal["linear", "kloss"] | MotorTable


def characteristic(drive: Drive) -> Characteristic:
    """The characteristic of the motor of a ``drive``.

    Raises
    ------
    TableError
        If its table is not one of a motor.
    """
    if drive.motor in {"linear", "kloss"}:
        return cast("Characteristic", drive.motor)
    if drive.motor is None or drive.table is None:
        raise AssertionError("check_structure lets no motor or table be missing")
    return motor_table(drive.table)


def motor_torque(motor: Characteristic, values: Mapping[str, Floats], omega: Floats) -> tuple[Floats, Floats]:
    """Torque in N*m at the speeds ``omega`` (rad/s) and its derivative by the speed.

    Linear: M_0 (1 - omega/omega_0). Kloss: 2 M_k/(s/s_k + s_k/s) with the slip s = 1 - omega/omega_s, written so that
    no slip is singular. A table is multiplied by ``scale``; its speeds are multiplied by ``unit_speed``. With an
    ``efficiency`` among the values, of a drive train, less of the torque reaches the main shaft, and more of it where
    the motor brakes.
    """
    if "efficiency" in values:
        own = {name: value for name, value in values.items() if name != "efficiency"}
        torque, slope = motor_torque(motor, own, omega)
        passed = np.where(torque >= 0.0, values["efficiency"], 1.0 / values["efficiency"])
        return passed * torque, passed * slope
    if isinstance(motor, MotorTable):
        scale, unit = values["scale"], values.get("unit_speed", np.float64(1.0))
        torque, slope = motor.at(omega / unit)
        return scale * torque, scale / unit * slope
    if motor == "linear":
        stall, free = values["stall_torque"], values["no_load_speed"]
        return stall * (1.0 - omega / free), np.broadcast_to(-stall / free, omega.shape)
    most, critical, synchronous = values["breakdown_torque"], values["breakdown_slip"], values["synchronous_speed"]
    slip = 1.0 - omega / synchronous
    size = np.square(slip) + np.square(critical)
    by_slip = 2.0 * most * critical * (np.square(critical) - np.square(slip)) / np.square(size)
    return 2.0 * most * critical * slip / size, -by_slip / synchronous


def free_speed(drive: Drive, values: Mapping[str, Floats]) -> Floats:
    """Speed in rad/s of the motor's shaft without load; ``values`` by path."""
    if drive.motor == "table":
        return np.full((1, 1, 1), cast("MotorTable", characteristic(drive)).free)
    name = "no_load_speed" if drive.motor == "linear" else "synchronous_speed"
    return values.get(f"drive.motor.{name}", np.ones((1, 1, 1)))


def steady_speed(motor: Characteristic, values: Mapping[str, Floats], torque: Floats) -> Floats:
    """Speed of the stable branch at which the motor gives ``torque``; that of its largest torque where it cannot."""
    if "efficiency" in values:
        own = {name: value for name, value in values.items() if name != "efficiency"}
        return steady_speed(
            motor, own, torque * np.where(torque >= 0.0, 1.0 / values["efficiency"], values["efficiency"])
        )
    if isinstance(motor, MotorTable):
        return values.get("unit_speed", np.ones((1, 1, 1))) * motor.speed_for(torque / values["scale"])
    if motor == "linear":
        return np.asarray(values["no_load_speed"] * (1.0 - torque / values["stall_torque"]))
    most, critical = values["breakdown_torque"], values["breakdown_slip"]
    share = np.clip(torque / most, -1.0, 1.0)
    # The root of s^2 - 2 s s_k/share + s_k^2 closer to zero slip, in a form that is valid for zero torque too.
    slip = critical * share / (1.0 + np.sqrt(1.0 - np.square(share)))
    return np.asarray(values["synchronous_speed"] * (1.0 - slip))


@dataclass(frozen=True, slots=True)
class LimitCycle:
    """The periodic motion.

    Attributes
    ----------
    start : array, shape (cases,)
        Kinetic energy T_0 at the angle 0, in J.
    drive, resistance : arrays, shape (cases, panels, nodes)
        The torques of motor and load in N*m.
    omega : array of that shape
        Speed in rad/s.
    stability : Stability
        Of the motion; unstable where a periodic motion was found, but none from which deviations die away.
    stalled, overrun : arrays of bool, shape (cases,)
        Where there is no periodic motion, because the shaft stops or because it runs away.
    """

    start: Floats
    drive: Floats
    resistance: Floats
    omega: Floats
    stability: Stability
    stalled: NDArray[np.bool_]
    overrun: NDArray[np.bool_]


def limit_cycle(
    motor: Characteristic,
    values: Mapping[str, Floats],
    panels: Panels,
    cycle: float,
    inertia: Floats,
    resistance: Floats,
    law: SpeedLaw | None = None,
) -> LimitCycle:
    """The periodic motion that a machine with a motor approaches.

    Integrating T' = M(omega) + M_r(phi, omega), omega^2 = 2 T/I, over many cycles leads to a periodic T, which is found
    directly: the equation is linearised about the last T, and the periodic solution of the linear equation (collocation
    at the nodes, panel after panel) is the next iterate. This converges quadratically. The solution is attracting if
    the mean of dM/dT, of the load's torque too, is negative; only then would integration approach it.

    Parameters
    ----------
    motor : Characteristic
    values : mapping
        Parameters under ``drive.motor.``, each of shape (cases or 1, 1, 1), reduced to the main shaft by
        ``Train.motor``.
    panels : Panels
    cycle : float
        In rad.
    inertia, resistance : arrays, shape (cases, panels, nodes)
    law : SpeedLaw, optional
        Of the loads that follow the speed, beside ``resistance``.

    Returns
    -------
    LimitCycle
    """
    free = steady_speed(motor, values, np.zeros((len(inertia), 1, 1)))
    speed = free
    for _ in range(1 if law is None else _GUESSES):
        given = resistance if law is None else resistance + law(np.broadcast_to(speed, inertia.shape))[0]
        needed = -(panels.integral(given) / cycle)[:, None, None]
        speed = np.maximum(steady_speed(motor, values, needed), 0.05 * free)
    found = _solved(motor, values, panels, inertia, resistance, law, speed)
    grows = found.periodic & ~found.attracts
    if grows.any():
        # Above an unstable cycle there may be a stable one, to which the shaft comes from its speed without load.
        again = _solved(motor, values, panels, inertia, resistance, law, np.where(grows[:, None, None], free, speed))
        found = found.replaced(grows & again.periodic & again.attracts, again)
    none = ~(found.periodic & found.attracts)
    with np.errstate(all="ignore"):
        # A load that follows the speed is judged by its torque at the last guess.
        overrun = none & _overruns(motor, values, panels, inertia, given, -needed[:, 0, 0] * cycle, none)
        omega = np.sqrt(2.0 * found.energy / inertia)
        stability = Stability.of(panels, found.slope)
    stability.unstable[~(none & ~overrun & found.periodic)] = False
    stalled = none & ~overrun & ~stability.unstable
    return LimitCycle(found.start, found.drive, found.load, omega, stability, stalled, overrun)


@dataclass(frozen=True, slots=True)
class _Solution:
    """Energy, torques and their derivative by the energy, (cases, panels, nodes); energy at the angle 0; whether these
    are a periodic motion, and whether it attracts, (cases,).
    """

    energy: Floats
    start: Floats
    drive: Floats
    load: Floats
    slope: Floats
    periodic: NDArray[np.bool_]
    attracts: NDArray[np.bool_]

    def replaced(self, cases: NDArray[np.bool_], other: "_Solution") -> "_Solution":
        """This solution with the ``cases`` of another one."""
        pairs = ((getattr(self, part.name), getattr(other, part.name)) for part in fields(self))
        return _Solution(*(np.where(cases.reshape(-1, *[1] * (own.ndim - 1)), new, own) for own, new in pairs))


def _solved(
    motor: Characteristic,
    values: Mapping[str, Floats],
    panels: Panels,
    inertia: Floats,
    resistance: Floats,
    law: SpeedLaw | None,
    speed: Floats,
) -> _Solution:
    """The periodic motion to which Newton's method comes from a ``speed`` (cases, 1, 1) in rad/s.

    The other parameters are those of ``limit_cycle``.
    """
    every = np.arange(len(inertia))
    energy = 0.5 * inertia * np.square(speed)
    start = energy[:, 0, 0].copy()
    active = every
    previous = np.full(len(inertia), np.inf)
    for _ in range(_MAX_ITERATIONS):
        own = _of_rows(values, active)
        own_panels, last = panels.take(active), energy[active]
        with np.errstate(all="ignore"):
            load = _load(inertia, resistance, law, energy, active)
            found, start[active] = _linear_step(motor, own, own_panels, inertia[active], load, last)
            kept = np.maximum(found, 0.1 * last)
            change = own_panels.largest(kept - last) / own_panels.largest(kept)
        energy[active] = kept
        # Convergence is quadratic down to rounding: a small change that no longer decreases is rounding error.
        rounding = (change < 1e-11) & (change >= 0.5 * previous[active])
        previous[active] = change
        active = active[~((change < 1e-15) | rounding | ~np.isfinite(change))]
        if not active.size:
            break
    with np.errstate(all="ignore"):
        drive, by_energy = _torque_and_slope(motor, values, inertia, energy)
        load = _load(inertia, resistance, law, energy, every)
        final, _ = _linear_step(motor, values, panels, inertia, load, energy)
        error = panels.largest(final - energy) / panels.largest(energy)
        slope = by_energy + load[1]
        attracts = panels.integral(slope) < 0.0
    return _Solution(energy, start, drive, load[0], slope, (error < 1e-9) & (start > 0.0), attracts)


def _of_rows(values: Mapping[str, Floats], rows: NDArray[np.int64]) -> dict[str, Floats]:
    """The parameters of some of the cases."""
    return {name: value[rows] if len(value) > 1 else value for name, value in values.items()}


def _load(
    inertia: Floats, resistance: Floats, law: SpeedLaw | None, energy: Floats, rows: NDArray[np.int64]
) -> tuple[Floats, Floats]:
    """Resisting torque at the ``energy`` of some of the cases, and its derivative by the energy."""
    if law is None:
        return resistance[rows], np.zeros(1)
    omega = np.sqrt(2.0 * energy / inertia)
    torque, slope = law(omega)
    return (resistance + torque)[rows], (slope / (inertia * omega))[rows]


def _overruns(
    motor: Characteristic,
    values: Mapping[str, Floats],
    panels: Panels,
    inertia: Floats,
    resistance: Floats,
    work: Floats,
    cases: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Whether the load makes those of the ``cases`` run away that have no steady cycle, and does not stop them.

    The braking torque of a linear motor and beyond the end of a table grows with the speed without bound, and a load
    that absorbs energy over a cycle slows down every fast shaft: neither is overrun. Kloss's motor is overrun by a load
    that supplies more than the motor can absorb. In between, a shaft that starts at the synchronous speed is simulated.
    """
    out = np.zeros(len(inertia), dtype=np.bool_)
    if motor != "kloss":
        return out
    for case in np.nonzero(cases & (work > 0.0))[0]:
        own = {name: float(value[case if len(value) > 1 else 0, 0, 0]) for name, value in values.items()}
        row = case if len(panels.half) > 1 else 0
        real = panels.half[row] > 0.0
        if work[case] > own["breakdown_torque"] / own.get("efficiency", 1.0) * panels.weights[row][real].sum():
            out[case] = True
        else:
            nodes = (panels.weights[row][real].ravel(), inertia[case][real].ravel(), resistance[case][real].ravel())
            out[case] = _runs_away(motor, own, *nodes)
    return out


def _runs_away(
    motor: Characteristic, values: Mapping[str, float], steps: Floats, inertia: Floats, resistance: Floats
) -> bool:
    """Integrate one case from the synchronous speed, from node to node; False where the shaft stops.

    The steps are implicit in the motor's torque where that falls with the speed, to handle stiff motors.
    """
    fast = values["synchronous_speed"] * (1.0 + values["breakdown_slip"])
    own = {name: np.asarray(value) for name, value in values.items()}
    energy = 0.5 * float(inertia[0]) * np.square(values["synchronous_speed"])
    for _ in range(_CYCLES):
        before, slowest = energy, np.inf
        for step, moment, load in zip(steps.tolist(), inertia.tolist(), resistance.tolist(), strict=True):
            omega = np.sqrt(2.0 * energy / moment)
            slowest = min(slowest, omega)
            torque, slope = motor_torque(motor, own, np.asarray(omega))
            energy += step * float(torque + load) / (1.0 - step * min(float(slope) / (moment * omega), 0.0))
            if not energy > 0.0:
                return False
        if slowest > fast and energy > before:
            # Beyond its largest braking torque, the motor brakes less at higher speed.
            return True
    return True


def _torque_and_slope(
    motor: Characteristic, values: Mapping[str, Floats], inertia: Floats, energy: Floats
) -> tuple[Floats, Floats]:
    omega = np.sqrt(2.0 * energy / inertia)
    torque, slope = motor_torque(motor, values, omega)
    return torque, slope / (inertia * omega)


def _linear_step(
    motor: Characteristic,
    values: Mapping[str, Floats],
    panels: Panels,
    inertia: Floats,
    load: tuple[Floats, Floats],
    energy: Floats,
) -> tuple[Floats, Floats]:
    """Periodic solution of the equation linearised about ``energy``: at the nodes and at the angle 0.

    ``load`` is the resisting torque and its derivative by the energy.
    """
    torque, slope = _torque_and_slope(motor, values, inertia, energy)
    slope = slope + load[1]
    return panels.periodic(slope, torque + load[0] - slope * energy)
