"""Which extra of the distribution brings a package that is not installed."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

#: Packages of the project: where one of these is not found, no extra helps.
_OWN: Final = frozenset({"sprag"})


class MissingExtraError(ImportError):
    """Something needs a package that the base installation does not have; ``str()`` tells how to install it."""


def command_for(missing: ModuleNotFoundError, extra: str = "server") -> str | None:
    """The command that installs what is missing; None where it is not a package of an extra."""
    package = (missing.name or "").partition(".")[0]
    return None if not package or package in _OWN else f'pip install "sprag[{extra}]"'


@contextmanager
def naming_extra(what: str, extra: str = "server") -> Iterator[None]:
    """Turn the failure to import a package into `MissingExtraError`: what needs it, and the command to install it."""
    try:
        yield
    except ModuleNotFoundError as error:
        command = command_for(error, extra)
        if command is None:
            raise
        raise MissingExtraError(f"{what} needs the package {error.name!r}: {command}", name=error.name) from error
