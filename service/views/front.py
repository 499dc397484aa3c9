"""The designs of a study with a goal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.answers import goals as m
from sprag_study.service.figures.front import chosen as drawn_over
from sprag_study.service.figures.front import front_figure
from sprag_study.service.figures.pictures import MAX_PICTURE_POINTS, check_size
from sprag_study.service.formats import Picture
from sprag_study.service.results.fronts import Designs, front_csv, front_json, goal_of, infos_of
from sprag_study.service.views import study_view
from sprag_study.service.views.study_questions import FRONT, FrontQuestion
from sprag_study.service.views.study_view import StudyAnswer, StudyView

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study


FrontAnswer = StudyAnswer[FrontQuestion, Designs]


class FrontView(StudyView[FrontQuestion, FrontQuestion, Designs]):
    """The best designs of a search."""

    about = FRONT
    content = "Designs, as JSON, a table or a picture."
    shape = m.FrontReport

    def choose(self, study: Study, question: FrontQuestion) -> FrontQuestion:
        """The question; FaultError where the study has no goal."""
        goal_of(study)
        return question

    def check(self, study: Study, chosen: FrontQuestion) -> None:
        """The quantities of a picture."""
        plan = goal_of(study)
        drawn_over(plan, infos_of(study, plan), chosen.x, chosen.y)

    def small(self, study: Study, chosen: FrontQuestion) -> bool:
        """By the cases of the study: ranking takes a time that grows faster than their number."""
        return study.cases <= study_view.FEW // 10

    def find(self, library: Library, study_id: str, chosen: FrontQuestion) -> Designs:
        """The ranked designs."""
        return library.fronts.of(study_id, exact=chosen.exact)

    def json(self, answer: FrontAnswer) -> m.FrontReport:
        """The designs as JSON data."""
        return front_json(answer.study_id, answer.result, answer.chosen.limit)

    def csv(self, answer: FrontAnswer, reading: Reading) -> bytes:
        """A row for each design."""
        return front_csv(answer.result, answer.study, reading.units, answer.chosen.limit)

    def figure(self, answer: FrontAnswer, columns: int = 2) -> Figure:
        """The designs over two quantities."""
        return front_figure(answer.result, answer.chosen.x, answer.chosen.y)

    def picture(self, answer: FrontAnswer, reading: Reading, title: str, form: Picture) -> bytes:
        """Not too many designs."""
        check_size("designs", len(answer.result.numbers), MAX_PICTURE_POINTS)
        return super().picture(answer, reading, title, form)
