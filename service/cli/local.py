"""Commands that need no service: run, validate, preview, trajectory, presets."""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import asdict
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from sprag.service.cli.console import (
    ExitCode,
    WrongInputError,
    duration_text,
    ending_lines,
    progress_text,
    say,
    show_table,
    write_json,
    write_text,
    wrong_option,
)
from sprag.service.cli.files import is_json, output, read_study, require_cases, to_file
from sprag.service.cli.options import (
    ChunkCases,
    FinishBy,
    Fresh,
    JsonFlag,
    OutputFile,
    PointsFile,
    Processes,
    SpecFile,
    TableFiles,
    ValueFormat,
    ValueFormatOption,
)
from sprag.service.cli.remote import TableFormat, table_format
from sprag.service.cli.running import run_parsed
from sprag.service.cli.settings import read_settings
from sprag.service.faults import Fault, warned
from sprag.worker.limits import MAX_TRAJECTORY_POINTS, MIN_TRAJECTORY_POINTS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag.service.formats import Format
    from sprag.service.jobs.local import LocalRun
    from sprag.service.results.report import ReportFormat
    from sprag.service.settings import Settings
    from sprag.service.spec.document import ParsedSpec
    from sprag.service.storage.records import Progress
    from sprag.worker.models import Trajectory
    from sprag.worker.study import Study


#: Rough start time (s) of the program and its pool of processes.
_START_SECONDS = 2.0


def validate(spec: SpecFile, points: PointsFile = None, tables: TableFiles = None, as_json: JsonFlag = False) -> None:
    """Check a spec: report all faults and warnings."""
    try:
        parsed = read_study(spec, points, files=tables)
    except WrongInputError as failure:
        if not as_json or not failure.faults:
            raise
        write_json({"valid": False, **failure.document()})
        raise typer.Exit(ExitCode.WRONG_INPUT) from failure
    if as_json:
        write_json(
            {
                "valid": True,
                "model": parsed.study.model,
                "name": parsed.study.name,
                "cases": parsed.study.cases,
                **warned(parsed.warnings),
            }
        )
        return
    print(f"{spec}: valid, {parsed.study.cases} cases")
    _say_warnings(parsed)


def _say_warnings(parsed: ParsedSpec) -> None:
    say(*(f"warning: {warning}" for warning in parsed.warnings))


def preview(
    spec: SpecFile,
    points: PointsFile = None,
    tables: TableFiles = None,
    db: Annotated[
        str | None, typer.Option("--db", metavar="URL", help="Database to search for cases that it already has.")
    ] = None,
    processes: Processes = None,
    finish_by: FinishBy = None,
    as_json: JsonFlag = False,
) -> None:
    """Preview a study: number of cases, time, size, first cases. Nothing is run."""
    from sprag.service.jobs.preview import preview_json
    from sprag.worker.chunking import Chunking

    finish = _finish(finish_by)
    left = None if finish is None else (finish - datetime.now(UTC)).total_seconds()
    settings = read_settings(database=db, processes=processes)
    parsed = read_study(spec, points, partial(_with_start, settings) if db is not None else None, tables)
    reusable = 0 if db is None else _reusable(settings, parsed)
    chunking = Chunking(0, settings.pool_processes, settings.chunk_timeout)
    made = preview_json(parsed, chunking, reusable, left, _START_SECONDS)
    if as_json:
        write_json(made)
        return
    count = f"{made['cases']} cases ({' x '.join(map(str, made['shape'])) or 'no axes'})"
    if made["most_rounds"] > 1:
        count = (
            f"at most {made['most_cases']} cases in at most {made['most_rounds']} rounds, {made['cases']} in the first"
        )
    write_text(
        f"{made['name'] or made['model']}: {count}, {made['results']} results each\n"
        f"about {duration_text(made['estimated_seconds'])} and {made['estimated_bytes'] / 1e6:.3g} MB\n"
    )
    if reusable:
        write_text(f"{reusable} of the cases need not be run: the database has them\n")
    columns = (("axis", False), ("unit", False), ("values", True), ("first", True), ("last", True))
    rows = [
        (", ".join(axis["paths"]), axis["unit"], axis["values"], axis["first"], axis["last"]) for axis in made["axes"]
    ]
    if rows:
        show_table("Axes", columns, rows)
    if made["derive"]:
        show_table("Derived parameters", (("parameter", False), ("formula, SI", False)), [*made["derive"].items()])
    say(*(f"warning: {warning}" for warning in made["warnings"]))


def _reusable(settings: Settings, parsed: ParsedSpec) -> int:
    """Number of cases in the database; 0 where there is no database yet."""
    from sprag.service.storage.session import Session
    from sprag.service.storage.store import Store

    session = Session(settings.database_url)
    session.close()
    if not session.on_server and not session.path.exists():
        return 0
    with Store.open(settings.database_url) as store:
        return store.reusable(parsed.study)


def trajectory(
    spec: SpecFile,
    case: Annotated[int, typer.Option("--case", min=0, metavar="N", help="Number of the case, from 0.")] = 0,
    tables: TableFiles = None,
    file: OutputFile = None,
    form: ValueFormatOption = None,
    start: Annotated[
        str | None, typer.Option("--from", metavar="TIME", help='First time, in s, or as "40 periods"; default: 0.')
    ] = None,
    end: Annotated[
        str | None, typer.Option("--to", metavar="TIME", help="Last time, likewise; default: the end.")
    ] = None,
    points: Annotated[
        int, typer.Option(min=MIN_TRAJECTORY_POINTS, max=MAX_TRAJECTORY_POINTS, help="Equally spaced times.")
    ] = 1000,
    as_json: JsonFlag = False,
) -> None:
    """Write the instantaneous values of one case: angles, speeds, torques, powers, states."""
    from sprag.worker.models import ENDING_SENTENCES, OK

    study = read_study(spec, files=tables).study
    with output(file) as write:
        made = _trajectory(study, case, start, end, points)
        written = is_json(file, as_json) if form is None else form is ValueFormat.JSON
        write(_trajectory_bytes(made, study, case, written))
    told = f"{points} points {'in time' if made.along == 'time' else 'over the angle'}"
    if not len(made.values):
        told = f"no points: {ENDING_SENTENCES[made.ending]}"
    say(f"case {case}: {made.ending}, {told}")
    if as_json and to_file(file):
        write_json({"file": file, "case": case, "ending": made.ending, "points": len(made.values)})
    if made.ending != OK:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _trajectory(study: Study, case: int, start: str | None, end: str | None, points: int) -> Trajectory:
    from sprag.service.faults import FaultError
    from sprag.service.results.trajectories import span
    from sprag.worker.models import run_trajectory

    require_cases(study, [case])
    try:
        first, last = span(study, case, start, end)
    except FaultError as error:
        problems = [
            Fault(f"--{item.where}", item.code, item.message, item.value, item.allowed) for item in error.faults
        ]
        raise WrongInputError("invalid-parameter", "invalid option", problems) from error
    return run_trajectory(study, case, first, last, points)


def _trajectory_bytes(made: Trajectory, study: Study, case: int, as_json: bool) -> bytes:
    from sprag.service.json_text import to_bytes
    from sprag.service.results.directions import case_values
    from sprag.service.results.trajectories import trajectory_csv, trajectory_json

    if not as_json:
        return trajectory_csv(made)
    return to_bytes(trajectory_json(made, case, case_values(study, case))) + b"\n"


def presets(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="Study to print; by default, a description of each.")
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """List the studies that come with the program, or print the spec of one."""
    from sprag.service.presets import ABOUT, preset_names, preset_text
    from sprag.service.spec.report import did_you_mean

    names = preset_names()
    if name is None:
        if as_json:
            write_json({"presets": list(names), "about": {item: asdict(ABOUT[item]) for item in names}})
        else:
            width = max(map(len, names)) + 2
            write_text("".join(f"{item:{width}}{ABOUT[item].shows}\n" for item in names))
        return
    if name not in names:
        message = f"unknown preset{did_you_mean(name, names)}"
        raise wrong_option("NAME", "unknown-name", message, name, allowed=", ".join(names), detail="invalid argument")
    file, text = preset_text(name)
    if as_json:
        write_json({"name": name, "file": file, "text": text})
    else:
        write_text(text)


def run(
    spec: SpecFile,
    points: PointsFile = None,
    tables: TableFiles = None,
    file: OutputFile = None,
    form: Annotated[
        TableFormat | None, typer.Option("--format", help="Default: by the name of FILE, otherwise csv.")
    ] = None,
    db: Annotated[
        str | None,
        typer.Option("--db", metavar="URL", help="Database to keep the study in; default: a temporary database."),
    ] = None,
    processes: Processes = None,
    chunk: ChunkCases = None,
    fresh: Fresh = False,
    finish_by: FinishBy = None,
    as_json: JsonFlag = False,
) -> None:
    """Run a study here, without a service: rows or a report to standard output or FILE, progress on standard error."""
    from sprag.service.results.rounds import sentence
    from sprag.service.results.unaffected import Unaffected

    finish = _finish(finish_by)
    settings = read_settings(database=db, processes=processes, chunk_cases=chunk)
    parsed = read_study(spec, points, partial(_with_start, settings) if db is not None else None, tables)
    _say_warnings(parsed)
    start = time.monotonic()
    with (
        _telling_what_is_kept(),
        output(file) as write,
        run_parsed(
            parsed,
            settings,
            lambda now: _remark(now, finish_by),
            db=db,
            processes=processes,
            fresh=fresh,
            finish_by=finish,
        ) as done,
    ):
        for piece in _rows(done, table_format(form, file, as_json)):
            write(piece)
        record, unaffecting = done.record, Unaffected().of(done.store, done.record)
        progress = done.store.progress(record.id)
        endings = progress.endings
    kept = f", kept as {record.id}" if db is not None else ""
    known = f", {record.reused} of them reused" if record.reused else ""
    say(*(f"warning: {text}" for text in unaffecting))
    seconds = time.monotonic() - start
    say(f"{record.done} of {record.cases} cases done{known}, {record.ok} ok, {seconds:.1f} s{kept}")
    if progress.rounds is not None:
        say(sentence(progress.rounds))
    say(*ending_lines(endings))
    if as_json and to_file(file):
        numbers = {"cases": record.cases, "done": record.done, "ok": record.ok, "reused": record.reused}
        study_id = record.id if db is not None else None
        write_json({"file": file, "study": study_id, **numbers, "endings": endings, "seconds": round(seconds, 3)})
    if record.time_over:
        say(str(record.reason))
    if record.ok != record.cases:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _with_start(settings: Settings, spec: object) -> object:
    """The spec with the initial values of the case in the database from whose end it starts, if it names one."""
    from sprag.service.jobs.start_from import with_start
    from sprag.service.spec.machine.drive import START
    from sprag.service.storage.store import Store

    base = spec.get("base") if isinstance(spec, Mapping) else None
    if not (isinstance(base, Mapping) and START in base):
        return spec
    with Store.open(settings.database_url) as store:
        return with_start(store, spec)


def _remark(now: Progress, finish_by: str | None) -> str:
    from sprag.service.results.rounds import sentence

    rounds = None if now.rounds is None else sentence(now.rounds)
    return progress_text(now.state, now.rate, now.seconds_left, finish_by, now.in_time, rounds)


@contextmanager
def _telling_what_is_kept() -> Iterator[None]:
    """After Ctrl-C, report the state of the study and how to continue it."""
    from sprag.service.jobs.local import RunInterruptedError

    try:
        yield
    except RunInterruptedError as stop:
        record = stop.record
        say(
            f"the study {record.id} is {record.state.value}: {record.done} of {record.cases} cases are kept, "
            "and the same command without --fresh reuses them"
        )
        raise


def _finish(text: str | None) -> datetime | None:
    """The deadline of an option; WrongInputError when it is invalid."""
    from sprag.service.schedules.deadline import ALLOWED, FinishError, finish_at

    try:
        return None if text is None else finish_at(text, datetime.now(UTC))
    except FinishError as error:
        raise wrong_option("--finish-by", error.code, str(error), text, allowed=ALLOWED) from None


def _rows(done: LocalRun, form: Format | ReportFormat) -> Iterator[bytes]:
    """The rows of a finished study as the service exports them, or its report."""
    from sprag.service.results.exports import export, stored
    from sprag.service.results.report import write_report
    from sprag.service.results.report.content import report_of

    if form == "html" or form == "pdf":  # noqa: PLR1714 - narrows the type
        return iter([write_report(report_of(done.store, done.record.id), form)])
    return export(stored(done.store, done.record, done.store.study(done.record.id)), form)
