"""Which service is meant where none is named, and its token: of the environment, and of ``sprag login``."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final, NamedTuple
from urllib.parse import urlsplit

#: Default address of `sprag serve`.
DEFAULT_SERVER: Final = "http://127.0.0.1:8000"
_PORTS: Final = {"http": 80, "https": 443}


#: Where a token comes from.
GIVEN: Final = "--token"
VARIABLE: Final = "SPRAG_TOKEN"
LOGIN: Final = "`sprag login`"


class Access(NamedTuple):
    """A service and its token: ``origin`` is one of `GIVEN`, `VARIABLE` and `LOGIN`, or "" without a token.

    ``takes_variable`` is false for the service of a login to which SPRAG_TOKEN is not sent.
    """

    server: str
    token: str | None
    origin: str
    takes_variable: bool


def access_of(server: str | None, token: str | None) -> Access:
    """The address of the service, its token, and where that comes from.

    What is given comes first, then ``SPRAG_SERVER`` and ``SPRAG_TOKEN``, then the login. A token that is kept is for
    the service of the same login only: it is sent to no other. ``SPRAG_TOKEN``, which may be the secret of a service
    of this machine, is not sent to the service of a login, unless ``SPRAG_SERVER`` names it, too, or the login has no
    token and the address is given; ``sprag login`` itself sends it, and keeps it.

    Parameters
    ----------
    server, token : str or None
        None where it is not given; a token of "" is none.
    """
    named, kept = os.environ.get("SPRAG_SERVER", ""), profile()
    chosen = (named or kept.get("server") or DEFAULT_SERVER) if server is None else server
    of_login = _is_of(chosen, kept)
    takes = not of_login or _place(chosen) == _place(named) or (server is not None and not kept.get("token"))
    if token is not None:
        return Access(chosen, token, GIVEN if token else "", takes)
    if takes and (secret := os.environ.get(VARIABLE)):
        return Access(chosen, secret, VARIABLE, takes)
    own = kept.get("token", "") if of_login else None
    return Access(chosen, own, LOGIN if own else "", takes)


def _is_of(address: str, kept: Mapping[str, str]) -> bool:
    """Whether an address is that of the kept login."""
    return _place(address) == _place(kept.get("server", ""))


def _place(address: str) -> tuple[object, ...]:
    """What tells the address of one service from another's: without user, the usual port, and a slash at the end."""
    try:
        parts = urlsplit(address)
        port = parts.port or _PORTS.get(parts.scheme)
    except ValueError:
        return (address,)
    return parts.scheme, parts.hostname, port, parts.path.rstrip("/")


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
