"""Calibrations as answers: values with intervals, residuals, the fitted curve, the next point."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.service import exports
from sprag_study.service.json_text import numbers
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.results.calibration_words import sentences
from sprag_study.worker import models

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.answers.calibration import (
        CalibratedParameter,
        CalibrationCurvePoint,
        CalibrationDirection,
        CalibrationPoint,
        CalibrationReport,
        FarPoint,
        LackOfFit,
        NextMeasurement,
        SensorOffset,
    )
    from sprag_study.service.reading.quantities import Units
    from sprag_study.service.results.calibration import Calibration


def calibration_json(study_id: str, found: Calibration) -> CalibrationReport:
    """The calibration as an answer."""
    plan, known = found.plan, found.answer
    return {
        "study": study_id,
        "phase": found.summary["phase"],
        "complete": found.summary["complete"],
        "loss": plan.loss,
        "seed": plan.seed,
        "parameters": [_parameter(found, index) for index in range(len(plan.fitted))],
        "correlations": None if known is None or known.correlations is None else _rows(known.correlations),
        "chi_square": None if known is None else known.chi_square,
        "freedom": plan.freedom if known is None else known.freedom,
        "sigma_given": plan.known_sigma,
        "refits": 0 if known is None else known.refits,
        "points": [_point(found, index) for index in range(plan.count)],
        "directions": [] if known is None else [_direction(found, index) for index in range(len(known.directions))],
        "next": _next(found),
        "lack_of_fit": _lack(found),
        "far_point": _far(found),
        "offsets": _offsets(found),
        "curve": _curve(found),
        "sentences": sentences(found),
    }


def _rows(matrix: NDArray[np.float64]) -> list[list[float | int | None]]:
    return [numbers(row) for row in matrix]


def _parameter(found: Calibration, index: int) -> CalibratedParameter:
    one, known = found.plan.fitted[index], found.answer
    interval = None if known is None or known.intervals is None else known.intervals[index].tolist()
    touching = (False, False) if known is None or known.at_bounds is None else known.at_bounds[index].tolist()
    return {
        "name": one.paths[0],
        "paths": [] if found.sensor(index) else list(one.paths),
        "sensor": found.sensor(index) or None,
        "unit": found.unit(index),
        "low": one.low,
        "high": one.high,
        "value": None if known is None else float(known.values[index]),
        "interval": interval,
        "deviation": None if known is None or known.deviations is None else float(known.deviations[index]),
        "at_low": touching[0],
        "at_high": touching[1],
        "prior": None if one.prior is None else {"mean": one.prior[0], "sigma": one.prior[1]},
    }


def _point(found: Calibration, index: int) -> CalibrationPoint:
    plan, known = found.plan, found.answer
    conditions, columns = plan.places
    given = plan.sigma[index]
    ribbon = None if known is None else known.ribbon_measured
    sigma, fitted, residual, leverage = numbers(
        np.array([given, np.nan, np.nan, np.nan])
        if known is None
        else np.array([known.sigma[index], known.modelled[index], known.residuals[index], known.leverages[index]])
    )
    inside = ribbon is not None and bool(np.isfinite(ribbon[index]).all())
    return {
        "result": plan.results[columns[index]],
        "at": found.at(plan.at[conditions[index]]),
        "measured": float(plan.values[index]),
        "sigma": sigma,
        "fitted": fitted,
        "interval": ribbon[index].tolist() if ribbon is not None and inside else None,
        "residual": residual,
        "leverage": leverage,
    }


def _direction(found: Calibration, index: int) -> CalibrationDirection:
    assert found.answer is not None
    one = found.answer.directions[index]
    names = [found.names[place] for place in one.parameters]
    return {
        "parameters": names,
        "changes": dict(zip(names, one.changes, strict=True)),
        "undetermined": one.undetermined,
    }


def _next(found: Calibration) -> NextMeasurement | None:
    if found.answer is None or found.answer.next is None:
        return None
    one = found.answer.next
    return {
        "at": found.at(np.array(one.condition)),
        "spread": dict(zip(found.plan.results, one.spread, strict=True)),
        "narrower": dict(zip(found.names, one.narrower, strict=True)),
    }


def _lack(found: Calibration) -> LackOfFit | None:
    test = found.test
    if test is None:
        return None
    return {
        "result": found.plan.results[test.column],
        "test": test.test,
        "statistic": test.statistic,
        "freedom": list(test.freedom),
        "p": test.p,
    }


def _far(found: Calibration) -> FarPoint | None:
    far = found.far
    if far is None:
        return None
    return {"number": far.place + 1, "deleted_residual": far.deleted, "cook": far.cook, "p": far.p}


def _offsets(found: Calibration) -> list[SensorOffset]:
    return [
        {
            "result": found.plan.results[one.column],
            "offset": one.value,
            "deviation": one.deviation,
            "p": one.p,
            "share": one.share,
            "p_after": one.rest,
        }
        for one in (found.answer.offsets if found.answer else ())
    ]


def _curve(found: Calibration) -> list[CalibrationCurvePoint]:
    known = found.answer
    if known is None or known.curve is None or known.others is None:
        return []
    ribbon = known.ribbon
    return [
        {
            "at": found.at(condition),
            "values": dict(zip(found.plan.results, numbers(known.curve[index]), strict=True)),
            "intervals": {}
            if ribbon is None
            else {name: numbers(ribbon[index, column]) for column, name in enumerate(found.plan.results)},
        }
        for index, condition in enumerate(known.others)
    ]


def calibration_csv(found: Calibration, shown: Units) -> bytes:
    """A row for each measured value: its condition, measured and fitted value, residual.

    In a reader's units; measured values of several units are in SI.
    """
    points: list[dict[str, Any]] = [{**_point(found, index)} for index in range(found.plan.count)]
    ends: list[Any] = [point["interval"] or (None, None) for point in points]
    columns: dict[str, list[Any]] = {
        **{path: [point["at"][path] for point in points] for path in found.plan.paths_at},
        **{name: [point[name] for point in points] for name in ("result", "measured", "sigma", "fitted")},
        "fitted.low": [low for low, _ in ends],
        "fitted.high": [high for _, high in ends],
        **{name: [point[name] for point in points] for name in ("residual", "leverage")},
    }
    of_result = {info.name: info.unit for info in models.study_results(found.study)}
    measured = {of_result[point["result"]] for point in points}
    units = {path: unit_of(found.study, path) for path in found.plan.paths_at}
    if len(measured) == 1:
        units |= dict.fromkeys(("measured", "sigma", "fitted", "fitted.low", "fitted.high", "residual"), measured.pop())
    return exports.read_table(columns, units, shown)
