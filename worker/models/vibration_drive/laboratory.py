"""What a vibration drive answers while it is drawn."""

from __future__ import annotations

from typing import Final

from sprag_study.worker.models.laboratory import Laboratory, SliderKind

LABORATORY: Final = Laboratory(
    sliders=(
        SliderKind(r"excitation\.amplitude_[xy]", 0.5, 1.5),
        SliderKind(r"shaft\.load", 0.0, 4.0),
        SliderKind(r"pendulums\.\d+\.(backlash|damping)", 0.0, 5.0),
        SliderKind(r"pendulums\.\d+\.(mass|arm)"),
    ),
    main={
        "shaft.speed.mean": "Mean speed", "torque.mean": "Mean torque", "power.useful.mean": "Useful power",
        "efficiency": "Efficiency",
    },
    studies={
        "load": r"shaft\.load", "frequency": r"excitation\.frequency",
        "amplitude": r"excitation\.amplitude_x",
    },
)  # fmt: skip
