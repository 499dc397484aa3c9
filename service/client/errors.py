"""Errors of requests: no answer, or a refusal of the service."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final, cast, get_args

from sprag_study.sentences import sentence_of
from sprag_study.service.faults import Code, Fault, FaultError, Kind, ParameterFault, shown


class ServiceError(FaultError):
    """A request failed; ``code`` gives the kind and is stable (docs/faults.md)."""


class SpecFileError(ServiceError, ValueError):
    """A spec was given as the name of a file that cannot be read."""

    def __init__(self, message: str) -> None:
        super().__init__("invalid-file", message)


class ArgumentError(ServiceError, ValueError):
    """An argument of a method cannot be what it must be; the fault names it. Nothing was requested."""

    def __init__(self, argument: str, value: object, allowed: str) -> None:
        text = shown(value if isinstance(value, str | int | float) else repr(value))
        fault = ParameterFault(argument, "wrong-type", "is not possible", text, allowed)
        super().__init__("invalid-parameter", str(fault), [fault])


class StatementError(ServiceError, ValueError):
    """A statement of SQL that does not only read, or that DuckDB refuses; the message has its reason."""

    def __init__(self, message: str) -> None:
        super().__init__("invalid-parameter", message)


class UnreachableError(ServiceError):
    """There was no answer, or not one of the service. ``address`` is the requested address."""

    def __init__(self, address: str, reason: str) -> None:
        super().__init__("unreachable", f"{address}: {reason}")
        self.address = address
        self.reason = reason


#: Most studies that a message lists.
_LISTED: Final = 5


class AmbiguousError(ServiceError, ValueError):
    """A text fits several studies or others of one ``kind``; the fault lists them."""

    def __init__(self, text: str, fits: Sequence[str], kind: str = "studies") -> None:
        more = f" and {len(fits) - _LISTED} more" if len(fits) > _LISTED else ""
        fault = Fault("ID", "ambiguous", f"fits several {kind}", text, ", ".join(fits[:_LISTED]) + more)
        super().__init__("invalid-parameter", str(fault), [fault])


class UntrustedError(UnreachableError):
    """The certificate of the service is not trusted."""

    def __init__(self, address: str, why: str) -> None:
        super().__init__(address, f"its certificate is not trusted: {why}")


class RefusedError(ServiceError):
    """The service answered with an error.

    Attributes
    ----------
    status : int
        HTTP status.
    code : str
        Kind of the problem, the last part of its type: "invalid-spec", "study-not-found".
    faults : tuple of Fault
        Faults of the input.
    problem : dict
        The problem document (RFC 9457): title, detail, and for wrong input ``errors``.
    """

    def __init__(self, status: int, problem: Mapping[str, Any]) -> None:
        self.status = status
        self.problem = dict(problem)
        kind = str(self.problem.get("type", "")).rpartition("/")[2] or "internal"
        detail = str(self.problem.get("detail") or self.problem.get("title") or f"HTTP status {status}")
        super().__init__(cast("Kind", kind), detail, map(_fault, self.errors))

    def __str__(self) -> str:
        """Each fault of the input in a line, or what the service says."""
        return "\n".join(map(str, self.faults)) or self.detail

    @property
    def errors(self) -> list[dict[str, Any]]:
        """Faults of the input, each with pointer, message, value and allowed range where known."""
        found = self.problem.get("errors")
        return [dict(error) for error in found if isinstance(error, Mapping)] if isinstance(found, list) else []


def _fault(error: Mapping[str, Any]) -> Fault:
    """A fault from the service's answer; a code unknown to this version becomes "invalid-text"."""
    code = cast("Code", error["code"] if error.get("code") in get_args(Code) else "invalid-text")
    made = ParameterFault if error.get("parameter") is not None else Fault
    where = error.get("parameter", error.get("pointer"))
    message = _sentence(error, "message") or "is wrong"
    message = message if isinstance(message, str) else str(message)
    return made(where, code, message, _sentence(error, "value"), _sentence(error, "allowed"), error.get("unit"))


def _sentence(error: Mapping[str, Any], name: str) -> Any:
    """A text of a fault with its values, where the service tells them."""
    try:
        return sentence_of(error["sentences"][name])
    except (KeyError, TypeError, ValueError, AttributeError):
        return error.get(name)


class StudyTimeoutError(ServiceError):
    """A study has not ended within the timeout; it continues. ``study`` is its state at that time."""

    def __init__(self, study: Mapping[str, Any], seconds: float) -> None:
        self.study = dict(study)
        super().__init__("not-done", f"the study {self.study['id']} is {self.study['state']} after {seconds:g} s")
