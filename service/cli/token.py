"""``sprag token``: create, list and revoke tokens."""

from __future__ import annotations

import secrets
from datetime import UTC
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sprag.service.cli.console import WrongInputError, say, show_table, write_json
from sprag.service.cli.options import Database, JsonFlag
from sprag.service.cli.settings import read_settings
from sprag.service.storage.scopes import TokenScope

if TYPE_CHECKING:
    from datetime import datetime

    from sprag.service.storage.store import Store
    from sprag.service.storage.tokens import TokenRecord

app = typer.Typer(
    help="Create, list and revoke tokens; without a command: print a secret for SPRAG_TOKEN.",
    invoke_without_command=True,
    rich_markup_mode="rich",
)


@app.callback()
def token(context: typer.Context, as_json: JsonFlag = False) -> None:
    """Create, list and revoke tokens; without a command: print a secret for SPRAG_TOKEN, which is not stored."""
    if context.invoked_subcommand is not None:
        return
    made = secrets.token_urlsafe(32)
    if as_json:
        write_json({"token": made})
    else:
        print(made)


@app.command()
def create(
    name: Annotated[str, typer.Option("--name", help="Owner or purpose of the token.")],
    scope: Annotated[
        TokenScope, typer.Option("--scope", help="read: read everything; write: change it too.")
    ] = TokenScope.WRITE,
    db: Database = None,
    as_json: JsonFlag = False,
) -> None:
    """Create a token and print it; only its digest is stored, so it cannot be shown again."""
    with _store(db) as store:
        secret, record = store.create_token(name, scope)
    if as_json:
        write_json({"token": secret, **_json(record)})
    else:
        print(secret)
        say(f"{record.id}: {record.name}, {record.scope}. It is shown only once; every request now needs a token.")


@app.command("list")
def list_tokens(db: Database = None, as_json: JsonFlag = False) -> None:
    """List all tokens, newest first, without their secrets."""
    with _store(db) as store:
        found = [_json(record) for record in store.tokens()]
    if as_json:
        write_json({"tokens": found})
        return
    columns = [(heading, False, heading == "id") for heading in ("id", "name", "scope", "created", "revoked")]
    show_table("", columns, [[t["id"], t["name"], t["scope"], t["created_at"], t["revoked_at"]] for t in found])


@app.command()
def revoke(
    token_id: Annotated[str, typer.Argument(metavar="ID", help="Id of the token, as `sprag token list` shows it.")],
    db: Database = None,
    as_json: JsonFlag = False,
) -> None:
    """Revoke a token and end the browser sessions that it started, within two seconds."""
    from sprag.service.storage.errors import TokenNotFoundError

    with _store(db) as store:
        try:
            record = store.revoke_token(token_id)
        except TokenNotFoundError as error:
            raise WrongInputError("token-not-found", str(error)) from error
    if as_json:
        write_json(_json(record))
    else:
        say(f"{record.id} ({record.name}) is revoked")


def _store(db: str | None) -> Store:
    from sprag.service.storage.store import Store

    return Store.open(read_settings(database=db).database_url)


def _json(record: TokenRecord) -> dict[str, Any]:
    return {
        "id": record.id,
        "name": record.name,
        "scope": record.scope.value,
        "created_at": _text(record.created_at),
        "revoked_at": None if record.revoked_at is None else _text(record.revoked_at),
    }


def _text(moment: datetime) -> str:
    return moment.astimezone(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
