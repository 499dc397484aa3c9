"""All rows of a study as a file, in all common formats, written piece by piece for any number of rows.

CSV, JSON and JSON lines (`text`), Parquet and Arrow (`arrow`), spreadsheets (`xlsx`), labelled grids (`netcdf`).
Numbers read back as the same doubles; values that could not be computed are empty, null or NaN, never 0.
"""

from __future__ import annotations

from collections.abc import Iterator

from sprag.service.formats import FORMATS, MEDIA_TYPES, SUFFIXES, Format, format_of
from sprag.service.results.exports.source import Source, stored
from sprag.service.results.exports.text import (
    csv_pieces,
    escape,
    json_lines_pieces,
    json_pieces,
    row_json,
    rows_json,
    table_csv,
)

__all__ = [
    "FORMATS",
    "MEDIA_TYPES",
    "SUFFIXES",
    "Format",
    "Source",
    "csv_pieces",
    "escape",
    "export",
    "format_of",
    "json_lines_pieces",
    "json_pieces",
    "row_json",
    "rows_json",
    "stored",
    "table_csv",
]


def export(source: Source, form: Format) -> Iterator[bytes]:
    """The file in pieces of about one block of rows. Only the libraries of the requested format are loaded."""
    if form == "csv":
        return csv_pieces(source)
    if form == "json":
        return json_pieces(source)
    if form == "jsonl":
        return json_lines_pieces(source)
    if form == "parquet":
        from sprag.service.results.exports.arrow import parquet_pieces

        return parquet_pieces(source)
    if form == "arrow":
        from sprag.service.results.exports.arrow import arrow_pieces

        return arrow_pieces(source)
    if form == "xlsx":
        from sprag.service.results.exports.xlsx import xlsx_pieces

        return xlsx_pieces(source)
    from sprag.service.results.exports.netcdf import netcdf_pieces

    return netcdf_pieces(source)
