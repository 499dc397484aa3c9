"""What a machine shaft answers while it is drawn."""

from __future__ import annotations

from typing import Final

from sprag_study.worker.models.laboratory import Laboratory, SliderKind

LABORATORY: Final = Laboratory(
    note="ω² = S₁ + S₂ + S₃ + S₄: shares of the least energy, of the mean energy above it, of the drive's and of the "
    "resistance's work. S₃ and S₄ change sign.",
    sliders=(
        SliderKind(r"drive\.inertia", 0.5, 4.0),
        SliderKind(r"operation\.scale", 0.0, 3.0),
        SliderKind(r"mechanism\..*_mass", 0.0, 4.0),
        SliderKind(r"mechanism\..*", 0.8, 1.2),
    ),
    main={"irregularity": "Irregularity"},
    along="irregularity",
    studies={
        "inertia": r"drive\.inertia", "masses": r"mechanism\..*mass",
        "load": r"operation\.scale",
    },
)  # fmt: skip
