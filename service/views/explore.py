"""Cases within ranges of parameters and results, sorted over all rows, with histograms."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag_study.service.answers import explore as m
from sprag_study.service.faults import refused
from sprag_study.service.figures.explore import explore_figure
from sprag_study.service.results.explore import Explored, ExploreQuery, explore, explored_csv, explored_json, plan_of
from sprag_study.service.spec.design import points_spec
from sprag_study.service.spec.stored import accepted
from sprag_study.service.views import study_view
from sprag_study.service.views.study_questions import EXPLORE, CasesQuestion, ExploreQuestion, SelectionQuestion
from sprag_study.service.views.study_view import StudyAnswer, StudyView

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study

#: The query, and the two quantities of a picture.
Chosen = tuple[ExploreQuery, tuple[str, str]]


def selection(question: SelectionQuestion | CasesQuestion, limit: int, show: tuple[str, ...] = ()) -> ExploreQuery:
    """The query of a question about cases."""
    kinds = question.ending or "", question.regime or "", question.flag or ""
    return ExploreQuery(tuple(question.where or ()), *kinds, question.sort, limit, show)


def read_ahead(library: Library, study_id: str) -> None:
    """Read the columns that people see first; raises StudyNotFoundError."""
    study = library.store.studies.study(study_id)
    library.columns.of(study_id, plan_of(study, ExploreQuery()).results)


def explored(library: Library, study_id: str, query: ExploreQuery) -> Explored:
    """The cases that a question selects; raises StudyNotFoundError, and SelectionError as `plan_of` does."""
    study = library.store.studies.study(study_id)
    plan = plan_of(study, query)
    return explore(study, plan, library.columns.of(study_id, plan.results))


def selection_spec(
    library: Library,
    study_id: str,
    query: ExploreQuery,
    find: Callable[[Library, str, ExploreQuery], Explored] = explored,
) -> dict[str, Any]:
    """The spec of a study of the first rows that ``find`` finds.

    Raises SelectionError where there are none, or nothing varies.
    """
    found = find(library, study_id, query)
    cases = found.rows.cases[found.order].tolist()
    if not cases:
        raise refused("where", "empty", "no case is selected")
    try:
        return points_spec(accepted(library.store.studies.spec(study_id), found.study), found.study, cases)
    except ValueError as error:
        raise refused("study", "nothing-varies", "no parameter of this study varies") from error


ExploreAnswer = StudyAnswer[Chosen, Explored]


class ExploreView(StudyView[ExploreQuestion, Chosen, Explored]):
    """All cases of a study at once."""

    about = EXPLORE
    content = "A selection of cases, as JSON, a table or a picture."
    shape = m.Exploration
    file = "selection"

    def choose(self, study: Study, question: ExploreQuestion) -> Chosen:
        """The query, and the quantities of a picture."""
        query = selection(question, question.limit, tuple(question.show or ()))
        return query, (question.x, question.y)

    def check(self, study: Study, chosen: Chosen) -> None:
        """The ranges and the names."""
        plan_of(study, chosen[0])

    def small(self, study: Study, chosen: Chosen) -> bool:
        """By the cases of the study and the rows that are wanted."""
        return study.cases <= study_view.FEW and chosen[0].limit <= study_view.FEW // 10

    def find(self, library: Library, study_id: str, chosen: Chosen) -> Explored:
        """The selected cases."""
        return explored(library, study_id, chosen[0])

    def json(self, answer: ExploreAnswer) -> m.Exploration:
        """The selection as JSON data."""
        return explored_json(answer.study_id, answer.result)

    def csv(self, answer: ExploreAnswer, reading: Reading) -> bytes:
        """The first rows."""
        return explored_csv(answer.study, answer.result, reading)

    def figure(self, answer: ExploreAnswer, columns: int = 2) -> Figure:
        """Two quantities of all cases."""
        return explore_figure(answer.result, *answer.chosen[1])
