"""Random machines whose torques follow the speed, and what marching by scipy says about their steady cycles.

It shares nothing with the engine.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.steady_cycles import SteadyCycles
from sprag_study.engine.machine_shaft.tables import Table

Floats = NDArray[np.float64]
TURN = 2.0 * math.pi
#: Energy, as a share of the one at the pace, below which the reference lets a shaft come to rest.
_REST = 1e-4


@dataclass(frozen=True, slots=True)
class Machine:
    """A machine for the engine, and its inertia, load and motor as functions of their own."""

    spec: MachineSpec
    numbers: dict[str, float]
    pace: float
    inertia: Callable[[float], float]
    load: Callable[[float, Floats], Floats]
    drive: Callable[[Floats], Floats] | None

    def torque(self, given: float) -> Callable[[float, Floats], Floats]:
        """Torque on the shaft; ``given`` is the constant drive of a machine without a motor."""
        return lambda phi, w: (given if self.drive is None else self.drive(w)) - self.load(phi, w)


def _motor(random: np.random.Generator, pace: float, size: float) -> tuple[Drive, dict[str, float], Any]:
    kind = random.choice(["linear", "kloss", "table", "table"])
    if kind == "linear":
        stall = size * random.uniform(1.5, 4.0)
        values = {"drive.motor.no_load_speed": pace, "drive.motor.stall_torque": stall}
        return Drive(motor="linear"), values, lambda w: stall * (1.0 - w / pace)
    if kind == "kloss":
        most, slip = size * random.uniform(1.2, 3.0), random.uniform(0.08, 0.3)
        values = {
            "drive.motor.synchronous_speed": pace, "drive.motor.breakdown_torque": most,
            "drive.motor.breakdown_slip": slip,
        }  # fmt: skip
        return Drive(motor="kloss"), values, lambda w: 2.0 * most / ((1.0 - w / pace) / slip + slip / (1.0 - w / pace))
    # A saddle: the torque falls to a fraction, rises to its breakdown, and falls to zero.
    x = np.array([0.0, random.uniform(0.05, 0.15), random.uniform(0.2, 0.35), random.uniform(0.7, 0.85), 1.0]) * pace
    y = np.array([random.uniform(1.3, 2.0), random.uniform(1.2, 1.8), random.uniform(0.3, 1.1), 2.2, 0.0]) * size
    rows = tuple(zip(x.tolist(), y.tolist(), strict=True))
    last = (y[-1] - y[-2]) / (x[-1] - x[-2])
    return (
        Drive(motor="table", table=Table(rows, "linear")), {},
        lambda w: np.where(w > x[-1], last * (w - x[-1]), np.interp(w, x, y)),
    )  # fmt: skip


def random_machine(random: np.random.Generator) -> Machine:
    """A scotch yoke under a load that falls with the speed somewhere, with a motor or a drive that balances it."""
    pace, size = random.uniform(8.0, 150.0), random.uniform(20.0, 200.0)
    a, b, c, d = (random.uniform(*ends) for ends in ((0.2, 1.2), (0.0, 0.5), (0.0, 0.5), (0.0, 1.2)))
    e, k, p = random.uniform(0.05, 0.4) * pace, random.uniform(4.0, 16.0) / pace, random.uniform(0.0, 0.3)
    a, b, c, d, p = (float(size * part) for part in (a, b, c, d, p))
    formula = (
        f"{a!r} + {b!r}*sin(phi) + {c!r}*(omega/{pace!r})^2 + {d!r}*exp(-omega/{e!r})"
        f" + {p!r}*sin({k!r}*omega)*(1 + 0.3*cos(phi))"
    )

    def load(phi: float, w: Floats) -> Floats:
        falling = d * np.exp(-w / e) + p * np.sin(k * w) * (1.0 + 0.3 * math.cos(phi))
        return np.asarray(a + b * math.sin(phi) + c * (w / pace) ** 2 + falling)

    inertia, mass = size / pace**2 * 10.0 ** random.uniform(0.7, 2.0), 0.0
    mass = inertia * random.uniform(0.0, 0.6)
    numbers = {
        "drive.inertia": inertia, "mechanism.scotch_yoke.crank": 1.0, "mechanism.scotch_yoke.yoke_mass": mass,
    }  # fmt: skip
    operation, yoke = OperationChoice("torque", "formula", formula=formula), MechanismChoice("scotch_yoke")
    drive: Callable[[Floats], Floats] | None = None
    if random.uniform() < 0.75:
        motor, values, drive = _motor(random, pace, size)
        spec = MachineSpec(mechanism=yoke, operation=operation, balance="motor", drive=motor)
        numbers |= values
    else:
        spec = MachineSpec(mechanism=yoke, operation=operation)
        numbers["mean_speed"] = pace * random.uniform(0.3, 1.0)
    return Machine(spec, numbers, pace, lambda phi: inertia + mass * math.sin(phi) ** 2, load, drive)


def marched(machine: Machine, given: float, energy: Floats, accuracy: float = 1e-8) -> Floats:
    """Energies at the angle 0 after a cycle from ``energy`` (n,); 0 where the shaft stops."""
    torque, rest = machine.torque(given), _REST * 0.5 * machine.inertia(0.0) * machine.pace**2
    exact = accuracy < 1e-8

    def rate(phi: float, y: Floats) -> Floats:
        kept = np.maximum(y, 1e-12 * rest)
        value = torque(phi, np.sqrt(2.0 * kept / machine.inertia(phi)))
        # Comes to rest smoothly; exactly the machine where the accuracy is asked for.
        return value if exact else np.where(value < 0.0, value * np.minimum(kept / rest, 1.0), value)

    least, scale = energy, accuracy * float(np.max(energy))
    for low, high in pairwise(np.linspace(0.0, TURN, 5)):
        course = solve_ivp(rate, (low, high), energy, method="DOP853", rtol=accuracy, atol=1e-3 * scale).y
        least, energy = np.minimum(least, course.min(axis=1)), course[:, -1]
    return energy if exact else np.where(least < 3.0 * rest, 0.0, energy)


def judged(machine: Machine, found: SteadyCycles, given: float) -> list[str]:
    """What marching says against the cycles: of each of them, and of those that are missing."""
    faults = []
    half = 0.5 * machine.inertia(0.0)
    for cycle in found.cycles:
        start = half * cycle.start**2
        there = float(marched(machine, given, np.array([start]), 1e-12)[0])
        # A deviation of the start grows by the multiplier.
        if abs(there / start - 1.0) > 1e-8 * max(1.0, cycle.multiplier):
            faults.append(f"no cycle at {cycle.start}: {there / start - 1.0}")
        near = start * (1.0 + np.array([-1e-6, 1e-6]))
        less, more = marched(machine, given, near, 1e-12)
        if cycle.multiplier < 1e3 and abs((more - less) / (near[1] - near[0]) - cycle.multiplier) > 1e-4 * (
            1.0 + cycle.multiplier
        ):
            faults.append(f"multiplier at {cycle.start}: {(more - less) / (near[1] - near[0])}, not {cycle.multiplier}")
    speeds = np.linspace(0.02, 2.0, 300) * machine.pace
    energy = half * speeds**2
    after = marched(machine, given, energy)
    gains = after - energy
    rises = gains > 0.0
    alive = after > 0.0
    starts = np.array([cycle.start for cycle in found.cycles])
    stable = np.array([cycle.stable for cycle in found.cycles], dtype=np.bool_)
    for place in np.nonzero((rises[:-1] != rises[1:]) & alive[:-1] & alive[1:])[0]:
        width = speeds[1] - speeds[0]
        inside = (starts > speeds[place] - 0.01 * width) & (starts < speeds[place + 1] + 0.01 * width)
        if int((stable & inside).sum()) - int((~stable & inside).sum()) != (1 if rises[place] else -1):
            faults.append(f"between {speeds[place]} and {speeds[place + 1]} a cycle is missing")
    # From the middle of every basin the shaft comes nearer to its cycle.
    for cycle in found.stable:
        low, high = max(cycle.low, 0.5 * cycle.start), min(cycle.high, 1.5 * cycle.start)
        begin = half * np.array([0.5 * (low + cycle.start), 0.5 * (high + cycle.start)]) ** 2
        more = marched(machine, given, begin)
        if not (
            begin[0] < more[0] <= half * cycle.start**2 * 1.0001
            and half * cycle.start**2 * 0.9999 <= more[1] < begin[1]
        ):
            faults.append(f"the basin of {cycle.start}, {cycle.low} to {cycle.high}")
    return faults
