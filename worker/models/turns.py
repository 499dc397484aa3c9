"""The settled motion of one case as a whole: results, one turn, and the state from which it goes on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sprag_study.engine.outcome import Trajectory


@dataclass(frozen=True, slots=True)
class CaseTurn:
    """The settled motion of one case.

    Attributes
    ----------
    ending : str
    flags : tuple of str
    results : dict
        Every result of the study by name, SI; None where it could not be computed.
    regime : str
        "" where the case did not end ok.
    order : int
        Excitation periods in one turn; 0 where the motion has no orbit.
    motion : Trajectory
        One turn of the orbit, or some periods of a motion without one, from the start of an excitation period on; no
        points where the case did not end ok.
    state : dict or None
        Initial values (SI) by path that go on from the motion; None where the case did not end ok.
    """

    ending: str
    flags: tuple[str, ...]
    results: dict[str, float | None]
    regime: str
    order: int
    motion: Trajectory
    state: dict[str, float] | None
