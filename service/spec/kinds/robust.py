"""Goals about the drives of a design: quantiles of results, and the yield."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.spec.described import Described, choice
from sprag_study.service.spec.node import Node
from sprag_study.worker.limits import FRESH_DRIVES, MAX_AXIS_VALUES, MAX_FRESH_DRIVES, MAX_PLANNED_CASES
from sprag_study.worker.planning.goals.plan import STATISTICS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.spec.report import Report

#: Fields of a goal or a constraint about the drives.
ROBUST: Final = ("quantile", "statistic", "yield")
#: JSON Schema of the quantile.
QUANTILE: Final[dict[str, Any]] = {
    "type": ["number", "string"],
    "description": "the quantile of the result over the drawn drives instead of that of the nominal drive: a share, as "
    'in "5 %"',
}

STATISTIC: Final = choice(
    "statistic", "mean or standard deviation of the result over the drawn drives instead of that of the nominal drive",
    *STATISTICS,
)  # fmt: skip
DEVIATIONS: Final = Described(
    "deviations", "Deviations", "standard deviations that are added to the mean, such as -3", "number", -100, 100
)
FRESH: Final = Described(
    "fresh_drives", "Fresh drives",
    "with tolerances: drives that the search has not seen, with which its best designs are run at the end; 0: none",
    "whole", 0, MAX_FRESH_DRIVES, FRESH_DRIVES,
)  # fmt: skip


def read_fresh(goal: Node, goals: int, points: int, columns: int) -> int:
    """The number of fresh drives; 0, and a fault recorded, where it is invalid.

    By default they are as many as `FRESH` says, or as there is room for beside the cases of the generations.

    Parameters
    ----------
    goal : the field `goal` of the spec
    goals, points, columns : numbers of goals, of operating points, and of what varies from case to case
    """
    # Of each goal the best design, and the best one that meets equalities to 1e-6.
    each = 2 * max(goals, 1) * max(points, 1)
    count: int | None = FRESH.read(goal)
    if count is None:
        return 0
    if FRESH.name not in goal:
        room = MAX_AXIS_VALUES // max(columns, 1) - MAX_PLANNED_CASES
        return max(0, min(count, MAX_PLANNED_CASES // each, room // each))
    most = MAX_PLANNED_CASES // each
    if count > most:
        message = Sentence("asks for up to {cases} cases at the end of the search", cases=count * each)
        goal[FRESH.name].refuse("too-many", message, count, allowed=Sentence("at most {drives} drives", drives=most))
        return 0
    return count


def read_quantile(item: Node) -> dict[str, float] | None:
    """The quantile of a goal or a constraint, by name; empty without one, None, and a fault recorded, if invalid."""
    if "quantile" not in item:
        return {}
    share = item["quantile"].share(0.0, 1.0)
    return None if share is None else {"quantile": share}


def read_about_drives(item: Node) -> dict[str, Any] | None:
    """What a goal or a constraint is about beside a yield: its quantile, or its statistic, by name.

    Empty where it is about the nominal drive; None, and faults recorded, where it is invalid.
    """
    quantile = read_quantile(item)
    if STATISTIC.name not in item:
        item.refuse_each((DEVIATIONS.name,), "has no effect without `statistic`", "not-used")
        return quantile
    item.refuse_each(("quantile",), "cannot be combined with `statistic`")
    statistic = STATISTIC.read(item)
    if DEVIATIONS.name in item and statistic == "deviation":
        item[DEVIATIONS.name].refuse("conflict", "are added to a mean", allowed='with "statistic": "mean"')
    deviations = DEVIATIONS.read(item) if DEVIATIONS.name in item else 0.0
    if statistic is None or deviations is None:
        return None
    return {STATISTIC.name: statistic, **({DEVIATIONS.name: deviations} if deviations else {})}


def check_drives(
    report: Report,
    best: Sequence[Mapping[str, Any]],
    constraints: Sequence[Mapping[str, Any]],
    drives: int,
    *,
    fresh: bool = False,
) -> None:
    """Record goals about drives in a study without tolerances, and tolerances without such a goal.

    ``fresh``: whether the spec says how many fresh drives there are.
    """
    about = [
        f"/goal/{part}/{index}/{name}"
        for part, items in (("best", best), ("subject_to", constraints))
        for index, item in enumerate(items)
        for name in ROBUST
        if name in item
    ]
    if drives and not about:
        report.fault(
            "/tolerances", "not-used", "have no effect on this goal", allowed="goals or constraints with `quantile`, "
            "`statistic` or `yield`; a study of a design afterwards shows what tolerances make of it",
        )  # fmt: skip
    about += [f"/goal/{FRESH.name}"] if fresh else []
    for where in about if drives == 1 else ():
        if where.endswith(f"/{STATISTIC.name}"):
            report.fault(where, "conflict", "is about one drive only", allowed="`drives` of at least 2")
    for where in about if not drives else ():
        report.fault(where, "conflict", "is about the drives, of which there is one only",
                     allowed="`tolerances` in the spec")  # fmt: skip
