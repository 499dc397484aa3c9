"""The answers of a study: what one asks of it first."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from sprag_study.service.answers import key as m
from sprag_study.service.faults import refused
from sprag_study.service.figures.answers import answers_figure
from sprag_study.service.figures.pictures import require_drawable
from sprag_study.service.formats import Picture
from sprag_study.service.results.curve_cases import select
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.results.key_answer_words import answers_csv, report
from sprag_study.service.results.key_answers import (
    ReadAnswer,
    StudyAnswers,
    answers_query,
    find_answers,
    find_overall,
    read_point,
)
from sprag_study.service.storage.studies.records import CaseColumns
from sprag_study.service.views import study_view
from sprag_study.service.views.curves import completed_query
from sprag_study.service.views.study_questions import ANSWERS, AnswersQuestion
from sprag_study.service.views.study_view import StudyAnswer, StudyView

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study


@dataclass(frozen=True, slots=True)
class AnswersChoice:
    """The curves, None for those of the page; and the working point."""

    query: CurveQuery | None
    point: str | None


def answers_of(library: Library, study_id: str, chosen: CurveQuery | None, point: str | None) -> StudyAnswers:
    """The answers of a study, of the ``chosen`` curves; raises StudyNotFoundError, and SelectionError."""
    study = library.store.studies.study(study_id)
    query = answers_query(study, chosen)
    if query is None and chosen is not None:
        raise refused(
            "x", "not-used", "the cases of this study lie on no curves", chosen.x, allowed="no choice of curves"
        )
    found = answers_in(library, study_id, query, point)
    # While a large study runs, all its rows would be read again for each of its chunks.
    if not library.store.studies.get(study_id).over and study.cases > study_view.FEW:
        return found
    return replace(found, overall=overall_in(library, study_id))


def answers_in(library: Library, study_id: str, query: CurveQuery | None, point: str | None) -> StudyAnswers:
    """The answers of curves, found once until the study has other rows; raises as `find_answers` does."""

    def find() -> StudyAnswers:
        fetch = partial(library.store.rows.for_cases, study_id)
        return find_answers(library.store.studies.study(study_id), query, point, fetch)

    revision = library.store.studies.get(study_id).revision
    return library.answers.of((study_id, revision, query, point), find)


def overall_in(library: Library, study_id: str) -> tuple[ReadAnswer, ...]:
    """The extremes among all cases, found once until the study has other rows."""

    def find() -> tuple[ReadAnswer, ...]:
        return tuple(find_overall(library.store.studies.study(study_id), partial(whole_columns, library, study_id)))

    return library.overall.of((study_id, library.store.studies.get(study_id).revision), find)


def whole_columns(library: Library, study_id: str, names: Sequence[str]) -> CaseColumns:
    """Results of all finished cases."""
    rows = library.columns.of(study_id, names)
    kinds = [rows.kinds[kind] for kind in rows.kind.tolist()]
    return CaseColumns(rows.cases, [ending for ending, _ in kinds], rows.values, [flags for _, flags in kinds])


KeyAnswer = StudyAnswer[AnswersChoice, StudyAnswers]


class AnswersView(StudyView[AnswersQuestion, AnswersChoice, StudyAnswers]):
    """No-load speed, largest power, best efficiency, stall torque, a working point."""

    about = ANSWERS
    content = "Answers, as JSON, a table or a picture."
    shape = m.AnswerReport

    def choose(self, study: Study, question: AnswersQuestion) -> AnswersChoice:
        """The curves where some are chosen, and the working point."""
        chosen = question.x, (), question.by, question.at, question.of
        return AnswersChoice(completed_query(study, *chosen) if any(chosen) else None, question.point)

    def check(self, study: Study, chosen: AnswersChoice) -> None:
        """The axes and the working point."""
        query = answers_query(study, chosen.query)
        if query is not None:
            select(study, query)
            read_point(study, query, chosen.point)

    def small(self, study: Study, chosen: AnswersChoice) -> bool:
        """By the cases of the study."""
        return study.cases <= study_view.FEW // 2

    def find(self, library: Library, study_id: str, chosen: AnswersChoice) -> StudyAnswers:
        """The answers."""
        return answers_of(library, study_id, chosen.query, chosen.point)

    def json(self, answer: KeyAnswer) -> m.AnswerReport:
        """The answers as JSON data."""
        return report(answer.study_id, answer.study, answer.result)

    def csv(self, answer: KeyAnswer, reading: Reading) -> bytes:
        """A row for each answer."""
        return answers_csv(answer.study, answer.result, reading)

    def figure(self, answer: KeyAnswer, columns: int = 2) -> Figure | None:
        """The curves of the main results with their answers marked; None where the cases lie on no curve."""
        if answer.result.drawn is None:
            return None
        return answers_figure(answer.result, columns)

    def picture(self, answer: KeyAnswer, reading: Reading, title: str, form: Picture) -> bytes:
        """Where there is a curve, and not too many."""
        if answer.result.drawn is None:
            raise refused("format", "not-used", "there is no curve to draw", form, allowed="json or csv")
        require_drawable([answer.result.drawn])
        return super().picture(answer, reading, title, form)
