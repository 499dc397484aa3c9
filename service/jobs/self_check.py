"""Known values that an installed engine must reproduce: closed forms of both models and a reference case.

They detect a faulty compiler, library or processor; a wrong model is detected by the tests.
"""

from __future__ import annotations

import math

from sprag_study.worker.models import MACHINE_SHAFT, OK, model_results, run_chunk
from sprag_study.worker.study import Study

#: Largest acceptable relative difference.
TOLERANCE = 1e-8

_RUN = {"duration": [60.0, "periods"], "window": [[40.0, "periods"], [60.0, "periods"]], "tolerance": 1e-9}
_PENDULUM = {"inertia": 1e-3, "mass": 0.5, "arm": 0.03, "spring_rate": 9000.0, "spring_arm": 0.05}
_GRAVITY = 9.80665

#: An independent 20th-order Taylor integrator at tolerance 1e-15, checked with Runge-Kutta-Fehlberg 7(8) at 1e-12.
_REFERENCE = {
    "shaft.speed.mean": 9.002760502669375,
    "shaft.speed.max": 11.169350886241586,
    "torque.mean": 0.30000324493097974,
    "torque.max": 2.6149521247028638,
    "power.input.mean": 3.1737456880902215,
    "run.events": 181.0,
}


def check_known_values() -> tuple[list[str], float]:
    """Run the cases; returns the faults, one sentence each, and the largest relative difference."""
    wrong: list[str] = []
    largest = 0.0
    for study, expected in (_quiet(), _driven(), _free_shaft()):
        result = run_chunk(study, 0, 1)
        if result.endings != [OK]:
            wrong.append(f"{study.name} ended as {result.endings[0]}")
            continue
        values = dict(zip((info.name for info in model_results(study)), result.values[0].tolist(), strict=True))
        for name, value in expected.items():
            difference = abs(values[name] - value) / abs(value)
            largest = max(largest, difference)
            if not difference <= TOLERANCE:  # also true for a NaN
                wrong.append(f"{study.name}: {name} is {values[name]!r} instead of {value!r}")
    return wrong, largest


def _study(name: str, base: dict[str, float]) -> Study:
    pendulum = {f"pendulums.0.{key}": value for key, value in _PENDULUM.items()}
    clutch = {f"clutch.coefficients.{k}": value for k, value in enumerate((0.0, 200.0, 0.0, 20000.0))}
    common = {"gravity": _GRAVITY, "shaft.inertia": 2e-3}
    return Study("vibration-drive", name, {**common, **pendulum, **clutch, **base}, {**_RUN, "reset": "contact"})


def _quiet() -> tuple[Study, dict[str, float]]:
    """Small forced oscillation within the backlash: amplitude and loss in closed form (docs/theory.md)."""
    frequency, amplitude, damping = 25.0, 1e-7, 0.05
    nu = 2.0 * math.pi * frequency
    stiffness = (
        _PENDULUM["spring_rate"] * _PENDULUM["spring_arm"] ** 2 - _PENDULUM["mass"] * _GRAVITY * _PENDULUM["arm"]
    )
    force = _PENDULUM["mass"] * _PENDULUM["arm"] * amplitude * nu**2
    angle = force / math.hypot(stiffness - _PENDULUM["inertia"] * nu**2, damping * nu)
    base = {
        "excitation.frequency": frequency,
        "excitation.amplitude_x": amplitude,
        "pendulums.0.damping": damping,
        "pendulums.0.backlash": 1.0,
        "shaft.load": 1.0,
    }
    expected = {"pendulums.0.angle.amplitude": angle, "pendulums.0.power.loss": damping * (nu * angle) ** 2 / 2.0}
    return _study("small forced oscillation", base), expected


def _driven() -> tuple[Study, dict[str, float]]:
    base = {
        "excitation.frequency": 180.0 / (2.0 * math.pi),
        "excitation.amplitude_x": 0.0016666666666666666,
        "excitation.amplitude_y": 0.0016666666666666666,
        "pendulums.0.damping": 0.01,
        "pendulums.0.backlash": 0.005,
        "shaft.load": 0.3,
    }
    return _study("reference case", base), _REFERENCE


def _free_shaft() -> tuple[Study, dict[str, float]]:
    """A machine shaft that nothing drives or brakes: its irregularity in closed form (docs/theory-machine-shaft.md)."""
    own, swinging = 2.0, 3.0
    q = math.sqrt(own / (own + swinging))
    base = {"mean_speed": 10.0, "drive.inertia": own, "constants.m": swinging}
    structure = {"mechanism": {"kind": "formula", "formula": "m*sin(phi)^2"}, "constants": ["m"]}
    study = Study(MACHINE_SHAFT, "free shaft", base, {}, structure=structure)
    return study, {"irregularity": 2.0 * (1.0 - q) / (1.0 + q), "omega.max": 20.0 / (1.0 + q)}
