"""Presentation of machine shafts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag.worker.models.presentation import Panel, Presentation

if TYPE_CHECKING:
    from collections.abc import Sequence

_PANELS: Final = (
    Panel("ω, angular speed", "rad/s", (("omega", "ω"),)),
    Panel("T, kinetic energy", "J", (("energy", "T"),)),
    Panel("S₁ … S₄", "rad^2/s^2", (("s1", "S₁"), ("s2", "S₂"), ("s3", "S₃"), ("s4", "S₄"))),
    Panel("Torques", "N*m", (("drive_torque", "driving"), ("resisting_torque", "resisting"))),
)


def _panels(_: Sequence[str], __: Sequence[str]) -> tuple[Panel, ...]:
    return _PANELS


PRESENTATION: Final = Presentation(
    along=("drive.inertia",),
    apart=("mean_speed",),
    drawn=("irregularity",),
    main=("irregularity", "omega.max", "omega.min", "energy.fluctuation", "drive_torque.mean", "required_inertia"),
    operating_point=("mean_speed", "drive.inertia"),
    checks=("balance",),
    panels=_panels,
    motion="Speed, energy, squares of the speed and torques over the angle of the shaft",
    motion_note="ω² = S₁ + S₂ + S₃ + S₄: shares of the least energy, of the mean energy above it, of the drive's and "
    "of the resistance's work.",
)
