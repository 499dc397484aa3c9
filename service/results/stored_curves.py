"""Curves and maps of a stored study."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.results.curve_cases import draw, draw_map, select
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.service.results.curves import Curve, CurveQuery, Curves, Map
    from sprag_study.service.storage.store import Store

#: Further motions of each case that a picture marks.
_MOST_FURTHER: Final = 4


def stored_curves(store: Store, study_id: str, query: CurveQuery) -> Curves:
    """The curves of a study; raises StudyNotFoundError, and SelectionError as `select` does."""
    study = store.studies.study(study_id)
    selection = select(study, query)
    return draw(selection, partial(store.rows.for_cases, study_id, number=query.number))


def drawn_curves(store: Store, study_id: str, query: CurveQuery) -> Curves:
    """The same for a picture: with the other motions of cases that have several, where the most frequent are drawn."""
    curves, study = stored_curves(store, study_id, query), store.studies.study(study_id)
    further: list[Curve] = []
    if query.number == 0 and models.numbered_by(study.model, models.variant_of(study)) is not None:
        for number in range(1, _MOST_FURTHER + 1):
            found = stored_curves(store, study_id, replace(query, number=number)).curves
            known = [curve for curve in found if any(np.isfinite(y).any() for y in curve.y.values())]
            if not known:
                break
            further += known
    return replace(curves, further=tuple(further))


def stored_map(store: Store, study_id: str, query: CurveQuery) -> Map:
    """The map of the one result of ``query`` over its x and its one axis of by; raises as `stored_curves` does."""
    study = store.studies.study(study_id)
    fetch = partial(store.rows.for_cases, study_id, number=query.number)
    return draw_map(study, query.x, query.by[0], query.y[0], query.at, fetch)
