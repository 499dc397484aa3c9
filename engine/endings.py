"""Endings of cases, each with a sentence for users. A physical failure is a stored result, never an exception."""

from enum import StrEnum


class Ending(StrEnum):
    """Ending of one case as the engine sees it (docs/theory.md). The member's value is what is stored and shown.

    New members go to the end: positions are stored in compiled code.
    """

    OK = "ok"
    ACCURACY_NOT_REACHED = "accuracy_not_reached"
    CHATTER = "chatter"
    STEP_BUDGET = "step_budget"
    DIVERGED = "diverged"
    INERTIA_INSUFFICIENT = "inertia_insufficient"
    UNBALANCED_WORK = "unbalanced_work"
    CANNOT_ASSEMBLE = "cannot_assemble"
    NEGATIVE_INERTIA = "negative_inertia"
    MOTOR_STALLED = "motor_stalled"
    QUADRATURE_NOT_REACHED = "quadrature_not_reached"
    MOTOR_OVERRUN = "motor_overrun"
    NEAR_SINGULAR = "near_singular"
    UNSTABLE = "unstable_motion"

    @property
    def sentence(self) -> str:
        """Plain sentence that explains the ending to a designer."""
        return _SENTENCES[self]


_SENTENCES = {
    Ending.OK: "The run reached its end.",
    Ending.ACCURACY_NOT_REACHED: (
        "The step size that the tolerance requires fell below the limit of double precision: some rate (a spring, the "
        "clutch or a very small inertia) is too fast for the rest of the machine, or the tolerance is too tight."
    ),
    Ending.CHATTER: (
        "The clutches or the shaft changed state more often than the event budget allows: the motion chatters, and no "
        "mean value of it would be trustworthy."
    ),
    Ending.STEP_BUDGET: (
        "The step budget was used up before the end of the run: shorten the run or loosen the tolerance."
    ),
    Ending.DIVERGED: (
        "An angle or a speed grew without bound (or became NaN): the parameters do not describe a steady machine."
    ),
    Ending.INERTIA_INSUFFICIENT: (
        "The inertia is insufficient for the required mean speed: the shaft would stop, or nearly stop, within the "
        "cycle. The least feasible mean speed, a result, must be exceeded; by a mean over time possibly by far."
    ),
    Ending.UNBALANCED_WORK: (
        "Drive and resistance do not do opposite work over the cycle, so there is no steady motion: scale the drive, "
        "let it be constant, or correct the torques."
    ),
    Ending.CANNOT_ASSEMBLE: (
        "The mechanism cannot be assembled at every angle of the shaft: its result has the first "
        "angle at which its links do not reach each other, or its motions take more than a revolution."
    ),
    Ending.NEGATIVE_INERTIA: "The reduced inertia is not positive at every angle of the shaft.",
    Ending.MOTOR_STALLED: (
        "The motor has no steady cycle with this load: the resistance stalls it, or holds it at a speed at which the "
        "torque of the load jumps or rises very steeply. Choose a stronger motor, or more inertia where the mean "
        "resistance is below the motor's largest torque, or let a load that follows the speed rise less steeply."
    ),
    Ending.QUADRATURE_NOT_REACHED: (
        "A torque or the inertia changes too abruptly to be integrated to 1e-10: split a formula where it "
        "jumps or widen its peaks, or smooth a table; an inertia may not jump at all. Or no steady speed was found for "
        "a load that follows it: let its torque rise with the speed."
    ),
    Ending.MOTOR_OVERRUN: (
        "The motor has no steady cycle with this load: the load drives the shaft harder than the motor can brake it, "
        "and the shaft runs away. Choose a motor with a larger breakdown torque, or correct the load's sign."
    ),
    Ending.NEAR_SINGULAR: (
        "The mechanism passes so close to a singular position (links nearly in line, or a pivot nearly on the crank's "
        "circle) that double precision cannot resolve its inertia or its motion: change the dimensions."
    ),
    Ending.UNSTABLE: (
        "The steady motion is unstable: a small deviation of the speed grows in every cycle, by the factor that is the "
        "multiplier of the cycle, a result, so that the shaft runs away or stops. Choose a drive whose torque falls "
        "with the speed, or a load whose torque rises with it."
    ),
}

#: Order in which compiled code numbers the endings; the position is the code.
ENDINGS: tuple[Ending, ...] = tuple(Ending)
