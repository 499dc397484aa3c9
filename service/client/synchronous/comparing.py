"""Studies side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from sprag.service.answers.differing import MOST_COMPARED, common_axes
from sprag.service.client.comparison import Comparison, compared, held_in
from sprag.service.client.frames import Curves
from sprag.service.client.queries import query_of
from sprag.service.client.synchronous.study import Study

if TYPE_CHECKING:
    from sprag.service.client.queries import Value
    from sprag.service.client.synchronous.connection import Connection


def compare_studies(
    connection: Connection,
    studies: Sequence[str],
    x: str | None,
    y: str | Sequence[str],
    *,
    by: str | Sequence[str],
    at: Mapping[str, Value] | None,
) -> Comparison:
    """Studies, by their ids, and the same curves of each, as the page that compares them draws them.

    Axes that only some of them have are held at their usual value. There are no curves where no parameter varies in
    all of them. ValueError for less than two, or too many.
    """
    if not 2 <= len(studies) <= MOST_COMPARED:
        raise ValueError(f"2 to {MOST_COMPARED} studies can be compared, not {len(studies)}")
    details = [Study(connection, study_id).detail() for study_id in studies]
    axes = common_axes([[(axis["paths"], axis["values"]) for axis in detail["axes"]] for detail in details])
    if not axes and x is None:
        return compared(details, [])
    held = [held_in(detail, details, at) for detail in details]
    if x is None or not y:
        usual = (_curves(connection, studies[0], x, y, by, held[0])).data
        x = x or (path if (path := usual["x"]["path"]) in axes else axes[0])
        y = y or list(usual["results"])
        by = by or [path for curve in usual["curves"][:1] for path in curve["by"] if path in axes and path != x]
    return compared(
        details,
        [_curves(connection, study_id, x, y, by, own) for study_id, own in zip(studies, held, strict=True)],
    )


def _curves(
    connection: Connection,
    study_id: str,
    x: str | None,
    y: str | Sequence[str],
    by: str | Sequence[str],
    at: Mapping[str, Value],
) -> Curves:
    query = query_of({"x": x, "y": y, "by": by, "at": at, "rest": "usual"})
    return Curves(cast("Any", connection.request("GET", f"/studies/{study_id}/curves", params=query)))
