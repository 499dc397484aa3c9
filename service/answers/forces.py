"""The answer with the forces of a case."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number, Value


class Forces(TypedDict):
    """The forces of one case on the vibrating table and on the bearings of its shaft."""

    case: int
    parameters: dict[str, Value]
    start: Annotated[float, Doc("start of the reported part, s")]
    end: Annotated[float, Doc("its end, s: after one turn of a periodic motion, or at the end of the window")]
    regime: Annotated[str | None, Doc("regime of the settled motion; null for a run of a given time")]
    shaft_mass: Annotated[float, Doc("mass of the shaft and of what is fixed to it, kg")]
    load_rating: Annotated[float | None, Doc("basic dynamic load rating of the bearing, N")]
    exponent: Annotated[float, Doc("exponent of the life: 3 for ball bearings, 10/3 for roller bearings")]
    share: Annotated[float, Doc("part of the load that the bearing with the largest load carries")]
    results: Annotated[dict[str, Number], Doc("results by name, SI; null for what does not exist")]
    units: Annotated[dict[str, str], Doc("unit of each result")]
    meanings: Annotated[dict[str, str], Doc("what each result is")]
    times: Annotated[list[float], Doc("s, within the reported part")]
    variables: Annotated[dict[str, dict[str, str]], Doc("unit of each variable")]
    values: Annotated[dict[str, list[Number]], Doc("forces at the times, by variable")]
    ending: str
