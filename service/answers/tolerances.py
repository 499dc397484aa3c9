"""Answers about batches of drives: ribbons, yields, their causes."""

from __future__ import annotations

from typing import Annotated, Literal, NotRequired

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number
from sprag_study.service.answers.results import ResultMeaning

Numbers = list[Number]


class ToleranceInfo(TypedDict):
    """A tolerance of the study."""

    name: str
    change: Annotated[
        Literal["scale", "offset", "value"],
        Doc("what a draw is: a factor of the nominal value, a difference from it, or the value itself (SI)"),
    ]
    unit: Annotated[str, Doc("unit of the parameter")]


class PlacesAxis(TypedDict):
    """The axis along each line."""

    path: str
    unit: str


class ToleranceShare(TypedDict):
    """The share that one tolerance has of a variance."""

    tolerance: str
    share: Annotated[float | None, Doc("share of the variance that would vanish without it; null: not known")]
    error: Annotated[float | None, Doc("half width of its 95 % interval")]


class CausesInfo(TypedDict):
    """What tolerances a variance is owed to."""

    shares: Annotated[list[ToleranceShare], Doc("in order of the tolerances")]
    rest: Annotated[float | None, Doc("share of what tolerances do together; null: not known")]
    note: Annotated[str, Doc("what to know about the shares; empty for nothing")]


class ExtremeDrive(TypedDict):
    """A drive with a small or large result."""

    drive: int
    value: Annotated[float, Doc("mean of the result over the places")]
    case: Annotated[int, Doc("its case at the middle place")]


class ResultRibbon(TypedDict):
    """One result along a line."""

    nominal: Annotated[Numbers, Doc("of the nominal drive, for each place")]
    drives: Annotated[list[int], Doc("drives with the result, for each place")]
    values: Annotated[list[Numbers], Doc("for each quantile a list over the places")]
    low: Annotated[list[Numbers], Doc("lower ends of their 95 % intervals; null where there are too few drives")]
    high: Annotated[list[Numbers], Doc("upper ends")]
    causes: CausesInfo
    lowest: Annotated[list[ExtremeDrive], Doc("the drives with the least mean over the places, least first")]
    highest: Annotated[list[ExtremeDrive], Doc("those with the largest one, largest first")]


class PlacesLine(TypedDict):
    """The places of one line."""

    by: dict[str, float]
    at: dict[str, float]
    x: Annotated[list[float], Doc("values of the axis, SI; empty for a single place")]
    cases: Annotated[list[int], Doc("cases of the nominal drive")]
    failed: Annotated[list[int], Doc("drives that were run and lack a result, for each place")]
    pending: Annotated[list[int], Doc("drives that are not run yet")]


class RibbonLine(PlacesLine):
    """The places of one line, and the spread of each result there."""

    results: dict[str, ResultRibbon]


class RibbonReport(TypedDict):
    """Quantiles of results over the drives of a study with tolerances, along an axis."""

    study: str
    drives: Annotated[int, Doc("drawn drives; the nominal one is not counted")]
    tolerances: list[ToleranceInfo]
    x: Annotated[PlacesAxis | None, Doc("null for a single place")]
    units: Annotated[dict[str, str], Doc("units of the paths in `by` and `at`")]
    quantiles: list[float]
    results: dict[str, ResultMeaning]
    lines: list[RibbonLine]


class ConditionInfo(TypedDict):
    """A condition that drives reach or not."""

    text: str
    result: str
    unit: str
    kind: Literal["at_least", "at_most", "is"]
    limit: Annotated[float | str, Doc("SI, the name of a category, or a part of the nominal drive's value")]
    of_nominal: bool


class YieldShare(TypedDict):
    """The share of drives that reach all conditions."""

    reached: int
    drives: Annotated[int, Doc("drives that were run; one without a result does not reach the conditions")]
    value: Annotated[float | None, Doc("null without a drive")]
    low: Annotated[float | None, Doc("lower end of the 95 % interval (Wilson)")]
    high: float | None


class WorstDrive(TypedDict):
    """A drive at the place where it is worst."""

    drive: int
    case: int
    x: NotRequired[Annotated[float, Doc("the place, SI")]]
    margin: Annotated[float | None, Doc("least relative distance within the limits, negative outside; null: no result")]
    results: dict[str, Number]
    draws: Annotated[dict[str, float], Doc("its draw of each tolerance, as `change` says")]


class YieldLine(PlacesLine):
    """The yield along a line of places."""

    each: Annotated[list[YieldShare], Doc("for each place")]
    all: Annotated[YieldShare, Doc("drives that reach the conditions at every place of the line")]
    nominal: Annotated[list[bool], Doc("whether the nominal drive reaches them")]
    causes: Annotated[CausesInfo, Doc("of reaching them at every place")]
    worst: Annotated[list[WorstDrive], Doc("the drives with the least margins")]


class YieldReport(TypedDict):
    """The share of the drives of a study with tolerances that reach conditions."""

    study: str
    drives: int
    tolerances: list[ToleranceInfo]
    conditions: list[ConditionInfo]
    x: PlacesAxis | None
    units: dict[str, str]
    lines: list[YieldLine]
