"""Scopes of tokens, apart from their storage, so that the command line starts without the database."""

from enum import StrEnum


class TokenScope(StrEnum):
    """Scope of a token: read everything, or also change it."""

    READ = "read"
    WRITE = "write"
