"""``sprag admin user``: add, list, change and remove users, of a service or of a database."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any, Final, Protocol

import typer

from sprag_study.service.actor import Role
from sprag_study.service.cli import completion
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import (
    CommandFailureError,
    WrongInputError,
    say,
    show_table,
    table_words,
    time_text,
    write_json,
)
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.names import user_of
from sprag_study.service.cli.options import Database
from sprag_study.service.cli.remote import connection
from sprag_study.service.cli.stores import asks_service, named_store
from sprag_study.service.faults import FaultError
from sprag_study.service.languages import _
from sprag_study.service.storage.people.scopes import require_one_limit, user_name

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from sprag_study.service.answers.people import CreatedToken, HandedOver, Token, User
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
    with users_at(db) as (users, where):
        user = users.add_user(user_name(name, "NAME"), role or Role.DESIGNER, **_limits(cases, storage, checks))
    said = {"name": user["name"], "role": user["role"]}
    if "server" in where:
        _show(where, user, _("{name} is a user: {role}; the page Users and tokens creates tokens", **said))
        return
    _show(
        where,
        user,
        _(
            "{name} is a user: {role}; every request to a service of this database now needs a token, which `sprag "
            "admin token create --user {name} --name PURPOSE` prints",
            **said,
        ),
    )


@app.command("list")
def list_users(db: Database = None) -> None:
    """List all users with their roles, their quotas and the use of the quotas."""
    with users_at(db) as (users, where):
        listed = users.users()
    if wants_json():
        write_json({**where, "users": [{**_json(user), **_used(user)} for user in listed]})
        return
    with table_words():
        limit = _("limit")
        waiting, size, checks = _("cases waiting"), _("bytes"), _("checks")
        headings = (_("name"), _("role"), waiting, limit, size, limit, checks, _("removed"))
        rows = []
        for user in listed:
            used = _used(user)
            limits = used["cases"], user["most_cases"], used["bytes"], user["most_bytes"], user["most_checks"]
            rows.append((user["name"], user["role"], *limits, time_text(_json(user)["removed_at"])))
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
    with users_at(db) as (users, where):
        limits = _limits(cases, storage, checks, as_set or ())
        fields = {} if role is None else {"role": str(role)}
        user = users.change_user(user_of(names_of(users), name), **fields, **limits)
    _show(where, user, _("{name} is changed: {role}", name=user["name"], role=user["role"]))


@app.command()
def remove(name: Known, db: Database = None) -> None:
    """Remove a user, whose tokens and sessions end within two seconds; studies and schedules are kept."""
    with users_at(db) as (users, where):
        user = users.change_user(user_of(names_of(users), name), removed=True)
    _show(
        where,
        user,
        _("{name} is removed; `sprag admin user hand-over` gives what they owned to another user", name=user["name"]),
    )


@app.command()
def restore(name: Known, db: Database = None) -> None:
    """Let a removed user in again, with the same tokens."""
    with users_at(db) as (users, where):
        before = {user["name"]: user for user in users.users()}
        known = user_of(before, name)
        removed = known in before and before[known]["removed_at"] is not None
        user = users.change_user(known, removed=False)
    values = {"name": user["name"], "role": user["role"]}
    again = _("{name} is a user again: {role}", **values)
    _show(where, user, again if removed else _("{name} is not removed, so nothing has changed: {role}", **values))


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
    with users_at(db) as (users, where):
        names = names_of(users)
        name, to = user_of(names, name), user_of(names, to, "--to")
        counts = users.hand_over_user(name, to)
    if wants_json():
        write_json({**where, **counts})
    else:
        say(_("{studies} studies and {schedules} schedules of {name} belong to {to} now", name=name, to=to, **counts))


class Users(Protocol):
    """The users and tokens of a service, or of a database."""

    def users(self) -> list[User]:
        """Every user, by name."""

    def add_user(self, name: str, role: str = ..., **limits: int | None) -> User:
        """Add a user."""

    def change_user(self, name: str, **fields: Any) -> User:
        """Change the given fields of a user."""

    def hand_over_user(self, name: str, to: str) -> HandedOver:
        """Give what belongs to a user to another."""

    def tokens(self) -> list[Token]:
        """Every token, newest first."""

    def create_token(
        self, name: str, *, user: str | None = ..., scope: str = ..., days: int | None = ...
    ) -> CreatedToken:
        """Create a token."""

    def revoke_token(self, token_id: str) -> Token:
        """Revoke a token."""


@contextmanager
def users_at(db: str | None) -> Iterator[tuple[Users, dict[str, str]]]:
    """The users of the service or of the database, and which it is; errors as of `users_of`, and of a service."""
    if asks_service(db):
        with _naming_options(), connection() as client:
            if not wants_json():
                say(_("service {address}:", address=client.server))
            yield client, {"server": client.server}
        return
    from sprag_study.service.jobs.users import StoredUsers

    with users_of(db) as store:
        store.people.most_tokens = read_settings().user_tokens
        yield StoredUsers(store.people), {"database": store.session.location}


@contextmanager
def users_of(db: str | None) -> Iterator[Store]:
    """The store of a database; an unknown user, one who exists already, and a wrong name are wrong input."""
    from sprag_study.service.storage.errors import TokenNotFoundError, UserExistsError, UserNotFoundError

    with _naming_options(), named_store(db) as store:
        try:
            yield store
        except UserNotFoundError as error:
            raise WrongInputError("user-not-found", str(error)) from error
        except UserExistsError as error:
            raise WrongInputError("user-exists", str(error)) from error
        except TokenNotFoundError as error:
            raise WrongInputError("token-not-found", str(error)) from error


@contextmanager
def _naming_options() -> Iterator[None]:
    """What is wrong with a parameter is wrong input, and said of its option."""
    try:
        yield
    except CommandFailureError:
        raise
    except FaultError as error:
        named = [replace(it, where=f"--{it.where}") if it.where in _OPTIONS else it for it in error.faults]
        raise WrongInputError("invalid-parameter", error.detail, named) from error


def _limits(
    cases: int | None, storage: int | None, checks: int | None, as_set: Collection[Limit] = ()
) -> dict[str, int | None]:
    """The limits that are given, by the names of their fields; None for one that is again as set for all users."""
    numbers = {"cases": cases, "bytes": None if storage is None else storage * 2**20, "checks": checks}
    given: dict[str, int | None] = {name: number for name, number in numbers.items() if number is not None}
    again = ["bytes" if limit is Limit.STORAGE else limit.value for limit in as_set]
    require_one_limit(given, again)
    return {f"most_{name}": number for name, number in {**given, **dict.fromkeys(again)}.items()}


def names_of(users: Users) -> list[str]:
    """The names of all users."""
    return [user["name"] for user in users.users()]


def _show(where: dict[str, str], user: User, sentence: str) -> None:
    if wants_json():
        write_json({**where, **_json(user)})
    else:
        say(sentence)


def _used(user: User) -> dict[str, int]:
    return {"cases": user["quota"]["cases"], "bytes": user["quota"]["bytes"]}


def _json(user: User) -> dict[str, Any]:
    return {name: value for name, value in user.items() if name != "quota"}
