"""Calibrations as answers: values with intervals, residuals, the fitted curve, the next point."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Amount, Name, Part
from sprag_study.service import exports
from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.json_text import numbers
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.worker import models
from sprag_study.worker.models import WorkerEnding
from sprag_study.worker.planning.calibrate import CalibratePlan, CalibratePlanner
from sprag_study.worker.planning.calibrate.answer import Answer, Direction, answer
from sprag_study.worker.planning.calibrate.lack_of_fit import CHANCE, FarValue, FitTest, far_value, lack_of_fit
from sprag_study.worker.planning.calibrate.plan import CALIBRATE
from sprag_study.worker.planning.calibrate.stored import from_json
from sprag_study.worker.planning.rounds import Rows

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

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
    from sprag_study.service.results.curves import Fetch
    from sprag_study.service.storage.studies.records import RoundRecord
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study


@dataclass(frozen=True, slots=True)
class Calibration:
    """A calibration as far as it has come.

    Attributes
    ----------
    study : Study
    plan : CalibratePlan
    infos : dict of ResultInfo
        The measured results by their names.
    answer : Answer or None
        None before the first fit.
    summary : dict
        As of the planner.
    converged : int
        Refits that have converged.
    """

    study: Study
    plan: CalibratePlan
    infos: dict[str, ResultInfo]
    answer: Answer | None
    summary: dict[str, Any]
    converged: int

    @property
    def test(self) -> FitTest | None:
        """The test for lack of fit; None where chi-square says as much, or where points are too few."""
        known = self.answer
        if known is None or self.plan.known_sigma:
            return None
        return lack_of_fit(self.plan, known.residuals, known.sigma, known.leverages)

    @property
    def far(self) -> FarValue | None:
        """The value that is farthest off the others; None where sigma says how far each is."""
        known = self.answer
        if known is None or self.plan.known_sigma:
            return None
        return far_value(self.plan, known.residuals, known.leverages)

    @property
    def sentences(self) -> list[str]:
        """What should be known before the values are used."""
        return sentences(self)

    @property
    def doubts(self) -> list[str]:
        """Those of the sentences about the fit and the measurement."""
        return [] if self.answer is None else list(_doubts(self, self.answer))

    @property
    def names(self) -> list[str]:
        """Names of what is fitted: the unknown parameters, then gains and offsets of sensors."""
        return [one.paths[0] for one in self.plan.fitted]

    def sensor(self, place: int) -> str:
        """The result whose sensor has the gain or offset at that place of `names`; "" for a parameter."""
        return "" if place < len(self.plan.unknown) else self.names[place].rpartition(".")[0]

    def unit(self, place: int) -> str:
        """The unit of what is at that place of `names`."""
        result, name = self.sensor(place), self.names[place]
        if not result:
            return unit_of(self.study, name)
        return "1" if name.endswith(".gain") else self.infos[result].unit

    def called(self, place: int, *, within: bool = True) -> Name | Phrase:
        """What it is called, within a sentence or at the beginning."""
        result, name = self.sensor(place), self.names[place]
        if not result:
            return Name(name, within=within)
        about = {"name": Name(result, within=True)}
        if name.endswith(".gain"):
            return Phrase("gain of {name}", **about) if within else Phrase("Gain of {name}", **about)
        return Phrase("offset of {name}", **about) if within else Phrase("Offset of {name}", **about)


def plan_of(study: Study) -> CalibratePlan:
    """The calibration of a study; FaultError for a study without one."""
    if study.plan is None or study.kind != CALIBRATE:
        message = N_("the study is not a calibration")
        fault = Fault(None, "conflict", message, allowed="a study whose spec has `calibrate`")
        raise FaultError("invalid-selection", message, [fault])
    return CalibratePlan.from_json(study.plan)


def calibration_of(study: Study, rounds: list[RoundRecord], fetch: Fetch) -> Calibration:
    """What the rows of whole rounds show, or the answer that an ended calibration has stored.

    Raises FaultError for a study that is not a calibration.

    Parameters
    ----------
    rounds : list of RoundRecord
        As `Studies.rounds` gives them.
    fetch : callable
        Gives rows by numbers of cases and names of results.
    """
    plan = plan_of(study)
    infos = {info.name: info for info in models.study_results(study) if info.name in plan.results}
    if rounds and not len(rounds[-1].cases) and "answer" in rounds[-1].summary:
        summary = dict(rounds[-1].summary)
        known, converged = summary.pop("answer"), summary.pop("converged")
        return Calibration(study, plan, infos, None if known is None else from_json(known), summary, converged)
    planner = CalibratePlanner(plan)
    for record in rounds:
        if not len(record.cases):
            break
        cases = np.arange(record.cases.start, record.cases.stop, dtype=np.int64)
        columns = fetch(cases, list(plan.results))
        endings = [ending or WorkerEnding.CANCELLED for ending in columns.endings]
        if WorkerEnding.CANCELLED in endings:
            break
        ok = models.usable(study.model, columns.endings, columns.flags)
        planner.tell(Rows(study.points(record.cases), ok, columns.values))
    refits = planner.state.refits
    converged = 0 if refits is None else int(np.count_nonzero(refits.converged))
    return Calibration(
        study, plan, infos, answer(planner.plan, planner.space, planner.state), planner.summary(), converged
    )


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
        "sentences": found.sentences,
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
        "at": _at(found, plan.at[conditions[index]]),
        "measured": float(plan.values[index]),
        "sigma": sigma,
        "fitted": fitted,
        "interval": ribbon[index].tolist() if ribbon is not None and inside else None,
        "residual": residual,
        "leverage": leverage,
    }


def _at(found: Calibration, condition: NDArray[np.float64]) -> dict[str, float]:
    return dict(zip(found.plan.paths_at, condition.tolist(), strict=True))


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
        "at": _at(found, np.array(one.condition)),
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
            "at": _at(found, condition),
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


#: Probability below which a chi-square is not explained by chance.
_CHANCE: Final = 0.01
#: Part of the squares of the residuals that an offset has to take where the rest is no chance.
_MOST_OF: Final = 0.9
#: Standard deviations from which on a point is named.
_FAR: Final = 4.0
#: Share of refits that may end before they converge without a word.
_ENDED: Final = 0.25
_MOST_POINTS: Final = 5


def sentences(found: Calibration) -> list[str]:
    """What should be known before the values are used."""
    known = found.answer
    if known is None:
        return []
    return [
        *_doubts(found, known),
        *_deviations(found, known),
        *(_undetermined(found, one) for one in known.directions),
        *_bounds(found, known),
        *_refits(found, known),
        *_next_point(found, known),
    ]


def _doubts(found: Calibration, known: Answer) -> Iterator[str]:
    """Whether the model fits, and what in the measurement may be wrong."""
    yield from _fits(found)
    yield from _chi_square(found, known)
    yield from _shifted(found, known)
    yield from _points(found, known)


def _fits(found: Calibration) -> Iterator[Phrase]:
    """Whether the residuals are chance, where no sigma says how large they may be."""
    if found.plan.known_sigma:
        return
    test = found.test
    if test is None:
        yield Phrase("These points are too few to test whether the model fits: repeat some of them, or give sigma.")
        return
    values: dict[str, Part] = {
        "name": Name(found.plan.results[test.column], within=True),
        "p": Amount(test.p, "1", 2, form=".2g"),
    }
    if test.test == "runs":
        values |= {"runs": round(test.statistic), "total": round(sum(test.freedom))}
        if test.p < CHANCE:
            yield Phrase(
                "The {total} residuals of {name} keep their sign too long for chance ({runs} runs, p = {p}): the model "
                "lacks something, or a value of the base is wrong, and the intervals are too narrow; free a further "
                "parameter, or correct the base.",
                **values,
            )
        else:
            yield Phrase(
                "The {total} residuals of {name} change their sign as by chance ({runs} runs, p = {p}): no lack of fit "
                "shows.",
                **values,
            )
        return
    values["ratio"] = Amount(test.statistic, "1", 3, form=".3g")
    if test.p < CHANCE:
        yield Phrase(
            "The fit misses {name} by more than repeated points scatter (F = {ratio}, p = {p}): the model lacks "
            "something, or a value of the base is wrong, and the intervals are too narrow; free a further parameter, "
            "or correct the base.",
            **values,
        )
    else:
        yield Phrase(
            "The fit misses {name} by no more than repeated points scatter (F = {ratio}, p = {p}): no lack of fit "
            "shows.",
            **values,
        )


def _shifted(found: Calibration, known: Answer) -> Iterator[Phrase]:
    """The offset that would explain the residuals."""
    offset = min(known.offsets, key=lambda one: one.p, default=None)
    if offset is not None and offset.p < _CHANCE and (offset.rest >= _CHANCE or offset.share >= _MOST_OF):
        result = found.plan.results[offset.column]
        unit = found.infos[result].unit
        yield Phrase(
            "An offset of {name} by {offset} (standard deviation {deviation}) would explain {share} % of the squares "
            "of the residuals (p = {p}): check the zero of its sensor, or calibrate it too by `sensors`.",
            name=Name(result, within=True),
            offset=Amount(offset.value, unit, 3, form="+.3g"),
            deviation=Amount(offset.deviation, unit, 2, form=".2g"),
            share=round(100.0 * offset.share),
            p=Amount(offset.p, "1", 2, form=".2g"),
        )


def _deviations(found: Calibration, known: Answer) -> Iterator[Phrase]:
    """The standard deviations that follow from the residuals."""
    plan = found.plan
    _, columns = plan.places
    for column, one in enumerate(plan.measured):
        if not one.sigma:
            sigma = float(known.sigma[columns == column][0])
            yield Phrase(
                "The standard deviation of {name} follows from the residuals: {sigma}.",
                name=Name(one.result, within=True),
                sigma=Amount(sigma, found.infos[one.result].unit, 4, form=".4g"),
            )


def _chi_square(found: Calibration, known: Answer) -> Iterator[Phrase]:
    """Whether the residuals are as large as given standard deviations say."""
    plan = found.plan
    if not plan.known_sigma or known.freedom < 1:
        return
    values: dict[str, Part] = {"value": Amount(known.chi_square, "1", 3, form=".3g"), "freedom": known.freedom}
    if plan.loss != "linear":
        yield Phrase("Chi-square is {value} for {freedom} degrees of freedom, outliers included.", **values)
        return
    above = _chi_square_above(known.chi_square, known.freedom)
    if above < _CHANCE:
        yield Phrase(
            "Chi-square is {value} for {freedom} degrees of freedom: the points are farther off than sigma explains; "
            "the intervals are too narrow.",
            **values,
        )
    elif above > 1.0 - _CHANCE:
        yield Phrase(
            "Chi-square is {value} for {freedom} degrees of freedom: the points scatter less than sigma; the intervals "
            "are too wide.",
            **values,
        )
    else:
        yield Phrase(
            "Chi-square is {value} for {freedom} degrees of freedom: the points scatter as sigma says.", **values
        )


def _chi_square_above(value: float, freedom: int) -> float:
    from scipy.special import gammaincc

    return float(gammaincc(0.5 * freedom, 0.5 * value))


def _undetermined(found: Calibration, one: Direction) -> Phrase:
    names = [found.called(place) for place in one.parameters]
    if len(names) == 1:
        return Phrase("These points do not determine {name}.", name=names[0])
    changes = [
        Phrase("{name} by {change}", name=name, change=Amount(change, found.unit(place), 3, form="+.3g"))
        for place, name, change in zip(one.parameters, names, one.changes, strict=True)
    ]
    parts = {"names": _listed(names), "changes": _listed(changes)}
    if one.undetermined:
        return Phrase("These points cannot separate {names}: changing {changes} changes hardly any of them.", **parts)
    return Phrase("These points hardly separate {names}: changing {changes} is within their scatter.", **parts)


def _bounds(found: Calibration, known: Answer) -> Iterator[Phrase]:
    if known.at_bounds is None:
        return
    for place, (one, (low, high)) in enumerate(zip(found.plan.fitted, known.at_bounds.tolist(), strict=True)):
        unit, name = found.unit(place), found.called(place)
        ends = [Amount(end, unit, 4, form=".4g") for end, reached in ((one.low, low), (one.high, high)) if reached]
        if len(ends) == 1:
            yield Phrase(
                "The interval of {name} reaches the end of its range ({end}); a wider one may change it.",
                name=name,
                end=ends[0],
            )
        elif ends:
            yield Phrase(
                "The interval of {name} reaches both ends of its range ({low}, {high}); a wider one may change it.",
                name=name,
                low=ends[0],
                high=ends[1],
            )


def _points(found: Calibration, known: Answer) -> Iterator[Phrase]:
    failed = int(np.count_nonzero(known.failed))
    if failed:
        yield Phrase(
            "{count} of {total} measured values have no result at the fitted values and are left out.",
            count=failed,
            total=found.plan.count,
        )
    lone = found.far
    if lone is not None and lone.p < CHANCE:
        yield Phrase(
            "Measured value {number} ({point}) is far off the others ({count} standard deviations, Cook's distance "
            "{cook}, p = {p}): check it, or let outliers count less by `loss`, such as soft_l1.",
            number=lone.place + 1,
            point=_named(found, lone.place),
            count=Amount(abs(lone.deleted), "1", 3, form=".3g"),
            cook=Amount(lone.cook, "1", 2, form=".2g"),
            p=Amount(lone.p, "1", 2, form=".2g"),
        )
    residuals = np.where(known.failed, 0.0, known.residuals)
    if lone is not None and lone.p < CHANCE:
        residuals[lone.place] = 0.0
    far = [index for index in np.argsort(-np.abs(residuals)).tolist() if abs(residuals[index]) > _FAR]
    for index in far[:_MOST_POINTS]:
        values: dict[str, Part] = {
            "number": index + 1,
            "point": _named(found, index),
            "count": Amount(round(abs(residuals[index]), 1), "1", form=".1f"),
        }
        if found.plan.loss == "linear":
            yield Phrase(
                "Measured value {number} ({point}) is {count} standard deviations off the fit: check it, or let "
                "outliers count less by `loss`, such as soft_l1.",
                **values,
            )
        else:
            yield Phrase("Measured value {number} ({point}) is {count} standard deviations off the fit.", **values)
    if len(far) > _MOST_POINTS:
        yield plural(
            "{count} further value is more than {limit} standard deviations off.",
            "{count} further values are more than {limit} standard deviations off.",
            len(far) - _MOST_POINTS,
            limit=Amount(_FAR, "1", form="g"),
        )


def _named(found: Calibration, index: int) -> Phrase:
    """A measured value by its condition and what was read there."""
    conditions, columns = found.plan.places
    result = found.plan.results[columns[index]]
    read = {result: (float(found.plan.values[index]), found.infos[result].unit)}
    at = _at(found, found.plan.at[conditions[index]])
    every = {path: (value, unit_of(found.study, path)) for path, value in at.items()} | read
    return joined(
        ", ",
        [
            Phrase("{name} = {value}", name=Name(name, within=True), value=Amount(value, unit, 4, form=".4g"))
            for name, (value, unit) in every.items()
        ],
    )


def _refits(found: Calibration, known: Answer) -> Iterator[Phrase]:
    if not found.summary["complete"]:
        yield Phrase("The calibration has not run to its end.")
    ended = known.refits - found.converged
    if known.refits and ended > _ENDED * known.refits:
        yield Phrase(
            "{count} of {total} refits ended before they converged, as the results are not smooth: the intervals are "
            "rough.",
            count=ended,
            total=known.refits,
        )


def _next_point(found: Calibration, known: Answer) -> Iterator[Phrase]:
    one = known.next
    if one is None:
        return
    best = int(np.argmax(one.narrower))
    at = [
        Phrase(
            "{name} = {value}",
            name=Name(path, within=True),
            value=Amount(value, unit_of(found.study, path), 4, form=".4g"),
        )
        for path, value in zip(found.plan.paths_at, one.condition, strict=True)
    ]
    yield Phrase(
        "A further measurement says most at {condition}: the interval of {name} would become {share} % narrower.",
        condition=joined(", ", at),
        name=found.called(best),
        share=Amount(100.0 * float(one.narrower[best]), "1", 2, form=".2g"),
    )


def _listed(parts: Sequence[Part]) -> Phrase:
    return Phrase("{first} and {last}", first=joined(", ", parts[:-1]), last=parts[-1])
