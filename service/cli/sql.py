"""``sprag show SPEC|ID sql STATEMENT``: SQL over the rows of a study, run here or of a running service."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sprag_study.service.cli.case_views import say_file
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import WrongInputError, heading, show_table, write_json
from sprag_study.service.cli.described import parameter, signed
from sprag_study.service.cli.file_formats import file_format, require_csv
from sprag_study.service.cli.files import write_pieces
from sprag_study.service.cli.options import OF_SPEC, SHARED
from sprag_study.service.cli.remote import opened
from sprag_study.service.cli.sources import SpecOrStudy

if TYPE_CHECKING:
    from sprag_study.service.formats import Decimal

_Statement = Annotated[
    str,
    typer.Argument(
        metavar="STATEMENT",
        help="A SELECT of DuckDB over the table `cases`; names with points stand in double quotes.",
    ),
]

_SHARED: Final = ("file", "units", "decimal", *OF_SPEC)


def _sql(
    study: str, statement: str, file: str | None, units: str | None, decimal: Decimal | None,
    points_file: str | None, tables: list[str] | None, db: str | None,
) -> None:  # fmt: skip
    from sprag_study.service.client import Study
    from sprag_study.service.client.errors import StatementError
    from sprag_study.service.client.statements import CASES, read_only, selected

    form = None if file is None else file_format(file, ("csv",))
    require_csv(None, decimal, form)
    try:
        read_only(statement)  # before anything is run
        with opened(study, points=points_file, tables=tables, db=db) as (source, study_id):
            parquet = Study(source, study_id).download("parquet", units)
        frame: Any = selected(statement, {CASES: parquet}, polars=False)
    except StatementError as error:
        raise WrongInputError("invalid-parameter", str(error)) from error
    _show(frame, file, form, decimal)


def _show(frame: Any, file: str | None, form: str | None, decimal: Decimal | None) -> None:
    heads = {name: heading(name, frame.attrs["units"].get(name, "1")) for name in frame.columns}
    rows = [[_plain(cell) for cell in row] for row in frame.astype(object).itertuples(index=False)]
    if file is not None and form is not None:
        from sprag_study.service.exports.decimal_commas import with_decimals
        from sprag_study.service.exports.text import table_csv

        table = table_csv(heads.values(), [map(_text, frame[name]) for name in frame.columns])
        write_pieces(file, with_decimals([table], decimal))
        say_file(file, form)
    if wants_json():
        columns = [{"name": name, "unit": frame.attrs["units"].get(name)} for name in frame.columns]
        write_json({"columns": columns, "rows": rows})
    elif file is None:
        numeric = [kind.kind in "iuf" for kind in frame.dtypes]
        show_table("", list(zip(heads.values(), numeric, strict=True)), [[_text(cell) for cell in row] for row in rows])


def _plain(cell: Any) -> Any:
    """A cell as JSON data: None where it has no value, and a text where it is neither number, text nor list."""
    plain = cell.tolist() if hasattr(cell, "tolist") else cell
    if isinstance(plain, list | tuple):
        return [_plain(item) for item in plain]
    if isinstance(plain, float):
        return plain if math.isfinite(plain) else None
    if plain is None or plain != plain:  # noqa: PLR0124 - a missing time
        return None
    return plain if isinstance(plain, str | int) else str(plain)


def _text(cell: Any) -> Any:
    """A cell for tables: the items of a list behind each other, as they show flags."""
    plain = cell.tolist() if hasattr(cell, "dtype") else cell
    return ", ".join(map(str, plain)) if isinstance(plain, list) else cell


sql = signed(
    _sql,
    "What a statement of SQL selects from the rows of a study, whose columns are those of its tables.",
    [
        parameter("study", SpecOrStudy, ...), parameter("statement", _Statement, ...),
        *(parameter(name, SHARED[name], None) for name in _SHARED),
    ],
)  # fmt: skip
