"""Answers about studies that calibrate: values with intervals, measured points with residuals, what to measure next."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number


class Prior(TypedDict):
    """What was known of a parameter before the measurement, as a normal distribution."""

    mean: Annotated[float, Doc("SI")]
    sigma: Annotated[float, Doc("standard deviation, SI")]


class CalibratedParameter(TypedDict):
    """An unknown parameter, or the gain or the offset of a sensor."""

    name: Annotated[str, Doc("the first of `paths`, or that of the result with `.gain` or `.offset`")]
    paths: Annotated[list[str], Doc("the parameters that take the value together; none for gain or offset")]
    sensor: Annotated[str | None, Doc("the measured result whose gain or offset it is; null for a parameter")]
    unit: str
    low: Annotated[float, Doc("lower end of its range, SI")]
    high: Annotated[float, Doc("upper end of its range, SI")]
    value: Annotated[Number, Doc("best value, SI; null before the first fit")]
    interval: Annotated[list[float] | None, Doc("ends of the 95 % interval, SI; null without refits")]
    deviation: Annotated[Number, Doc("standard deviation over the refits, SI; null without refits")]
    at_low: Annotated[bool, Doc("whether the interval reaches the lower end of the range")]
    at_high: Annotated[bool, Doc("whether the interval reaches the upper end of the range")]
    prior: Annotated[Prior | None, Doc("null where none was given")]


class CalibrationPoint(TypedDict):
    """A measured value beside the fitted one."""

    result: str
    at: Annotated[dict[str, float], Doc("the measured condition, SI")]
    measured: Annotated[float, Doc("SI")]
    sigma: Annotated[Number, Doc("standard deviation, SI: as given, otherwise from the residuals")]
    fitted: Annotated[Number, Doc("as the sensor reads it, SI; null where the case has no result")]
    interval: Annotated[list[float] | None, Doc("ends of the 95 % interval of `fitted`, SI; null without refits")]
    residual: Annotated[Number, Doc("measured less fitted, in standard deviations")]
    leverage: Annotated[
        Number, Doc("how much the point determines the fit, 0 to 1; their sum is the number of unknowns")
    ]


class CalibrationDirection(TypedDict):
    """Parameters that these points do not separate."""

    parameters: Annotated[list[str], Doc("the one that changes most first")]
    changes: Annotated[dict[str, float], Doc("their changes together that the points do not show, SI")]
    undetermined: Annotated[bool, Doc("whether nothing is known within the ranges; otherwise little")]


class NextMeasurement(TypedDict):
    """The condition, among some between and around the measured ones, whose measurement would say most."""

    at: Annotated[dict[str, float], Doc("SI")]
    spread: Annotated[dict[str, float], Doc("standard deviation of each result there over the refits, SI")]
    narrower: Annotated[dict[str, float], Doc("by how much each standard deviation would shrink, 0 to 1")]


class LackOfFit(TypedDict):
    """A test for lack of fit, of the result that fits worst."""

    result: str
    test: Annotated[str, Doc("pure error: the F test against the scatter of repeated points; runs: of the residuals")]
    statistic: Annotated[float, Doc("F, or the number of runs of residuals of the same sign")]
    freedom: Annotated[
        list[float], Doc("degrees of freedom of lack of fit and pure error; or how many residuals are above and below")
    ]
    p: Annotated[float, Doc("probability of such a value where the model is right, times the number of tests")]


class FarPoint(TypedDict):
    """The measured value that is farthest off what the others say."""

    number: Annotated[int, Doc("its place among `points`, from 1")]
    deleted_residual: Annotated[float, Doc("residual in standard deviations that follow from the other values")]
    cook: Annotated[float, Doc("Cook's distance: how far the value moves the fit")]
    p: Annotated[float, Doc("probability of such a residual of any value where all scatter alike")]


class SensorOffset(TypedDict):
    """What an offset of the sensor of a result, as a further unknown, would do to the fit, linearised."""

    result: str
    offset: Annotated[float, Doc("measured less modelled, SI")]
    deviation: Annotated[float, Doc("its standard deviation, SI")]
    p: Annotated[float, Doc("probability of such an offset where there is none, times the number of results")]
    share: Annotated[float, Doc("part of the sum of the squares of the residuals that it takes, 0 to 1")]
    p_after: Annotated[
        float, Doc("that of the residuals it leaves, where the model is right; 1 where no test is possible")
    ]


class CalibrationCurvePoint(TypedDict):
    """The fit at a condition between or around the measured ones."""

    at: Annotated[dict[str, float], Doc("SI")]
    values: Annotated[dict[str, Number], Doc("each result, SI")]
    intervals: Annotated[dict[str, list[Number]], Doc("ends of its 95 % interval, SI; empty without refits")]


class CalibrationReport(TypedDict):
    """What a calibration has found, as far as it has come."""

    study: str
    phase: Annotated[str, Doc("what comes next: scan, fit, intervals, curve, or ended")]
    complete: Annotated[bool, Doc("whether fit, intervals and curve are all there")]
    loss: str
    seed: int
    parameters: list[CalibratedParameter]
    correlations: Annotated[list[list[Number]] | None, Doc("over the refits, in the order of `parameters`")]
    chi_square: Annotated[Number, Doc("sum of the squares of the residuals")]
    freedom: Annotated[int, Doc("degrees of freedom: measured values less what is fitted")]
    sigma_given: Annotated[bool, Doc("whether the standard deviations were given")]
    refits: Annotated[int, Doc("refits that the intervals rest on")]
    points: list[CalibrationPoint]
    directions: list[CalibrationDirection]
    next: NextMeasurement | None
    lack_of_fit: Annotated[
        LackOfFit | None, Doc("null where sigma is given and chi-square says it, or where there are too few points")
    ]
    far_point: Annotated[FarPoint | None, Doc("null where sigma is given, or with another loss than linear")]
    offsets: Annotated[list[SensorOffset], Doc("of each result that the parameters cannot imitate")]
    curve: list[CalibrationCurvePoint]
    sentences: Annotated[list[str], Doc("what should be known before the values are used")]
