"""The base of every error that the program raises for its callers, here or from a running service."""

from typing import Any

from sprag_study.sentences import Sentence


class SpragError(Exception):
    """A failure, as one sentence or with a line for each fault.

    Attributes
    ----------
    code : str
        Kind of the failure, stable: docs/faults.md explains it.
    faults : tuple of Fault
        Every faulty place of the input, each with its pointer, value and allowed range; empty where it is not the
        input.
    """

    code: str = "unavailable"
    faults: tuple[Any, ...] = ()


class WrongPlanError(ValueError):
    """A plan with a field out of its range; ``message`` names it."""

    def __init__(self, message: Sentence) -> None:
        super().__init__(message)
        self.message = message
