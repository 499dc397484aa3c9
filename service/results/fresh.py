"""What the best designs of a search are worth with fresh drives, which the search has not seen."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, cast

import numpy as np

from sprag_study.service.json_text import numbers
from sprag_study.service.results.tolerances.quantiles import proportion, ranks
from sprag_study.worker import models
from sprag_study.worker.planning.goals.fresh import FRESH
from sprag_study.worker.planning.goals.robust import Table
from sprag_study.worker.planning.goals.scores import judge, outputs_of, signs
from sprag_study.worker.planning.rounds import Rows

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.service.answers.goals import FreshDesign, FreshResult
    from sprag_study.service.results.curves import Fetch
    from sprag_study.service.storage.studies.records import RoundRecord
    from sprag_study.worker.arrays import Floats
    from sprag_study.worker.planning.goals import Goal, GoalPlan, Limit
    from sprag_study.worker.study import Study

#: 97.5 % quantile of the standard normal distribution.
_NORMAL: Final = 1.959963984540054


@dataclass(frozen=True, slots=True)
class Interval:
    """A value at each operating point with its 95 % interval, each array of shape (points,); NaN where not known."""

    values: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True)
class Fresh:
    """A design with fresh drives.

    Attributes
    ----------
    design : number of the design
    cases : those of the fresh drives
    drives : number of fresh drives at each operating point
    goals : array, shape (goals,), over the operating points; NaN where missing
    results : what is about the drives in goals and limits, by name
    feasible, failed : as of a `Front`
    """

    design: int
    cases: range
    drives: int
    goals: Floats
    results: Mapping[str, Interval]
    feasible: bool
    failed: bool


def searched_cases(study: Study, rounds: Sequence[RoundRecord]) -> int:
    """How many of the first cases of a search are not of fresh drives; those are its last ones."""
    return next((one.cases.start for one in rounds if one.summary.get("phase") == FRESH), study.cases)


def fresh_designs(
    study: Study, plan: GoalPlan, rounds: Sequence[RoundRecord], fetch: Fetch, names: Sequence[str], designs: Floats
) -> tuple[Fresh, ...]:
    """The designs whose cases with fresh drives all have their rows, in the order of these.

    Parameters
    ----------
    rounds, fetch : as of `fronts.designs_of`
    names : the results that goals and limits need, with half widths
    designs : array, shape (designs, variables), of all numbers of designs
    """
    each = len(plan.at) * plan.fresh
    numbers_of = {own.tobytes(): number for number, own in reversed(list(enumerate(np.ascontiguousarray(designs))))}
    found = []
    for record in rounds:
        for start in range(record.cases.start, record.cases.stop, each) if record.summary.get("phase") == FRESH else ():
            cases = range(start, start + each)
            key = np.ascontiguousarray(study.points(cases[:1])[0, : len(plan.vary)]).tobytes()
            if (own := _fresh(study, plan, numbers_of[key], cases, fetch, names)) is not None:
                found.append(own)
    return tuple(found)


def _fresh(study: Study, plan: GoalPlan, design: int, cases: range, fetch: Fetch, names: Sequence[str]) -> Fresh | None:
    """A design with its nominal and its fresh drives; None where a case has no row."""
    points = len(plan.at)
    nominal = design * plan.cases_each + np.arange(points) * (1 + plan.drives)
    every = np.column_stack([nominal, np.array(cases).reshape(points, plan.fresh)]).reshape(-1)
    columns = fetch(every, names)
    if not all(columns.endings):
        return None
    ok = models.usable(study.model, columns.endings, columns.flags)
    rows = Rows(np.zeros((len(every), 0)), ok, columns.values)
    own = replace(plan, drives=plan.fresh, fresh=0)
    table, scores = Table(own, rows), judge(own, outputs_of(own, rows))
    return Fresh(
        design=design,
        cases=cases,
        drives=plan.fresh,
        goals=scores.goals[0] * signs(own),
        results={item.name: interval(item, table, plan.fresh) for item in plan.items if item.robust},
        feasible=bool(scores.feasible[0]),
        failed=bool(scores.failed[0]),
    )


def interval(item: Goal | Limit, table: Table, drives: int) -> Interval:
    """What a goal or a limit is about, with the interval of independent drives (`tolerances.quantiles`)."""
    values = table.values(item)[0]
    if item.conditions:
        share = proportion(np.rint(values * drives).astype(np.int64), np.full(values.shape, drives))
        return Interval(values, share.low, share.high)
    if item.statistic is not None:
        half = _half_width(item, table.drawn(item)[0])
        return Interval(values, values - half, values + half)
    assert item.quantile is not None
    ordered, (first, last) = np.sort(table.drawn(item)[0], axis=1), ranks(drives, item.quantile)
    ends = [ordered[:, rank - 1] if 1 <= rank <= drives else np.full(len(values), math.nan) for rank in (first, last)]
    low, high = (np.where(np.isfinite(end), end, math.nan) for end in ends)
    return Interval(values, low, high)


def _half_width(item: Goal | Limit, drawn: Floats) -> Floats:
    """Half the width of the 95 % interval of a mean with deviations, or of a deviation, shape (points,).

    For large samples m + k s is normal with the variance s^2/n (1 + k g + k^2 (b - 1)/4), the deviation s alone with
    the last term for k = 1; g and b are skewness and kurtosis (H. Cramer, Mathematical Methods of Statistics, Princeton
    1946, chapters 27 and 28). NaN where a drive lacks the result.
    """
    known = np.where(np.isfinite(drawn), drawn, math.nan)
    apart = known - known.mean(axis=1, keepdims=True)
    variance = (apart**2).mean(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        skewness = np.where(variance > 0.0, (apart**3).mean(axis=1) / variance**1.5, 0.0)
        kurtosis = np.where(variance > 0.0, (apart**4).mean(axis=1) / variance**2, 1.0)
    k = item.deviations
    shape = 1.0 + k * skewness + k * k * (kurtosis - 1.0) / 4.0 if item.statistic == "mean" else (kurtosis - 1.0) / 4.0
    half: Floats = _NORMAL * np.sqrt(variance * np.maximum(shape, 0.0) / drawn.shape[1])
    return np.where(np.isnan(known).any(axis=1), math.nan, half)


def worst_point(item: Goal | Limit, values: Floats) -> int:
    """The operating point, of those that count, at which a value about the drives is the worst; a missing one is."""
    counted = list(item.at or range(len(values)))
    off = np.where(np.isnan(values), np.inf, -values if item.upwards else values)[counted]
    return counted[int(off.argmax())]


def fresh_json(fresh: Fresh, goals: Sequence[str]) -> FreshDesign:
    """A design with fresh drives as an answer."""
    return {
        "design": fresh.design,
        "drives": fresh.drives,
        "first_case": fresh.cases.start,
        "goals": dict(zip(goals, numbers(fresh.goals + 0.0), strict=True)),
        "results": {
            name: cast(
                "FreshResult",
                {part: numbers(getattr(one, part)) for part in ("values", "low", "high")},
            )
            for name, one in fresh.results.items()
        },
        "feasible": fresh.feasible,
        "failed": fresh.failed,
    }


def fresh_columns(fresh: Sequence[Fresh], points: int) -> list[str]:
    """The columns of a file of designs about fresh drives; none without a design that has them.

    They begin with "fresh.", then like the columns of designs, which are numbered where there are several points.
    """
    if not fresh:
        return []
    ends = [f".{number}" for number in range(1, points + 1)] if points > 1 else [""]
    parts = [f"fresh.{name}{end}{part}" for name in fresh[0].results for end in ends for part in ("", ".low", ".high")]
    return ["fresh.drives", "fresh.feasible", *parts]


def fresh_cells(fresh: Fresh | None, columns: int) -> list[float | bool | None]:
    """The cells of a design in `fresh_columns`, empty for one without fresh drives."""
    if fresh is None:
        return [None] * columns
    ends = (np.column_stack([one.values, one.low, one.high]).reshape(-1) for one in fresh.results.values())
    return [fresh.drives, fresh.feasible, *(value for own in ends for value in numbers(own))]
