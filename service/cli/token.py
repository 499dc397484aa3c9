"""``sprag admin token``: create, list and revoke tokens, of a service or of a database."""

from __future__ import annotations

import secrets
from typing import Annotated, Final

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import agreed, say, show_table, table_words, time_text, write_json
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.names import token_of, user_of
from sprag_study.service.cli.options import Database
from sprag_study.service.cli.user import names_of, users_at
from sprag_study.service.languages import N_, _
from sprag_study.service.storage.people.scopes import MOST_DAYS, TokenScope, TokenState, token_name

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
            autocompletion=completion.users,
        ),
    ] = None,
    expires: Annotated[
        int | None,
        typer.Option(
            "--expires", metavar="DAYS", min=1, max=MOST_DAYS, help="Days for which it is valid; default: always."
        ),
    ] = None,
    db: Database = None,
) -> None:
    """Create a token and print it; only its digest is stored, so it cannot be shown again."""
    with users_at(db) as (people, where):
        name = token_name(name, "--name")
        owner = None if user is None else user_of(names_of(people), user, "--user")
        made = people.create_token(name, user=owner, scope=scope.value, days=expires)
    if wants_json():
        write_json({**where, **made})
        return
    print(made["token"])
    once = _("It is shown only once; every request to a service of this database now needs a token.")
    say(f"{made['id']}: {made['name']}, {made['scope']}. {_('It is shown only once.') if 'server' in where else once}")


@app.command("list")
def list_tokens(db: Database = None) -> None:
    """List all tokens with owner, state, expiry and last use, newest first, without their secrets."""
    with users_at(db) as (people, where):
        listed = people.tokens()
    if wants_json():
        write_json({**where, "tokens": listed})
        return
    with table_words():
        times = (_("created"), _("expires"), _("used"), _("revoked"))
        heads = (_("id"), _("name"), _("user"), _("scope"), _("state"), *times)
        columns = [(head, False, place == 0) for place, head in enumerate(heads)]
        rows = []
        for it in listed:
            moments = (it["created_at"], it["expires_at"], it["used_at"], it["revoked_at"])
            state = _(_STATES[TokenState(it["state"])])
            rows.append((it["id"], it["name"], it["user"], it["scope"], state, *map(time_text, moments)))
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
    with users_at(db) as (people, where):
        listed = people.tokens()
        known = token_of(listed, token_id)
        name = next((it["name"] for it in listed if it["id"] == known), known)
        if not agreed(_("Revoke the token {name} ({token})?", name=name, token=known), yes=yes):
            say(_("nothing is revoked"))
            return
        gone = people.revoke_token(known)
    if wants_json():
        write_json({**where, **gone})
    else:
        say(_("{token} ({name}) is revoked", token=gone["id"], name=gone["name"]))
