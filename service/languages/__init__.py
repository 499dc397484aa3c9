"""The languages in which people read pages, reports and the command line.

English texts stand in the code and are the keys of the catalogues (``uk.po`` beside this module, one file for each
further language). The language of a task is a context variable, English unless somebody chose another one, so that
JSON, files, logs and the API are English. docs/languages.md tells how to add a language, docs/architecture.md how to
add a text.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import Final

from sprag_study.service.languages.catalogue import Catalogue, read

ENGLISH: Final = "en"
FOLDER: Final = Path(__file__).parent
_SEPARATED: Final = 10_000
_LANGUAGE: ContextVar[str] = ContextVar("language", default=ENGLISH)

__all__ = [
    "ENGLISH",
    "FOLDER",
    "N_",
    "_",
    "available",
    "catalogue",
    "current",
    "date_format",
    "decimal",
    "gettext",
    "grouped",
    "language",
    "ngettext",
    "pgettext",
    "titles",
    "use",
]


@cache
def available() -> tuple[str, ...]:
    """Codes of the languages (ISO 639), English first."""
    return (ENGLISH, *sorted(file.stem for file in FOLDER.glob("*.po")))


@cache
def catalogue(code: str) -> Catalogue:
    """The texts of a language other than English; read at the first use."""
    return read(FOLDER / f"{code}.po")


def current() -> str:
    """The code of the language of this task."""
    return _LANGUAGE.get()


def use(code: str) -> None:
    """Use a language from here on in this task; English where there is no such language."""
    _LANGUAGE.set(code if code in available() else ENGLISH)


@contextmanager
def language(code: str) -> Iterator[None]:
    """Use a language within the block; English where there is no such language."""
    token = _LANGUAGE.set(code if code in available() else ENGLISH)
    try:
        yield
    finally:
        _LANGUAGE.reset(token)


def gettext(message: str, /, **values: object) -> str:
    """``message`` in the language of the task, English where it is not in the catalogue.

    ``values`` replace ``{name}`` in it, by `str.format`; without values braces stay as they are.
    """
    return _filled(message if current() == ENGLISH else catalogue(current()).text(message), values)


def pgettext(context: str, message: str, /, **values: object) -> str:
    """`gettext` for a text that means different things in different places, such as "Open" or "."."""
    return _filled(message if current() == ENGLISH else catalogue(current()).text(message, context), values)


def ngettext(one: str, many: str, number: float, /, **values: object) -> str:
    """The form of a text that goes with ``number``; English has two, other languages up to six."""
    if current() == ENGLISH:
        return _filled(one if number == 1 else many, values)
    return _filled(catalogue(current()).plural(one, many, number), values)


def _filled(text: str, values: dict[str, object]) -> str:
    return text.format(**values) if values else text


def N_(message: str) -> str:  # noqa: N802 - the usual name
    """Mark a text for the catalogues that is translated where it is shown."""
    return message


_ = gettext


def decimal(text: str) -> str:
    """A number written with a decimal point, with the decimal mark of the language."""
    mark = pgettext("decimal mark", ".")
    return text if mark == "." else text.replace(".", mark)


def grouped(count: int) -> str:
    """A whole number with thousands separated by narrow spaces, as in ISO 80000: a comma would be a decimal mark.

    Numbers of four digits are not separated: 9000, but 10 000.
    """
    return f"{count:,}".replace(",", "\N{NARROW NO-BREAK SPACE}") if abs(count) >= _SEPARATED else str(count)


def date_format() -> str:
    """How a date is written, as `datetime.strftime` takes it."""
    return pgettext("date", "%Y-%m-%d")


@cache
def titles() -> dict[str, str]:
    """Code of each language, and what it is called in itself."""
    names = {}
    for code in available():
        with language(code):
            names[code] = pgettext("name of this language", "English")
    return names
