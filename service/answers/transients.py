"""The answer about a transient of one case."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number


class Transient(TypedDict):
    """A run-up, a load step or the coasting of one case over time."""

    case: int
    parameters: dict[str, float]
    kind: Annotated[str, Doc("run-up, load-step or coasting")]
    load: Annotated[float, Doc("factor on the torque of the operations")]
    angle: Annotated[float, Doc("angle of the shaft at the start, rad")]
    torque: Annotated[float | None, Doc("constant driving torque, N*m; null with a motor")]
    within: Annotated[float, Doc("share of the first difference in speed at which the steady cycle counts as reached")]
    revolutions: Annotated[float, Doc("most revolutions that are computed")]
    outcome: Annotated[str, Doc("reached, stopped, not_started, not_reached, too_stiff or no_motion")]
    cause: Annotated[str, Doc("how it ended, and why, in a sentence")]
    results: Annotated[dict[str, Number], Doc("results by name, SI; null for what could not be computed")]
    units: Annotated[dict[str, str], Doc("unit of each result")]
    times: Annotated[list[float], Doc("times, s")]
    variables: Annotated[dict[str, dict[str, str]], Doc("unit of each variable")]
    values: Annotated[dict[str, list[Number]], Doc("every variable at the times")]
    ending: Annotated[str, Doc("ending of the steady cycle of the case")]
