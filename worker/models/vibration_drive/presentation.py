"""Presentation of vibration drives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag_study.worker.models.presentation import Answer, Clauses, Panel, Presentation
from sprag_study.worker.models.vibration_drive.form import FORM
from sprag_study.worker.models.vibration_drive.laboratory import LABORATORY
from sprag_study.worker.models.vibration_drive.words import CAPTIONS, LETTERS
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from collections.abc import Sequence


def _pendulums(names: Sequence[str]) -> tuple[str, ...]:
    """Prefixes of the variables of each pendulum, such as "pendulums.0"."""
    return tuple(name.removesuffix(".angle") for name in names if name.endswith(".angle") and name != "shaft.angle")


def _title(pendulum: str) -> str:
    return f"Pendulum {ordinal(pendulum.rpartition('.')[2])}"


def _panels(names: Sequence[str], _: Sequence[str]) -> tuple[Panel, ...]:
    pendulums = _pendulums(names)

    def each(quantity: str) -> tuple[tuple[str, str], ...]:
        return tuple((f"{pendulum}.{quantity}", _title(pendulum)) for pendulum in pendulums)

    together = (("torque", "All clutches"),) if len(pendulums) > 1 else ()
    powers = (
        ("power.input", "input"),
        ("power.useful", "useful"),
        ("power.loss", "loss"),
        ("power.clutch", "clutches"),
    )
    return (
        Panel("angle", "rad", each("angle")),
        Panel("speed", "rad/s", (*each("speed"), ("shaft.speed", "Shaft"))),
        Panel("torque", "N*m", (*each("torque"), *together)),
        Panel("power", "W", powers),
    )


def _phases(names: Sequence[str]) -> tuple[tuple[str, str, str], ...]:
    return tuple((f"{pendulum}.angle", f"{pendulum}.speed", _title(pendulum)) for pendulum in _pendulums(names))


_LOADS: Final = (
    *("bearing_damping", "linear_load", "quadratic_load", "stribeck_load", "stribeck_speed"),
    *("cyclic_load", "load_cycles", "load_phase", "load_factor"),
)
_POINT: Final = ("excitation.frequency", "excitation.amplitude_x", "excitation.amplitude_y", "shaft.load")

PRESENTATION: Final = Presentation(
    title="Vibration drive",
    along=("shaft.load", "excitation.frequency"),
    apart=_POINT,
    drawn=("shaft.speed.mean", "shaft.speed.max"),
    main=("shaft.speed.mean", "torque.mean", "power.useful.mean", "efficiency"),
    heading="Mechanical characteristic",
    below=("power.useful.mean", "efficiency"),
    answers=(
        Answer("no_load_speed", "No-load speed", "shaft.speed.mean", "at_zero", along="shaft.load"),
        Answer("largest_power", "Largest useful power", "power.useful.mean", "largest", better="larger"),
        Answer("best_efficiency", "Best efficiency", "efficiency", "largest", better="larger"),
        Answer("stall_torque", "Stall torque", "shaft.speed.mean", "until_zero", along="shaft.load"),
    ),
    clauses=Clauses(
        results={"speed": "shaft.speed.mean", "efficiency": "efficiency"},
        here=("it runs at {speed} with {efficiency} efficiency", "it runs at {speed}"),
        still="it stands still",
        left="only {speed} is left",
        stalls="it stalls between {low} and {high}",
        batch="half of the drives run faster than {middle}, 9 of 10 between {low} and {high}",
    ),
    shares=(
        "efficiency",
        "fraction.rotating",
        "fraction.held",
        "fraction.driven",
        "pendulums.N.fraction.engaged",
        "pendulums.N.fraction.beyond_data",
    ),
    workshop=("deg", "rpm", "mm", "kg*cm^2", "N/mm", "%"),
    columns=("regime", "shaft.speed.mean", "shaft.irregularity", "torque.mean", "power.useful.mean", "efficiency"),
    operating_point=_POINT,
    checks=("balance", "run", "reset", "regime"),
    balance=(
        ("", "power.input.mean", "put in by the base"),
        ("−", "power.loss.mean", "lost in damping"),
        ("−", "power.useful.mean", "against the load"),
        ("=", "power.stored.mean", "stored in the machine"),
    ),
    residual="balance.energy",
    panels=_panels,
    first_panels=("speed", "torque"),
    states={
        "free": ("#d9dee5", ""),
        "take_up": ("#f0c35a", "/"),
        "engaged": ("#3f87c5", ""),
        "beyond": ("#d55e00", "x"),
        "locked": ("#8a6fc4", "."),
        "held": ("#b9c1cb", "-"),
        "rotating": ("#5fb38b", ""),
    },
    phases=_phases,
    portrait="Speed over angle of each pendulum",
    motion="Angles, speeds, torques and powers over time, and the states of clutches and shaft",
    motion_note="States of the clutches: free; taking up the backlash; engaged; beyond the measured data; locked. "
    "The shaft is held by the load or rotating.",
    symbols={
        "nu/2pi": ("f", ""),
        "phi(0)": ("φ", "0"),
        "phi'(0)": ("ω", "0"),
        "phi_e'(0)": ("ω", "e0"),
        "c_(K+1)": ("c", "k"),
    },
    captions=CAPTIONS,
    letters=LETTERS,
    form=FORM,
    laboratory=LABORATORY,
    theory={
        **dict.fromkeys(
            ("gravity", "excitation", "pendulums", "pendulums.clutch", "shaft", "clutch"), "theory#equations-of-motion"
        ),
        **dict.fromkeys(
            (f"pendulums.initial_{name}" for name in ("angle", "speed", "windup", "clutch")), "theory#the-automaton"
        ),
        "shaft.initial_speed": "theory#the-automaton",
        **{f"pendulums.{name}": "theory#the-clutches" for name in ("clutch_damping", "overrunning_damping")},
        **{f"shaft.{name}": "theory#the-load" for name in ("load", *_LOADS)},
        **{
            f"pendulums.{name}": "theory#duty-of-the-clutches"
            for name in ("rated_torque", "rated_frequency", "rated_speed", "fatigue_exponent")
        },
        **{
            f"shaft.{name}": "theory#forces"
            for name in ("rotor_mass", "bearing_rating", "bearing_exponent", "bearing_share")
        },
        **{
            f"{clutch}.{name}": "theory#clutch-law-from-measured-data"
            for clutch in ("clutch", "pendulums.clutch")
            for name in ("data", "accuracy", "max_degree", "windup_limit")
        },
    },
)
