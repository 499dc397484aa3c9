"""The answer with the start-up of a case."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number, Value


class StartUp(TypedDict):
    """The start-up of one case with ramps of the excitation frequency and of the load."""

    case: int
    parameters: dict[str, Value]
    ramp: Annotated[float, Doc("time in which the excitation frequency rises to its value, s")]
    start_frequency: Annotated[float, Doc("frequency at which that ramp begins, Hz")]
    load_ramp: Annotated[float, Doc("time in which the load rises from nothing to its value, s")]
    within: Annotated[float, Doc("share by which a mean speed may differ from the settled one")]
    reached: Annotated[
        bool, Doc("whether the shaft came to its settled speed; otherwise results are of all that was computed")
    ]
    regime: Annotated[
        str | None, Doc("regime of the motion after the ramps; null where the load swings with the angle of the shaft")
    ]
    results: Annotated[dict[str, Number], Doc("results by name, SI; null for what does not exist")]
    units: Annotated[dict[str, str], Doc("unit of each result")]
    meanings: Annotated[dict[str, str], Doc("what each result is")]
    times: Annotated[list[float], Doc("s, from the start until some time after the speed is settled")]
    variables: Annotated[dict[str, dict[str, str]], Doc("unit of each variable")]
    values: Annotated[dict[str, list[Number]], Doc("every variable at the times")]
    states: Annotated[dict[str, list[str]], Doc("states of shaft and clutches at the times")]
    ending: str
