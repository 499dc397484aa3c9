"""``sprag transient``: the run-up, a load step or the coasting of one case of machine shafts, or of every case."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Annotated

import typer

from sprag.service.cli.console import ExitCode, say, write_json, wrong_option
from sprag.service.cli.file_formats import value_format
from sprag.service.cli.files import output, read_study, require_cases, to_file
from sprag.service.cli.motions import naming_options
from sprag.service.cli.options import (
    CaseOption,
    JsonFlag,
    OutputFile,
    SpecFile,
    TableFiles,
    ValueFormatOption,
)
from sprag.service.json_text import to_bytes
from sprag.service.languages import N_, _
from sprag.worker.limits import MAX_TRAJECTORY_POINTS, MIN_TRAJECTORY_POINTS

if TYPE_CHECKING:
    from sprag.worker.models.transients import Course, Transient
    from sprag.worker.study import Study


def transient(
    spec: SpecFile,
    kind: Annotated[str, typer.Option("--kind", metavar="KIND", help="run-up, load-step or coasting.")],
    case: CaseOption = 0,
    every: Annotated[
        bool, typer.Option("--all", help="A row for each case instead: its axes, the outcome and the results.")
    ] = False,
    load: Annotated[
        str | None, typer.Option("--load", metavar="FACTOR", help="Factor on all operations during it; default: 1.")
    ] = None,
    angle: Annotated[
        str | None, typer.Option("--angle", metavar="ANGLE", help="Angle of the shaft at the start; default: 0.")
    ] = None,
    torque: Annotated[
        str | None,
        typer.Option("--torque", metavar="TORQUE", help="Driving torque of a run-up, for machines without a motor."),
    ] = None,
    within: Annotated[
        str | None,
        typer.Option(
            "--within", metavar="SHARE", help="Share of the first difference in speed that counts as reached."
        ),
    ] = None,
    revolutions: Annotated[
        str | None, typer.Option("--revolutions", metavar="N", help="Most revolutions; default: 1000.")
    ] = None,
    points: Annotated[
        int, typer.Option(min=MIN_TRAJECTORY_POINTS, max=MAX_TRAJECTORY_POINTS, help="Equally spaced times.")
    ] = 1000,
    tables: TableFiles = None,
    file: OutputFile = None,
    form: ValueFormatOption = None,
    as_json: JsonFlag = False,
) -> None:
    """Compute the run-up from rest of a machine shaft, a step of its load, or its coasting, over time."""
    from sprag.service.results.trajectories import trajectory_csv
    from sprag.service.results.transients import course_of, results_json, transient_json
    from sprag.worker.models.abilities import run_transient

    written = value_format(form, file, as_json)
    study = read_study(spec, files=tables).study
    require_cases(study, [case])
    if every and case:
        raise wrong_option("--case", "conflict", N_("cannot be given with --all"), case, allowed=_("--case or --all"))
    given = {"load": load, "angle": angle, "torque": torque, "within": within, "revolutions": revolutions}
    with naming_options(study, N_("has no transients")):
        course = course_of(study, case, kind, given)
    if every:
        _write_all(study, course, file, as_json=written == "json")
        return
    with output(file) as write:
        made = run_transient(study, case, course, points)
        content = (
            trajectory_csv(made.motion)
            if written == "csv"
            else to_bytes(transient_json(made, study, case, course)) + b"\n"
        )
        write(content)
    _report(made, case)
    if as_json and to_file(file):
        results = results_json(made)
        write_json({"file": file, "case": case, "outcome": made.outcome, "cause": made.cause, "results": results})
    if made.outcome != completed(course):
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _write_all(study: Study, course: Course, file: str | None, *, as_json: bool) -> None:
    """Write a row for each case; a line of JSON each, or CSV with a line of headings."""
    from sprag.service.results.exports.text import csv_lines
    from sprag.service.results.transients import case_rows, row_headings

    ends: Counter[str] = Counter()
    with output(file) as write:
        if not as_json:
            write(csv_lines([row_headings(study)]))
        for row in case_rows(study, course):
            ends[str(row["outcome"])] += 1
            cells = ["" if value is None else value for value in row.values()]
            write(to_bytes(row) + b"\n" if as_json else csv_lines([cells]))
    text = ", ".join(f"{count} {outcome}" for outcome, count in ends.most_common())
    say(_("{count} cases: {text}", count=study.cases, text=text))
    if set(ends) - {completed(course)}:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def completed(course: Course) -> str:
    """The outcome of a transient that comes to its end."""
    return "stopped" if course.kind == "coasting" else "reached"


def _report(made: Transient, case: int) -> None:
    """Write the end and its cause, and the results, to standard error."""
    from sprag.service.reading.wording import number, unit_text
    from sprag.worker.models.transients import RESULTS

    say(_("case {case}: {text}", case=case, text=f"{made.outcome}. {_(made.cause)}"))
    for name, unit, meaning in RESULTS:
        if math.isfinite(made.results[name]):
            say(f"  {name} = {number(made.results[name], 6)} {unit_text(unit)}".rstrip() + f"  ({_(meaning)})")
