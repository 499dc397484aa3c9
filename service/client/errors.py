"""How a request to the service can fail: nobody answered, or the service refused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from sprag.service.faults import CODES, Code, Fault, FaultError, Kind, ParameterFault


class ServiceError(FaultError):
    """The service did not do what it was asked to; ``code`` says the kind and is stable (docs/faults.md)."""


class SpecFileError(ServiceError, ValueError):
    """A spec was given as the name of a file, and there is none that can be read."""

    def __init__(self, message: str) -> None:
        super().__init__("invalid-file", message)


class UnreachableError(ServiceError):
    """Nobody answered, or what answered is not the service. ``address`` is what was asked."""

    def __init__(self, address: str, reason: str) -> None:
        super().__init__("unreachable", f"{address}: {reason}")
        self.address = address
        self.reason = reason


class RefusedError(ServiceError):
    """The service answered with an error.

    Attributes
    ----------
    status : int
        HTTP status.
    code : str
        Kind of the problem, the last part of its type: "invalid-spec", "study-not-found".
    faults : tuple of Fault
        What is wrong with the input, place by place.
    problem : dict
        The problem document (RFC 9457): title, detail, and for wrong input ``errors``.
    """

    def __init__(self, status: int, problem: Mapping[str, Any]) -> None:
        self.status = status
        self.problem = dict(problem)
        kind = str(self.problem.get("type", "")).rpartition("/")[2] or "internal"
        detail = str(self.problem.get("detail") or self.problem.get("title") or f"HTTP status {status}")
        super().__init__(cast("Kind", kind), detail, map(_fault, self.errors))

    @property
    def errors(self) -> list[dict[str, Any]]:
        """The problems of the input, each with pointer, message, value and allowed range where known."""
        found = self.problem.get("errors")
        return [dict(error) for error in found if isinstance(error, Mapping)] if isinstance(found, list) else []


def _fault(error: Mapping[str, Any]) -> Fault:
    """What the service told of one place; a code that this version does not know is an invalid text."""
    code = cast("Code", error["code"] if error.get("code") in CODES else "invalid-text")
    made = ParameterFault if error.get("parameter") is not None else Fault
    where = error.get("parameter", error.get("pointer"))
    told = (str(error.get("message", "is wrong")), error.get("value"), error.get("allowed"), error.get("unit"))
    return made(where, code, *told)


class StudyTimeoutError(ServiceError):
    """A study has not ended in the time it was given; it goes on. ``study`` is the study as it was then."""

    def __init__(self, study: Mapping[str, Any], seconds: float) -> None:
        self.study = dict(study)
        super().__init__("not-done", f"the study {self.study['id']} is {self.study['state']} after {seconds:g} s")
