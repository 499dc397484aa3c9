"""The answers of a study that people ask for first, as the API gives them."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Value


class AnswerFacts(TypedDict):
    """What is known of one answer. Numbers are SI."""

    name: str
    title: str
    kind: Annotated[
        str,
        Doc(
            "how it is read off its curve: at_zero (where x is 0), largest, smallest, until_zero (the x up to which "
            "the result is above 0) or here (at the working point)"
        ),
    ]
    result: Annotated[str, Doc("the result that it is read from")]
    result_unit: Annotated[str, Doc("of this result; `unit` is that of the value, which may be a place on the axis")]
    unit: str
    description: str
    value: Annotated[float | None, Doc("null: there is none, see `why`")]
    x: Annotated[float | None, Doc("value of the axis along the curve at which it holds")]
    low: Annotated[
        float | None,
        Doc("neighbouring values of the axis: the largest value of the curve itself may lie anywhere between them"),
    ]
    high: float | None
    above: Annotated[bool, Doc("of until_zero: no case has 0, so the true value is above this one")]
    there: Annotated[float | None, Doc("of until_zero with `above`: the result at this place")]
    edge: Annotated[bool, Doc("an extreme at the end of the axis, which may go on beyond it")]
    interpolated: Annotated[bool, Doc("on a straight line between two cases")]
    cases: Annotated[list[int], Doc("the case that it was read from, or the two that it is between")]
    of_cases: Annotated[int, Doc("how many cases were compared")]
    half_width: Annotated[float | None, Doc("of the 95 % interval of a mean of irregular motion")]
    error: Annotated[float | None, Doc("of a refined curve, relative to its range")]
    regime: str | None
    flags: list[str]
    why: Annotated[str | None, Doc("why there is no value: no-case, outside, not-joined, no-result or unsettled")]


class AnswerValue(AnswerFacts):
    """One answer, such as the largest useful power and the load of it."""

    note: Annotated[str, Doc("the same in words")]


class OverallAnswer(AnswerValue):
    """An extreme among all cases of a study."""

    parameters: Annotated[dict[str, Value], Doc("of its case")]


class CurveAnswer(TypedDict):
    """The answers of one curve."""

    by: dict[str, Value]
    at: dict[str, Value]
    answers: list[AnswerValue]
    working_point: Annotated[list[AnswerValue], Doc("the main results at the working point")]


class AnswerReport(TypedDict):
    """What people ask of a study first."""

    study: str
    x: Annotated[str | None, Doc("path of the axis along the curves; null where the cases lie on none")]
    unit: Annotated[str | None, Doc("of x and the working point")]
    point: Annotated[float | None, Doc("value of x of the working point")]
    units: Annotated[dict[str, str], Doc("SI units of the parameters")]
    curves: list[CurveAnswer]
    overall: Annotated[list[OverallAnswer], Doc("extremes among all cases of the study, not of these curves only")]
