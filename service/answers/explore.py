"""All cases of a study at once: a selection, its histograms and its first rows."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number, Value


class Histogram(TypedDict):
    """Numbers of cases in equal intervals of a quantity."""

    edges: Annotated[list[float], Doc("ends of the intervals, SI; one more than there are intervals")]
    all: Annotated[list[int], Doc("of all finished cases")]
    selected: list[int]


class ExploredQuantity(TypedDict):
    """A parameter or a result, and how the cases are spread over it."""

    name: str
    unit: str
    histogram: Annotated[Histogram | None, Doc("null: no case has a number")]


class ExploredCase(TypedDict):
    """One selected case."""

    case: int
    ending: str
    flags: list[str]
    regime: str | None
    parameters: Annotated[dict[str, Value], Doc("values of the axes and of derived parameters, SI")]
    results: Annotated[dict[str, Number], Doc("the shown results, SI")]


class Exploration(TypedDict):
    """The cases that ranges and kinds select, the first ones in the requested order."""

    study: str
    known: Annotated[int, Doc("finished cases")]
    selected: int
    quantities: list[ExploredQuantity]
    cases: Annotated[list[ExploredCase], Doc("at most `limit` of the selected cases")]
