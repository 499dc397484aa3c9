"""``sprag show ID curves``, ``map``, ``answers`` and their like: the views of a study, run here or of a service.

Their options are the settings of the views (`sprag_study.service.views.study_questions`); nothing else is loaded before
one runs.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final, cast

import typer

from sprag_study.service import languages
from sprag_study.service.cli.case_views import naming_options, require_language, say_file
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import WrongInputError, say, warning_lines, write_json, wrong_option
from sprag_study.service.cli.described import option, parameter, query_of, signed
from sprag_study.service.cli.file_formats import file_format, require_csv
from sprag_study.service.cli.files import MAX_DATA_BYTES, decode, read_bytes, read_study, write_pieces
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import SHARED, in_decimals, in_language, in_units
from sprag_study.service.cli.remote import connection
from sprag_study.service.cli.running import run_parsed
from sprag_study.service.cli.shown import (
    show_answers,
    show_calibration,
    show_cases,
    show_curves,
    show_designs,
    show_map,
    show_ribbon,
    show_sensitivity,
    show_yield,
)
from sprag_study.service.cli.sources import SpecOrStudy, is_study, refuse_local
from sprag_study.service.cli.stores import require_store
from sprag_study.service.faults import Fault
from sprag_study.service.formats import PICTURES
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.numbers import probability_of
from sprag_study.service.views import study_questions as questions
from sprag_study.service.views.setting import settings_of

if TYPE_CHECKING:
    from sprag_study.service.formats import Decimal
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.service.storage.studies.records import Progress
    from sprag_study.service.views.setting import NamedSetting, ViewInfo

#: Formats of their files.
_FORMATS: Final = ("csv", *PICTURES)
_SHARED: Final = ("file", "units", "decimal", "language", "points_file", "tables", "db", "processes")
_Measured = Annotated[
    str | None,
    typer.Option("--measured", metavar="FILE", help="CSV file of measured points, instead of those of the spec."),
]


@dataclass(frozen=True, slots=True)
class Command:
    """The command of a view: its name, how it shows the answer, and what differs from the settings of the view.

    ``show`` gets the answer, and what gives the model of the study. ``few`` are the rows of a table, unless others are
    asked for; a file has as many as the question allows.
    """

    name: str
    about: ViewInfo
    show: Callable[[dict[str, Any], Callable[[], str]], None]
    few: int | None = None


_COMMANDS: Final = (
    Command("answers", questions.ANSWERS, show_answers),
    Command("curves", questions.CURVES, lambda found, _model: show_curves(found)),
    Command("explore", questions.EXPLORE, lambda found, _model: show_cases(found), 20),
    Command("front", questions.FRONT, lambda found, _model: show_designs(found), 20),
    Command("calibration", questions.CALIBRATION, lambda found, _model: show_calibration(found)),
    Command("map", questions.MAP, lambda found, _model: show_map(found)),
    Command("ribbon", questions.RIBBON, lambda found, _model: show_ribbon(found)),
    Command("sensitivity", questions.SENSITIVITY, lambda found, _model: show_sensitivity(found)),
    Command("yield", questions.YIELD, lambda found, _model: show_yield(found)),
)


@dataclass(frozen=True, slots=True)
class _Source:
    """Where a view comes from: the answer as data, the pieces of a file, and the model of the study."""

    answer: Callable[[dict[str, Any]], dict[str, Any]]
    pieces: Callable[[dict[str, Any], str], Iterable[bytes]]
    model: Callable[[], str]


def _function_of(command: Command) -> Callable[..., None]:
    about = command.about
    asked = settings_of(about.question)

    def run(
        study: str, file: str | None, units: str | None, decimal: Decimal | None, language: str | None,
        db: str | None, processes: int | None, points_file: str | None, tables: list[str] | None,
        measured: str | None = None, **settings: Any,
    ) -> None:  # fmt: skip
        form = None if file is None else file_format(file, _FORMATS)
        require_csv(None, decimal, form)
        _require_file(form, units, language)
        if settings.get("quantiles"):
            settings["quantiles"] = list(map(_probability, settings["quantiles"]))
        whole, most = settings, None
        if command.few is not None:
            most = _most_rows(about.question)
            settings = {**settings, "limit": settings["limit"] or command.few}
            whole = {**settings, "limit": most}
        drawing = dict([*in_units(units), *in_decimals(decimal), *in_language(language)])
        if is_study(study):
            refuse_local(measured=measured, points_file=points_file, tables=tables, db=db, processes=processes)
            opened = _remote(study, about, asked, drawing)
        else:
            require_store(db)
            change = None if measured is None else partial(_with_measured, measured)
            parsed = read_study(study, points_file, change, tables)
            opened = _local(parsed, about, asked, settings, drawing, db, processes)
        with opened as source:
            found = source.answer(settings)
            if file is not None and form is not None:
                write_pieces(file, source.pieces(whole, form))
            if wants_json():
                write_json(found)
            else:
                command.show(found, source.model)
        if file is not None:
            say_file(file, form, None if most is None or found.get("selected", 0) <= most else most)

    own = [
        parameter(one.name, option(one), None if one.name == "limit" and command.few else one.default) for one in asked
    ]
    own += [parameter("measured", _Measured, None)] if about is questions.CALIBRATION else []
    shared = [parameter(name, SHARED[name], None) for name in _SHARED]
    return signed(run, about.summary, [parameter("study", SpecOrStudy, ...), *own, *shared])


def _require_file(form: str | None, units: str | None, language: str | None) -> None:
    """Refuse what applies to a file, or to a picture, where none is written; WrongInputError."""
    if units is not None and form is None:
        raise wrong_option("--units", "not-used", N_("only a file has them"), units, allowed=_("with --output FILE"))
    if language is not None and form not in PICTURES:
        raise wrong_option("--language", "not-used", N_("only pictures have it"), language, allowed=", ".join(PICTURES))


def _with_measured(file: str, spec: object) -> object:
    """The spec of a calibration with the measured points of a CSV file instead of its own."""
    calibration = spec.get("calibrate") if isinstance(spec, Mapping) else None
    if not isinstance(spec, Mapping) or not isinstance(calibration, Mapping):
        problem = Fault("/calibrate", "required", N_("is required"), None, _("unknown parameters and measured points"))
        raise WrongInputError("invalid-spec", _("{file}: not a calibration", file=file), [problem])
    return {**spec, "calibrate": {**calibration, "measured": {"csv": decode(file, read_bytes(file, MAX_DATA_BYTES))}}}


def _most_rows(question: type) -> int | None:
    """The most rows of a table that may be asked for."""
    return next(asked.setting.high for asked in settings_of(question) if asked.name == "limit")


def _probability(text: str) -> float:
    """The probability of ``5%`` or ``0.05``."""
    value = probability_of(text)
    if value is None:
        raise wrong_option(
            "--quantile", "out-of-range", N_("is no probability"), text, allowed=_("such as 5 % or 0.05")
        )
    return value


def _remark(now: Progress) -> str:
    """What is known of a study that chooses its own cases, beside its bar."""
    from sprag_study.service.results.rounds import sentence

    return sentence(now.rounds, now.state) if now.rounds else ""


@contextmanager
def _remote(text: str, about: ViewInfo, asked: tuple[NamedSetting, ...], drawing: dict[str, str]) -> Iterator[_Source]:
    """The view of a study of a running service."""
    from sprag_study.service.client.wire import study_path

    with connection() as client:
        path = study_path(study_of(client, text))
        view = f"{path}/{about.name}"

        def pieces(settings: dict[str, Any], form: str) -> Iterator[bytes]:
            with client.pieces(view, [*query_of(asked, settings), *drawing.items(), ("format", form)]) as found:
                yield from found

        yield _Source(
            lambda settings: client.request("GET", view, params=query_of(asked, settings)),
            pieces,
            lambda: str(client.request("GET", path)["model"]),
        )


@contextmanager
def _local(
    parsed: ParsedSpec, about: ViewInfo, asked: tuple[NamedSetting, ...], first: dict[str, Any],
    drawing: dict[str, str], db: str | None, processes: int | None,
) -> Iterator[_Source]:  # fmt: skip
    """The view of the study of a spec, which is run here first."""
    from sprag_study.service.exports.decimal_commas import with_decimals
    from sprag_study.service.reading.quantities import SI
    from sprag_study.service.reading.reader import CAPTIONS, Choice, reading_for
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.studies import STUDY_VIEWS
    from sprag_study.service.views.study_view import StudyAnswer, answer_of, is_drawn, written

    say(*warning_lines(parsed.warnings))
    view = STUDY_VIEWS[about.name]
    choice = Choice(drawing.get("units", SI), CAPTIONS)
    with naming_options(parsed.study, asked, ""):
        require_language(drawing)
        reading_for(parsed.study, parsed.spec, choice)
        if parsed.study.plan is None:  # otherwise the cases that it chooses decide what can be asked
            view.check(parsed.study, view.choose(parsed.study, about.question(**first)))
    known: list[tuple[Any, bool, StudyAnswer[Any, Any]]] = []

    def answer_as(settings: dict[str, Any], form: str) -> StudyAnswer[Any, Any]:
        """The view, found once for all its forms where these have the same."""
        chosen, drawn = view.choose(study, about.question(**settings)), view.drawn_differs and is_drawn(form)
        for other, other_drawn, answer in known:
            if (chosen, drawn) == (other, other_drawn):
                return answer
        known.append((chosen, drawn, answer_of(library, done.record.id, view, chosen, drawn=drawn)))
        return known[-1][-1]

    def file_of(settings: dict[str, Any], form: str) -> bytes:
        with naming_options(study, asked, ""):
            answer = answer_as(settings, form)
            with languages.language(drawing.get("language", languages.ENGLISH)):
                return written(view, answer, choice, study.name or study.model, form)

    settings = read_settings(database=db, processes=processes)
    with run_parsed(parsed, settings, _remark, db=db, processes=processes) as done:
        library, study = Library(done.store), done.store.studies.study(done.record.id)
        yield _Source(
            lambda settings: cast("dict[str, Any]", json.loads(file_of(settings, "json"))),
            lambda settings, form: with_decimals([file_of(settings, form)], drawing.get("decimal")),
            lambda: study.model,
        )


#: The commands by name.
COMMANDS: Final = {command.name: _function_of(command) for command in _COMMANDS}
