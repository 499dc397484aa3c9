"""All designs of a search at once, ranked: what pages, files and the API show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.ranking import ranks
from sprag_study.worker.planning.goals.scores import judge, misses, outputs_of, signs

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.plan import GoalPlan
    from sprag_study.worker.planning.rounds import Rows


@dataclass(frozen=True, slots=True)
class Front:
    """Ranked designs, in the order of their cases.

    Attributes
    ----------
    variables : float64 array, shape (designs, variables)
        SI.
    goals : float64 array, shape (designs, goals)
        The results themselves, taken over the operating points; NaN where missing.
    violation : float64 array, shape (designs,)
        0 within every limit; inf where a case has failed or a goal is missing. Otherwise the sum over the limits of the
        largest relative violation.
    feasible, failed : bool arrays, shape (designs,)
    rank : int64 array, shape (designs,)
        0 for the best: those that no other design dominates. Designs outside the limits come after all that are within,
        failed ones last.
    miss : float64 array, shape (designs,)
        Largest relative distance from the value of an equality of real numbers; 0 without one, NaN where missing.
    cases : int64 array, shape (designs, operating points)
        Numbers of the rows, with drives those of the nominal one.
    """

    variables: NDArray[np.float64]
    goals: NDArray[np.float64]
    violation: NDArray[np.float64]
    feasible: NDArray[np.bool_]
    failed: NDArray[np.bool_]
    rank: NDArray[np.int64]
    miss: NDArray[np.float64]
    cases: NDArray[np.int64]


def front(plan: GoalPlan, rows: Rows, *, equality: float | None = None) -> Front:
    """Rank all designs.

    Parameters
    ----------
    plan : GoalPlan
    rows : Rows
        Of whole designs: all rounds, one after another.
    equality : float, optional
        Relative half width of the bands of equalities of real numbers instead of the plan's: with 1e-6, only polished
        designs are feasible.

    Raises
    ------
    ValueError
        If the last design lacks rows.
    """
    each = plan.cases_each
    if len(rows.points) % each:
        raise ValueError(f"{len(rows.points)} rows are not those of whole designs, which have {each} each")
    outputs = outputs_of(plan, rows)
    scores = judge(plan, outputs, equality=equality)
    return Front(
        variables=rows.points[::each, : len(plan.vary)],
        goals=scores.goals * signs(plan),
        violation=scores.violation,
        feasible=scores.feasible,
        failed=scores.failed,
        rank=ranks(scores),
        miss=misses(plan, outputs),
        cases=np.arange(len(rows.points), dtype=np.int64).reshape(-1, each)[:, :: 1 + plan.drives],
    )
