"""Studies side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from sprag.service.answers.differing import MOST_COMPARED
from sprag.service.client.asynchronous.study import AsyncStudy
from sprag.service.client.comparison import Comparison, compared
from sprag.service.client.frames import Curves

if TYPE_CHECKING:
    from sprag.service.client.asynchronous.connection import AsyncConnection
    from sprag.service.client.queries import Value


async def compare_studies(
    connection: AsyncConnection,
    studies: Sequence[str],
    x: str | None,
    y: str | Sequence[str],
    *,
    by: str | Sequence[str],
    at: Mapping[str, Value] | None,
) -> Comparison:
    """Studies, by their ids, and the same curves of each; ValueError for less than two, or too many."""
    if not 2 <= len(studies) <= MOST_COMPARED:
        raise ValueError(f"2 to {MOST_COMPARED} studies can be compared, not {len(studies)}")
    details, curves = [], list[Curves]()
    for study_id in studies:
        study = AsyncStudy(connection, study_id)
        details.append(await study.detail())
        found = await study.curves(x, y, by=by, at=at)
        if not curves and found.data["curves"]:
            # The others have the curves of the first, however it has chosen them.
            first = found.data["curves"][0]
            x, y, by, at = found.data["x"]["path"], list(found.data["results"]), list(first["by"]), first["at"]
        curves.append(found)
    return compared(details, curves)
