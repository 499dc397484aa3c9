"""``sprag export``: the rows of a study, or its report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, get_args

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import say, write_json, wrong_option
from sprag_study.service.cli.described import option, parameter, query_of, signed
from sprag_study.service.cli.file_formats import TableFormat, TableFormOption, require_csv, table_format
from sprag_study.service.cli.files import to_file, write_pieces
from sprag_study.service.cli.options import (
    CsvDecimal,
    CsvHeader,
    FileUnits,
    KeptIn,
    OutputFile,
    in_language,
    in_units,
)
from sprag_study.service.cli.remote import opened
from sprag_study.service.cli.sources import SpecOrStudy
from sprag_study.service.formats import Format
from sprag_study.service.languages import N_, _
from sprag_study.service.views.setting import settings_of
from sprag_study.service.views.study_questions import ReportQuestion

if TYPE_CHECKING:
    from sprag_study.service.formats import Decimal, Header

#: What a report says; the curves of its figures are chosen by saved views.
_ASKED: Final = tuple(
    one for one in settings_of(ReportQuestion) if one.name not in ("x", "y", "by", "at", "of", "curve")
)


def _export(
    study: str, form: TableFormat | None, file: str | None, units: str | None, header: Header | None,
    decimal: Decimal | None, db: str | None, **asked: Any,
) -> None:  # fmt: skip
    from sprag_study.service.client.wire import study_path

    chosen = table_format(form, file)
    require_csv(header, decimal, chosen)
    given = query_of(_ASKED, asked)
    table = chosen in get_args(Format)
    if table and given:
        raise wrong_option(f"--{given[0][0]}", "not-used", N_("only reports have it"), given[0][1], allowed="pdf, html")
    settings_given = [(name, value) for name, value in (("header", header), ("decimal", decimal)) if value is not None]
    query = [*in_units(units), *given, *settings_given, *(() if table else in_language())]
    with opened(study, db=db, units=units) as (source, study_id):
        path = study_path(study_id)
        report = f"{path}/report", [*query, ("format", chosen)]
        with source.rows(path, chosen, query) if table else source.pieces(*report) as pieces:
            written = write_pieces(file, pieces)
    if to_file(file):
        say(_("{file}: {size} bytes", file=file, size=written))
        if wants_json():
            write_json({"file": file, "format": chosen, "bytes": written})


export: Final = signed(
    _export,
    "Write all case rows of a study, or a report of it, to a file or to standard output. A spec is run here first.\n\n"
    "What a report says and draws is for --format pdf or html.",
    [
        parameter("study", SpecOrStudy, ...), parameter("form", TableFormOption, None),
        parameter("file", OutputFile, None), parameter("units", FileUnits, None), parameter("header", CsvHeader, None),
        parameter("decimal", CsvDecimal, None), parameter("db", KeptIn, None),
        *(parameter(one.name, option(one), one.default) for one in _ASKED),
    ],
)  # fmt: skip
