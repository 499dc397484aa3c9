"""How a request to the service can fail: nobody answered, or the service refused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class ServiceError(Exception):
    """The service did not do what it was asked to."""


class SpecFileError(ServiceError, ValueError):
    """A spec was given as the name of a file, and there is none that can be read."""


class UnreachableError(ServiceError):
    """Nobody answered, or what answered is not the service. ``address`` is what was asked."""

    def __init__(self, address: str, reason: str) -> None:
        super().__init__(f"{address}: {reason}")
        self.address = address
        self.reason = reason


class RefusedError(ServiceError):
    """The service answered with an error.

    Attributes
    ----------
    status : int
        HTTP status.
    problem : dict
        The problem document (RFC 9457): title, detail, and for wrong input ``errors``.
    """

    def __init__(self, status: int, problem: Mapping[str, Any]) -> None:
        self.status = status
        self.problem = dict(problem)
        super().__init__(str(self.problem.get("detail") or self.problem.get("title") or f"HTTP status {status}"))

    @property
    def errors(self) -> list[dict[str, Any]]:
        """The problems of the input, each with pointer, message, value and allowed range where known."""
        found = self.problem.get("errors")
        return [dict(error) for error in found if isinstance(error, Mapping)] if isinstance(found, list) else []


class StudyTimeoutError(ServiceError):
    """A study has not ended in the time it was given; it goes on. ``study`` is the study as it was then."""

    def __init__(self, study: Mapping[str, Any], seconds: float) -> None:
        self.study = dict(study)
        super().__init__(f"the study {self.study['id']} is {self.study['state']} after {seconds:g} s")
