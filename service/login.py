"""Which service is meant where none is named, and its token: of the environment, and of ``sprag login``."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Final

#: Default address of `sprag serve`.
DEFAULT_SERVER: Final = "http://127.0.0.1:8000"


def service_of(server: str | None, token: str | None) -> tuple[str, str | None]:
    """The address of the service and its token.

    What is given comes first, then ``SPRAG_SERVER`` and ``SPRAG_TOKEN``, then the login. A token that is kept is for
    the service of the same login only: it is sent to no other. ``SPRAG_TOKEN``, which may be the secret of a service
    of this machine, is not sent to the service of a login.

    Parameters
    ----------
    server, token : str or None
        None where it is not given; a token of "" is none.
    """
    named, kept = os.environ.get("SPRAG_SERVER") if server is None else server, profile()
    if server is None and not named and "server" in kept:
        return kept["server"], kept.get("token", "") if token is None else token
    chosen = (named or DEFAULT_SERVER) if server is None else server
    if token is not None:
        return chosen, token
    of_login = chosen.rstrip("/") == kept.get("server", "").rstrip("/")
    return chosen, os.environ.get("SPRAG_TOKEN") or (kept.get("token") if of_login else None)


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
