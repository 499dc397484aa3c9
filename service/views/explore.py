"""Cases within ranges of parameters and results, sorted over all rows, with histograms."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.answers import explore as m
from sprag.service.jobs.explore import explored
from sprag.service.results.explore import Explored, ExploreQuery, explored_csv, explored_json
from sprag.service.results.figures.explore import explore_figure
from sprag.service.views import study_view
from sprag.service.views.study_questions import EXPLORE, CasesQuestion, ExploreQuestion, SelectionQuestion
from sprag.service.views.study_view import Found, StudyView

if TYPE_CHECKING:
    from sprag.service.jobs.library import Library
    from sprag.service.reading.reader import Reading
    from sprag.service.results.figures.figure import Figure
    from sprag.worker.study import Study

#: The query, and the two quantities of a picture.
Chosen = tuple[ExploreQuery, tuple[str, str]]


def selection(question: SelectionQuestion | CasesQuestion, limit: int, show: tuple[str, ...] = ()) -> ExploreQuery:
    """The query of a question about cases."""
    kinds = question.ending or "", question.regime or "", question.flag or ""
    return ExploreQuery(tuple(question.where or ()), *kinds, question.sort, limit, show)


class ExploreView(StudyView[ExploreQuestion, Chosen, Explored]):
    """All cases of a study at once."""

    about = EXPLORE
    content = "A selection of cases, as JSON, a table or a picture."
    answer = m.Exploration
    file = "selection"
    selects = True

    def choose(self, study: Study, question: ExploreQuestion) -> Chosen:
        """The query, and the quantities of a picture."""
        query = selection(question, question.limit, tuple(question.show or ()))
        return query, (question.x, question.y)

    def small(self, study: Study, chosen: Chosen) -> bool:
        """By the cases of the study and the rows that are wanted."""
        return study.cases <= study_view.FEW and chosen[0].limit <= study_view.FEW // 10

    def find(self, library: Library, study_id: str, chosen: Chosen, *, drawn: bool = False) -> Explored:
        """The selected cases."""
        return explored(library, study_id, chosen[0])

    def json(self, found: Found[Chosen, Explored]) -> m.Exploration:
        """The selection as JSON data."""
        return explored_json(found.study_id, found.made)

    def csv(self, found: Found[Chosen, Explored], reading: Reading) -> bytes:
        """The first rows."""
        return explored_csv(found.study, found.made, reading)

    def figure(self, found: Found[Chosen, Explored], columns: int = 2) -> Figure:
        """Two quantities of all cases."""
        return explore_figure(found.made, *found.chosen[1])
