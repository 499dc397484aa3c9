"""Formats of whole studies, shared by server and client: names, media types, file endings."""

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
#: Heads of the columns of CSV: names, with the unit where it is not SI, or names with every unit.
Header = Literal["names", "units"]
HEADERS: Final[tuple[Header, ...]] = get_args(Header)
#: Decimal signs of CSV: a point, or a comma, with semicolons between the columns and a byte order mark.
Decimal = Literal["point", "comma"]
DECIMALS: Final[tuple[Decimal, ...]] = get_args(Decimal)
#: Attribute of the variables of a NetCDF file with the name that they have everywhere else, such as shaft.speed.mean.
NAME_ATTRIBUTE: Final = "sprag_name"
#: Formats of a study's report.
ReportFormat = Literal["html", "pdf"]
REPORT_FORMATS: Final[tuple[ReportFormat, ...]] = get_args(ReportFormat)
#: Formats of pictures.
Picture = Literal["svg", "png", "pdf"]
PICTURES: Final[tuple[Picture, ...]] = get_args(Picture)
#: File endings of each format; the first one is used for writing.
SUFFIXES: Final[dict[Format, tuple[str, ...]]] = {
    "csv": ("csv",),
    "json": ("json",),
    "jsonl": ("jsonl", "ndjson"),
    "parquet": ("parquet",),
    "arrow": ("arrows", "arrow"),
    "xlsx": ("xlsx",),
    "netcdf": ("nc", "netcdf"),
}


def format_of(file: str) -> Format | ReportFormat | None:
    """The format of rows or a report by the ending of a file's name; None for an unknown ending."""
    ending = file.rpartition(".")[2].lower()
    report = next((form for form in REPORT_FORMATS if form == ending), None)
    return report or next((form for form, endings in SUFFIXES.items() if ending in endings), None)
