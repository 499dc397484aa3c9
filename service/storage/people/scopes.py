"""Scopes of tokens, names of users and tokens, limits of users, apart from their storage: the command line starts
without it.
"""

from collections.abc import Collection
from enum import StrEnum
from typing import Final

from sprag_study.service.faults import parameter_error
from sprag_study.service.languages import N_, _
from sprag_study.worker.limits import MAX_NAME_LENGTH

#: Most characters in the name of a user.
MAX_USER_NAME: Final = 80
#: Most days for which a token is valid, where it ends.
MOST_DAYS: Final = 36_500


def user_name(text: str, where: str = "name") -> str:
    """The name of a new user; raises FaultError about the parameter ``where``."""
    if not 1 <= len(text) <= MAX_USER_NAME or not text.isprintable() or text != text.strip():
        allowed = _("1 to {most} printable characters, no blank at either end", most=MAX_USER_NAME)
        raise parameter_error(where, "invalid-text", N_("is not the name of a user"), text, allowed)
    return text


def token_name(text: str, where: str = "name") -> str:
    """The name of a new token; raises FaultError about the parameter ``where``."""
    if not 1 <= len(text) <= MAX_NAME_LENGTH or not text.isprintable() or not text.strip():
        allowed = _("1 to {most} printable characters in one line", most=MAX_NAME_LENGTH)
        raise parameter_error(where, "invalid-text", N_("is not the name of a token"), text, allowed)
    return text


def require_one_limit(numbers: Collection[str], as_set: Collection[str]) -> None:
    """Raise FaultError where a limit of a user (cases, bytes, checks) is a number, and as set for all users, too."""
    for limit in as_set:
        if limit in numbers:
            where = "storage" if limit == "bytes" else limit
            raise parameter_error(where, "conflict", N_("is a number, and as set for all users: give one of them"))


class TokenScope(StrEnum):
    """Scope of a token: read everything, or also change it."""

    READ = "read"
    WRITE = "write"


class TokenState(StrEnum):
    """Whether a token lets anybody in, and if not, why."""

    VALID = "valid"
    EXPIRED = "expired"
    REVOKED = "revoked"
    USER_REMOVED = "user-removed"
