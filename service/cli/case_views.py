"""``sprag show ID trajectory``, ``branch``, ``basin`` and their like: the views of a case, run here or by a service.

Their options are the settings of the views (`sprag_study.service.views.setting`); nothing else is loaded before one
runs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import typer

from sprag_study.service import languages
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import ExitCode, WrongInputError, say, write_json, wrong_option
from sprag_study.service.cli.described import option, parameter, query_of, signed
from sprag_study.service.cli.file_formats import require_csv, value_format
from sprag_study.service.cli.files import output, require_cases, to_file, write_pieces
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import SHARED, in_decimals, in_language
from sprag_study.service.cli.remote import connection, study_named
from sprag_study.service.cli.sources import SpecOrStudy, is_study, refuse_local
from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.formats import PICTURES
from sprag_study.service.languages import N_, _
from sprag_study.service.views.case_questions import CASE_VIEWS, TRANSIENT
from sprag_study.service.views.setting import NamedSetting, ViewInfo, settings_of

if TYPE_CHECKING:
    from sprag_study.service.formats import Decimal
    from sprag_study.service.views.case_view import CaseView
    from sprag_study.worker.models.transients import Course
    from sprag_study.worker.study import Study

_EachCase = Annotated[
    bool, typer.Option("--all", help="A row for each case instead: its axes, the outcome and the results.")
]

#: What 1.0.0 has beside the ending of FILE, for one release (`sprag_study.service.cli.old_words`).
_Form = Annotated[Literal["csv", "json"] | None, typer.Option("--format", hidden=True)]


def command(about: ViewInfo) -> Callable[..., None]:
    """The command of a view."""
    asked = settings_of(about.question)
    counted = any(one.option == "--points" for one in asked)  # which then are no file of cases

    def run(
        spec: str, case: int, file: str | None, points_file: str | None = None, tables: list[str] | None = None,
        start: int | None = None, every: bool = False, decimal: Decimal | None = None, form: str | None = None,
        db: str | None = None, **settings: Any,
    ) -> None:  # fmt: skip
        written = value_format(file, PICTURES if about.pictures else (), form)
        require_csv(None, decimal, written)
        drawing = [*(in_language() if written in PICTURES else ()), *in_decimals(decimal)]
        if is_study(spec):
            from sprag_study.service.client.wire import case_path

            refuse_local(every=every, points_file=points_file, tables=tables, db=db)
            query = [*query_of(asked, settings), *([] if start is None else [("start", str(start))]), *drawing]
            with connection() as client:
                path = case_path(study_of(client, spec), case, f"/{about.name}")
                with client.pieces(path, [*query, ("format", written)]) as pieces:
                    write_pieces(file, pieces)
            _say_written(file, written, case, {})
            return
        from sprag_study.service.views import cases

        view = cases.CASE_VIEWS[about.name]
        study = study_named(spec, points_file, tables, db).study
        require_cases(study, [case])
        if every and case:
            raise wrong_option(
                "--case", "conflict", N_("cannot be given with --all"), case, allowed=_("--case or --all")
            )
        with naming_options(study, asked, view.lacks):
            _check_start(study, start)
            chosen = view.choose(study, case, about.question(**settings))
        if every:
            _write_all(study, chosen[0], file, decimal, lines=written == "json")
        else:
            _write(view, study, case, chosen, start, written, file, dict(drawing))

    options = [parameter(one.name, option(one), one.default) for one in asked]
    shared = {"case": 0, **({"start": None} if about.starts else {}), **({} if counted else {"points_file": None})}
    shared |= dict.fromkeys(("tables", "db", "file", "decimal"))
    last = [parameter(name, SHARED[name], default) for name, default in shared.items()]
    last += [parameter("every", _EachCase, False)] if about is TRANSIENT else []
    last += [parameter("form", _Form, None)]
    return signed(run, about.summary, [parameter("spec", SpecOrStudy, ...), *options, *last])


def say_file(file: str, form: str | None, first: int | None = None) -> None:
    """Say what was written; of a selection that is larger than a file only the ``first`` cases."""
    if form in PICTURES:
        say(_("picture: {file}", file=file))
    elif first is None:
        say(_("table: {file}", file=file))
    else:
        say(_("table: {file}, the first {count} cases of the selection", file=file, count=f"{first:,}"))


def _check_start(study: Study, start: int | None) -> None:
    from sprag_study.service.results.start_states import check_start

    check_start(study, start)


@contextmanager
def naming_options(study: Study, asked: Sequence[NamedSetting], lacks: str) -> Iterator[None]:
    """Name the options of a command instead of the settings of a view; WrongInputError for each fault."""
    try:
        yield
    except FaultError as error:
        if not error.faults:
            raise wrong_option("/model", "wrong-type", lacks, study.model, detail=error.detail) from error
        options = {one.alias: one.option for one in asked}
        faults = [
            fault
            if fault.where is None
            else Fault(_named(options, fault), fault.code, fault.message, fault.value, fault.allowed)
            for fault in error.faults
        ]
        raise WrongInputError("invalid-parameter", _("invalid option"), faults) from error


#: Codes of faults of names, which no further case of a study undoes where they say which value is meant.
_OF_NAMES: Final = ("not-an-axis", "unknown-name", "not-numeric", "invalid-choice")
#: Codes of faults of what a study is asked that its spec does not have.
_OF_STUDIES: Final = ("not-used", "not-a-grid")


@contextmanager
def before_run(study: Study, asked: Sequence[NamedSetting]) -> Iterator[None]:
    """Name options as `naming_options`; of a study that chooses its own cases only what these leave as it is."""
    with naming_options(study, asked, ""):
        try:
            yield
        except FaultError as error:
            if study.plan is None or not error.faults or any(map(_stays, error.faults)):
                raise


def _stays(fault: Fault) -> bool:
    """Whether a fault stays whatever cases a study chooses: of a name, or of a view that it does not have.

    Where no axis is named and the first cases lie on no curve, as the designs of a search, it is to be named.
    """
    named = fault.code in _OF_NAMES and (fault.value is not None or fault.code == "not-an-axis")
    return named or fault.where is None or fault.code in _OF_STUDIES


def _named(options: dict[str, str], fault: Fault) -> str:
    where = str(fault.where)
    return options.get(where, f"--{where}".replace("_", "-"))


def _write(
    view: CaseView[Any, Any, Any], study: Study, case: int, chosen: Any, start: int | None, form: Any,
    file: str | None, drawing: Mapping[str, str],
) -> None:  # fmt: skip
    """Compute the view of a case, write it, and say what it has."""
    from sprag_study.service.exports.decimal_commas import with_decimals
    from sprag_study.service.reading.reader import shown
    from sprag_study.service.views.case_view import drawn, see, written

    with output(file) as write:
        answer = see(study, case, view, chosen, start)
        if form in PICTURES:
            with languages.language(drawing.get("language", languages.ENGLISH)):
                content = drawn(view, answer, form)
        else:
            content = written(view, answer, form)
        content = b"".join(with_decimals([content], drawing.get("decimal")))
        write(content if content.endswith(b"\n") or form in PICTURES else content + b"\n")
    said = view.said(answer)
    if said is not None:
        told = view.shown(answer)
        first, *rest = map(shown, told.sentences)
        say(_("case {case}: {text}", case=case, text=first), *rest)
        pairs = (row for one in told.tables if len(one.columns) == 2 for row in one.rows)  # others are the file itself
        for row in pairs:
            say("  " + ": ".join(shown(cell) for cell in row if isinstance(cell, str)))
    _say_written(file, form, case, {} if said is None else said.data)
    if said is not None and not said.ok:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _say_written(file: str | None, form: str, case: int, data: Mapping[str, Any]) -> None:
    """Say which file was written, for people and where asked for programs."""
    if file is None or not to_file(file):
        return
    say_file(file, form)
    if wants_json():
        write_json({"file": file, "case": case, **data})


def _write_all(study: Study, course: Course, file: str | None, decimal: Decimal | None, *, lines: bool) -> None:
    """Write a row for each case; a line of JSON each, or CSV with a line of headings."""
    from sprag_study.service.exports.decimal_commas import with_decimals
    from sprag_study.service.exports.text import csv_lines
    from sprag_study.service.json_text import to_bytes
    from sprag_study.service.views.transient import case_rows, completed, row_headings

    ends: Counter[str] = Counter()

    def pieces() -> Iterator[bytes]:
        if not lines:
            yield csv_lines([row_headings(study)])
        for row in case_rows(study, course):
            ends[str(row["outcome"])] += 1
            cells = ["" if value is None else value for value in row.values()]
            yield to_bytes(row) + b"\n" if lines else csv_lines([cells])

    write_pieces(file, with_decimals(pieces(), decimal))
    text = ", ".join(f"{count} {outcome}" for outcome, count in ends.most_common())
    say(_("{count} cases: {text}", count=study.cases, text=text))
    if set(ends) - {completed(course)}:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


#: The commands by name.
COMMANDS = {about.name: command(about) for about in CASE_VIEWS}
