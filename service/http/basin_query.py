"""The parameters by which a basin is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final

from fastapi import Depends, Query

from sprag.service.results.basins import basin_query
from sprag.worker.limits import MAX_BASIN_POINTS

if TYPE_CHECKING:
    from sprag.service.results.basins import BasinQuery
    from sprag.worker.study import Study

Across = Annotated[
    str | None, Query(description="initial value across; by default the first one of the study's starts")
]
Along = Annotated[str | None, Query(description="the other initial value; by default the next one")]
End = Annotated[str | None, Query(description="SI or with a unit; by default as in the study's starts", max_length=80)]
Points = Annotated[int, Query(ge=2, le=MAX_BASIN_POINTS, description="values of each", examples=[2])]

#: Values of each, where a request gives none.
USUAL_POINTS: Final = 20


@dataclass(frozen=True, slots=True)
class BasinParameters:
    """What a request gives: texts, None where it gives nothing."""

    x: str | None
    y: str | None
    x_ends: tuple[str | None, str | None]
    y_ends: tuple[str | None, str | None]
    points: int

    def of(self, study: Study, case: int) -> BasinQuery:
        """What is asked for of a case; FaultError about a parameter."""
        return basin_query(study, case, self.x, self.y, {"x": self.x_ends, "y": self.y_ends}, self.points)


def _parameters(
    x: Across = None,
    y: Along = None,
    x_from: End = None,
    x_to: End = None,
    y_from: End = None,
    y_to: End = None,
    points: Points = USUAL_POINTS,
) -> BasinParameters:
    return BasinParameters(x, y, (x_from, x_to), (y_from, y_to), points)


#: Parameters of a route.
AskedBasin = Annotated[BasinParameters, Depends(_parameters)]
