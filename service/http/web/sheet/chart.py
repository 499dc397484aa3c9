"""The charts of a sheet: curves with the working point, a map, designs, a calibration, or ribbons of drives."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

import numpy as np
from markupsafe import Markup
from starlette.datastructures import QueryParams

from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.figure import Note
from sprag_study.service.figures.read import read_figure, read_map
from sprag_study.service.http.web.figures.drawn import drawn, drawn_map
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.results.choice import curve_query, map_query, pairs_of
from sprag_study.service.results.curve_cases import drawn_curves, stored_map
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.results.defaults import caption, main_results
from sprag_study.service.results.headlines.along import (
    Along,
    case_sentence,
    curve_numbers,
    curve_place,
    judged_by,
    place_on,
)
from sprag_study.service.results.headlines.batch import asked_like
from sprag_study.service.results.headlines.headline import amount
from sprag_study.service.results.key_answer_words import curve_name
from sprag_study.service.results.key_answers import answers_query
from sprag_study.service.results.refined import curve_plan
from sprag_study.service.results.refined_maps import map_plan
from sprag_study.service.results.selection import numeric_names
from sprag_study.service.results.tolerances.ribbons import QUANTILES
from sprag_study.service.views.answers import answers_in
from sprag_study.service.views.calibration import CalibrationView
from sprag_study.service.views.drives import RibbonQuery, RibbonView
from sprag_study.service.views.front import FrontView
from sprag_study.service.views.relatives import asked_by
from sprag_study.service.views.study_questions import FrontQuestion
from sprag_study.service.views.study_view import answer_of
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.choice import MapQuery
    from sprag_study.service.results.curves import Curve, Curves
    from sprag_study.service.results.key_answers import StudyAnswers
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.study_view import StudyView
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

#: Parameters of the address that choose curves.
CHOICES: Final = ("x", "y", "by", "at", "of", "every")
#: In the place of the result of a map: the usual one.
_ANY: Final = "-"
#: Cases of a curve that a script tells about while the working point is moved.
_TOLD: Final = 250


@dataclass(frozen=True, slots=True)
class Slider:
    """The working point as a range: in the reader's units, with the cases of the chosen curve and what each says."""

    path: str
    low: float
    high: float
    value: float
    unit: str
    cases: list[tuple[float, str]]
    missing: str


@dataclass(frozen=True, slots=True)
class Chart:
    """What a sheet draws.

    Attributes
    ----------
    figure : the chart for wide and narrow places, with the sentence below it
    title : what it shows, for those who do not see it; ``held`` is what is held
    view, query : the view of the interface with its numbers, and what that is asked
    curves : the curves, a map, or neither
    chosen : place of the curve that is told of, of the ``names`` of all
    lower : what the lower chart can show: name, whether it does
    family : of several curves the name and the answers of each, by their titles
    """

    figure: Markup
    title: str
    view: str
    query: str
    held: list[str]
    slider: Slider | None = None
    curves: CurveQuery | None = None
    map: MapQuery | None = None
    chosen: int = 0
    names: tuple[Phrase, ...] = ()
    lower: tuple[tuple[str, bool], ...] = ()
    family: list[tuple[str, list[tuple[str, str]]]] = field(default_factory=list)


def has_chart(study: Study) -> bool:
    """Whether a study is drawn on its sheet once it has rows."""
    chosen = study.plan is not None or study.spread is not None
    return chosen or answers_query(study) is not None


def chart_of(
    library: Library, study_id: str, params: QueryParams, usual: CurveQuery | None, reading: Reading, cases: str
) -> Chart | None:
    """The chart that an address asks for, by default that of the kind of the study; None where there is none.

    Raises SelectionError. ``cases`` is the address of the cases.
    """
    study = library.store.studies.study(study_id)
    draw = partial(_drawn, library, study_id, reading, cases)
    kind = asked_by(study)
    if kind == "best":
        return draw(FrontView(), FrontQuestion(), Phrase("Every design of the search"))
    if kind == "measured":
        return draw(CalibrationView(), None, Phrase("Measured points on the fitted curve"))
    if params.get("z") or (map_plan(study) is not None and not params.get("x")):
        return _map(library, study_id, study, params, reading, cases)
    if study.spread is not None and not any(params.get(name) for name in CHOICES):
        names, places = (judged_by(study, models.results_by_name(study)),), asked_like(usual)
        own = pairs_of(CurveQuery(places.x or "", names, places.by, places.at))
        query = RibbonQuery(names, places, QUANTILES, False)
        title = Phrase("9 of 10 drives lie in the band")
        return draw(RibbonView(), query, title, urlencode([pair for pair in own if pair[1]]))
    return _curves(library, study_id, study, params, usual, reading, cases)


def _drawn(
    library: Library,
    study_id: str,
    reading: Reading,
    cases: str,
    view: StudyView[Any, Any, Any],
    chosen: Any,
    title: Phrase,
    query: str = "",
) -> Chart:
    label = reading.say(title)
    read = read_figure(view.drawn_in(answer_of(library, study_id, view, chosen), 1), reading)
    return Chart(drawn(replace(read, columns=1), label, cases), label, view.about.name, query, list(read.held))


def as_map(params: QueryParams) -> QueryParams:
    """The parameters of a map: the axis upwards has a name of its own beside the results of curves."""
    names = {"up": "y", "y": ""}
    pairs = [(names.get(name, name), value) for name, value in params.multi_items() if value != _ANY]
    return QueryParams([pair for pair in pairs if pair[0]])


def _map(
    library: Library,
    study_id: str,
    study: Study,
    params: QueryParams,
    reading: Reading,
    cases: str,
) -> Chart | None:
    query = map_query(study, as_map(params))
    if query is None:
        return None
    mapped = stored_map(library.store, study_id, CurveQuery(query.x, (query.z,), (query.y,), query.at))
    read = read_map(mapped, reading)
    label = Phrase(
        "{z} over {x} and {y}", z=reading.caption(query.z), x=reading.within(query.x), y=reading.within(query.y)
    )
    title, contours = reading.say(label), params.get("kind") == "contour"
    figure = drawn_map(read, title, cases, contours=contours)
    return Chart(figure, title, "map", urlencode(pairs_of(query)), list(read.held), map=query)


def results_of(
    study: Study, infos: Iterable[ResultInfo], params: QueryParams, drawn: Curves | None = None
) -> tuple[tuple[str, ...], list[str]]:
    """The results that are drawn, and those that the lower chart can show: none where others are asked for.

    What has no number on the ``drawn`` curves, whose first result has some, is not among these; None: not drawn yet.
    """
    asked = tuple(name for name in params.getlist("y") if name)
    if asked:
        return asked, []
    plan = curve_plan(study)
    known = plan.results if plan is not None else tuple(numeric_names(infos))
    first = judged_by(study, known)
    curves = () if drawn is None else drawn.curves
    empty = {name for curve in curves for name in curve.y if not _numbered(curves, name)}
    known = tuple(name for name in known if first in empty or name not in empty)
    others = (*models.presentation_of(study).below, *main_results(study))
    below = list(dict.fromkeys(name for name in others if name in known and name != first))[:4]
    lower = params.get("lower")
    second = lower if lower in below else next(iter(below), None)
    return (first, *([second] if second else ())), below


def _numbered(curves: Sequence[Curve], name: str) -> bool:
    return any(np.isfinite(curve.shown(name)).any() for curve in curves if name in curve.y)


def _curves(
    library: Library,
    study_id: str,
    study: Study,
    params: QueryParams,
    usual: CurveQuery | None,
    reading: Reading,
    cases: str,
) -> Chart | None:
    answers = answers_of_address(library, study_id, params, usual, reading)
    if answers.query is None or answers.drawn is None:
        return None
    names, below = results_of(study, models.study_results(study), params, answers.drawn)
    query = replace(answers.query, y=names)
    curves = drawn_curves(library.store, study_id, query)
    figure = curves_figure([("", curves)], 1)
    if below:  # after how many periods motions repeat is for those who choose curves
        figure = replace(figure, spans={}, looks={})
    titles = tuple(curve_name(one, study) for one in answers.curves)
    chosen = curve_place(study, answers, params.get("curve") or "")
    curve = answers.drawn.curves[chosen]
    asked = bool((params.get("point") or "").strip())
    spot = place_on(curve, judged_by(study, curve.y), answers.point, asked=asked)
    slider = None
    if spot is not None and not figure.note:
        own = Along(study, curve, answers.query.x, *spot)
        figure = _with_point(figure, own, names, chosen)
        slider = _slider(own, reading)
    read = read_figure(figure, reading)
    title = caption(study, query).said(reading)
    if study.sweep is not None:  # the answer says it
        read = replace(read, below="")
    picture = drawn(read, title, cases, str(chosen) if len(answers.curves) > 1 else "")
    return Chart(
        picture, title, "curves", urlencode(pairs_of(query)), list(read.held),
        slider=slider, curves=query, chosen=chosen, names=titles,
        lower=tuple((name, name in names) for name in below),
        family=_family(answers, titles, reading) if len(answers.curves) > 1 else [],
    )  # fmt: skip


def _family(
    answers: StudyAnswers, titles: Sequence[Phrase], reading: Reading
) -> list[tuple[str, list[tuple[str, str]]]]:
    """The answers of every curve in words."""
    return [
        (
            reading.say(title),
            [(number.title(reading), number.said(reading)) for number in curve_numbers(one, answers.unit)],
        )
        for title, one in zip(titles, answers.curves, strict=True)
    ]


def answers_of_address(
    library: Library, study_id: str, params: QueryParams, usual: CurveQuery | None, reading: Reading
) -> StudyAnswers:
    """The answers of the curves and the point that an address asks for. Raises SelectionError."""
    study = library.store.studies.study(study_id)
    query = answers_query(study, chosen_curves(study, params, usual))
    point = point_of(study, query, params, reading)
    return answers_in(library, study_id, query, point)


def chosen_curves(study: Study, params: QueryParams, usual: CurveQuery | None) -> CurveQuery | None:
    """The curves that an address asks for, otherwise the ``usual`` ones. Raises SelectionError."""
    if answers_query(study) is None:
        return None
    if not any(params.getlist(name) for name in CHOICES if name != "y"):
        return usual
    return curve_query(study, params)


def point_of(study: Study, query: CurveQuery | None, params: QueryParams, reading: Reading) -> str | None:
    """The working point of an address; a bare number is in the unit that the page shows."""
    text = (params.get("point") or "").strip()
    return (text if query is None else reading.typed(text, unit_of(study, query.x))) or None


def _with_point(figure: Figure, own: Along, names: tuple[str, ...], chosen: int) -> Figure:
    """The figure with the working point: a line across its panels, and a mark on the chosen curve."""
    panels = []
    for panel, name in zip(figure.panels, names, strict=True):
        notes: tuple[Note, ...] = ()
        value = own.value(own.places[0], name) if name in own.curve.y else np.nan
        if len(own.places) == 1 and np.isfinite(value):
            colour = next((line.colour for line in panel.lines if line.key == str(chosen)), "")
            text = joined("", [amount(models.results_by_name(own.study)[name], value)])
            notes = (Note(own.x, value, colour, "point", text, str(chosen)),)
        panels.append(replace(panel, notes=notes))
    return replace(figure, panels=tuple(panels), at=own.x)


def _slider(own: Along, reading: Reading) -> Slider | None:
    si = unit_of(own.study, own.path)
    run = own.curve.run().tolist()
    x = np.asarray(own.curve.line.x)[run]
    if np.unique(x).size < 2:
        return None
    told = [
        (float(reading.value(float(x[at]), si)), case_sentence(own, place).said(reading))
        for at, place in enumerate(run if len(run) <= _TOLD else ())
    ]
    missing = Phrase("No case was run at {place}.", place="#").said(reading)
    low, high = (float(reading.value(float(end), si)) for end in (x.min(), x.max()))
    value = float(f"{reading.value(own.x, si):.10g}")
    return Slider(own.path, low, high, value, reading.unit(si), told, missing)
