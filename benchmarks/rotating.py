"""Rotating pendulums: how many orbits along which a pendulum turns over are found, and how far they miss themselves.

    python -m benchmarks.rotating [--drives COUNT] [--seed SEED]

From the point of each certified orbit scipy integrates the equations once more, with a second implementation of the
automaton, and a step of Newton's method with its strobe map shows how far its own orbit is.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.settle import SettledBatch, settle
from sprag_study.engine.vibration_drive.start_states import as_parameters
from sprag_study.engine.vibration_drive.sweep import whole_periods
from tests.engine.vibration_drive.reference_equations import Outcome
from tests.engine.vibration_drive.reference_run import Drive

Floats = NDArray[np.float64]

_TURN = 2.0 * math.pi
_STATES = ("free", "take_up", "engaged", "beyond", "locked")


def rotating_drives(count: int, seed: int) -> dict[str, Any]:
    """Drives of one pendulum without a spring, most of which begin with the speed of the excitation."""
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> Floats:
        return rng.uniform(low, high, count)

    frequency, amplitude = between(15.0, 38.0), between(2e-3, 6e-3)
    speed = _TURN * frequency
    mass, arm = between(0.3, 0.8), between(0.02, 0.04)
    return {
        "excitation.frequency": frequency,
        "excitation.amplitude_x": amplitude,
        "excitation.amplitude_y": amplitude * rng.choice([0.0, 0.5, 1.0], count),
        "excitation.phase": rng.choice([0.0, 0.5], count),
        "shaft.inertia": between(1e-4, 3e-3),
        "shaft.load": between(0.02, 0.3),
        "shaft.initial_speed": speed * rng.choice([0.0, 1.0], count),
        "clutch.coefficients.0": 0.0,
        "clutch.coefficients.1": between(20.0, 300.0),
        "pendulums.0.inertia": 1.1 * mass * arm**2 + between(1e-5, 1e-3),
        "pendulums.0.mass": mass,
        "pendulums.0.arm": arm * rng.choice([1.0, -1.0], count),
        "pendulums.0.damping": between(2e-4, 2e-3),
        "pendulums.0.backlash": between(0.0, 0.012),
        "pendulums.0.initial_speed": speed * rng.choice([-1.0, 1.0, 1.0], count),
        "pendulums.0.initial_angle": between(-3.0, 3.0),
    }


def missed(columns: dict[str, Any], batch: SettledBatch, case: int) -> float:
    """How far the point of an orbit is from that of scipy, over its largest speed (angles: over that and nu).

    The point is run on to the end of a period by the engine; from there Newton's method with scipy's strobe map takes
    one step.
    """
    drive = {path: float(value[case]) if isinstance(value, np.ndarray) else value for path, value in columns.items()}
    row = whole_periods(drive, SettledRun(), batch.points[case : case + 1])[0][0]
    order, winding = int(batch.orders[case]), int(batch.windings[case, 0])
    begin = as_parameters(row)
    machine = _machine(drive | begin)
    state = _state(machine, machine.start)
    scale = np.full(len(state), max(np.abs(state[1:]).max(), machine.nu))
    scale[0] /= machine.nu
    scale[2:-1] /= machine.nu

    def image(point: Floats) -> Floats:
        again = _machine(drive | begin, point)
        y = again.start.copy()
        for k in range(order):
            y = again.advance(k * again.period, (k + 1) * again.period, y)
        end = _state(again, y)
        end[0] -= _TURN * winding
        return end

    base = image(state)
    if len(base) != len(state):
        return math.inf
    jacobian = np.empty((len(state), len(state)))
    for k in range(len(state)):
        moved = state.copy()
        moved[k] += 1e-6 * scale[k]
        jacobian[:, k] = (image(moved) - base) / (1e-6 * scale[k])
    step = np.linalg.solve(np.eye(len(state)) - jacobian, base - state)
    return float(np.max(np.abs(step / scale)))


def _machine(values: dict[str, float], point: Floats | None = None) -> Drive:
    """The machine in a state at the start of a period, or in one nearby in which clutch and shaft are as there."""
    machine = Drive(values, literal=False)
    machine.out, machine.rtol, machine.watching = Outcome(), 1e-12, False
    machine.clutches = [_STATES[int(values["pendulums.0.initial_clutch"])]]
    machine.start[2] = values["pendulums.0.initial_windup"]
    if point is not None:
        machine.start[:2] = point[:2]
        if machine.clutches != ["free"]:
            machine.start[2] = point[2]
        if machine.shaft_state == "rotating":
            machine.start[machine.shaft] = point[-1]
    return machine


def _state(machine: Drive, y: Floats) -> Floats:
    """Angle and speed, windup where the clutch interacts, speed of the shaft where it rotates."""
    windup = [] if machine.clutches == ["free"] else [y[2]]
    shaft = [] if machine.shaft_state == "held" else [y[machine.shaft]]
    return np.array([y[0], y[1], *windup, *shaft])


def main() -> None:
    """Print what is found and how far it is off."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drives", type=int, default=300)
    parser.add_argument("--seed", type=int, default=38)
    options = parser.parse_args()
    columns = rotating_drives(options.drives, options.seed)
    batch = settle(columns, SettledRun(), cases=options.drives)
    rotates = np.any(batch.windings != 0, axis=1)
    regimes = Counter(Regime(int(regime)).name.lower() for regime in batch.regimes)
    print(f"{options.drives} drives: {dict(regimes)}; along {np.count_nonzero(rotates)} orbits a pendulum turns over")
    exponents = batch.values[:, [info.name for info in settled_infos(1)].index("regime.exponent")]
    print(f"irregular with an exponent above 0.02: {np.count_nonzero(exponents > 0.02)}")
    off = np.array([missed(columns, batch, case) for case in np.flatnonzero(rotates).tolist()])
    compared = off[np.isfinite(off)]
    print(f"compared with scipy: {len(compared)}, largest deviation {compared.max(initial=0.0):.1e}")
    print(f"with an event at the strobe: {len(off) - len(compared)}")


if __name__ == "__main__":
    main()
