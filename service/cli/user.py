"""``sprag admin user``: add, list, change and remove users of the database."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sprag_study.service.actor import Role
from sprag_study.service.cli import completion
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import WrongInputError, say, show_table, time_text, write_json
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.names import user_of
from sprag_study.service.cli.options import Database
from sprag_study.service.cli.stores import named_store
from sprag_study.service.faults import FaultError
from sprag_study.service.languages import _
from sprag_study.service.storage.people.scopes import user_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.storage.people.people import Quota, UserRecord
    from sprag_study.service.storage.store import Store

app = typer.Typer(
    help="Add, list, change and remove users.",
    no_args_is_help=True,
    cls=Groups,
)

Name = Annotated[str, typer.Argument(metavar="NAME", help="Name of the user, as a trusted proxy gives it.")]
Known = Annotated[
    str,
    typer.Argument(metavar="NAME", help="Name of the user, or its beginning.", autocompletion=completion.users),
]
RoleOption = Annotated[
    Role | None,
    typer.Option(
        "--role",
        help="viewer: can read; designer: can also submit, and change their own; administrator: can do everything.",
    ),
]
Cases = Annotated[
    int | None,
    typer.Option("--cases", min=0, max=2**63 - 1, help="Most cases that wait; 0: no limit; default: SPRAG_USER_CASES."),
]
Storage = Annotated[
    int | None,
    typer.Option(
        "--storage",
        metavar="MIB",
        min=0,
        max=2**43 - 1,
        help="Most MiB of results; 0: no limit; default: SPRAG_USER_STORAGE.",
    ),
]
Checks = Annotated[
    int | None,
    typer.Option("--checks", min=0, max=64, help="Most checks at once; 0: no limit; default: SPRAG_USER_CHECKS."),
]


class Limit(StrEnum):
    """A quota of a user."""

    CASES = "cases"
    STORAGE = "storage"
    CHECKS = "checks"


#: Options whose parameter of the same name can be at fault.
_OPTIONS: Final = frozenset({*Limit, "to"})

AsSet = Annotated[
    list[Limit] | None,
    typer.Option("--as-set", help="A quota that is again as the settings have it; can be repeated."),
]


@app.command()
def add(
    name: Name,
    role: RoleOption = Role.DESIGNER,
    cases: Cases = None,
    storage: Storage = None,
    checks: Checks = None,
    db: Database = None,
) -> None:
    """Add a user, who logs in with a token (`sprag admin token create --user`) or through a trusted proxy."""
    with users_of(db) as store:
        record = store.people.add_user(user_name(name, "NAME"), role or Role.DESIGNER, _quota(cases, storage, checks))
    _show(
        store,
        record,
        _(
            "{name} is a user: {role}; every request to a service of this database now needs a token, which `sprag "
            "admin token create --user {name} --name PURPOSE` prints",
            name=record.name,
            role=record.role,
        ),
    )


@app.command("list")
def list_users(db: Database = None) -> None:
    """List all users with their roles, their quotas and the use of the quotas."""
    with users_of(db) as store:
        found = [(record, store.people.usage(record.name)) for record in store.people.users()]
        where = {"database": store.session.location}
    if wants_json():
        write_json({**where, "users": [{**_json(u), "cases": used.cases, "bytes": used.bytes} for u, used in found]})
        return
    limit = _("limit")
    waiting, size, checks = _("cases waiting"), _("bytes"), _("checks")
    headings = (_("name"), _("role"), waiting, limit, size, limit, checks, _("removed"))
    rows = [
        (
            *(u.name, u.role, used.cases, u.quota.cases, used.bytes, u.quota.bytes, u.quota.checks),
            time_text(_json(u)["removed_at"]),
        )
        for u, used in found
    ]
    show_table("", [(head, 2 <= place <= 6, place == 0) for place, head in enumerate(headings)], rows)


@app.command()
def change(
    name: Known,
    role: RoleOption = None,
    cases: Cases = None,
    storage: Storage = None,
    checks: Checks = None,
    as_set: AsSet = None,
    db: Database = None,
) -> None:
    """Change the role or the quotas of a user, within two seconds; options that are not given keep their values."""
    if role is None and cases is None and storage is None and checks is None and not as_set:
        raise WrongInputError(
            "invalid-parameter", _("nothing to change; `sprag admin user change --help` lists the options")
        )
    with users_of(db) as store:
        quota, known = _quota(cases, storage, checks), user_of(store.people, name)
        again = ["bytes" if limit is Limit.STORAGE else limit.value for limit in as_set or ()]
        record = store.people.change_user(known, role, quota, as_set=again)
    _show(store, record, _("{name} is changed: {role}", name=record.name, role=record.role))


@app.command()
def remove(name: Known, db: Database = None) -> None:
    """Remove a user, whose tokens and sessions end within two seconds; studies and schedules are kept."""
    with users_of(db) as store:
        record = store.people.change_user(user_of(store.people, name), removed=True)
    _show(
        store,
        record,
        _("{name} is removed; `sprag admin user hand-over` gives what they owned to another user", name=record.name),
    )


@app.command()
def restore(name: Known, db: Database = None) -> None:
    """Let a removed user in again, with the same tokens."""
    with users_of(db) as store:
        known = user_of(store.people, name)
        removed = any(user.name == known and user.removed_at is not None for user in store.people.users())
        record = store.people.change_user(known, removed=False)
    values = {"name": record.name, "role": record.role}
    again = _("{name} is a user again: {role}", **values)
    _show(store, record, again if removed else _("{name} is not removed, so nothing has changed: {role}", **values))


@app.command("hand-over")
def hand_over(
    name: Known,
    to: Annotated[
        str,
        typer.Option(
            "--to",
            metavar="NAME",
            help="The user to whom they belong from now on.",
            autocompletion=completion.users,
        ),
    ],
    db: Database = None,
) -> None:
    """Give the studies and schedules of one user to another."""
    with users_of(db) as store:
        name, to = user_of(store.people, name), user_of(store.people, to, "--to")
        studies, schedules = store.people.hand_over(name, to)
    if wants_json():
        write_json({"database": store.session.location, "studies": studies, "schedules": schedules})
    else:
        counts = {"studies": studies, "schedules": schedules}
        say(_("{studies} studies and {schedules} schedules of {name} belong to {to} now", name=name, to=to, **counts))


@contextmanager
def users_of(db: str | None) -> Iterator[Store]:
    """The store of a database; an unknown user, one who exists already, and a wrong name are wrong input."""
    from sprag_study.service.storage.errors import UserExistsError, UserNotFoundError

    with named_store(db) as store:
        try:
            yield store
        except WrongInputError:
            raise
        except UserNotFoundError as error:
            raise WrongInputError("user-not-found", str(error)) from error
        except UserExistsError as error:
            raise WrongInputError("user-exists", str(error)) from error
        except FaultError as error:
            named = [replace(it, where=f"--{it.where}") if it.where in _OPTIONS else it for it in error.faults]
            raise WrongInputError("invalid-parameter", error.detail, named) from error


def _quota(cases: int | None, storage: int | None, checks: int | None) -> Quota:
    from sprag_study.service.storage.people.people import Quota

    return Quota(cases, None if storage is None else storage * 2**20, checks)


def _show(store: Store, record: UserRecord, sentence: str) -> None:
    if wants_json():
        write_json({"database": store.session.location, **_json(record)})
    else:
        say(sentence)


def _json(record: UserRecord) -> dict[str, Any]:
    from sprag_study.service.json_text import timestamp

    return {
        "name": record.name,
        "role": record.role.value,
        "created_at": timestamp(record.created_at),
        "removed_at": None if record.removed_at is None else timestamp(record.removed_at),
        "most_cases": record.quota.cases,
        "most_bytes": record.quota.bytes,
        "most_checks": record.quota.checks,
    }
