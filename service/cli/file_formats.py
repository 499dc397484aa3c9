"""Formats of the files that commands write: by name, by the ending of the file's name, or by ``--json``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath
from typing import Annotated, Final, Literal

import typer

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import WrongInputError, wrong_option
from sprag_study.service.cli.files import to_file
from sprag_study.service.formats import REPORT_FORMATS, SUFFIXES, Decimal, Format, Header, ReportFormat, format_of
from sprag_study.service.languages import N_, _

#: Formats of a whole study: case rows (`sprag_study.service.exports`) and documents (`sprag_study.service.report`).
TableFormat = Literal[Format, ReportFormat]
TableFormOption = Annotated[
    TableFormat | None, typer.Option("--format", help="Default: by the ending of FILE; csv where it has none.")
]
#: Endings of their files.
_TABLES: Final = (*(ending for endings in SUFFIXES.values() for ending in endings), *REPORT_FORMATS)


def file_format(file: str, allowed: Sequence[str]) -> str:
    """The format given by the ending of ``file``; raises WrongInputError when it is not in ``allowed``."""
    form = file.rpartition(".")[2].lower()
    if form not in allowed:
        raise _wrong_ending(file, allowed)
    return form


def table_format(form: TableFormat | None, file: str | None) -> TableFormat:
    """The format of a whole study; WrongInputError where only the file's name tells it, by an unknown ending."""
    if form is not None:
        return form
    if file is None or not _has_ending(file):
        return "json" if wants_json() else "csv"
    found = format_of(file)
    if found is None:
        raise _wrong_ending(file, _TABLES)
    return found


def value_format(file: str | None, pictures: Sequence[str] = (), form: str | None = None) -> str:
    """The format of a view of one case: by the ending of a file, unless given; WrongInputError for an unknown one."""
    if form is not None:
        return form
    if file is not None and _has_ending(file):
        return file_format(file, ("csv", "json", *pictures))
    return "json" if wants_json() else "csv"


def require_csv(header: Header | None, decimal: Decimal | None, form: str | None) -> None:
    """Raise WrongInputError for ``--header`` or ``--decimal`` where the file is not CSV."""
    for option, value in (("--header", header), ("--decimal", decimal)):
        if value is not None and form != "csv":
            raise wrong_option(option, "not-used", N_("only CSV files have it"), value, allowed="csv")


def require_table(units: str | None, form: str | None = None) -> None:
    """Raise WrongInputError for ``--units`` where the answer is JSON and no file is written."""
    if units is not None and form is None and wants_json():
        raise wrong_option("--units", "not-used", N_("JSON is in SI units"), units, allowed=_("a table or a file"))


def require_report(appendix: Sequence[str] | None, form: str) -> None:
    """Raise WrongInputError for ``--appendix`` where the file is no report."""
    if appendix and form not in REPORT_FORMATS:
        raise wrong_option("--appendix", "not-used", N_("only reports have it"), appendix[0], allowed="pdf, html")


def _has_ending(file: str) -> bool:
    return to_file(file) and PurePath(file).suffix not in ("", ".")


def _wrong_ending(file: str, allowed: Sequence[str]) -> WrongInputError:
    endings = ", ".join(f".{name}" for name in allowed)
    message, sentence = N_("is not a file of this kind"), _("a name that ends in {endings}", endings=endings)
    return wrong_option("--output", "invalid-choice", message, file, allowed=sentence)
