"""The answers on the page of a study: what is chosen in its address, and what is shown of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from starlette.datastructures import QueryParams

from sprag.service.faults import SelectionError
from sprag.service.figures.pictures import MAX_PICTURE_POINTS
from sprag.service.http import views
from sprag.service.http.language import language_pairs
from sprag.service.http.reading import address_pairs
from sprag.service.http.web.held import with_held
from sprag.service.languages import decimal
from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.units import split_quantity, to_float
from sprag.service.reading.wording import unit_text
from sprag.service.results.choice import curve_query, pairs_of, value_choices
from sprag.service.results.key_answer_words import answer_facts, curve_name, curve_named, note_of, place_text
from sprag.service.results.key_answers import answers_query, usual_curve
from sprag.service.views.answers import answers_of
from sprag.service.views.library import reading_of
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.faults import Fault
    from sprag.service.reading.reader import Choice, Phrase, Reading
    from sprag.service.results.curves import CurveQuery
    from sprag.service.results.key_answers import CurveAnswers, Found, StudyAnswers
    from sprag.service.views.library import Library
    from sprag.worker.study import Study

#: Parameters of the page's address that choose curves.
_CURVES: Final = ("x", "by", "at", "of", "every")


@dataclass(frozen=True, slots=True)
class Tile:
    """One answer as the page shows it."""

    title: str
    value: float | None
    unit: str
    where: float | None = None
    above: bool = False
    note: str = ""
    cases: tuple[int, ...] = ()
    place: str = ""


@dataclass(frozen=True, slots=True)
class FamilyRow:
    """The answers of one curve of a family, aligned with the titles of the table."""

    name: str
    tiles: list[Tile]


@dataclass(frozen=True, slots=True)
class AnswersOnPage:
    """What the page shows of the answers of a study.

    Attributes
    ----------
    faults : why they are not those that were asked for
    query : the curves; None where the cases lie on none
    point : the working point as typed, otherwise its SI number; ``unit`` is its unit
    place : the working point that is shown, with a unit
    chosen : place of the curve whose answers are shown, of the ``names`` of all curves; ``codes`` in addresses
    tiles, here : its answers, and its main results at the working point
    family : the answers of all curves, where there are several
    overall : extremes among all cases
    choices : values of the axes that tell curves apart, where some are chosen
    figure, picture : addresses of the figure and of its picture
    report : parameters of the report with these answers
    """

    faults: tuple[Fault, ...] = ()
    query: CurveQuery | None = None
    point: str = ""
    place: str = ""
    unit: str = "1"
    chosen: int = 0
    names: list[Phrase] = field(default_factory=list)
    codes: list[str] = field(default_factory=list)
    tiles: list[Tile] = field(default_factory=list)
    here: list[Tile] = field(default_factory=list)
    family: list[FamilyRow] = field(default_factory=list)
    overall: list[Tile] = field(default_factory=list)
    choices: list[dict[str, Any]] = field(default_factory=list)
    figure: str | None = None
    picture: str | None = None
    report: list[tuple[str, str]] = field(default_factory=list)

    @property
    def known(self) -> bool:
        """Whether there is any answer."""
        return any(tile.value is not None for tile in (*self.tiles, *self.here))


def answers_choice(study: Study, given: QueryParams, usual: CurveQuery | None) -> CurveQuery | None:
    """The curves that the address of the page asks for, otherwise the ``usual`` ones; raises SelectionError."""
    infos = models.study_results(study)
    if answers_query(study, infos) is None:
        return None
    if not any(given.getlist(name) for name in _CURVES):
        return usual
    return curve_query(study, infos, given)


def answers_view(
    library: Library, study_id: str, given: Sequence[tuple[str, str]], usual: CurveQuery | None, choice: Choice
) -> AnswersOnPage:
    """The answers of a study as the page shows them; those of the ``usual`` curves where others cannot be shown."""
    study, params = library.store.studies.study(study_id), QueryParams(list(given))
    faults: tuple[Fault, ...] = ()
    reading = reading_of(library.store, study_id, choice)
    params = with_held(params, study, reading)
    point: str | None = None
    query = usual
    try:
        query = answers_choice(study, params, usual)
        point = _point(study, query, params, reading)
        found = answers_of(library, study_id, query, point)
    except SelectionError as error:
        faults, query, typed = error.faults, usual, point
        found = answers_of(library, study_id, usual, None)
        return _view(study, study_id, found, faults, typed or "", "", reading, choice)
    return _view(study, study_id, found, faults, point or "", params.get("curve") or "", reading, choice)


def _point(study: Study, query: CurveQuery | None, params: QueryParams, reading: Reading) -> str | None:
    """The working point of the address; a bare number is in the unit that the page shows."""
    text = (params.get("point") or "").strip()
    return (text if query is None else reading.typed(text, unit_of(study, query.x))) or None


def _view(
    study: Study,
    study_id: str,
    found: StudyAnswers,
    faults: tuple[Fault, ...],
    point: str,
    curve: str,
    reading: Reading,
    choice: Choice,
) -> AnswersOnPage:
    names = [curve_name(one, study) for one in found.curves]
    asked_for = curve_named(names, curve)
    chosen = usual_curve(study, found) if asked_for is None else asked_for
    one = found.curves[chosen] if found.curves else None
    overall = [_tile(item, found.unit, reading, study) for item in found.overall if item.value is not None]
    if one is None:
        return AnswersOnPage(faults, overall=overall)
    tiles, here = ([_tile(item, found.unit, reading) for item in part] for part in (one.answers, one.working_point))
    if found.query is None:
        return AnswersOnPage(faults, tiles=tiles or here, here=here if tiles else [])
    pairs = pairs_of(found.query)
    asked = [pair for pair in pairs if pair[0] != "y"]
    shown = [("point", point)] if point and not faults else []
    usual = f"{reading.value(found.point, found.unit):.10g}" if found.point is not None else ""
    used = point if point and not faults else usual
    unit = reading.unit(found.unit)
    drawn = sum(line.cases.size for line in (part.line for part in found.curves)) * len(found.query.y)
    address = views.study_address(study_id)
    named = [("curve", names[chosen]), ("columns", "2")]
    in_file = [*address_pairs(choice), *language_pairs()]
    picture = f"{address}/answers?{urlencode([*asked, *shown, ('format', 'svg'), *in_file])}"
    return AnswersOnPage(
        faults,
        found.query,
        point or usual,
        _as_read(used, unit) if used else "",
        unit,
        chosen,
        names,
        list(map(str, names)),
        tiles,
        here,
        [
            FamilyRow(name, _row(part, found, reading))
            for name, part in zip(names, found.curves, strict=True)
            if len(names) > 1
        ],
        overall,
        value_choices(study, found.query),
        f"/studies/{study_id}/figures/answers?{urlencode([*asked, *shown, *named, *address_pairs(choice)])}",
        picture if drawn <= MAX_PICTURE_POINTS else None,
        [*asked, *shown],
    )


def _as_read(text: str, unit: str) -> str:
    """A working point, typed in any language, as its reader has it; a bare number is in ``unit``."""
    value, own = split_quantity(text)
    return f"{decimal(f'{to_float(value):.10g}')} {unit_text(own or unit)}".strip()


def _row(one: CurveAnswers, found: StudyAnswers, reading: Reading) -> list[Tile]:
    return [_tile(item, found.unit, reading) for item in (one.answers or one.working_point)]


def _tile(item: Found, x_unit: str, reading: Reading, study: Study | None = None) -> Tile:
    """An answer in the units and words of the reader."""
    where = None if item.answer.kind in ("at_zero", "until_zero", "here") else item.x
    title = reading.say_name(item.answer.title) if item.answer.title == item.answer.result else item.answer.title
    return Tile(
        reading.say(title),
        reading.value(item.value, item.unit),
        reading.unit(item.unit),
        reading.value(where, x_unit),
        item.above,
        note_of(answer_facts(item), x_unit).said(reading),
        tuple(case for case in (item.case, item.other) if case is not None),
        place_text(study, item.case).said(reading) if study is not None and item.case is not None else "",
    )
