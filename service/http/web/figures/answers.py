"""Figures of a study as bytes that are ready to be sent; as for `sprag.service.jobs.answers`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.http.web.figures.curves import curves_figure, map_figure
from sprag.service.jobs.answers import curves_of, map_of
from sprag.service.json_text import to_bytes

if TYPE_CHECKING:
    from sprag.service.jobs.checks import Library
    from sprag.service.results.curves import CurveQuery


def curves_json(library: Library, study_id: str, query: CurveQuery, columns: int) -> bytes:
    """The figure of curves, as JSON text."""
    return to_bytes(curves_figure([("", curves_of(library, study_id, query))], columns))


def map_json(library: Library, study_id: str, query: CurveQuery, contours: bool) -> bytes:
    """The figure of a map, as JSON text."""
    return to_bytes(map_figure(map_of(library, study_id, query), contours))
