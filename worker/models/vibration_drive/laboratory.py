"""The laboratory of vibration drives."""

from __future__ import annotations

import math
from typing import Final

from sprag.worker.models.laboratory import Laboratory, SliderKind

_AMPLITUDES: Final = ("excitation.amplitude_x", "excitation.amplitude_y")


def _of_pendulums(name: str, label: str, low: float, high: float, **more: float) -> SliderKind:
    group = "Clutch" if name == "backlash" else "Pendulum"
    return SliderKind(
        rf"pendulums\.\d+\.{name}", label, group, low, high, more.get("least", 0.0), logarithmic=low > 0.0
    )


LABORATORY: Final = Laboratory(
    address="drive",
    template="drive_laboratory.html",
    sliders=(
        SliderKind(r"excitation\.frequency", "Frequency", "Excitation"),
        SliderKind(
            r"excitation\.amplitude_x", "Horizontal amplitude", "Excitation", 0.0, 2.5, 2e-3, beside=_AMPLITUDES
        ),
        SliderKind(r"excitation\.amplitude_y", "Vertical amplitude", "Excitation", 0.0, 2.5, 2e-3, beside=_AMPLITUDES),
        SliderKind(r"excitation\.phase", "Phase of the vertical", "Excitation", ends=(-math.pi, math.pi)),
        SliderKind(r"shaft\.load", "Load torque", "Shaft", 0.0, 4.0, 1.0),
        SliderKind(r"shaft\.inertia", "Inertia", "Shaft", 0.1, 10.0, logarithmic=True),
        _of_pendulums("backlash", "Backlash", 0.0, 5.0, least=0.02),
        SliderKind(
            r"(pendulums\.\d+\.)?clutch\.coefficients\.1", "Stiffness", "Clutch", 0.1, 10.0, logarithmic=True,
            symbol="c2", help="slope of the torque at small windup",
        ),
        _of_pendulums("damping", "Damping", 0.0, 5.0, least=0.02),
        _of_pendulums("mass", "Mass", 0.0, 2.0),
        _of_pendulums("arm", "Arm", 0.0, 2.0),
        _of_pendulums("inertia", "Inertia", 0.5, 2.0),
        _of_pendulums("spring_rate", "Spring rate", 0.5, 2.0),
    ),
    shown_in=((r"excitation\.amplitude_[xy]|.*\.arm", "mm"), (r"excitation\.phase", "deg")),
    main={
        "shaft.speed.mean": "Mean speed", "torque.mean": "Mean torque", "power.useful.mean": "Useful power",
        "efficiency": "Efficiency",
    },
    further=(
        "shaft.irregularity", "shaft.speed.min", "shaft.speed.max", "torque.max", "power.input.mean",
        "power.loss.mean", "fraction.rotating", "fraction.driven", "clutches.engagements_per_period", "regime.order",
        "regime.multiplier", "regime.settled_after", "runup.time", "balance.energy",
    ),
    states=("initial_angle", "initial_speed", "initial_windup", "initial_clutch"),
    of_clutches=("initial_windup", "initial_clutch"),
    held=1,
    studies={
        "load": ("the load", r"shaft\.load"), "frequency": ("the frequency", r"excitation\.frequency"),
        "amplitude": ("the horizontal amplitude", r"excitation\.amplitude_x"),
    },
    against="{machine}: characteristic against {what}",
    values=41,
    by_name=True,
    without=("refine", "goal"),
)  # fmt: skip
