"""Presentation of machine shafts."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.worker.models.machine_shaft.form import FORM
from sprag_study.worker.models.machine_shaft.laboratory import LABORATORY
from sprag_study.worker.models.machine_shaft.words import CAPTIONS, LETTERS
from sprag_study.worker.models.presentation import Answer, Clauses, Panel, Presentation, Reference

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from typing import Any

    from sprag_study.engine.outcome import Trajectory

_SPEED: Final = "ω, angular speed"
_ENERGY: Final = "T, kinetic energy"
_SQUARES: Final = "S₁ … S₄"
_TORQUES: Final = "Torques"
_PANELS: Final = (
    Panel(_SPEED, "rad/s", (("omega", "ω"),)),
    Panel(_ENERGY, "J", (("energy", "T"),)),
    Panel(_SQUARES, "rad^2/s^2", (("s1", "S₁"), ("s2", "S₂"), ("s3", "S₃"), ("s4", "S₄"))),
    Panel(_TORQUES, "N*m", (("drive_torque", "driving"), ("resisting_torque", "resisting"))),
)


def _panels(_: Sequence[str], __: Sequence[str]) -> tuple[Panel, ...]:
    return _PANELS


def _references(made: Trajectory) -> Mapping[str, tuple[Reference, ...]]:
    """The levels of the energy, the angle from which S3 and S4 count, and the sum of the squares."""
    if not made.times.size:
        return {}
    values = dict(zip(made.names, made.values.T, strict=True))
    ends = made.times[[0, -1]]
    half = 0.5 * float(values["inertia"][0])
    least, mean = half * float(values["s1"][0]), half * float(values["s1"][0] + values["s2"][0])

    def level(label: str, value: float, style: int) -> Reference:
        return Reference(label, ends, np.full(2, value), style)

    levels = [level("Tₘₑₐₙ", mean, 1), level("Tₘᵢₙ", least, 2)]
    if made.times[0] == 0.0:
        levels.append(level("T₀", float(values["energy"][0]), 3))
    within = [angle for angle in made.phi_c if ends[0] <= angle <= ends[1]]
    if within:
        # The work of the drive counts from phi_c, where it is zero.
        start = min(within, key=lambda angle: abs(float(np.interp(angle, made.times, values["s3"]))))
        bounds = np.array([least, float(values["energy"].max())])
        levels.append(Reference("φc", np.full(2, start), bounds, 2))
    whole = Reference("ω² = S₁ + S₂ + S₃ + S₄", made.times, values["omega"] ** 2, 0, wide=True)
    return {_ENERGY: tuple(levels), _SQUARES: (whole,)}


#: Heading of docs/theory-machine-shaft.md by the beginning of paths.
_THEORY: Final = {
    "mean_speed": "the-mean-speed-and-t_0",
    "mean_speed_is": "the-mean-speed-and-t_0",
    "wanted_irregularity": "the-mean-speed-and-t_0",
    "cycle": "the-machine",
    "gravity": "mechanisms",
    "phi_c": "four-squares",
    "balance": "balance-of-works",
    "balance_side": "balance-of-works",
    "drive": "balance-of-works",
    **dict.fromkeys(("drive.inertia", "drive.stages"), "the-drive-train"),
    **dict.fromkeys(("drive.stages.stiffness", "drive.stages.relative_damping"), "torsional-vibration"),
    "drive.torque": "balance-of-works",
    "drive.scale": "balance-of-works",
    "drive.motor": "balance-of-works",
    "drive.motor.rated_torque": "rating-of-the-motor",
    "drive.flywheel": "flywheels",
    "mechanism": "mechanisms",
    "parts": "several-parts",
    "parts.mechanism": "mechanisms",
    "parts.operation": "operations",
    **dict.fromkeys(("operation", "friction_torque", "constants"), "operations"),
}

PRESENTATION: Final = Presentation(
    title="Machine shaft",
    along=("drive.inertia",),
    apart=("mean_speed",),
    drawn=("irregularity",),
    main=("irregularity", "omega.max", "omega.min", "energy.fluctuation", "drive_torque.mean", "required_inertia"),
    below=("required_inertia", "energy.fluctuation"),
    answers=(
        Answer("irregularity", "Irregularity", "irregularity", "here", better="smaller"),
        Answer("required_inertia", "Required inertia", "required_inertia", "here"),
        Answer("energy_fluctuation", "Energy fluctuation", "energy.fluctuation", "here"),
        Answer("mean_energy", "Mean kinetic energy", "energy.mean", "here"),
        Answer("least_irregularity", "Least irregularity", "irregularity", "smallest", better="smaller"),
    ),
    wanted={"irregularity": "wanted_irregularity"},
    clauses=Clauses(
        results={"irregularity": "irregularity", "inertia": "required_inertia"},
        here=(
            "the irregularity is {irregularity}; the wanted one needs a drive inertia of {inertia}",
            "the irregularity is {irregularity}",
        ),
        still="it runs evenly",
        batch="half of the machines have an irregularity above {middle}, 9 of 10 between {low} and {high}",
    ),
    shares=("s1.share", "s2.share", "s3.share", "s4.share"),
    operating_point=("mean_speed", "drive.inertia"),
    checks=("balance",),
    panels=_panels,
    first_panels=(_SPEED, _TORQUES),
    references=_references,
    motion="Speed, energy, squares of the speed and torques over the angle of the shaft",
    motion_note="ω² = S₁ + S₂ + S₃ + S₄: shares of the least energy, of the mean energy above it, of the drive's and "
    "of the resistance's work.",
    captions=CAPTIONS,
    letters=LETTERS,
    form=FORM,
    laboratory=LABORATORY,
    theory={path: f"theory-machine-shaft#{heading}" for path, heading in _THEORY.items()},
)

_OF_FLYWHEEL: Final = ("flywheel.inertia", "flywheel.stress", "flywheel.margin", "flywheel.required_mass")
_OF_MOTOR: Final = (
    "motor.speed.mean", "motor.torque.mean", "motor.torque.max", "motor.torque.rms", "motor.power.mean"
)  # fmt: skip

#: Of couplings: what follows the irregularity, what follows all others, and the answers behind that of irregularity.
_OF_COUPLINGS: Final = ("torsion.dynamic_factor", "torsion.margin", "torsion.torque.amplitude")
_FURTHER_OF_COUPLINGS: Final = ("torsion.natural_frequency", "torsion.reversals")
_ANSWERS_OF_COUPLINGS: Final = (
    Answer("dynamic_factor", CAPTIONS["torsion.dynamic_factor"], "torsion.dynamic_factor", "here", better="smaller"),
    Answer("resonance_margin", CAPTIONS["torsion.margin"], "torsion.margin", "here", better="larger"),
)


def presentation_of(structure: Mapping[str, Any], paths: Collection[str] = ()) -> Presentation:
    """The presentation of machine shafts, with the main results of this one's flywheel, motor and couplings.

    ``paths`` are those of its numbers.
    """
    drive, shown = structure.get("drive", {}), PRESENTATION
    more: tuple[str, ...] = _OF_FLYWHEEL if drive.get("flywheel") else ()
    if drive.get("motor") or drive.get("stages"):
        more += _OF_MOTOR
    if "drive.motor.rated_torque" in paths:
        more += ("motor.torque.margin",)
    if "coupling" in drive.get("stages", ()):
        main = (*shown.main[:1], *_OF_COUPLINGS, *shown.main[1:])
        answers = (*shown.answers[:1], *_ANSWERS_OF_COUPLINGS, *shown.answers[1:])
        shown = replace(shown, main=main, answers=answers)
        more += _FURTHER_OF_COUPLINGS
    return replace(shown, main=shown.main + more) if more else shown
