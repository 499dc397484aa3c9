"""``sprag admin token``: create, list and revoke tokens."""

from __future__ import annotations

import secrets
from datetime import UTC, timedelta
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import WrongInputError, agreed, say, show_table, table_words, write_json
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.names import token_of, user_of
from sprag_study.service.cli.options import Database
from sprag_study.service.cli.user import users_of
from sprag_study.service.languages import N_, _
from sprag_study.service.storage.people.scopes import TokenScope, TokenState, token_name

if TYPE_CHECKING:
    from datetime import datetime

    from sprag_study.service.storage.people.people import TokenRecord

_STATES: Final = {
    TokenState.VALID: N_("valid"),
    TokenState.EXPIRED: N_("expired"),
    TokenState.REVOKED: N_("revoked"),
    TokenState.USER_REMOVED: N_("its user is removed"),
}

app = typer.Typer(
    help="Create, list and revoke tokens; without a command: print a secret for SPRAG_TOKEN.",
    invoke_without_command=True,
    cls=Groups,
)


@app.callback()
def token(context: typer.Context) -> None:
    """Create, list and revoke tokens; without a command: print a secret for SPRAG_TOKEN, which is not stored."""
    if context.invoked_subcommand is not None:
        return
    made = secrets.token_urlsafe(32)
    if wants_json():
        write_json({"token": made})
    else:
        print(made)


@app.command()
def create(
    name: Annotated[str, typer.Option("--name", metavar="TEXT", help="Owner or purpose of the token.")],
    scope: Annotated[
        TokenScope, typer.Option("--scope", help="read: read everything; write: change it too.")
    ] = TokenScope.WRITE,
    user: Annotated[
        str | None,
        typer.Option(
            "--user",
            metavar="NAME",
            help="User to whom the token belongs; default: none.",
            autocompletion=completion.stored_users,
        ),
    ] = None,
    expires: Annotated[
        int | None,
        typer.Option(
            "--expires", metavar="DAYS", min=1, max=36_500, help="Days for which it is valid; default: always."
        ),
    ] = None,
    db: Database = None,
) -> None:
    """Create a token and print it; only its digest is stored, so it cannot be shown again."""
    with users_of(db) as store:
        ends = None if expires is None else store.clock.now() + timedelta(days=expires)
        owner = None if user is None else user_of([known.name for known in store.people.users()], user, "--user")
        store.people.most_tokens = read_settings().user_tokens
        secret, record = store.people.create_token(token_name(name, "--name"), scope, owner=owner, expires_at=ends)
    if wants_json():
        write_json({"database": store.session.location, "token": secret, **_json(record)})
    else:
        print(secret)
        said = _("It is shown only once; every request to a service of this database now needs a token.")
        say(f"{record.id}: {record.name}, {record.scope}. {said}")


@app.command("list")
def list_tokens(db: Database = None) -> None:
    """List all tokens with owner, state, expiry and last use, newest first, without their secrets."""
    with users_of(db) as store:
        now, users = store.clock.now(), {user.name: user for user in store.people.users()}
        records = store.people.tokens()
    states = [record.state_at(now, users.get(record.owner or "")) for record in records]
    found = [{**_json(record), "state": state.value} for record, state in zip(records, states, strict=True)]
    if wants_json():
        write_json({"database": store.session.location, "tokens": found})
        return
    fields = ("id", "name", "user", "scope", "state", "created_at", "expires_at", "used_at", "revoked_at")
    with table_words():
        times = (_("created"), _("expires"), _("used"), _("revoked"))
        heads = (_("id"), _("name"), _("user"), _("scope"), _("state"), *times)
        columns = [(head, False, place == 0) for place, head in enumerate(heads)]
        words = {state.value: _(_STATES[state]) for state in TokenState}
        rows = [[words[t[field]] if field == "state" else t[field] for field in fields] for t in found]
        show_table("", columns, rows)


@app.command()
def revoke(
    token_id: Annotated[
        str,
        typer.Argument(
            metavar="ID",
            help="Id or name of the token, or the beginning of one, as `sprag admin token list` shows them.",
            autocompletion=completion.tokens,
        ),
    ],
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask before revoking.")] = False,
    db: Database = None,
) -> None:
    """Revoke a token and end the browser sessions that it started, within two seconds; asks at a terminal."""
    from sprag_study.service.storage.errors import TokenNotFoundError

    with users_of(db) as store:
        known = token_of(store.people, token_id)
        name = next((record.name for record in store.people.tokens() if record.id == known), known)
        if not agreed(_("Revoke the token {name} ({token})?", name=name, token=known), yes=yes):
            say(_("nothing is revoked"))
            return
        try:
            record = store.people.revoke_token(known)
        except TokenNotFoundError as error:
            raise WrongInputError("token-not-found", str(error)) from error
    if wants_json():
        write_json({"database": store.session.location, **_json(record)})
    else:
        say(_("{token} ({name}) is revoked", token=record.id, name=record.name))


def _json(record: TokenRecord) -> dict[str, Any]:
    return {
        "id": record.id,
        "name": record.name,
        "user": record.owner,
        "scope": record.scope.value,
        "created_at": _text(record.created_at),
        "expires_at": _text(record.expires_at),
        "used_at": _text(record.used_at),
        "revoked_at": _text(record.revoked_at),
    }


def _text(moment: datetime | None) -> str | None:
    return None if moment is None else moment.astimezone(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
