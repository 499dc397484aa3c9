"""``sprag login`` and ``sprag logout``: the service that commands ask unless another is named."""

from __future__ import annotations

import json
import os
import sys
from typing import Annotated

import typer

from sprag_study.service.cli.common import CURRENT, wants_json
from sprag_study.service.cli.console import say, write_json
from sprag_study.service.cli.remote import served_by
from sprag_study.service.languages import _
from sprag_study.service.login import GIVEN, LOGIN, VARIABLE, Access, profile_file


def login(
    server: Annotated[str, typer.Argument(metavar="URL", help="Address of the service.")],
) -> None:
    """Keep the address of a service and its token for later commands, in a file that only you can read.

    The token is that of --token or SPRAG_TOKEN, or it is asked for; an empty one is none.
    """
    given, secret = CURRENT.get().token, os.environ.get(VARIABLE)
    token = given or secret or _asked()
    origin = GIVEN if given else VARIABLE if secret else LOGIN if token else ""
    with served_by(Access(server, token, origin, takes_variable=True)) as client:
        me = client.me()
    file = profile_file()
    file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    file.unlink(missing_ok=True)
    with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w", encoding="utf-8") as out:
        json.dump({"server": server, **({"token": token} if token else {})}, out)
    from sprag_study.service.client.wire import public

    shown = public(server)
    if wants_json():
        write_json({"server": shown, "file": str(file), "me": me})
    else:
        say(_("{server} is asked from now on; {file} keeps it", server=shown, file=file))


def _asked() -> str:
    """The token that somebody types, which is not shown; a line of standard input elsewhere."""
    if not sys.stdin.isatty():
        return sys.stdin.readline().strip()
    from getpass import getpass

    return getpass(_("Token: "), sys.stderr).strip()


def logout() -> None:
    """Forget the service of the login and its token."""
    file = profile_file()
    kept = file.exists()
    file.unlink(missing_ok=True)
    if wants_json():
        write_json({"file": str(file), "removed": kept})
    else:
        say(_("{file} is removed", file=file) if kept else _("there is no login"))
