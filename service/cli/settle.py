"""The command that finds settled motions."""

from __future__ import annotations

import csv
import io
import json
import math
from collections import Counter
from typing import TYPE_CHECKING, Annotated, Any

import typer

from service.cli.console import ExitCode, WrongInputError, progress_bar, say, show_table, write_json
from service.cli.files import output, read_study, to_file
from service.cli.options import JsonFlag, OutputFile, PointsFile, SpecFile
from service.spec.report import Problem
from worker.limits import MAX_SETTLED_PERIODS, MIN_SETTLED_PERIODS

if TYPE_CHECKING:
    from worker.models.settled import SettledCases
    from worker.study import Study

#: Cases that are settled side by side: enough to fill the engine, few enough to show progress.
_BATCH = 512


def settle(
    spec: SpecFile,
    case: Annotated[
        list[int] | None,
        typer.Option("--case", min=0, metavar="N", help="Number of a case, from 0; may be repeated. Default: all."),
    ] = None,
    points: PointsFile = None,
    file: OutputFile = None,
    at_most: Annotated[
        int,
        typer.Option(
            min=MIN_SETTLED_PERIODS, max=MAX_SETTLED_PERIODS, help="Excitation periods after which a search ends."
        ),
    ] = 1000,
    as_json: JsonFlag = False,
) -> None:
    """Find the settled motion of cases: its regime, order, stability and characteristics."""
    from worker.models import OK

    study = read_study(spec, points).study
    cases = _chosen(study, case)
    with output(file) as write:
        parts = list(_settled(study, cases, at_most))
        if as_json or (file or "").lower().endswith(".json"):
            write((json.dumps([row for part in parts for row in _objects(study, part)], indent=1) + "\n").encode())
        elif len(cases) == 1 and not to_file(file):
            _show(parts[0])
        else:
            write(_csv(study, parts))
    regimes = Counter(regime for part in parts for regime in part.regimes if regime != "none")
    endings = Counter(ending for part in parts for ending in part.endings)
    say(", ".join(f"{count} {regime}" for regime, count in regimes.most_common()) or "no case ended ok")
    if as_json and to_file(file):
        write_json({"file": file, "cases": len(cases), "regimes": dict(regimes), "endings": dict(endings)})
    if set(endings) != {OK}:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _chosen(study: Study, asked: list[int] | None) -> list[int]:
    """The cases to be settled; WrongInputError where the model or a number is wrong."""
    from worker.models.settled import can_settle

    if not can_settle(study):
        problem = Problem("/model", "has no motion that settles", study.model, allowed="vibration-drive")
        raise WrongInputError("this study cannot be settled", problems=[problem])
    if asked is None:
        return list(range(study.cases))
    problems = [
        Problem("--case", "there is no such case", case, allowed=f"0 .. {study.cases - 1}")
        for case in asked
        if case >= study.cases
    ]
    if problems:
        raise WrongInputError("an option is wrong", problems=problems)
    return list(dict.fromkeys(asked))


def _settled(study: Study, cases: list[int], at_most: int) -> list[SettledCases]:
    from worker.models.settled import settle_cases

    parts = []
    with progress_bar(study.name or "study") as update:
        for first in range(0, len(cases), _BATCH):
            parts.append(settle_cases(study, cases[first : first + _BATCH], at_most))
            update(min(first + _BATCH, len(cases)), len(cases), "")
    return parts


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _objects(study: Study, part: SettledCases) -> list[dict[str, Any]]:
    return [
        {
            "case": case,
            "parameters": study.case_parameters(case),
            "ending": part.endings[k],
            "regime": part.regimes[k],
            "results": {
                info.name: _number(value) for info, value in zip(part.infos, part.values[k].tolist(), strict=True)
            },
        }
        for k, case in enumerate(part.cases)
    ]


def _csv(study: Study, parts: list[SettledCases]) -> bytes:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["case", *study.axis_paths, "ending", "regime", *(info.name for info in parts[0].infos)])
    for part in parts:
        for k, case in enumerate(part.cases):
            values = [_number(value) for value in part.values[k].tolist()]
            parameters = study.case_parameters(case).values()
            rows.writerow([case, *parameters, part.endings[k], part.regimes[k], *values])
    return text.getvalue().encode()


def _show(part: SettledCases) -> None:
    """One case as a table for people, without what it has no value of."""
    from worker.models import ENDING_SENTENCES, OK
    from worker.models.settled import REGIME_SENTENCES

    meaning = REGIME_SENTENCES[part.regimes[0]] if part.endings[0] == OK else ENDING_SENTENCES[part.endings[0]]
    values = zip(part.infos, part.values[0].tolist(), strict=True)
    rows = [(info.name, _number(value), info.unit) for info, value in values if math.isfinite(value)]
    show_table(f"Case {part.cases[0]}: {meaning}", [("result", False, True), ("value", True), ("unit", False)], rows)
