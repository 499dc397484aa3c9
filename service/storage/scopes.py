"""What tokens allow; apart from their storage, so that the command line starts without the database."""

from enum import StrEnum


class TokenScope(StrEnum):
    """What a token allows: to look at everything, or also to change it."""

    READ = "read"
    WRITE = "write"
