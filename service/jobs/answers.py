"""Curves and maps as bytes that are ready to be sent.

The service itself writes small answers; those with more than `FEW` numbers belong in a checking process, because
reading and writing them takes seconds during which nobody else would be answered.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Final

from sprag.service.json_text import to_bytes
from sprag.service.results import exports
from sprag.service.results.curves import draw, draw_map, select
from sprag.service.results.pictures import curves as pictures
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.jobs.checks import Library
    from sprag.service.results.curves import CurveQuery, Curves, Map

#: Numbers of curves or a map that are read and written in about ten milliseconds.
FEW: Final = 20_000


def curves_of(library: Library, study_id: str, query: CurveQuery) -> Curves:
    """The curves of a study; raises StudyNotFound, and SelectionError as `select` does."""
    study = library.store.study(study_id)
    selection = select(study, models.study_results(study), query)
    return draw(selection, partial(library.store.rows_for_cases, study_id))


def curves_json(library: Library, study_id: str, query: CurveQuery) -> bytes:
    """The curves as JSON text."""
    return to_bytes({"study": study_id, **curves_of(library, study_id, query).to_json()})


def curves_csv(library: Library, study_id: str, query: CurveQuery) -> bytes:
    """Every point of every curve as one row: fixed parameters, x, results, ending."""
    curves = curves_of(library, study_id, query)
    first = curves.curves[0].line
    paths = [*first.by, *first.at]
    names = [info.name for info in curves.selection.results]
    regime = [] if curves.selection.regime is None else [curves.selection.regime.name]
    columns: list[list[Any]] = [[] for _ in range(len(paths) + 2 + len(names) + 1 + len(regime))]
    for curve in curves.curves:
        held = {**curve.line.by, **curve.line.at}
        points = len(curve.endings)
        parts: list[list[Any]] = [[held[path]] * points for path in paths]
        parts += [curve.line.cases.tolist(), list(curve.line.x)]
        parts += [curve.y[name].tolist() for name in names]
        parts += [curve.regimes] if curve.regimes is not None else []
        for column, part in zip(columns, [*parts, curve.endings], strict=True):
            column.extend(part)
    return exports.table_csv([*paths, "case", curves.selection.x, *names, *regime, "ending"], columns)


def curves_picture(library: Library, study_id: str, query: CurveQuery, title: str, form: pictures.Picture) -> bytes:
    """The curves as a picture."""
    return pictures.draw_curves(curves_of(library, study_id, query), title, form)


def map_of(library: Library, study_id: str, query: CurveQuery) -> Map:
    """The map of the one result of ``query`` over its x and its one axis of by; raises as `curves_of` does."""
    study = library.store.study(study_id)
    fetch = partial(library.store.rows_for_cases, study_id)
    return draw_map(study, models.study_results(study), query.x, query.by[0], query.y[0], query.at, fetch)


def map_json(library: Library, study_id: str, query: CurveQuery) -> bytes:
    """The map as JSON text."""
    return to_bytes({"study": study_id, **map_of(library, study_id, query).to_json()})


def map_picture(library: Library, study_id: str, query: CurveQuery, title: str, form: pictures.Picture) -> bytes:
    """The map as a picture."""
    return pictures.draw_map(map_of(library, study_id, query), title, form)
