"""Curves and maps of a study: what is asked for, the tables as CSV, and the figures."""

from __future__ import annotations

from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service import exports
from sprag_study.service.answers import results as m
from sprag_study.service.faults import parameter_error
from sprag_study.service.figures import pictures
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.pictures import draw_map
from sprag_study.service.figures.read import read_map
from sprag_study.service.formats import Picture
from sprag_study.service.json_text import numbers
from sprag_study.service.results.choice import held
from sprag_study.service.results.curve_cases import check_map, drawn_curves, select, stored_curves, stored_map
from sprag_study.service.results.curves import CurveQuery, Curves, Map, Pairs, flag_names
from sprag_study.service.results.defaults import completed, drawn_numbers
from sprag_study.service.results.refined import not_joined, scattered
from sprag_study.service.results.refined_maps import check_refined_map, map_plan
from sprag_study.service.results.regimes import kind_columns
from sprag_study.service.views import study_view
from sprag_study.service.views.study_questions import CURVES, MAP, CurvesQuestion, MapQuestion
from sprag_study.service.views.study_view import StudyAnswer, StudyView
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.curves import Curve
    from sprag_study.service.views.library import Library
    from sprag_study.worker.planning.refine_plan import RefinePlan
    from sprag_study.worker.study import Study


#: Behind the name of a result: the half width of its band where the motion is irregular, a column of tables.
BAND: Final = ".band"


def pairs(texts: Sequence[str] | None, parameter: str = "at") -> Pairs:
    """Paths and values of a setting such as ``at``; raises a fault for a text without a path or a value."""
    found = []
    for item in texts or ():
        path, separator, value = item.partition("=")
        if not separator or not path.strip() or not value.strip():
            raise parameter_error(
                parameter, "invalid-text", "must be path=value", item, "for instance shaft.load=0.1 N*m"
            )
        found.append((path.strip(), value.strip()))
    return tuple(found)


def completed_query(
    study: Study,
    x: str | None,
    y: Sequence[str] | None,
    by: Sequence[str] | None,
    at: Sequence[str] | None,
    of: Sequence[str] | None,
) -> CurveQuery:
    """The curves of settings; what is not given is as on the page of the study."""
    return completed(study, x, tuple(y or ()), tuple(by or ()), pairs(at), pairs(of, "of"))


def _numbered(study: Study, query: CurveQuery, number: int) -> CurveQuery:
    """The query about the regime with a number; a fault where the cases of the study have one row each."""
    if number and models.numbered_by(study.model, models.variant_of(study)) is None:
        allowed = "0; other numbers in studies with `starts`"
        raise parameter_error("number", "out-of-range", "the cases of this study have one row each", number, allowed)
    return replace(query, number=number)


CurvesAnswer = StudyAnswer[CurveQuery, Curves]
MapAnswer = StudyAnswer[tuple[CurveQuery, bool], Map]


class CurvesView(StudyView[CurvesQuestion, CurveQuery, Curves]):
    """Results against one axis."""

    about = CURVES
    content = "Curves, as JSON, a table or a picture."
    shape = m.Curves

    def choose(self, study: Study, question: CurvesQuestion) -> CurveQuery:
        """The query, with the axes held at their usual value if that is wanted."""
        query = completed_query(study, question.x, question.y, question.by, question.at, question.of)
        if question.rest == "usual":
            given = [f"{path}={value}" for path, value in query.at]
            query = replace(query, at=held(study, given, (query.x, *query.by)))
        return _numbered(study, query, question.number)

    def check(self, study: Study, chosen: CurveQuery) -> None:
        """The axes and the results."""
        select(study, chosen)

    def small(self, study: Study, chosen: CurveQuery) -> bool:
        """By the numbers of the curves."""
        return drawn_numbers(study, chosen) <= study_view.FEW

    def find(self, library: Library, study_id: str, chosen: CurveQuery) -> Curves:
        """The curves."""
        return stored_curves(library.store, study_id, chosen)

    def find_drawn(self, library: Library, study_id: str, chosen: CurveQuery) -> Curves:
        """The curves with the other motions of cases that have several."""
        return drawn_curves(library.store, study_id, chosen)

    def json(self, answer: CurvesAnswer) -> dict[str, Any]:
        """The curves as JSON data."""
        return {"study": answer.study_id, **answer.result.to_json()}

    def csv(self, answer: CurvesAnswer, reading: Reading) -> bytes:
        """Every point of every curve as one row: fixed parameters, case, x, results, regime and its order, ending.

        Of refined curves also the results that are not interpolated up to the next point, and of settled ones those
        that scatter up to there, with the half widths of their bands; of a sweep whether the motion jumps between this
        point and the next.
        """
        curves = answer.result
        names, infos = kind_columns(curves.selection.regime), curves.selection.results
        columns = exports.stacked(
            {
                **curve.fixed(answer.result.selection.units),
                curves.selection.x: list(curve.line.x),
                **{info.name: numbers(curve.y[info.name], info.kind == "count") for info in infos},
                **dict(zip(names, (curve.regimes or [], curve.orders or []), strict=False)),
                **_jumped(curve),
                **_not_joined(curve, [info.name for info in infos]),
                **_scattered(curve, curves.selection.plan, [info.name for info in infos]),
                **curve.ends(),
            }
            for curve in curves.curves
        )
        units = {**curves.selection.units, **{info.name: info.unit for info in curves.selection.results}}
        units |= {f"{info.name}{BAND}": info.unit for info in curves.selection.results}
        return exports.read_table(columns, units, reading.units)

    def figure(self, answer: CurvesAnswer, columns: int = 2) -> Figure:
        """A panel for each result."""
        return curves_figure([("", answer.result)], columns)

    def picture(self, answer: CurvesAnswer, reading: Reading, title: str, form: Picture) -> bytes:
        """Not too many curves and points."""
        pictures.require_drawable([answer.result])
        return super().picture(answer, reading, title, form)


def _jumped(curve: Curve) -> dict[str, list[Any]]:
    """A column of a sweep: 1 where the motion jumps between the point of a row and the next one."""
    if curve.jumps is None:
        return {}
    lows = {jump["low"] for jump in curve.jumps}
    return {"jump": [int(x in lows) for x in curve.line.x]}


def _not_joined(curve: Curve, names: list[str]) -> dict[str, list[Any]]:
    """A column of refined curves: the results that are not interpolated from the point of a row to the next one."""
    if curve.refined is None:
        return {}
    texts = [""] * len(curve.endings)
    for place, text in zip(curve.run().tolist(), not_joined(curve.refined, names), strict=True):
        texts[place] = text
    return {"not_joined": texts}


def _scattered(curve: Curve, plan: RefinePlan | None, names: list[str]) -> dict[str, list[Any]]:
    """Columns of settled refined curves: the results that scatter from the point of a row to the next one, and their
    half widths at the point.
    """
    if curve.refined is None or plan is None or not plan.regime:
        return {}
    texts = [""] * len(curve.endings)
    for place, text in zip(curve.run().tolist(), scattered(curve.refined, names), strict=True):
        texts[place] = text
    return {"irregular": texts, **{f"{name}{BAND}": curve.band(name) for name in names if name in plan.results}}


class MapView(StudyView[MapQuestion, tuple[CurveQuery, bool], Map]):
    """One result over two axes; chosen are the query, and whether lines of equal value are drawn."""

    about = MAP
    content = "A map, as JSON, a table or a picture."
    shape = m.Map

    def choose(self, study: Study, question: MapQuestion) -> tuple[CurveQuery, bool]:
        """The query, and the kind of picture."""
        query = CurveQuery(question.x, (question.z,), (question.y,), pairs(question.at))
        return _numbered(study, query, question.number), question.kind == "contour"

    def check(self, study: Study, chosen: tuple[CurveQuery, bool]) -> None:
        """The axes and the result."""
        query, _ = chosen
        names = query.x, query.by[0], query.y[0]
        plan = map_plan(study)
        if plan is None:
            check_map(study, *names, query.at)
        else:
            check_refined_map(study, plan, names, query.at)

    def small(self, study: Study, chosen: tuple[CurveQuery, bool]) -> bool:
        """By the numbers of the map."""
        return drawn_numbers(study, chosen[0]) <= study_view.FEW

    def find(self, library: Library, study_id: str, chosen: tuple[CurveQuery, bool]) -> Map:
        """The map."""
        return stored_map(library.store, study_id, chosen[0])

    def json(self, answer: MapAnswer) -> dict[str, Any]:
        """The map as JSON data."""
        return {"study": answer.study_id, **answer.result.to_json()}

    def csv(self, answer: MapAnswer, reading: Reading) -> bytes:
        """Every point of the map as one row: fixed parameters, y, x, case, result, regime and its order, flags, ending.

        The squares of a refined map are no cases: they have neither regimes nor flags.
        """
        drawn = answer.result
        across, points = len(drawn.x_values), drawn.values.size
        kinds = kind_columns(models.regime_info(models.study_results(answer.study)))
        flags = [""] * points if drawn.flags is None else list(chain.from_iterable(drawn.flags))
        columns: dict[str, list[Any]] = {
            **{path: [value] * points for path, value in drawn.at.items()},
            drawn.y: [y for y in drawn.y_values for _ in range(across)],
            drawn.x: [*drawn.x_values] * len(drawn.y_values),
            **({} if drawn.refined else {"case": drawn.cases.reshape(-1).tolist()}),
            drawn.result.name: numbers(drawn.values.reshape(-1), drawn.result.kind == "count"),
            **{
                name: list(chain.from_iterable(rows))
                for name, rows in zip(kinds, (drawn.regimes, drawn.orders), strict=False)
                if rows is not None
            },
            **({} if drawn.refined else {"flags": [" ".join(names) for names in flag_names(flags)]}),
            "ending": list(chain.from_iterable(drawn.endings)),
        }
        (x_unit, y_unit), result = drawn.units, drawn.result
        units = {**drawn.at_units, drawn.x: x_unit, drawn.y: y_unit, result.name: result.unit}
        return exports.read_table(columns, units, reading.units)

    def picture(self, answer: MapAnswer, reading: Reading, title: str, form: Picture) -> bytes:
        """Colours, or lines of equal value."""
        return draw_map(read_map(answer.result, reading), title, form, contours=answer.chosen[1])
