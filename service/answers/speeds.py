"""The answer with all steady cycles of one case."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number, Value


class SteadyCycleRow(TypedDict):
    """A steady cycle of a machine shaft; speeds in rad/s."""

    stable: Annotated[bool, Doc("whether deviations die away, so that the shaft stays in it")]
    multiplier: Annotated[Number, Doc("factor by which a small deviation of the speed grows in a cycle")]
    mean: Annotated[float, Doc("mean speed, by the definition of the machine")]
    largest: float
    smallest: float
    irregularity: float
    start: Annotated[float, Doc("speed at the angle 0")]
    low: Annotated[Number, Doc("the shaft comes to it from speeds at the angle 0 above this; null of an unstable one")]
    high: Annotated[Number, Doc("and below this; null where there is no limit, and of an unstable one")]


class SteadySpeeds(TypedDict):
    """Every steady cycle of one case, and what becomes of the shaft from any speed; speeds in rad/s."""

    case: int
    parameters: dict[str, Value]
    load: Annotated[float, Doc("factor on the torque of the operations")]
    cycles: Annotated[list[SteadyCycleRow], Doc("by their speed, the slowest first")]
    of_case: Annotated[int | None, Doc("the cycle that the results of the case are about, counted from 0; or null")]
    stops_below: Annotated[
        Number, Doc("speed at the angle 0 up to which the shaft comes to a standstill; null where it does not")
    ]
    runs_away_above: Annotated[Number, Doc("speed from which it becomes faster and faster; null where it does not")]
    whole: Annotated[bool, Doc("whether the motion was followed from every computed speed")]
    speeds: Annotated[list[float], Doc("speeds at the angle 0")]
    changes: Annotated[
        list[float], Doc("by how much the shaft is faster a cycle later; where it stops, minus its speed")
    ]
    ending: Annotated[str, Doc("ending of the case")]
