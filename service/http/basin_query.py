"""The parameters by which a basin is asked for."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query

from sprag.worker.limits import MAX_BASIN_POINTS

Across = Annotated[
    str | None, Query(description="initial value across; by default the first one of the study's starts")
]
Along = Annotated[str | None, Query(description="the other initial value; by default the next one")]
End = Annotated[str | None, Query(description="SI or with a unit; by default as in the study's starts", max_length=80)]
Points = Annotated[int, Query(ge=2, le=MAX_BASIN_POINTS, description="values of each", examples=[2])]
