"""The end of a transient and its cause, as a sentence with its numbers."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from sprag_study.sentences import Amount, Sentence

#: The refusal of a load that jumps or has a kink over the speed.
ROUGH_LOAD = Sentence(
    "The load is not smooth in the speed: a transient needs a formula without abs, sign, step, floor, mod, min, max "
    "or comparisons of omega."
)


@dataclass(frozen=True, slots=True)
class Ends:
    """What is known of the end of a transient.

    Attributes
    ----------
    angle : float
        Angle of the shaft in the cycle, in rad.
    drive, resistance : float
        Torques there of the drive, at rest, and of everything else, in N*m.
    largest_drive : float
        Largest torque of the drive at the main shaft, from rest on.
    mean_resistance : float
        Mean over a cycle of the torque of everything but the drive.
    turns_back : bool
        Whether weights and springs overcome the friction of the shaft there.
    within : float
        Share of the first deviation from the steady cycle at which it counts as reached.
    cycle : bool
        Whether there is a steady cycle to come to.
    missed : float
        Mean speed in rad/s of a steady cycle to which the shaft does not come, because there is another before it; NaN
        where there is none.
    no_cycle : str
        Why there is none.
    """

    angle: float
    drive: float
    largest_drive: float
    resistance: float
    mean_resistance: float
    turns_back: bool
    within: float
    cycle: bool
    missed: float
    no_cycle: str


def cause_of(kind: str, outcome: str, results: Mapping[str, float], ends: Ends) -> Sentence:
    """The sentence about the end of a transient."""
    lasted = {"time": _amount(results["duration"], "s"), "turns": _amount(results["turns"])}
    if outcome == "too_stiff":
        return Sentence(
            "The motion was followed for {time} and {turns} revolutions only: the drive reacts too fast to the speed, "
            "or the shaft has too little inertia for it.",
            **lasted,
        )
    if outcome == "reached":
        return _reached(kind, ends, lasted, results["after.omega.mean"])
    if outcome == "not_reached":
        return _going_on(kind, ends, {**lasted, "speed": _amount(results["omega.end"], "rad/s")})
    if kind == "coasting":
        if ends.turns_back:
            return Sentence(
                "The shaft stops after {time} and {turns} revolutions. Weights and springs then turn it back.", **lasted
            )
        return Sentence("The shaft stops after {time} and {turns} revolutions.", **lasted)
    return _stalled(outcome, ends, lasted)


def _amount(value: float, unit: str = "1") -> Amount:
    """A number to four digits, without the sign of a zero."""
    return Amount(float(value) + 0.0, unit, 4, form=".4g")


def _reached(kind: str, ends: Ends, lasted: Mapping[str, Amount], mean: float) -> Sentence:
    share = _amount(100.0 * ends.within)
    if math.isfinite(ends.missed):
        return Sentence(
            "The shaft comes to the steady cycle at {speed}, and not to the one at {missed}, after {time} and {turns} "
            "revolutions, to {share} % of the first difference in speed.",
            speed=_amount(mean, "rad/s"), missed=_amount(ends.missed, "rad/s"), share=share, **lasted,
        )  # fmt: skip
    if kind == "run-up":
        if ends.within == 0.0:
            return Sentence("The shaft comes to its steady cycle after {time} and {turns} revolutions.", **lasted)
        return Sentence(
            "The shaft comes to its steady cycle after {time} and {turns} revolutions, to {share} % of the first "
            "difference in speed.",
            share=share, **lasted,
        )  # fmt: skip
    if ends.within == 0.0:
        return Sentence("The shaft comes to the new steady cycle after {time} and {turns} revolutions.", **lasted)
    return Sentence(
        "The shaft comes to the new steady cycle after {time} and {turns} revolutions, to {share} % of the first "
        "difference in speed.",
        share=share, **lasted,
    )  # fmt: skip


def _going_on(kind: str, ends: Ends, parts: Mapping[str, Amount]) -> Sentence:
    if kind == "coasting":
        if ends.mean_resistance >= -1e-12 * abs(ends.resistance):
            return Sentence(
                "The shaft still turns at {speed} after {time} and {turns} revolutions: nothing takes work from it "
                "over a cycle.",
                **parts,
            )
        return Sentence(
            "The shaft still turns at {speed} after {time} and {turns} revolutions: more revolutions are needed.",
            **parts,
        )
    if ends.cycle:
        return Sentence(
            "The shaft still turns at {speed} after {time} and {turns} revolutions and has not come to the steady "
            "cycle: more revolutions are needed, or it settles at another speed.",
            **parts,
        )
    if not ends.no_cycle:
        return Sentence(
            "The shaft still turns at {speed} after {time} and {turns} revolutions; it comes to no steady cycle.",
            **parts,
        )
    return Sentence(
        "The shaft still turns at {speed} after {time} and {turns} revolutions; it comes to no steady cycle. {why}",
        why=Sentence(ends.no_cycle), **parts,
    )  # fmt: skip


def _stalled(outcome: str, ends: Ends, lasted: Mapping[str, Amount]) -> Sentence:
    """Why the drive could not keep the shaft turning."""
    parts = {"place": replace(_amount(ends.angle, "rad"), degrees=True), "resistance": _amount(-ends.resistance, "N*m")}
    if outcome == "not_started":
        return Sentence(
            "The shaft does not start: at {place} the torque of the drive at rest, {drive}, does not exceed the "
            "resisting torque, {resistance}.",
            drive=_amount(ends.drive, "N*m"), **parts,
        )  # fmt: skip
    parts |= lasted
    if -ends.mean_resistance > ends.largest_drive:
        parts["resistance"] = _amount(-ends.mean_resistance, "N*m")
        return Sentence(
            "The shaft stops at {place}, after {time} and {turns} revolutions: the mean resisting torque, "
            "{resistance}, exceeds the largest torque of the drive, {drive}.",
            drive=_amount(ends.largest_drive, "N*m"), **parts,
        )  # fmt: skip
    return Sentence(
        "The shaft stops at {place}, after {time} and {turns} revolutions: its energy is spent. The resisting torque "
        "there is {resistance}, the torque of the drive at rest {drive}.",
        drive=_amount(ends.drive, "N*m"), **parts,
    )  # fmt: skip
