"""``sprag engagements``: the engagements of a case."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

from sprag.service.cli.console import ExitCode, say, write_json, wrong_option
from sprag.service.cli.file_formats import value_format
from sprag.service.cli.files import output, read_study, require_cases, to_file
from sprag.service.cli.options import JsonFlag, OutputFile, PointsFile, SpecFile
from sprag.service.json_text import to_bytes
from sprag.service.languages import N_, _, decimal

if TYPE_CHECKING:
    from sprag.worker.study import Study


class TableName(StrEnum):
    """The tables of a case."""

    ENGAGEMENTS = "engagements"
    PERIODS = "periods"


def engagements(
    spec: SpecFile,
    case: Annotated[int, typer.Option("--case", min=0, metavar="N", help="Number of the case, from 0.")] = 0,
    points: PointsFile = None,
    file: OutputFile = None,
    table: Annotated[
        TableName, typer.Option(help="Table of a CSV file: engagements, or means of excitation periods.")
    ] = TableName.ENGAGEMENTS,
    as_json: JsonFlag = False,
) -> None:
    """Write every engagement of the clutches of one case: start, end, order, torque, work. JSON has the periods too."""
    from sprag.service.results.directions import case_values
    from sprag.service.results.engagements import engagements_csv, engagements_json
    from sprag.worker.models import ENDING_SENTENCES, OK, run_engagements

    written = value_format(None, file, as_json)
    study = read_study(spec, points).study
    _require(study, case)
    with output(file) as write:
        made = run_engagements(study, case)
        if written == "json":
            write(to_bytes(engagements_json(made, case, case_values(study, case))) + b"\n")
        else:
            write(engagements_csv(made, table.value))
    first, last = (decimal(f"{time:g}") for time in (made.start, made.end))
    text = _("{count} engagements from {first} s to {last} s", count=len(made.rows), first=first, last=last)
    meaning = text if made.ending == OK else _(ENDING_SENTENCES[made.ending])
    say(_("case {case}: {text}", case=case, text=meaning))
    if as_json and to_file(file):
        write_json({"file": file, "case": case, "ending": made.ending, "engagements": len(made.rows)})
    if made.ending != OK:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _require(study: Study, case: int) -> None:
    """Raise WrongInputError for an unknown case, or a machine without clutches."""
    from sprag.worker.models import VIBRATION_DRIVE, has_clutches

    if not has_clutches(study):
        message, detail = N_("has no clutches, so that nothing engages"), _("this study has no engagements")
        raise wrong_option("/model", "wrong-type", message, study.model, allowed=VIBRATION_DRIVE, detail=detail)
    require_cases(study, [case])
