"""What people name: ``latest``, an id or the beginning of one, or a name."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sprag_study.service.cli.console import WrongInputError, wrong_option
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_, _

if TYPE_CHECKING:
    from sprag_study.service.answers.people import Token
    from sprag_study.service.client import Client


def study_of(client: Client, text: str, *, deleted: bool = False) -> str:
    """The id of the study that is meant, as the client finds it; WrongInputError where several fit or none is named."""
    from sprag_study.service.client.synchronous import naming

    with _one("ID", text, _("the id or name of a study, or latest"), _("the study is not unique")):
        return naming.study_of(client, text, deleted=deleted)


def schedule_of(client: Client, text: str) -> str:
    """The id of the schedule that is meant; errors as of `study_of`."""
    from sprag_study.service.client.synchronous import naming

    with _one("ID", text, _("the id or name of a schedule"), _("the schedule is not unique")):
        return naming.schedule_of(client, text)


def token_of(tokens: Iterable[Token], text: str) -> str:
    """The id of the token that is meant, of one that is revoked by its id only; errors as of `study_of`."""
    from sprag_study.service.client.matching import Named, meant

    with _one("ID", text, _("the id or name of a token"), _("the token is not unique")):
        named = [Named(t["id"], t["name"], f"{t['id']} ({t['name']})") for t in tokens if t["state"] != "revoked"]
        return meant(text, named, "tokens", "tk_")


def user_of(names: Iterable[str], text: str, where: str = "NAME") -> str:
    """The one of the ``names`` of users that is meant by ``where`` of a command; errors as of `study_of`."""
    from sprag_study.service.client.matching import Named, meant

    with _one(where, text, _("the name of a user"), _("the user is not unique")):
        return meant(text, [Named(name, name, name) for name in names], "users")


@contextmanager
def _one(where: str, text: str, allowed: str, several: str) -> Iterator[None]:
    """WrongInputError for an empty text, and where several fit."""
    from sprag_study.service.client import AmbiguousError

    if not text.strip():
        raise wrong_option(where, "required", N_("must not be empty"), text, allowed=allowed)
    try:
        yield
    except AmbiguousError as error:
        faults = [Fault(where, fault.code, fault.message, fault.value, fault.allowed) for fault in error.faults]
        raise WrongInputError("invalid-parameter", several, faults) from error
