"""What the shell completes beside commands, options and their choices: names, and what only a running service knows."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar

import typer

from sprag_study.service.languages import _
from sprag_study.worker.codes import ENDING_CODES, FLAG_MASKS, PENDING, REGIME_CODES

if TYPE_CHECKING:
    from sprag_study.service.client import Client
    from sprag_study.service.storage.store import Store

#: Variable in which typer's scripts ask for completions, or people for such a script.
COMPLETION_VARIABLE: Final = "_SPRAG_COMPLETE"
#: Longest wait for the service, s: somebody waits at the keyboard.
_TIMEOUT: Final = 1.0
#: Studies that are offered, the newest.
_OFFERED: Final = "100"
#: Names that need no quotes in any shell.
_PLAIN: Final = re.compile(r"[\w.-]+")
Kept = TypeVar("Kept")
Offered = TypeVar("Offered", str, tuple[str, str])


def studies(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Ids of the newest studies, each with its name and state, and names; nothing where no service answers."""
    return _asked(context, lambda client: _studies(client, incomplete))


def _studies(client: Client, incomplete: str) -> list[tuple[str, str]]:
    found = client.request("GET", "/studies", params={"page_size": _OFFERED})["studies"]
    ids = [(study["id"], f"{study['name'] or study['model']}, {study['state']}") for study in found]
    names = _names(incomplete, ((study["name"], study["id"]) for study in found))
    from sprag_study.service.client.synchronous.naming import LATEST

    newest = [(LATEST, ids[0][1])] if ids else []
    return [*newest, *ids, *names]


def schedules(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Ids of the schedules, each with its name and times, and names; nothing where no service answers."""

    def asked(client: Client) -> list[tuple[str, str]]:
        found = client.request("GET", "/schedules")["schedules"]
        ids = [(s["id"], f"{s['name']}, {s['cron'] or s['at']}") for s in found]
        return ids + _names(incomplete, ((s["name"], s["id"]) for s in found))

    return _asked(context, asked)


def tokens(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Ids of the tokens that are not revoked, each with its name, and names."""
    listed = [it for it in _of_people(context, lambda people: people.tokens()) if it["state"] != "revoked"]
    ids = [(it["id"], f"{it['name']}, {it['scope']}") for it in listed]
    return ids + _names(incomplete, ((it["name"], it["id"]) for it in listed))


def users(context: typer.Context) -> list[tuple[str, str]]:
    """Names of the users of the service or of the database; each with the role, a removed one too."""
    return [(user["name"], user["role"]) for user in _of_people(context, lambda people: people.users())]


def _of_people(context: typer.Context, ask: Callable[[Any], list[Any]]) -> Sequence[Any]:
    """What the users and tokens of the service or of the database are asked for."""
    from sprag_study.service.cli.stores import asks_service

    with _typed(context):
        asks = context.params.get("db") is None and asks_service(None)
    if asks:
        return _asked(context, ask)
    from sprag_study.service.jobs.users import StoredUsers

    return _stored(context, lambda store: ask(StoredUsers(store.people)))


def _names(incomplete: str, named: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Names with what they stand for, once somebody has begun to type one."""
    return [(name, meant) for name, meant in named if incomplete and _PLAIN.fullmatch(name or "")]


def endings() -> list[str]:
    """Endings of cases."""
    return [name for name in ENDING_CODES if name != PENDING]


def regimes() -> list[str]:
    """Regimes of settled motion."""
    return [name for name, code in REGIME_CODES.items() if code]


def flags() -> list[str]:
    """Flags of cases."""
    return list(FLAG_MASKS)


def presets() -> list[tuple[str, str]]:
    """Studies that come with the program, each with what it shows."""
    from sprag_study.service.presets import ABOUT, preset_names

    return [(name, _(ABOUT[name].shows)) for name in preset_names()]


def models(context: typer.Context) -> list[str]:
    """Models of the service."""
    return _asked(context, lambda client: [model["name"] for model in client.request("GET", "/models")["models"]])


def parameters(context: typer.Context) -> list[tuple[str, str]]:
    """Parameters that vary in the study of the command, each with its unit."""
    return _of_study(context, ("parameters",))


def results(context: typer.Context) -> list[tuple[str, str]]:
    """Results of the study of the command, each with its unit."""
    return _of_study(context, ("results",))


def quantities(context: typer.Context) -> list[tuple[str, str]]:
    """Parameters and results of the study of the command, each with its unit."""
    return _of_study(context, ("parameters", "results"))


def sortings(context: typer.Context) -> list[tuple[str, str]]:
    """What the cases of the study of the command are sorted by."""
    kinds = [("ending", _("how it ended")), ("flags", _("those without first"))]
    return [("case", _("number of the case")), *kinds, *quantities(context)]


def _of_study(context: typer.Context, parts: Sequence[str]) -> list[tuple[str, str]]:
    # A word after an option without its value is not yet the value of an argument.
    given = context.params
    named = [given.get("study_id"), given.get("study"), given.get("spec"), *(given.get("studies") or ()), *context.args]
    study = next((name for name in named if name), None)
    if study is None:
        return []

    def names(client: Client) -> list[tuple[str, str]]:
        from sprag_study.service.cli.names import study_of
        from sprag_study.service.client.wire import case_path

        case = client.request("GET", case_path(study_of(client, study), 0, ""))
        return [(name, case["units"].get(name, "")) for part in parts for name in case[part]]

    return _asked(context, names)


def _asked(context: typer.Context, ask: Callable[[Client], list[Offered]]) -> list[Offered]:
    """What the service of the command answers; nothing where none answers."""
    from sprag_study.service.cli.common import access
    from sprag_study.service.cli.console import CommandFailureError
    from sprag_study.service.client import Client, RefusedError, UnreachableError

    try:
        with _typed(context):
            service = access()
            with Client(service.server, service.token, retry=0.0, timeout=_TIMEOUT) as client:
                return ask(client)
    except (CommandFailureError, RefusedError, UnreachableError, ValueError):  # ValueError: the address of the service
        return []


@contextmanager
def _typed(context: typer.Context) -> Iterator[None]:
    """With the options of every command as they are typed."""
    from sprag_study.service.cli.common import CURRENT, Common

    typed = context.find_root().params
    before = CURRENT.set(Common(typed.get("server"), typed.get("token")))
    try:
        yield
    finally:
        CURRENT.reset(before)


def _stored(context: typer.Context, read: Callable[[Store], Sequence[Kept]]) -> Sequence[Kept]:
    """What the database of the command has; nothing where there is none, which is not created."""
    from sprag_study.service.cli.console import CommandFailureError
    from sprag_study.service.cli.stores import database_of
    from sprag_study.service.storage.errors import StoreError
    from sprag_study.service.storage.store import Store

    try:
        with Store.open(database_of(context.params.get("db")), create=False) as store:
            return read(store)
    except (CommandFailureError, StoreError):
        return ()
