"""Studies side by side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from sprag_study.service.answers.differing import MOST_COMPARED, common_axes
from sprag_study.service.client.comparison import Comparison, compared, held_in

if TYPE_CHECKING:
    from sprag_study.service.client.asynchronous.study import AsyncStudy
    from sprag_study.service.client.queries import Held


async def compare(
    studies: Sequence[AsyncStudy],
    x: str | None = None,
    y: str | Sequence[str] = (),
    *,
    by: str | Sequence[str] = (),
    at: Held | None = None,
) -> Comparison:
    """Two to ten studies, of a service or run here: inputs in which they differ, and the same curves of each.

    Curves are chosen as in `Study.curves`; without ``x`` and ``y``, those that the first study shows first, over a
    parameter that varies in all of them. Axes that are not drawn and not in ``at`` are held at the usual value of each
    study, and a value of an axis that only some of them have applies to these. There are no curves where no parameter
    varies in all of them. ValueError for less than two studies, or too many.
    """
    if not 2 <= len(studies) <= MOST_COMPARED:
        raise ValueError(f"2 to {MOST_COMPARED} studies can be compared, not {len(studies)}")
    details = [await study.detail() for study in studies]
    axes = common_axes([[(axis["paths"], axis["values"]) for axis in detail["axes"]] for detail in details])
    if not axes and x is None:
        return compared(details, [])
    held = [held_in(detail, details, at) for detail in details]
    if x is None or not y:
        usual = (await studies[0].curves(x, y, by=by, at=held[0], rest="usual")).data
        x = x or (path if (path := usual["x"]["path"]) in axes else axes[0])
        y = y or list(usual["results"])
        by = by or [path for curve in usual["curves"][:1] for path in curve["by"] if path in axes and path != x]
    pairs = zip(studies, held, strict=True)
    return compared(details, [await study.curves(x, y, by=by, at=own, rest="usual") for study, own in pairs])
