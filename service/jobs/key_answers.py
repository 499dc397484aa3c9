"""The answers of a study as bytes that are ready to be sent, as for `sprag.service.jobs.answers`."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from sprag.service.faults import refused
from sprag.service.jobs.answers import FEW
from sprag.service.jobs.reading import reading_of
from sprag.service.json_text import to_bytes
from sprag.service.results.figures.answers import answers_figure
from sprag.service.results.figures.read import read_figure
from sprag.service.results.key_answer_words import answers_csv, report
from sprag.service.results.key_answers import answers_query, find_answers
from sprag.service.results.pictures import curves as pictures
from sprag.service.storage.records import CaseColumns
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.jobs.library import Library
    from sprag.service.reading.reader import Choice
    from sprag.service.results.curves import CurveQuery
    from sprag.service.results.key_answers import StudyAnswers


def answers_of(library: Library, study_id: str, chosen: CurveQuery | None, point: str | None) -> StudyAnswers:
    """The answers of a study, of the ``chosen`` curves; raises StudyNotFoundError, and SelectionError."""
    study = library.store.study(study_id)
    infos = models.study_results(study)
    query = answers_query(study, infos, chosen)
    if query is None and chosen is not None:
        raise refused(
            "x", "not-used", "the cases of this study lie on no curves", chosen.x, allowed="no choice of curves"
        )
    # While a large study runs, all its rows would be read again for each of its chunks.
    over = library.store.get_study(study_id).over or study.cases <= FEW
    whole = partial(_whole, library, study_id) if over else None
    return find_answers(study, infos, query, point, partial(library.store.rows_for_cases, study_id), whole)


def _whole(library: Library, study_id: str, names: Sequence[str]) -> CaseColumns:
    """Results of all finished cases."""
    rows = library.columns.of(study_id, names)
    kinds = [rows.kinds[kind] for kind in rows.kind.tolist()]
    return CaseColumns(rows.cases, [ending for ending, _ in kinds], rows.values, [flags for _, flags in kinds])


def answers_as_json(library: Library, study_id: str, chosen: CurveQuery | None, point: str | None) -> bytes:
    """The answers as JSON text."""
    return to_bytes(report(study_id, library.store.study(study_id), answers_of(library, study_id, chosen, point)))


def answers_as_csv(
    library: Library, study_id: str, chosen: CurveQuery | None, point: str | None, choice: Choice
) -> bytes:
    """The answers as a table."""
    reading = reading_of(library.store, study_id, choice)
    return answers_csv(library.store.study(study_id), answers_of(library, study_id, chosen, point), reading)


def answers_picture(
    library: Library,
    study_id: str,
    chosen: CurveQuery | None,
    point: str | None,
    choice: Choice,
    title: str,
    form: pictures.Picture,
) -> bytes:
    """The curves of the main results with their answers marked, as a picture."""
    found = answers_of(library, study_id, chosen, point)
    if found.drawn is None:
        raise refused("format", "not-used", "there is no curve to draw", form, allowed="json or csv")
    pictures.require_drawable([found.drawn])
    figure = read_figure(answers_figure(found, 2), reading_of(library.store, study_id, choice))
    return pictures.draw_figure(figure, title, form)
