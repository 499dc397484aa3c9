"""The laboratory of machine shafts."""

from __future__ import annotations

import math
from typing import Final

from sprag.worker.models.laboratory import Laboratory, SliderKind

LABORATORY: Final = Laboratory(
    address="",
    title="Laboratory: the irregularity of a machine's shaft",
    lead="Choose a machine and change its numbers: speed, energy and the four squares of the speed are recomputed and "
    "redrawn immediately.",
    curves="Speed, energy, squares of the speed and torques over the angle of the shaft",
    note="ω² = S₁ + S₂ + S₃ + S₄: shares of the least energy, of the mean energy above it, of the drive's and of the "
    "resistance's work. S₃ and S₄ change sign.",
    sliders=(
        SliderKind(r"drive\.inertia", low=0.05, high=20.0, logarithmic=True),
        SliderKind("mean_speed", low=0.25, high=4.0, logarithmic=True),
        SliderKind(r"operation\.scale", "Load, as a multiple of the diagram", low=0.0, high=3.0),
        SliderKind(r"mechanism\..*", low=0.0, high=4.0, unit="kg"),
    ),
    angles={"crank_angle": (-2.0 * math.pi, 2.0 * math.pi), "inclination": (-math.pi, math.pi)},
    shown_in=((r".*", "deg"), (r".*", "rpm")),
    numbered={"operation.steps": "Step {number}: {label}", "drive.stages": "Stage {number}: {label}"},
    main={"irregularity": "Irregularity"},
    further=(
        "omega.mean", "omega.max", "omega.angle_at_max", "omega.min", "omega.angle_at_min", "energy.fluctuation",
        "energy.mean", "drive_torque.mean", "power.mean", "acceleration.max", "omega_squared.amplitude",
        *(f"s{number}.amplitude" for number in range(1, 5)), *(f"s{number}.share" for number in range(1, 5)),
        "energy.coefficient", "required_inertia", "flywheel.required_mass", "flywheel.required_diameter",
        "flywheel.stress", "flywheel.margin", "motor.torque.max", "motor.power.mean",
    ),
    studies={
        "inertia": ("the drive's inertia", r"drive\.inertia"), "masses": ("the masses", r"mechanism\..*"),
        "load": ("the operation's load", r"operation\.scale"),
    },
    each=("masses",),
    questions={
        "inertia": ("The drive's inertia is doubled.", 2.0, r"drive\.inertia", ("kg*m^2",)),
        "masses": ("All masses and inertias of the mechanism are halved.", 0.5, r"mechanism\..*", ("kg", "kg*m^2")),
        "load": ("The load of the operation is halved.", 0.5, r"operation\.scale", ("1",)),
    },
    against="{machine}: irregularity against {what}",
    without=("question_",),
)  # fmt: skip
