"""Scopes of tokens and names of users, apart from their storage, so that the command line starts without it."""

from enum import StrEnum
from typing import Final

#: Most characters in the name of a user.
MAX_USER_NAME: Final = 80


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
