"""What is said once for every command: the service, its token, and whether the answer is JSON.

Options before or after the command come first, then ``SPRAG_SERVER`` and ``SPRAG_TOKEN``, then what ``sprag login``
has kept; a service of the login gets the token of the login.
"""

from __future__ import annotations

import json
import os
from contextlib import suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path
from typing import Final

#: Default address of `sprag serve`.
DEFAULT_SERVER: Final = "http://127.0.0.1:8000"


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
    """The address of the service and its token.

    A token that is kept is for the service of the same login only: it is sent to no other. ``SPRAG_TOKEN``, which may
    be the secret of a service of this machine, is not sent to the service of a login.
    """
    given, kept = CURRENT.get(), profile()
    named = given.server or os.environ.get("SPRAG_SERVER")
    if not named and "server" in kept:
        return kept["server"], given.token or kept.get("token", "")
    server = named or DEFAULT_SERVER
    token = given.token or os.environ.get("SPRAG_TOKEN")
    of_login = server.rstrip("/") == kept.get("server", "").rstrip("/")
    return server, token or (kept.get("token") if of_login else None)


def profile_file() -> Path:
    """Where ``sprag login`` keeps the address and the token of a service: the user's folder of settings."""
    import typer

    return Path(typer.get_app_dir("sprag")) / "login.json"


def profile() -> dict[str, str]:
    """The service of the login; {} where there is none, or its file cannot be read."""
    with suppress(OSError, ValueError):
        kept = json.loads(profile_file().read_text(encoding="utf-8"))
        if isinstance(kept, dict):
            return {name: text for name, text in kept.items() if isinstance(text, str)}
    return {}
