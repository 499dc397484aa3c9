"""What is said once for every command: the service, its token, and whether the answer is JSON.

Options before or after the command come first, then ``SPRAG_SERVER`` and ``SPRAG_TOKEN``, then what ``sprag login``
has kept; a service of the login gets the token of the login.
"""

from __future__ import annotations

from contextvars import ContextVar
from dataclasses import dataclass

from sprag_study.service.login import service_of


@dataclass(frozen=True, slots=True)
class Common:
    """The options that every command has."""

    server: str | None = None
    token: str | None = None
    json: bool = False


CURRENT: ContextVar[Common] = ContextVar("common", default=Common())  # noqa: B039 - it cannot be changed


def wants_json() -> bool:
    """Whether the answer is read by a program."""
    return CURRENT.get().json


def address() -> tuple[str, str | None]:
    """The address of the service and its token (`sprag_study.service.login`), an option before anything else."""
    given = CURRENT.get()
    return service_of(given.server or None, given.token or None)
