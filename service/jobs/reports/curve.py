"""The picture of a report: the first figure that was put into it, or the first curve of the study's page."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from sprag_study.service.figures.pictures import draw_curves
from sprag_study.service.reading.reader import Choice, reading_for
from sprag_study.service.report.chosen_figures import chosen_figures
from sprag_study.service.results.curve_cases import draw, select
from sprag_study.service.results.defaults import main_query

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store


def small_curve(store: Store, study_id: str, units: str) -> bytes | None:
    """The figure or the curve as PNG; None for a study whose cases lie on no curves.

    Raises StudyNotFoundError, and SelectionError for curves that cannot be drawn.
    """
    study, choice = store.studies.study(study_id), Choice(units)
    chosen = next((figure for figure in chosen_figures(store, study_id, choice) if figure.shown is not None), None)
    if chosen is not None:
        return chosen.draw("png", chosen.name)
    query = main_query(study)
    if query is None:
        return None
    fetch = partial(store.rows.for_cases, study_id)
    drawn = draw(select(study, replace(query, y=query.y[:1])), fetch)
    return draw_curves(drawn, "", "png", reading_for(study, store.studies.spec(study_id), choice))
