"""What is said once for every command: the service, its token, and whether the answer is JSON.

Options before or after the command come first, then ``SPRAG_SERVER`` and ``SPRAG_TOKEN``, then what ``sprag login``
has kept; a service of the login gets the token of the login.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextvars import ContextVar
from dataclasses import dataclass

from sprag_study.service.languages import _
from sprag_study.service.login import GIVEN, LOGIN, VARIABLE, Access, access_of, profile


@dataclass(frozen=True, slots=True)
class Common:
    """The options that every command has; ``language`` is that of the command line, not that of the environment."""

    server: str | None = None
    token: str | None = None
    json: bool = False
    language: str | None = None


CURRENT: ContextVar[Common] = ContextVar("common", default=Common())  # noqa: B039 - it cannot be changed


def wants_json() -> bool:
    """Whether the answer is read by a program."""
    return CURRENT.get().json


def names_service() -> bool:
    """Whether the command line names a service, which then answers what the command can also find out by itself."""
    return bool(CURRENT.get().server)


def access() -> Access:
    """The address of the service and its token (`sprag_study.service.login`), an option before anything else."""
    given = CURRENT.get()
    return access_of(given.server or None, given.token or None)


def token_sentences(access: Access) -> Iterator[str]:
    """Which token the service gets, and which one it does not get although it is there."""
    origin = access.origin
    yield _("The token is that of {origin}.", origin=origin) if origin else _("No token is sent.")
    if origin == GIVEN:
        return
    if os.environ.get(VARIABLE) and origin != VARIABLE:
        yield _("SPRAG_TOKEN is not sent to the service of `sprag login`, unless SPRAG_SERVER names it, too.")
    if profile().get("token") and origin != LOGIN:
        yield _("The token of `sprag login` is for its service only, and where SPRAG_TOKEN is sent, it comes first.")
