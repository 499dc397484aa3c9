"""Options that several commands share."""

from __future__ import annotations

import math
from typing import Annotated, Any, Final

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.common import CURRENT
from sprag_study.service.formats import Decimal, Header
from sprag_study.service.views.study_questions import CHAPTERS
from sprag_study.worker.limits import MAX_STARTS

SpecFile = Annotated[
    str,
    typer.Argument(metavar="SPEC", help="Study spec, JSON or TOML, or the name of a preset; - reads standard input."),
]
PointsFile = Annotated[
    str | None,
    typer.Option(
        "--points",
        metavar="FILE",
        help="CSV file of cases, instead of the spec's axes; its header names the parameters.",
    ),
]
CaseOption = Annotated[int, typer.Option("--case", min=0, metavar="N", help="Number of the case, from 0.")]
StartOption = Annotated[
    int | None,
    typer.Option("--start", min=0, max=MAX_STARTS - 1, metavar="K", help="Start of a case with many; default: 0."),
]
TableFiles = Annotated[
    list[str] | None,
    typer.Option(
        "--file",
        metavar="PLACE=FILE",
        help="CSV file in place of a table of the machine, as operation=torque.csv; may be repeated.",
    ),
]
OutputFile = Annotated[
    str | None, typer.Option("-o", "--output", metavar="FILE", help="File to write; default: standard output.")
]
CsvHeader = Annotated[
    Header | None,
    typer.Option(
        "--header", help="Heads of CSV columns: names, with units that are not SI, or every unit; default: names."
    ),
]
CsvDecimal = Annotated[
    Decimal | None,
    typer.Option(
        "--decimal", help="Decimal sign of CSV; a comma goes with semicolons and a byte order mark; default: point."
    ),
]
Appendix = Annotated[
    list[str] | None,
    typer.Option(
        "--appendix",
        metavar="CHAPTER",
        help=f"Chapter after the two pages of a report: {', '.join(CHAPTERS)}, or all; may be repeated.",
    ),
]
FileUnits = Annotated[
    str | None,
    typer.Option(
        "--units",
        metavar="UNITS",
        help='Units of tables: si, typed (those of the spec), or a list such as "rpm, mm, torque=N*mm"; default: SI.',
    ),
]
StudyId = Annotated[
    str,
    typer.Argument(
        metavar="ID",
        help="Id or name of the study, or the beginning of one; latest: the newest.",
        autocompletion=completion.studies,
    ),
]
CurveBy = Annotated[
    list[str] | None,
    typer.Option(
        "--by",
        metavar="PATH",
        help="Axis with one curve for each value; may be repeated.",
        autocompletion=completion.parameters,
    ),
]
Database = Annotated[
    str | None,
    typer.Option(
        "--db",
        metavar="URL",
        help="Database: path of an SQLite file or SQLAlchemy URL; default: SPRAG_DATABASE, or `sprag.sqlite3` in the "
        "user's data directory.",
    ),
]
KeptIn = Annotated[
    str | None,
    typer.Option(
        "--db",
        metavar="URL",
        help="Database to keep the study in; has the case at whose end a drive starts; default: a temporary one.",
    ),
]
Processes = Annotated[
    int | None, typer.Option("--processes", min=1, max=1024, help="Processes of the pool; default: one for each core.")
]
Fresh = Annotated[
    bool, typer.Option("--fresh", help="Run every case, including those that other studies already have.")
]

FinishBy = Annotated[
    str | None,
    typer.Option(
        "--finish-by",
        metavar="TIME",
        help='Run coarse to fine until a time, such as 2027-01-31T06:00+01:00, or for a duration, such as "8 h".',
    ),
]


def _no_nan(seconds: float | None) -> float | None:
    if seconds is not None and math.isnan(seconds):  # every comparison with a range lets it pass
        raise typer.BadParameter(f"{seconds} is not in the range x>=0.0.")
    return seconds


Wait = Annotated[bool, typer.Option("--wait", help="Wait until the study has ended.")]

WaitTimeout = Annotated[
    float | None,
    typer.Option(
        "--timeout",
        metavar="SECONDS",
        min=0.0,
        callback=_no_nan,
        help="Longest time to wait, then exit code 3; default: no limit.",
    ),
]


def in_units(units: str | None) -> list[tuple[str, str]]:
    """The units of a file as a query."""
    return [] if units is None else [("units", units)]


def in_decimals(decimal: Decimal | None) -> list[tuple[str, str]]:
    """The decimal sign of a file as a query."""
    return [] if decimal is None else [("decimal", decimal)]


def in_language() -> list[tuple[str, str]]:
    """The language of a picture or a report as a query: that of --language, not of SPRAG_LANGUAGE or the system."""
    language = CURRENT.get().language
    return [] if language is None else [("language", language)]


#: Options that most views have, by the name of their parameter; the help of `sprag show` lists them once.
SHARED: Final[dict[str, Any]] = {
    "file": Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="FILE", help="File to write: .csv, .svg, .png, .pdf; .json of a case."),
    ],
    "units": FileUnits,
    "decimal": CsvDecimal,
    "by": CurveBy,
    "at": Annotated[
        list[str] | None,
        typer.Option(
            "--at",
            metavar="PATH=VALUE",
            help="Value at which an axis is held, SI or with a unit; `cases` lists those with it; may be repeated.",
        ),
    ],
    "case": CaseOption,
    "start": StartOption,
    "points_file": PointsFile,
    "tables": TableFiles,
    "db": KeptIn,
}
#: Those of a spec that is run here.
OF_SPEC: Final = ("points_file", "tables", "db")
