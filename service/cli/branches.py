"""``sprag branch``: the branch of periodic motions through the motion of a case, along a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from sprag.service.cli.console import ExitCode, say, write_json
from sprag.service.cli.file_formats import value_format
from sprag.service.cli.files import output, to_file
from sprag.service.cli.motions import naming_options, study_of
from sprag.service.cli.options import (
    AlongOption,
    CaseOption,
    FromOption,
    JsonFlag,
    OutputFile,
    PointsFile,
    SpecFile,
    StartOption,
    ToOption,
    ValueFormatOption,
)
from sprag.service.json_text import to_bytes
from sprag.service.languages import _

if TYPE_CHECKING:
    from sprag.worker.models.branches import Along, CaseBranch
    from sprag.worker.study import Study


def branch(
    spec: SpecFile,
    along: AlongOption,
    case: CaseOption = 0,
    low: FromOption = None,
    high: ToOption = None,
    start: StartOption = None,
    points: PointsFile = None,
    file: OutputFile = None,
    form: ValueFormatOption = None,
    as_json: JsonFlag = False,
) -> None:
    """Follow the periodic motion of one case along a parameter: stable and unstable, folds, doublings, grazings."""
    from sprag.service.results.branches import along_of, branch_csv, branch_json
    from sprag.worker.models.abilities import run_branch
    from sprag.worker.models.starts import motion_of

    written = value_format(form, file, as_json)
    study = study_of(spec, points, case, start)
    with naming_options(study):
        asked = along_of(study, case, along, low, high)
    with output(file) as write:
        made = run_branch(*motion_of(study, case, start), asked)
        content = (
            branch_csv(made, asked) if written == "csv" else to_bytes(branch_json(made, study, case, asked)) + b"\n"
        )
        write(content)
    _report(made, study, asked, case)
    if as_json and to_file(file):
        write_json({"file": file, "case": case, "points": len(made.parameters), "specials": len(made.specials)})
    if made.note:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _report(made: CaseBranch, study: Study, asked: Along, case: int) -> None:
    """Say on standard error what has been found."""
    from sprag.service.reading.catalogue import unit_of
    from sprag.service.results.figures.branch import special_text

    if made.note:
        say(_("case {case} has no branch: {why}", case=case, why=_(made.note)))
        return
    unit = unit_of(study, asked.paths[0])
    say(
        _(
            "case {case}: {count} orbits of order {order}; from {first} to {last}",
            case=case,
            count=len(made.parameters),
            order=made.order,
            first=_(made.ends[0]),
            last=_(made.ends[1]),
        )
    )
    say(*(special_text(special, unit) for special in made.specials))
