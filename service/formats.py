"""Formats of whole studies: names, media types, endings of files. Server and client agree on them here."""

from __future__ import annotations

from typing import Final, Literal, get_args

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
#: Formats of a study's report.
ReportFormat = Literal["html", "pdf"]
REPORT_FORMATS: Final[tuple[ReportFormat, ...]] = get_args(ReportFormat)
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
