"""All rows of a study as a file, in every format people work with, written piece by piece, however many there are.

CSV, JSON and JSON lines (`text`), Parquet and Arrow (`arrow`), spreadsheets (`xlsx`), labelled grids (`netcdf`).
Reading the numbers gives the same doubles back; what could not be computed is empty, null or NaN, never 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, Literal, get_args

from service.exports.source import Source
from service.exports.text import csv_pieces, escape, json_lines_pieces, json_pieces, row_json, rows_json, table_csv

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
    "table_csv",
]

Format = Literal["csv", "json", "jsonl", "parquet", "arrow", "xlsx", "netcdf"]
FORMATS: Final[tuple[Format, ...]] = get_args(Format)
MEDIA_TYPES: Final[dict[Format, str]] = {
    "csv": "text/csv; charset=utf-8",
    "json": "application/json",
    "jsonl": "application/x-ndjson",
    "parquet": "application/vnd.apache.parquet",
    "arrow": "application/vnd.apache.arrow.stream",
    "xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    "netcdf": "application/x-netcdf",
}
#: How the name of a file in each format ends; the first ending is the one that is given.
SUFFIXES: Final[dict[Format, tuple[str, ...]]] = {
    "csv": ("csv",),
    "json": ("json",),
    "jsonl": ("jsonl", "ndjson"),
    "parquet": ("parquet",),
    "arrow": ("arrows", "arrow"),
    "xlsx": ("xlsx",),
    "netcdf": ("nc", "netcdf"),
}


def format_of(file: str) -> Format | None:
    """The format that the ending of a file's name tells; None when it tells none."""
    ending = file.rpartition(".")[2].lower()
    return next((form for form, endings in SUFFIXES.items() if ending in endings), None)


def export(source: Source, form: Format) -> Iterator[bytes]:
    """The file in pieces, each of about one block of rows. Libraries are loaded for the format that is asked for."""
    if form == "csv":
        return csv_pieces(source)
    if form == "json":
        return json_pieces(source)
    if form == "jsonl":
        return json_lines_pieces(source)
    if form == "parquet":
        from service.exports.arrow import parquet_pieces

        return parquet_pieces(source)
    if form == "arrow":
        from service.exports.arrow import arrow_pieces

        return arrow_pieces(source)
    if form == "xlsx":
        from service.exports.xlsx import xlsx_pieces

        return xlsx_pieces(source)
    from service.exports.netcdf import netcdf_pieces

    return netcdf_pieces(source)
