"""The examples of the API documentation. A test sends each of them."""

from __future__ import annotations

from typing import Any, Final

SPEC: Final[dict[str, Any]] = {
    "sprag": 1,
    "model": "vibration-drive",
    "name": "Feeder motor: speed against load",
    "base": {
        "excitation": {"frequency": "25 Hz", "amplitude_x": "2 mm", "amplitude_y": "2 mm", "phase": "0 deg"},
        "pendulums": [
            {
                "inertia": "1e-3 kg*m^2",
                "mass": "0.5 kg",
                "arm": "30 mm",
                "spring_rate": "9000 N/m",
                "spring_arm": "50 mm",
                "damping": "0.01 N*m*s/rad",
                "backlash": "0.005 rad",
            }
        ],
        "shaft": {"inertia": "2e-3 kg*m^2", "load": "0.1 N*m"},
        "clutch": {"coefficients": [0, 200, 0, 20000]},
    },
    "run": {"until": "settled", "at_most": "1000 periods"},
    "axes": [
        {"path": "excitation.frequency", "linspace": ["16 Hz", "35 Hz", 3]},
        {"path": "shaft.load", "values": [0.02, 0.1, "0.3 N*m"]},
    ],
}

SPEC_TOML: Final = """\
sprag = 1
model = "vibration-drive"
name = "Feeder motor: speed against load"

[base]
excitation = { frequency = "25 Hz", amplitude_x = "2 mm", amplitude_y = "2 mm" }
shaft = { inertia = "2e-3 kg*m^2", load = "0.1 N*m" }
clutch = { coefficients = [0, 200, 0, 20000] }

[[base.pendulums]]
inertia = "1e-3 kg*m^2"
mass = "0.5 kg"
arm = "30 mm"
spring_rate = "9000 N/m"
spring_arm = "50 mm"
damping = "0.01 N*m*s/rad"
backlash = "0.005 rad"

[run]
until = "settled"
at_most = "1000 periods"

[[axes]]
path = "shaft.load"
values = [0.02, 0.1, "0.3 N*m"]
"""

CLUTCH_FIT: Final[dict[str, Any]] = {
    "data": [[0.0, 0.0], [0.01, 2.02], [0.02, 4.16], [0.03, 6.54], [0.04, 9.28], [0.05, 12.5]],
    "accuracy": "0.05 N*m",
    "max_degree": 7,
    "through_origin": True,
}

EXTENSION_AXES: Final = {"axes": [{"path": "shaft.load", "values": [0.5, "0.7 N*m"]}]}
EXTENSION_GENERATIONS: Final = {"generations": 40}
EXTENSION_CASES: Final = {"cases": [{"points": "excitation.frequency [rpm],shaft.load\n1500,0.9\n"}]}
