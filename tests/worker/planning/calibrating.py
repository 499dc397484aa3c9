"""Calibrations of closed forms for tests: plans, and planners driven to their ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate import CalibratePlan, CalibratePlanner, Measured, Unknown
from sprag_study.worker.planning.rounds import Rows

Floats = NDArray[np.float64]
#: Parameters (cases, p) and conditions (cases, c) in, results out; NaN where a case fails.
Form = Callable[[Floats, Floats], dict[str, Floats]]


def plan_of(
    ranges: Sequence[tuple[float, float]],
    x: Floats,
    measured: dict[str, Floats],
    sigma: Floats | None = None,
    **rest: Any,
) -> CalibratePlan:
    """A plan with unknowns a, b, ... and a condition x; repeated values of x are one condition."""
    values, places = np.unique(x, return_inverse=True)
    return CalibratePlan(
        unknown=tuple(Unknown((chr(97 + i),), *ends) for i, ends in enumerate(ranges)),
        paths_at=("x",),
        conditions=tuple((value,) for value in values.tolist()),
        measured=tuple(
            Measured(name, tuple(places.tolist()), tuple(y.tolist()), () if sigma is None else tuple(sigma.tolist()))
            for name, y in measured.items()
        ),
        **rest,
    )


def rows_of(plan: CalibratePlan, points: Floats, form: Form) -> Rows:
    """The rows of points; failed where a result is NaN."""
    p = len(plan.unknown)
    values = form(points[:, :p], points[:, p:])
    ok = np.all([np.isfinite(values[name]) for name in plan.results], axis=0)
    return Rows(points, ok, values)


def calibrated(plan: CalibratePlan, form: Form) -> tuple[CalibratePlanner, list[Rows]]:
    """A planner at its end, and its rounds."""
    planner, rounds = CalibratePlanner(plan), []
    while len(points := planner.ask().points):
        rounds.append(rows_of(plan, points, form))
        planner.tell(rounds[-1])
    return planner, rounds
