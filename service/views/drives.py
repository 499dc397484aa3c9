"""What the drives of a study with tolerances do: ribbons of quantiles, and the share that reaches conditions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from sprag_study.service.answers import tolerances as m
from sprag_study.service.faults import parameter_error
from sprag_study.service.figures.pictures import draw_map
from sprag_study.service.figures.read import read_map
from sprag_study.service.figures.ribbons import ribbon_figure, ribbon_map, yield_figure, yield_map
from sprag_study.service.formats import Picture
from sprag_study.service.results.defaults import drawn_results, main_query, varying_axes
from sprag_study.service.results.headlines.along import judged_by
from sprag_study.service.results.selection import axis_name, numeric_names, numeric_results
from sprag_study.service.results.tolerances.batch import Asked, places_of
from sprag_study.service.results.tolerances.conditions import first_condition, read_conditions
from sprag_study.service.results.tolerances.ribbons import QUANTILES, Ribbon, ribbon
from sprag_study.service.results.tolerances.written import ribbon_csv, ribbon_json, yield_csv, yield_json
from sprag_study.service.results.tolerances.yields import Yield, yields
from sprag_study.service.views import study_view
from sprag_study.service.views.branch import named
from sprag_study.service.views.curves import pairs
from sprag_study.service.views.setting import Offered
from sprag_study.service.views.study_questions import RIBBON, YIELD, RibbonQuestion, YieldQuestion
from sprag_study.service.views.study_view import StudyAnswer, StudyView
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study


@dataclass(frozen=True, slots=True)
class RibbonQuery:
    """Which ribbons: results (by default those drawn first), places, probabilities of quantiles, picture as a map."""

    y: tuple[str, ...] = ()
    asked: Asked = field(default_factory=Asked)
    quantiles: tuple[float, ...] = QUANTILES
    mapped: bool = False


@dataclass(frozen=True, slots=True)
class YieldQuery:
    """Which yield: conditions, places, number of worst drives, picture as a map."""

    conditions: tuple[str, ...]
    asked: Asked = field(default_factory=Asked)
    worst: int = 10
    mapped: bool = False


def _asked(question: RibbonQuestion | YieldQuestion) -> Asked:
    return Asked(question.x, tuple(dict.fromkeys(question.by or ())), pairs(question.at))


class _OfDrives:
    """Which studies have it, and the places to choose from."""

    def has(self, study: Study) -> bool:
        """Whether drives were drawn."""
        return study.batched

    def small(self, study: Study, chosen: object) -> bool:
        """By the cases of the study."""
        return study.cases <= study_view.FEW // 10

    def offered(self, study: Study) -> dict[str, Offered]:
        """The axes, the results, and what a good drive reaches first."""
        axes = {"": [(axis.paths[0], axis_name(study, axis.paths[0])) for axis in varying_axes(study)]}
        main, y = main_query(study), judged_by(study, drawn_results(study))
        return {
            "x": Offered((main.x,) if main else (), groups=axes, left_out=main is None),
            "by": Offered(groups=axes, left_out=len(axes[""]) < 2),
            "y": Offered((y,), groups=named(numeric_names(models.study_results(study)))),
            "quantile": Offered(tuple(f"{100.0 * p:g} %" for p in QUANTILES)),
            "condition": Offered((first_condition(study, y),)),
        }


RibbonAnswer = StudyAnswer[RibbonQuery, Ribbon]
YieldAnswer = StudyAnswer[YieldQuery, Yield]


class RibbonView(_OfDrives, StudyView[RibbonQuestion, RibbonQuery, Ribbon]):
    """Quantiles of results over the drives along an axis."""

    about = RIBBON
    content = "Quantiles over the drives, as JSON, a table or a picture."
    shape = m.RibbonReport

    def choose(self, study: Study, question: RibbonQuestion) -> RibbonQuery:
        """The query; a fault for several quantiles of a map."""
        given = question.quantiles
        if question.mapped and given is not None and len(given) > 1:
            raise parameter_error("quantile", "too-many", "a map shows one quantile", given, "one")
        quantiles = tuple(given) if given else (0.5,) if question.mapped else QUANTILES
        return RibbonQuery(tuple(dict.fromkeys(question.y or ())), _asked(question), quantiles, question.mapped)

    def check(self, study: Study, chosen: RibbonQuery) -> None:
        """The results and the axes."""
        numeric_results(models.study_results(study), "y", chosen.y)
        places_of(study, chosen.asked)

    def find(self, library: Library, study_id: str, chosen: RibbonQuery) -> Ribbon:
        """The ribbons; SelectionError as of `ribbon`."""
        study = library.store.studies.study(study_id)
        fetch = partial(library.store.rows.for_cases, study_id)
        return ribbon(study, chosen.y or drawn_results(study), chosen.asked, chosen.quantiles, fetch)

    def json(self, answer: RibbonAnswer) -> m.RibbonReport:
        """The ribbons as JSON data."""
        return ribbon_json(answer.study_id, answer.result)

    def csv(self, answer: RibbonAnswer, reading: Reading) -> bytes:
        """A row for each place and quantile."""
        return ribbon_csv(answer.result, reading.units)

    def figure(self, answer: RibbonAnswer, columns: int = 2) -> Figure:
        """The quantiles over the places."""
        return ribbon_figure(answer.result)

    def picture(self, answer: RibbonAnswer, reading: Reading, title: str, form: Picture) -> bytes:
        """The ribbons, or a map of the first quantile."""
        if not answer.chosen.mapped:
            return super().picture(answer, reading, title, form)
        return draw_map(read_map(ribbon_map(answer.result, answer.chosen.quantiles[0]), reading), title, form)


class YieldView(_OfDrives, StudyView[YieldQuestion, YieldQuery, Yield]):
    """The share of drives that reach conditions."""

    about = YIELD
    content = "Yields, as JSON, a table or a picture."
    shape = m.YieldReport

    def choose(self, study: Study, question: YieldQuestion) -> YieldQuery:
        """The query."""
        return YieldQuery(tuple(question.conditions), _asked(question), question.worst, question.mapped)

    def check(self, study: Study, chosen: YieldQuery) -> None:
        """The conditions and the axes."""
        read_conditions(models.study_results(study), chosen.conditions)
        places_of(study, chosen.asked)

    def find(self, library: Library, study_id: str, chosen: YieldQuery) -> Yield:
        """The yields; SelectionError as of `yields`."""
        study = library.store.studies.study(study_id)
        fetch = partial(library.store.rows.for_cases, study_id)
        return yields(study, chosen.conditions, chosen.asked, chosen.worst, fetch)

    def json(self, answer: YieldAnswer) -> m.YieldReport:
        """The yields as JSON data."""
        return yield_json(answer.study_id, answer.result)

    def csv(self, answer: YieldAnswer, reading: Reading) -> bytes:
        """A row for each place."""
        return yield_csv(answer.result, reading.units)

    def figure(self, answer: YieldAnswer, columns: int = 2) -> Figure:
        """The yield over the places."""
        return yield_figure(answer.result)

    def picture(self, answer: YieldAnswer, reading: Reading, title: str, form: Picture) -> bytes:
        """The yields over the places, or as a map."""
        if not answer.chosen.mapped:
            return super().picture(answer, reading, title, form)
        return draw_map(read_map(yield_map(answer.result), reading), title, form)
