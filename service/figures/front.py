"""Designs of a search as described figures: two quantities of each design, and how the search has come to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Name
from sprag_study.service.faults import refused
from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, plural
from sprag_study.service.results.fronts import history, worst_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.service.results.fronts import Designs
    from sprag_study.worker.arrays import Bools, Floats
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.planning.goals.plan import GoalPlan

#: The number of a design, as an axis.
NUMBER: Final = "design"
#: Colour of designs outside the limits.
_OUTSIDE: Final = "#b0b8c4"
#: Feasible designs from which on the picture is fitted to them.
_FEW: Final = 5
_NOTHING: Final = Phrase("No design has its results yet.")


def names_of(plan: GoalPlan, infos: Mapping[str, ResultInfo]) -> list[str]:
    """What a design can be drawn over: goals first, then variables, numeric results of limits, and its number."""
    limited = [limit.name for limit in plan.subject_to if infos[limit.name].kind != "category"]
    return list(
        dict.fromkeys([*(goal.name for goal in plan.best), *(one.paths[0] for one in plan.vary), *limited, NUMBER])
    )


def quantities(found: Designs) -> dict[str, tuple[str, Floats]]:
    """The unit and the values of what a design can be drawn over, by name."""
    goals = {goal.name: index for index, goal in enumerate(found.plan.best)}
    variables = {one.paths[0]: index for index, one in enumerate(found.plan.vary)}
    limits = {limit.name: limit for limit in found.plan.subject_to}

    def of(name: str) -> tuple[str, Floats]:
        if name in variables:
            return unit_of(found.study, name), found.front.variables[:, variables[name]]
        if name == NUMBER:
            return "1", found.numbers.astype(np.float64)
        values = found.front.goals[:, goals[name]] if name in goals else worst_of(limits[name], found.values[name])
        return found.infos[name].unit, values

    return {name: of(name) for name in names_of(found.plan, found.infos)}


def chosen(plan: GoalPlan, infos: Mapping[str, ResultInfo], x: str | None, y: str | None) -> tuple[str, str]:
    """Names of the two quantities; by default the first two goals. Raises SelectionError for an unknown name."""
    names = names_of(plan, infos)
    goals = [goal.name for goal in plan.best]
    first, second = [*goals, NUMBER, names[0]][:2] if len(goals) != 1 else (NUMBER, goals[0])
    for parameter, name in (("x", x), ("y", y)):
        if name is not None and name not in names:
            raise refused(
                parameter, "unknown-name", "is not a goal, a variable or a numeric limit of this study", name,
                allowed=", ".join(names),
            )  # fmt: skip
    return x or first, y or second


def front_figure(found: Designs, x: str | None = None, y: str | None = None) -> Figure:
    """Every design as a point: on the front, feasible, or outside the limits (grey). Nothing joins them."""
    first, second = chosen(found.plan, found.infos, x, y)
    known = quantities(found)
    (x_unit, xs), (y_unit, ys) = known[first], known[second]
    ranked = found.front
    best = ranked.feasible & (ranked.rank == 0)
    near = ranked.feasible | (_near(xs, ranked.feasible) & _near(ys, ranked.feasible))
    far = int(np.count_nonzero(~near & ~ranked.failed))
    kinds = (
        (Phrase("outside the limits"), _OUTSIDE, ~ranked.feasible & near),
        (Phrase("feasible"), PALETTE[0], ranked.feasible & ~best),
        (Phrase("front"), PALETTE[1], best),
    )
    cases = ranked.cases[:, 0]
    lines = tuple(
        Line(name, xs[which], ys[which], colour, index, str(index), cases=cases[which], joined=False)
        for index, (name, colour, which) in enumerate(kinds)
        if which.any()
    )
    across, along = (
        Quantity(Phrase("design") if name == NUMBER else name, unit)
        for name, unit in ((first, x_unit), (second, y_unit))
    )
    note = "" if len(found.numbers) else _NOTHING
    below = (
        plural(
            "{count} design outside the limits lies beyond the edges.",
            "{count} designs outside the limits lie beyond the edges.",
            far,
        )
        if far
        else ""
    )
    panel = Panel(along, lines, x=across)
    return Figure(across, (panel,), note=note, below=below, most=20_000)


def _near(values: Floats, feasible: Bools) -> Bools:
    """Which values are within the range of the feasible ones, or as much as that beyond; all where few are feasible."""
    known = values[feasible & np.isfinite(values)]
    if known.size < _FEW or np.ptp(known) == 0.0:
        return np.ones(len(values), dtype=np.bool_)
    span = np.ptp(known)
    return np.asarray((values >= known.min() - span) & (values <= known.max() + span))


def history_figure(found: Designs, columns: int = 2) -> Figure:
    """The best value of each goal, the hypervolume, and feasible designs over the generations; only what is known."""
    after = [item for item in history(found.rounds) if item["phase"] != "polish" or item["generation"]]
    # Of each generation what it had reached itself: the polish asks for the same best values more strictly.
    first = {item["generation"]: item for item in reversed(after)}
    at = np.array(sorted(first), dtype=np.float64)
    rows = [first[int(generation)] for generation in at]
    across = Quantity(Phrase("generation"), "1")
    found_values: list[tuple[str, str, list[float | None]]] = [
        (
            Phrase("best {result}", result=Name(goal.name, within=True)),
            found.infos[goal.name].unit,
            [row["best"][index] for row in rows],
        )
        for index, goal in enumerate(found.plan.best)
    ]
    found_values.append((Phrase("hypervolume"), "1", [row["hypervolume"] for row in rows]))
    drawn = [one for one in found_values if any(value is not None for value in one[2])]
    drawn.append((Phrase("feasible designs"), "1", [float(row["feasible"]) for row in rows]))
    panels = tuple(
        Panel(
            Quantity(name, unit),
            (Line(name, at, np.array(values, dtype=np.float64), PALETTE[0], key="0", listed=False),),
            x=across,
        )
        for name, unit, values in drawn
    )
    return Figure(across, panels, columns, note="" if rows else Phrase("No generation has ended yet."))
