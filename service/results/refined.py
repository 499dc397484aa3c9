"""Refined curves: which studies have them, and what their planner says of each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.sentences import Amount, Name, Part
from sprag_study.service.languages import N_
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.reading.wording import percent
from sprag_study.worker import models
from sprag_study.worker.planning.curves import Why
from sprag_study.worker.planning.refine import Curve as Refined
from sprag_study.worker.planning.refine import describe
from sprag_study.worker.planning.refine_plan import REFINE, ErrorBound, RefinePlan
from sprag_study.worker.planning.rounds import Rows

if TYPE_CHECKING:
    from sprag_study.service.answers.results import AskedError, Jump
    from sprag_study.service.storage.studies.records import CaseColumns
    from sprag_study.worker.arrays import Bools, Floats, Ints
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study


@dataclass(frozen=True, slots=True)
class Line:
    """The cases of one curve, in order of its points; ``by`` and ``at`` contain the fixed parameters (SI)."""

    by: dict[str, float]
    at: dict[str, float]
    x: tuple[float, ...]
    cases: Ints


@dataclass(frozen=True, slots=True)
class RefinedMap:
    """What is known of a refined map beside its squares.

    Attributes
    ----------
    asked : ErrorBound
        The requested error.
    error : float or None
        The estimated one outside jumps, relative to the range; None: not known yet.
    absolute : float or None
        The estimated error in the unit of the result (SI).
    unit : str
        Unit of the result.
    jumps_share : float
        Share of the map that is not interpolated.
    passed : bool
        Whether no more points are needed.
    x, y, values : float64 arrays, shape (points,)
        The cases that have been run.
    cases : int64 array, shape (points,)
    """

    asked: ErrorBound
    error: float | None
    absolute: float | None
    unit: str
    jumps_share: float
    passed: bool
    x: Floats
    y: Floats
    values: Floats
    cases: Ints

    @property
    def failed(self) -> bool:
        """Whether cases were run and none of them has a result."""
        return len(self.values) > 0 and not bool(np.isfinite(self.values).any())

    @property
    def sentence(self) -> Phrase:
        """How right the map is, for people."""
        share = percent(self.jumps_share)
        outside = Phrase("outside jumps ({share} of the map)", share=share) if self.jumps_share else Phrase("")
        error = self.absolute if self.asked.absolute else self.error
        return reached(self.asked, error, outside, self.unit, passed=self.passed, failed=self.failed)


def curve_plan(study: Study) -> RefinePlan | None:
    """The plan of a study that refines curves; None for any other, also one that refines maps."""
    return refine_plan(study, 1)


def refine_plan(study: Study, adaptive: int) -> RefinePlan | None:
    """The plan of a study that refines along so many axes; None for any other."""
    if study.plan is None or study.kind != REFINE:
        return None
    plan = RefinePlan.from_json(study.plan)
    return plan if len(plan.adaptive) == adaptive else None


def plan_along(study: Study, path: str) -> RefinePlan | None:
    """The plan of a study that refines curves over ``path``; None for any other."""
    plan = curve_plan(study)
    return plan if plan is not None and path in plan.adaptive[0].paths else None


def families(plan: RefinePlan) -> list[str]:
    """The fixed axes that tell curves apart, each by its first path."""
    return [axis.paths[0] for axis in plan.fixed if len(axis.values) > 1]


def refined_curves(
    model: str, plan: RefinePlan, lines: Sequence[Line], run: Bools, columns: CaseColumns
) -> list[Refined]:
    """What the planner says of each line, which is one combination of the fixed axes.

    ``columns`` has the results that the plan needs, for the cases of all lines in their order; ``run`` says which of
    these cases have been run.
    """
    points = [_points(plan, line) for line in lines]
    rows = Rows(
        np.concatenate(points)[run],
        models.usable(model, columns.endings, columns.flags)[run],
        {name: columns.values[name][run] for name in plan.needed},
    )
    every = describe(plan, rows)
    return [every[int(plan.places(own[:1])[0][0])] for own in points]


def _points(plan: RefinePlan, line: Line) -> Floats:
    """The points of a line as the plan has them, shape (cases, columns)."""
    given = {**line.by, **line.at}
    fixed = [next((given[path] for path in axis.paths if path in given), axis.values[0]) for axis in plan.fixed]
    return np.column_stack([np.tile(fixed, (len(line.x), 1)), line.x])


def stretches(refined: Refined, name: str, regimes: Sequence[Ints]) -> tuple[Ints, ...]:
    """Indices of the points of a curve that straight lines join, each ascending.

    For a result that was not asked for: the stretches ``regimes`` of like motion, broken at every jump.
    """
    joined = refined.joined.get(name)
    if joined is not None:
        return _split(joined)
    known = refined.joined.items()
    joined = np.logical_and.reduce([own & ~refined.scattered[other] for other, own in known])
    whole = _split(joined)
    number = np.concatenate([np.full(part.size, place) for place, part in enumerate(whole)])
    found = []
    for part in regimes:
        found += np.split(part, np.flatnonzero(np.diff(number[part])) + 1)
    return tuple(found)


def _split(joined: Bools) -> tuple[Ints, ...]:
    return tuple(np.split(np.arange(joined.size + 1, dtype=np.int64), np.flatnonzero(~joined) + 1))


def jumps_of(refined: Refined, names: Iterable[str]) -> list[Jump]:
    """The intervals in which lines of these results are broken; of one that was not asked for, all.

    A result that was not asked for has no band where the motion is irregular: its lines are broken there, too.
    """
    wanted = set(names)
    every = not wanted <= refined.joined.keys()
    jumps: list[Jump] = [jump.to_json() for jump in refined.jumps if every or wanted & set(jump.results)]  # type: ignore[misc]
    if every:
        irregular = Why.IRREGULAR.value
        jumps += [
            {"low": own.low, "high": own.high, "why": irregular, "results": [*own.half_widths]}
            for own in refined.stretches
        ]
    return sorted(jumps, key=lambda jump: jump["low"])


def band(refined: Refined, name: str) -> tuple[Floats, Floats, Floats]:
    """The band around the lines of a result where the motion is irregular: x, low and high, with NaN between stretches.

    Empty where there is none, also of a result that was not asked for.
    """
    scattered = refined.scattered.get(name, np.zeros(0, dtype=bool))
    parts = [
        np.append(own, own[-1] + 1)
        for own in np.split(np.flatnonzero(scattered), np.flatnonzero(np.diff(np.flatnonzero(scattered)) > 1) + 1)
        if own.size
    ]
    if not parts:
        return (np.zeros(0),) * 3
    values, widths, gap = refined.values[name], refined.half_widths[name], [np.nan]
    columns = (refined.x, values - widths, values + widths)
    return tuple(np.concatenate([np.append(column[own], gap) for own in parts]) for column in columns)  # type: ignore[return-value]


def not_joined(refined: Refined, names: Sequence[str]) -> list[str]:
    """For each point the results that are not interpolated to the next point, with a space between them."""
    return _named(refined, names, {name: ~own for name, own in refined.joined.items()})


def scattered(refined: Refined, names: Sequence[str]) -> list[str]:
    """For each point the results that scatter around the line to the next point, with a space between them."""
    return _named(refined, names, refined.scattered)


def _named(refined: Refined, names: Sequence[str], parts: Mapping[str, Bools]) -> list[str]:
    """For each point the names of those results of which its part up to the next point is one of ``parts``."""
    asked = [name for name in names if name in parts]
    texts = [
        " ".join(name for name, one in zip(asked, row, strict=True) if one)
        for row in zip(*(parts[name].tolist() for name in asked), strict=True)
    ]
    return [*(texts or [""] * (len(refined.x) - 1)), ""] if len(refined.x) else []


def sentence(plan: RefinePlan, curves: Sequence[Refined], results: Iterable[ResultInfo]) -> str:
    """How right the curves of these results are, for people; "" where none of them was asked for."""
    drawn = {info.name: info for info in results}
    asked = [name for name in drawn if name in plan.results]
    if not asked:
        return ""
    # Results without an error of their own share a sentence, the others have one each.
    groups = [[name for name in asked if name not in plan.errors], *([name] for name in asked if name in plan.errors)]
    groups = [group for group in groups if group]
    texts = [_sentence(plan, curves, [drawn[name] for name in group]) for group in groups]
    if len(groups) > 1:
        named = (joined(", ", (Name(name, within=place > 0) for place, name in enumerate(group))) for group in groups)
        texts = [Phrase("{names}: {text}", names=names, text=text) for names, text in zip(named, texts, strict=True)]
    text = joined(" ", texts) if len(texts) > 1 else texts[0]
    others = [name for name in drawn if name not in asked]
    names = joined(", ", (Name(name, within=True) for name in others))
    return Phrase("{text} No error was asked for {names}.", text=text, names=names) if others else text


def _sentence(plan: RefinePlan, curves: Sequence[Refined], results: Sequence[ResultInfo]) -> Phrase:
    """How right the curves of results of the same requested error are."""
    asked = [info.name for info in results]
    broken = [jumps_of(curve, asked) for curve in curves]
    count = sum(map(_apart, broken))
    within = sum(jump["high"] - jump["low"] for jumps in broken for jump in jumps)
    share = within / sum(float(np.ptp(curve.x)) for curve in curves if len(curve.x)) if count else 0.0
    outside = (
        plural(
            "outside {count} jump ({share} of the axis)",
            "outside {count} jumps ({share} of the axis)",
            count,
            share=percent(share),
        )
        if count
        else Phrase("")
    )
    bound = plan.asked(asked[0])
    # An absolute error is compared in the unit of the result: curves have ranges of their own.
    every = [
        error if error is None or not bound.absolute else error * curve.ranges[name]
        for curve in curves for name in asked if np.isfinite(curve.values[name]).any()
        for error in [curve.errors[name]]
    ]  # fmt: skip
    error = None if None in every or not every else max(error for error in every if error is not None)
    passed = all(curve.passed for curve in curves)
    without = sum(len(curve.x) > 0 and not _has_result(curve, asked) for curve in curves)
    failed = without == len(curves) > 0
    text = reached(bound, error, outside, results[0].unit, passed=passed, failed=failed)
    if 0 < without < len(curves):
        missing = plural("{count} curve has no result.", "{count} curves have no result.", without)
        text = joined(" ", [text, missing])
    irregular = _irregular(curves, results, absolute=bound.absolute)
    return joined(" ", [text, irregular]) if irregular else text


def _irregular(curves: Sequence[Refined], results: Sequence[ResultInfo], *, absolute: bool) -> Phrase | None:
    """How far results scatter where the motion is irregular, for people; None where none does."""
    asked = [info.name for info in results]
    steps = [np.logical_or.reduce([curve.scattered[name] for name in asked]) for curve in curves]
    length = sum(float(np.diff(curve.x)[own].sum()) for curve, own in zip(curves, steps, strict=True))
    if not length:
        return None
    most = max(
        width / (1.0 if absolute else curve.ranges[name])
        for curve in curves for stretch in curve.stretches for name, width in stretch.half_widths.items()
        if name in asked
    )  # fmt: skip
    size = Amount(most, results[0].unit, digits=2) if absolute else Phrase("{share} of the range", share=percent(most))
    share = percent(length / sum(float(np.ptp(curve.x)) for curve in curves if len(curve.x)))
    text = N_("Where the motion is irregular ({share} of the axis), results scatter around the line by up to {size}.")
    return Phrase(text, share=share, size=size)


def _has_result(curve: Refined, names: Iterable[str]) -> bool:
    return any(bool(np.isfinite(curve.values[name]).any()) for name in names)


def reached(
    asked: ErrorBound, error: float | None, outside: Phrase, unit: str, *, passed: bool, failed: bool
) -> Phrase:
    """Whether a requested error is reached, for people; ``outside`` is "outside 2 jumps", or "" without jumps.

    ``error`` is relative to the range as the requested one is, or absolute in the ``unit`` of the result (SI).
    ``failed`` says that cases were run and none of them has a result.
    """
    sizes: list[Part] = [percent(asked.value), percent(error or 0.0)]
    if asked.absolute:
        sizes = [Amount(asked.value, unit), Amount(error or 0.0, unit, digits=2)]
    wanted, now = sizes
    limit, reached_now = sizes if asked.absolute else [Phrase("{share} of the range", share=size) for size in sizes]
    if failed:
        return Phrase("No case has a result, so that there is no error; {asked} is asked.", asked=limit)
    if error is None:
        return Phrase("The error is not known yet; {asked} is asked.", asked=limit)
    if passed and error <= asked.value:
        if outside:
            text = N_("Within {asked}, as asked, {outside} (estimate: {error}).")
            return Phrase(text, asked=limit, outside=outside, error=now)
        return Phrase("Within {asked}, as asked (estimate: {error}).", asked=limit, error=now)
    if outside:
        text = N_("Not reached: {error} now {outside}, {asked} asked.")
        return Phrase(text, asked=wanted, outside=outside, error=reached_now)
    return Phrase("Not reached: {error} now, {asked} asked.", asked=wanted, error=reached_now)


def asked_errors(plan: RefinePlan, names: Iterable[str]) -> dict[str, AskedError]:
    """The errors that were asked for one result alone, as JSON data."""
    return {
        name: {"value": bound.value, "absolute": bound.absolute} for name in names if (bound := plan.errors.get(name))
    }


def _apart(jumps: Sequence[Jump]) -> int:
    """Number of jumps; neighbours of different reasons are one."""
    return len({jump["low"] for jump in jumps} - {jump["high"] for jump in jumps})
