"""Commands that need no service: run, check, presets; the last two ask one that is named."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.common import CURRENT, names_service, wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import (
    ExitCode,
    WrongInputError,
    duration_text,
    ending_lines,
    progress_text,
    say,
    show_table,
    state_text,
    table_words,
    warning_lines,
    write_json,
    write_text,
    wrong_option,
)
from sprag_study.service.cli.file_formats import TableFormOption, require_csv, require_report, table_format
from sprag_study.service.cli.files import naming_points, output, read_spec, read_study, to_file
from sprag_study.service.cli.options import (
    Appendix,
    CsvDecimal,
    CsvHeader,
    FinishBy,
    Fresh,
    KeptIn,
    OutputFile,
    PointsFile,
    Processes,
    SpecFile,
    TableFiles,
)
from sprag_study.service.cli.remote import connection
from sprag_study.service.cli.running import run_parsed
from sprag_study.service.cli.sources import refuse_here
from sprag_study.service.cli.stores import started_in
from sprag_study.service.languages import ENGLISH, N_, _, decimal, language
from sprag_study.worker.limits import MAX_BODY_BYTES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.answers.studies import Preview
    from sprag_study.service.formats import Format, Header
    from sprag_study.service.jobs.local import LocalRun
    from sprag_study.service.report import ReportFormat
    from sprag_study.service.settings import Settings
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.service.storage.studies.records import Progress, StudyRecord


#: Rough start time (s) of the program and its pool of processes.
_START_SECONDS = 2.0


def _say_warnings(parsed: ParsedSpec) -> None:
    say(*warning_lines(parsed.warnings))


def check(
    spec: SpecFile,
    points: PointsFile = None,
    tables: TableFiles = None,
    db: Annotated[
        str | None, typer.Option("--db", metavar="URL", help="Database to search for cases that it already has.")
    ] = None,
    finish_by: FinishBy = None,
) -> None:
    """Check a spec: every fault and warning, then the number of cases, time and size. Nothing is run.

    With --server that service checks it, with its database and its processes.
    """
    from sprag_study.service.reading.directions import ends_in_words

    finish, settings = _finish(finish_by), None
    if names_service():
        refuse_here(db=db)
    else:
        settings = read_settings(database=db)
    try:
        if settings is None:
            made = _asked(spec, points, tables, finish_by)
        else:
            made = _checked(spec, points, tables, settings, finish, stored=db is not None)
    except WrongInputError as failure:
        if not wants_json() or not failure.faults:
            raise
        write_json({"valid": False, **failure.document()})
        raise typer.Exit(ExitCode.WRONG_INPUT) from failure
    if wants_json():
        write_json({"valid": True, **made})
        return
    if made["most_rounds"] > 1:
        print(_("{file}: valid, at most {cases} cases", file=spec, cases=made["most_cases"]))
    else:
        print(_("{file}: valid, {cases} cases", file=spec, cases=made["cases"]))
    _show_preview(made)
    if made["reusable"]:
        write_text(_("{count} of the cases need not be run: the database has them", count=made["reusable"]) + "\n")
    with table_words():
        heads = ((_("axis"), False), (_("unit"), False), (_("values"), True), (_("least"), True), (_("largest"), True))
        rows = [(", ".join(axis["paths"]), axis["unit"], axis["values"], *ends_in_words(axis)) for axis in made["axes"]]
        if rows:
            show_table(_("Axes"), heads, rows)
        if made["derive"]:
            columns = ((_("parameter"), False), (_("formula, SI"), False))
            show_table(_("Derived parameters"), columns, [*made["derive"].items()])
    say(*warning_lines(made["warnings"], made["warning_codes"]))


def _asked(spec: str, points: str | None, tables: list[str] | None, finish_by: str | None) -> Preview:
    """The preview of the service that is named."""
    from sprag_study.service.client.queries import query_of

    with naming_points(points), connection() as client:
        data = read_spec(spec, points, MAX_BODY_BYTES, tables)
        query = query_of({"finish_by": finish_by})
        return cast("Preview", client.request("POST", "/studies:preview", json=data, params=query))


def _checked(
    spec: str,
    points: str | None,
    tables: list[str] | None,
    settings: Settings,
    finish: datetime | None,
    *,
    stored: bool,
) -> Preview:
    """The preview of this machine; ``stored``: with the cases and studies of the database of the settings."""
    from sprag_study.service.jobs.preview import preview_json
    from sprag_study.worker.chunking import Chunking

    left = None if finish is None else (finish - datetime.now(UTC)).total_seconds()
    parsed = read_study(spec, points, started_in(settings.database_url) if stored else None, tables)
    chunking = Chunking(0, settings.pool_processes, settings.chunk_timeout)
    return preview_json(parsed, chunking, _reusable(settings, parsed) if stored else 0, left, _START_SECONDS)


def _show_preview(made: Mapping[str, Any]) -> None:
    """What a study has, and what it costs."""
    cases = {"cases": made["cases"], "results": made["results"], "name": made["name"] or made["model"]}
    if made["most_rounds"] > 1:
        most = {"most": made["most_cases"], "rounds": made["most_rounds"]}
        text = _(
            "{name}: at most {most} cases in at most {rounds} rounds, {cases} in the first, {results} results each",
            **most,
            **cases,
        )
    else:
        shape = " x ".join(map(str, made["shape"])) or _("no axes")
        text = _("{name}: {cases} cases ({shape}), {results} results each", shape=shape, **cases)
    size = decimal(f"{made['estimated_bytes'] / 1e6:.3g}")
    cost = _("about {time} and {size} MB", time=duration_text(made["estimated_seconds"]), size=size)
    write_text(f"{text}\n{cost}\n")


def _reusable(settings: Settings, parsed: ParsedSpec) -> int:
    """Number of cases in the database; 0 where there is no database yet."""
    from sprag_study.service.storage.database.session import file_of
    from sprag_study.service.storage.store import Store

    file = file_of(settings.database_url)
    if file is not None and not file.exists():
        return 0
    with Store.open(settings.database_url, create=False) as store:
        return store.reuse.count(parsed.study)


def presets(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[NAME]",
            help="Study to print; by default, a description of each.",
            autocompletion=completion.presets,
        ),
    ] = None,
) -> None:
    """List the studies that come with the program, or print the spec of one; with --server those of that service."""
    from sprag_study.service.presets import ABOUT, preset_names, preset_text

    if names_service():
        _presets_of_service(name)
        return
    names = preset_names()
    if name is None:
        if wants_json():
            write_json({"presets": list(names), "about": {item: asdict(ABOUT[item]) for item in names}})
        else:
            _show_presets((item, ABOUT[item].shows) for item in names)
        return
    if name not in names:
        message = N_("unknown preset")
        detail = _("invalid argument")
        raise wrong_option("NAME", "unknown-name", message, name, allowed=", ".join(names), detail=detail)
    file, text = preset_text(name)
    if wants_json():
        write_json({"name": name, "file": file, "text": text})
    else:
        write_text(text)
        say(_("{name} is the file {file}", name=name, file=file))  # its ending says what is to be kept


def _presets_of_service(name: str | None) -> None:
    with connection() as client:
        if name is not None:
            write_json(client.preset(name)["spec"])
            return
        listed = client.presets()
    if wants_json():
        about = {item["name"]: {part: item[part] for part in ("shows", "values", "cases")} for item in listed}
        write_json({"presets": [item["name"] for item in listed], "about": about})
    else:
        _show_presets((item["name"], item["shows"]) for item in listed)


def _show_presets(presets: Iterable[tuple[str, str]]) -> None:
    """Names of presets and what each shows, as a table."""
    with table_words():
        rows = [(name, _(shows)) for name, shows in presets]
        show_table("", ((_("preset"), False, True), (_("shows"), False)), rows)


def run(
    spec: SpecFile,
    points: PointsFile = None,
    tables: TableFiles = None,
    file: OutputFile = None,
    form: TableFormOption = None,
    header: CsvHeader = None,
    decimal: CsvDecimal = None,
    appendix: Appendix = None,
    db: KeptIn = None,
    processes: Processes = None,
    fresh: Fresh = False,
    finish_by: FinishBy = None,
) -> None:
    """Run a study here, without a service: rows or a report to standard output or FILE, progress on standard error."""
    from sprag_study.service.exports.decimal_commas import with_decimals
    from sprag_study.service.results.unaffected import unaffecting

    finish, written = _finish(finish_by), table_format(form, file)
    require_csv(header, decimal, written)
    require_report(appendix, written)
    settings = read_settings(database=db, processes=processes)
    parsed = read_study(spec, points, started_in(db), tables)
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
        pieces = _rows(done, written, header or "names", appendix)
        for piece in with_decimals(pieces, decimal):
            write(piece)
        record, without_effect = done.record, unaffecting(done.store, done.record)
        progress = done.store.studies.progress(record.id)
        endings = progress.endings
    say(*warning_lines(without_effect))
    seconds = time.monotonic() - start
    say(", ".join(_done(record, seconds, kept=db is not None)), *_rounds(progress), *ending_lines(endings))
    if wants_json() and to_file(file):
        numbers = {"cases": record.cases, "done": record.done, "ok": record.ok, "reused": record.reused}
        study_id = record.id if db is not None else None
        write_json({"file": file, "study": study_id, **numbers, "endings": endings, "seconds": round(seconds, 3)})
    if record.time_over:
        from sprag_study.service.reading.reader import shown_stored

        say(shown_stored(record.reason or ""))
    if record.ok != record.cases:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _rounds(progress: Progress) -> Iterator[str]:
    """What is known of a study that chooses its own cases."""
    from sprag_study.service.results.rounds import sentence

    if progress.rounds is not None:
        yield sentence(progress.rounds, progress.state)


def _done(record: StudyRecord, seconds: float, *, kept: bool) -> Iterator[str]:
    """How a run ended, in short."""
    yield _("{done} of {cases} cases done", done=record.done, cases=record.cases)
    if record.reused:
        yield _("{count} of them reused", count=record.reused)
    yield _("{count} ok", count=record.ok)
    yield _("{seconds} s", seconds=decimal(f"{seconds:.1f}"))
    if kept:
        yield _("kept as {study}", study=record.id)


def _remark(now: Progress, finish_by: str | None) -> str:
    from sprag_study.service.results.rounds import sentence

    rounds = None if now.rounds is None else sentence(now.rounds, now.state)
    return progress_text(now.state, now.rate, now.seconds_left, finish_by, now.in_time, rounds)


@contextmanager
def _telling_what_is_kept() -> Iterator[None]:
    """After Ctrl-C, report the state of the study and how to continue it."""
    from sprag_study.service.jobs.local import RunInterruptedError

    try:
        yield
    except RunInterruptedError as stop:
        record = stop.record
        say(
            _(
                "the study {study} is {state}: {done} of {cases} cases are kept, and the same command without --fresh "
                "reuses them",
                study=record.id,
                state=state_text(record.state),
                done=record.done,
                cases=record.cases,
            )
        )
        raise


def _finish(text: str | None) -> datetime | None:
    """The deadline of an option; WrongInputError when it is invalid."""
    from sprag_study.service.schedules.deadline import ALLOWED, finish_at
    from sprag_study.service.schedules.times import TimingError

    try:
        return None if text is None else finish_at(text, datetime.now(UTC))
    except TimingError as error:
        raise wrong_option("--finish-by", error.code, error.message, text, allowed=ALLOWED) from None


def _rows(done: LocalRun, form: Format | ReportFormat, header: Header, appendix: list[str] | None) -> Iterator[bytes]:
    """The rows of a finished study as the service exports them, or its report."""
    from sprag_study.service.exports import export, stored
    from sprag_study.service.reading.reader import Choice
    from sprag_study.service.report import Office, report_file
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.study_questions import ReportQuestion

    if form == "html" or form == "pdf":  # noqa: PLR1714 - narrows the type
        settings = read_settings()
        asked = Choice(settings.units), ReportQuestion(appendix=appendix)
        with language(CURRENT.get().language or ENGLISH):  # as reports of `sprag export`
            return iter([report_file(Library(done.store), done.record.id, *asked, Office.of(settings), form)])
    return export(stored(done.store, done.record, done.store.studies.study(done.record.id), header=header), form)
