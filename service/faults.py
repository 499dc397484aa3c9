"""Faults that a caller is told of, whoever it is: where, what was given, what is allowed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable

_SHOWN_LENGTH = 200


@dataclass(frozen=True, slots=True)
class ErrorItem:
    """One fault: where it is (JSON Pointer into the body, or name of a parameter), what was given, what is allowed."""

    message: str
    pointer: str | None = None
    parameter: str | None = None
    value: Any = None
    allowed: str | None = None
    unit: str | None = None

    def to_json(self) -> dict[str, Any]:
        """The fault as JSON data; where a fault is not told by a name, the name is left out."""
        where = {"pointer": self.pointer} if self.parameter is None else {"parameter": self.parameter}
        return {**where, "message": self.message, "value": self.value, "allowed": self.allowed, "unit": self.unit}


class FaultError(Exception):
    """Something that whoever asked for it is told of; how HTTP tells it stands in ``sprag.service.http.problems``.

    Attributes
    ----------
    code : str
        Kind of the fault, stable: the last part of a problem's type.
    detail : str
        What went wrong this time, as a sentence.
    errors : tuple of ErrorItem
        Every faulty place, where there can be several.
    retry_after : int or None
        Seconds after which another attempt makes sense.
    """

    def __init__(
        self, code: str, detail: str, errors: Iterable[ErrorItem] = (), retry_after: int | None = None
    ) -> None:
        super().__init__(detail)
        self.code = code
        self.detail = detail
        self.errors = tuple(errors)
        self.retry_after = retry_after


def parameter_error(name: str, message: str, value: Any = None, allowed: str | None = None) -> FaultError:
    """A `FaultError` about one parameter of the request."""
    item = ErrorItem(message, parameter=name, value=shown(value), allowed=allowed)
    return FaultError("invalid-parameter", f"{name}: {message}", (item,))


def shown(value: Any) -> Any:
    """``value`` cut to a length that is fit to be sent back; only text can be long here."""
    if isinstance(value, str) and len(value) > _SHOWN_LENGTH:
        return value[: _SHOWN_LENGTH - 1] + "\N{HORIZONTAL ELLIPSIS}"
    return value
