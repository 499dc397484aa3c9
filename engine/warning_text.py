"""Warnings: sentences with a stable code."""


class WarningText(str):
    """A sentence about what is allowed but probably unintended.

    Attributes
    ----------
    code : str
        Its kind, stable; wording may change.
    """

    code: str

    def __new__(cls, message: str, code: str = "") -> "WarningText":
        """The warning ``message`` with its code."""
        self = super().__new__(cls, message)
        self.code = code
        return self
