"""``sprag show ID curves``, ``map``, ``answers`` and their like: the views of a study, run here or of a service.

Their options are the settings of the views (`sprag_study.service.views.study_questions`); nothing else is loaded before
one runs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sprag_study.service.cli.case_views import before_run, say_file
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import WrongInputError, piped, table_words, write_json, write_table, wrong_option
from sprag_study.service.cli.described import option, parameter, query_of, signed
from sprag_study.service.cli.file_formats import file_format, require_csv, require_table
from sprag_study.service.cli.files import MAX_DATA_BYTES, decode, read_bytes, write_pieces
from sprag_study.service.cli.options import OF_SPEC, SHARED, in_decimals, in_language, in_units
from sprag_study.service.cli.remote import opened, read_in
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
from sprag_study.service.cli.sources import SpecOrStudy
from sprag_study.service.faults import Fault
from sprag_study.service.formats import PICTURES
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.numbers import probability_of
from sprag_study.service.views import study_questions as questions
from sprag_study.service.views.setting import settings_of

if TYPE_CHECKING:
    from sprag_study.service.formats import Decimal
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.service.views.setting import NamedSetting, ViewInfo

#: Formats of their files.
_FORMATS: Final = ("csv", *PICTURES)
_SHARED: Final = ("file", "units", "decimal", *OF_SPEC)
_Measured = Annotated[
    str | None,
    typer.Option("--measured", metavar="FILE", help="CSV file of measured points, instead of those of the spec."),
]


@dataclass(frozen=True, slots=True)
class Command:
    """The command of a view: its name, how it shows the answer, and what differs from the settings of the view.

    ``show`` gets the answer, and what gives its reading. ``few`` are the rows of a table, unless others are asked for;
    a file has as many as the question allows. Programs get the rows of the file, unless ``in_rows`` is false.
    """

    name: str
    about: ViewInfo
    show: Callable[[dict[str, Any], Callable[[], Reading]], None]
    few: int | None = None
    in_rows: bool = True


_COMMANDS: Final = (
    Command("answers", questions.ANSWERS, show_answers),
    Command("curves", questions.CURVES, lambda found, _reading: show_curves(found)),
    Command("explore", questions.EXPLORE, lambda found, _reading: show_cases(found), 20),
    Command("front", questions.FRONT, lambda found, _reading: show_designs(found), 20),
    Command("calibration", questions.CALIBRATION, lambda found, _reading: show_calibration(found), in_rows=False),
    Command("map", questions.MAP, lambda found, _reading: show_map(found)),
    Command("ribbon", questions.RIBBON, lambda found, _reading: show_ribbon(found)),
    Command("sensitivity", questions.SENSITIVITY, lambda found, _reading: show_sensitivity(found)),
    Command("yield", questions.YIELD, lambda found, _reading: show_yield(found)),
)


def _function_of(command: Command) -> Callable[..., None]:
    about = command.about
    asked = settings_of(about.question)

    def run(
        study: str, file: str | None, units: str | None, decimal: Decimal | None, points_file: str | None,
        tables: list[str] | None, db: str | None, measured: str | None = None, **settings: Any,
    ) -> None:  # fmt: skip
        form = None if file is None else file_format(file, _FORMATS)
        require_csv(None, decimal, form)
        require_table(units, form)
        if settings.get("quantiles"):
            settings["quantiles"] = list(map(_probability, settings["quantiles"]))
        whole, most = settings, None
        if command.few is not None:
            most = _most_rows(about.question)
            settings = {**settings, "limit": settings["limit"] or command.few}
            whole = {**settings, "limit": most}
        drawing = [*in_units(units), *in_decimals(decimal), *(in_language() if form in PICTURES else ())]
        from sprag_study.service.client.wire import study_path

        with opened(
            study, points=points_file, tables=tables, db=db, units=units, measured=measured,
            change=None if measured is None else partial(_with_measured, measured),
            check=partial(_check, about, asked, settings),
        ) as (source, study_id):  # fmt: skip
            view = f"{study_path(study_id)}/{about.name}"
            if file is not None and form is not None:
                with source.pieces(view, [*query_of(asked, whole), *drawing, ("format", form)]) as pieces:
                    write_pieces(file, pieces)
            query, rows = query_of(asked, settings), piped() and command.in_rows and not wants_json()
            # A service computes each form of an answer by itself; in rows only the number of cases of a file is said.
            needed = not rows or (file is not None and most is not None)
            answer = source.request("GET", view, params=query) if needed else {}
            if wants_json():
                write_json(answer)
            elif rows:
                write_table(source.read(view, [*query, *in_units(units), ("format", "csv")]))
            else:
                with read_in(source, study_id, units) as reading, table_words():
                    command.show(answer, reading)
        if file is not None:
            say_file(file, form, None if most is None or answer.get("selected", 0) <= most else most)

    own = [
        parameter(one.name, option(one), None if one.name == "limit" and command.few else one.default) for one in asked
    ]
    own += [parameter("measured", _Measured, None)] if about is questions.CALIBRATION else []
    shared = [parameter(name, SHARED[name], None) for name in _SHARED]
    return signed(run, about.summary, [parameter("study", SpecOrStudy, ...), *own, *shared])


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


def _check(
    about: ViewInfo, asked: tuple[NamedSetting, ...], settings: dict[str, Any], parsed: ParsedSpec
) -> None:  # fmt: skip
    """Refuse what the study of a spec cannot be asked before it is run; WrongInputError."""
    from sprag_study.service.results.selection import numeric_results
    from sprag_study.service.views.studies import STUDY_VIEWS
    from sprag_study.worker.models import study_results

    view = STUDY_VIEWS[about.name]
    with before_run(parsed.study, asked):
        for one in asked:
            if one.setting.metavar == "RESULT" and (names := settings[one.name]):
                numeric_results(study_results(parsed.study), one.alias, [names] if isinstance(names, str) else names)
        view.check(parsed.study, view.choose(parsed.study, about.question(**settings)))


#: The commands by name.
COMMANDS: Final = {command.name: _function_of(command) for command in _COMMANDS}
