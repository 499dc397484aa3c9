"""Curves of known functions, refined without an engine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.models.vibration_drive.settled import IRREGULAR
from sprag_study.worker.planning.refine import describe, refiner
from sprag_study.worker.planning.refine_plan import AdaptiveAxis, RefinePlan
from sprag_study.worker.planning.rounds import Rows, Step

if TYPE_CHECKING:
    from sprag_study.worker.planning.refine import Curve


Floats = NDArray[np.float64]
Function = Callable[[Floats], dict[str, Floats]]

PERIODIC = 1.0
#: Width of the finest interval of the plans.
LEAF = 1.6 / 256
LOAD = AdaptiveAxis(("shaft.load",), 0.0, 1.6)
PLAN = RefinePlan(("a",), error=0.01, start=17, finest=256, adaptive=(LOAD,))
SETTLED = replace(PLAN, results=("mean", "max"), regime=True, half_widths=("mean",))


def rows_of(plan: RefinePlan, points: Floats, function: Function) -> Rows:
    """Rows of a function of the points; "ok" is among its values where cases fail."""
    values = function(points)
    ok = values.pop("ok", np.ones(len(points))) > 0.0
    return Rows(points, ok, {name: values.get(name, np.full(len(points), np.nan)) for name in plan.needed})


def refined(plan: RefinePlan, function: Function) -> tuple[list[Rows], Step]:
    """The rows of all rounds, and the last step."""
    planner, rounds = refiner(plan), []
    while len((step := planner.ask()).points):
        rounds.append(rows_of(plan, step.points, function))
        planner.tell(rounds[-1])
        assert len(rounds) <= planner.most_rounds
    assert sum(len(rows.points) for rows in rounds) <= planner.most_cases
    return rounds, step


def joined(rounds: list[Rows]) -> Rows:
    """The rows of all rounds as those of one."""
    names = rounds[0].values
    points, ok = np.vstack([rows.points for rows in rounds]), np.concatenate([rows.ok for rows in rounds])
    return Rows(points, ok, {name: np.concatenate([rows.values[name] for rows in rounds]) for name in names})


def curve_of(plan: RefinePlan, function: Function) -> Curve:
    """The only curve of a plan."""
    rounds, step = refined(plan, function)
    (curve,) = describe(plan, joined(rounds))
    assert step.summary["curves"] == [curve.to_json()]
    return curve


def errors_outside(curve: Curve, name: str, function: Function, places: int = 1025) -> Floats:
    """Errors of straight lines at equally spaced places outside the jumps, relative to the range."""
    x = np.linspace(curve.x[0], curve.x[-1], places)
    true = function(x[:, None])[name]
    inside = np.zeros(places, dtype=bool)
    for jump in curve.jumps:
        inside |= (x >= jump.low) & (x <= jump.high)
    found = np.interp(x, curve.x, curve.values[name])
    return np.asarray(np.abs(found - true)[~inside] / (true.max() - true.min()))


def settled(x: Floats, mean: Floats, most: Floats, **more: Floats) -> dict[str, Floats]:
    """Rows of settled motions: periodic of order 1 unless more is given."""
    own = {"regime": np.full(len(x), PERIODIC), "regime.order": np.ones(len(x))}
    return own | {"mean": mean, "max": most, "mean.half_width": np.full(len(x), np.nan)} | more


def noise(x: Floats) -> Floats:
    """Numbers between -1 and 1 that differ at any two points."""
    return np.asarray(np.sin(1e6 * x))


def irregular_zone(points: Floats) -> dict[str, Floats]:
    """Irregular motion from 0.5 to 0.9: the mean is known to 0.4 % of its range, the extreme scatters by 10 %."""
    x = points[:, -1]
    inside = (x > 0.5) & (x < 0.9)
    mean, most = x + np.where(inside, 0.002 * noise(x), 0.0), 2.0 - x + np.where(inside, 0.15 * noise(x), 0.0)
    more = {
        "regime": np.where(inside, IRREGULAR, PERIODIC),
        "regime.order": np.where(inside, np.nan, 1.0),
        "mean.half_width": np.where(inside, 0.006, np.nan),
    }
    return settled(x, mean, most, **more)
