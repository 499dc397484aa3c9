"""Answers about strobes of settled motions: bifurcation diagrams and Poincare sections."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number, Value


class Sections(TypedDict):
    """Strobes of settled motions at one phase of the excitation: of a case, or along a parameter of it."""

    case: int
    parameters: dict[str, Value]
    along: Annotated[list[str], Doc("paths that have the value of the parameter; empty for a section")]
    unit: Annotated[str | None, Doc("SI unit of the parameter; null for a section")]
    phase: Annotated[float, Doc("phase of the excitation at the strobes, rad")]
    parameter: Annotated[list[float], Doc("values of the parameter, SI; empty for a section")]
    regime: Annotated[list[str | None], Doc("of each motion; null where the case did not end ok")]
    order: Annotated[list[int | None], Doc("excitation periods in one turn of each orbit; null where there is none")]
    variables: Annotated[dict[str, dict[str, str]], Doc("unit of each variable")]
    strobes: Annotated[
        dict[str, list[list[Number]]],
        Doc("of each variable and motion the values at its strobes: of a periodic motion those of one turn"),
    ]
