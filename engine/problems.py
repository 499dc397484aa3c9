"""Faults of machines of any model. A base machine raises these; a case of a grid stores the ending instead."""

from sprag_study.engine.endings import Ending


class MachineError(ValueError):
    """A fault of a machine; ``str`` is its sentence in English.

    Attributes
    ----------
    message : str
        The sentence for users, with its values.
    ending : Ending or None
        Ending of a case of a grid with the same fault; None for faults that no numeric parameter can remove.
    found, allowed : str or None
        What the machine has and what it must have, with units where they are known.
    """

    ending: Ending | None = None
    found: str | None = None
    allowed: str | None = None

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.message = message
