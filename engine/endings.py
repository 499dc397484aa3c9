"""How a case can end, each with the sentence a user reads. A physical failure is a stored result, never an
exception.
"""

from enum import StrEnum


class Ending(StrEnum):
    """Ending of one case as the engine sees it (MODEL.md A5). The member's value is what is stored and shown."""

    OK = "ok"
    ACCURACY_NOT_REACHED = "accuracy_not_reached"
    CHATTER = "chatter"
    STEP_BUDGET = "step_budget"
    DIVERGED = "diverged"

    @property
    def sentence(self) -> str:
        """Plain sentence that explains the ending to a designer."""
        return _SENTENCES[self]


_SENTENCES = {
    Ending.OK: "The run reached its end.",
    Ending.ACCURACY_NOT_REACHED: (
        "The step size the tolerance asks for fell under the floor of double precision: some rate (a spring, the "
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
        "An angle or a speed grew beyond every bound (or was no number): the parameters describe no steady machine."
    ),
}

#: Order in which compiled code numbers the endings; the position is the code.
ENDING_CODES: tuple[Ending, ...] = tuple(Ending)
