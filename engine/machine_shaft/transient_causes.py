"""The end of a transient and its cause as a sentence."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

#: The refusal of a load that jumps or has a kink over the speed.
ROUGH_LOAD = (
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
    no_cycle: str


def shown(value: float) -> str:
    """A number to four digits, without the sign of a zero."""
    return f"{value + 0.0:.4g}"


def cause_of(kind: str, outcome: str, results: Mapping[str, float], ends: Ends) -> str:
    """A sentence about the end of a transient."""
    lasted = f"{shown(results['duration'])} s and {shown(results['turns'])} revolutions"
    if outcome == "too_stiff":
        return (
            f"The motion was followed for {lasted} only: the drive reacts too fast to the speed, or the shaft has too "
            "little inertia for it."
        )
    if outcome == "reached":
        cycle = "its steady cycle" if kind == "run-up" else "the new steady cycle"
        left = "" if ends.within == 0.0 else f" to {shown(100.0 * ends.within)} % of the first difference in speed"
        return f"The shaft comes to {cycle} after {lasted}{left and ','}{left}."
    if outcome == "not_reached":
        return _going_on(kind, results, ends, lasted)
    if kind == "coasting":
        back = " Weights and springs then turn it back." if ends.turns_back else ""
        return f"The shaft stops after {lasted}.{back}"
    return _stalled(outcome, ends, lasted)


def _going_on(kind: str, results: Mapping[str, float], ends: Ends, lasted: str) -> str:
    speed = f"The shaft still turns at {shown(results['omega.end'])} rad/s after {lasted}"
    if kind == "coasting":
        free = ends.mean_resistance >= -1e-12 * abs(ends.resistance)
        return f"{speed}: {'nothing takes work from it over a cycle' if free else 'more revolutions are needed'}."
    if not ends.cycle:
        return f"{speed}; it comes to no steady cycle. {ends.no_cycle}".rstrip()
    return f"{speed} and has not come to the steady cycle: more revolutions are needed, or it settles at another speed."


def _stalled(outcome: str, ends: Ends, lasted: str) -> str:
    """Why the drive could not keep the shaft turning."""
    place = f"{shown(math.degrees(ends.angle))} deg"
    if outcome == "not_started":
        return (
            f"The shaft does not start: at {place} the torque of the drive at rest, {shown(ends.drive)} N*m, does not "
            f"exceed the resisting torque, {shown(-ends.resistance)} N*m."
        )
    begin = f"The shaft stops at {place}, after {lasted}: "
    if -ends.mean_resistance > ends.largest_drive:
        return (
            f"{begin}the mean resisting torque, {shown(-ends.mean_resistance)} N*m, exceeds the largest torque of the "
            f"drive, {shown(ends.largest_drive)} N*m."
        )
    return (
        f"{begin}its energy is spent. The resisting torque there is {shown(-ends.resistance)} N*m, the torque of the "
        f"drive at rest {shown(ends.drive)} N*m."
    )
