"""Which extra of the distribution installs a missing package."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from sprag_study.worker.errors import SpragError

#: Packages of the project itself, for which no extra helps.
_OWN: Final = frozenset({"sprag_study"})


class MissingExtraError(SpragError, ImportError):
    """A feature needs a package outside the base installation; ``str()`` explains how to install it."""

    code = "missing-extra"


def command_for(missing: ModuleNotFoundError, extra: str = "server") -> str | None:
    """The command that installs the missing package; None where no extra contains it."""
    package = (missing.name or "").partition(".")[0]
    return None if not package or package in _OWN else f'pip install "sprag-study[{extra}]"'


@contextmanager
def naming_extra(what: str, extra: str = "server") -> Iterator[None]:
    """Convert a failed import to `MissingExtraError`, which names the feature and the command to install the
    package.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        command = command_for(error, extra)
        if command is None:
            raise
        raise MissingExtraError(f"{what} needs the package {error.name!r}: {command}", name=error.name) from error
