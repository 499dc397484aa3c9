"""The states in which the clutches of a drive can begin."""

from typing import Final

from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.possible_starts import ImpossibleStart, impossible_starts

#: Begins the last part of the path of every initial value.
_INITIAL: Final = "initial_"
#: The state of a clutch whose pendulum turns with the shaft.
LOCKED: Final = float(Clutch.LOCKED)

__all__ = ["LOCKED", "ImpossibleStart", "impossible_starts", "is_initial", "is_state"]


def is_state(path: str) -> bool:
    """Whether a path is that of the state of a clutch, whose numbers have nothing in between."""
    return path.endswith(".initial_clutch")


def is_initial(path: str) -> bool:
    """Whether a path is that of an initial value, which runs begin with and periodic motions do not depend on."""
    return path.rpartition(".")[2].startswith(_INITIAL)
