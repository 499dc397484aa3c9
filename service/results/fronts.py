"""Designs of a study with a goal: ranked, with their numbers, and how the search has come to them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import chain
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np

from sprag_study.sentences import Amount, Name, Named
from sprag_study.service import exports
from sprag_study.service.answers.goals import (
    Counted,
    Design,
    DesignGoal,
    DesignLimit,
    DesignVariable,
    FrontReport,
    Generation,
)
from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.json_text import numbers
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.directions import in_words
from sprag_study.service.reading.reader import Phrase, term
from sprag_study.service.results.explore import Further
from sprag_study.service.results.fresh import (
    Fresh,
    fresh_cells,
    fresh_columns,
    fresh_designs,
    fresh_json,
    searched_cases,
)
from sprag_study.service.results.regimes import kind_columns
from sprag_study.worker import models
from sprag_study.worker.models import WorkerEnding
from sprag_study.worker.planning.goals import GoalPlan, front, taken
from sprag_study.worker.planning.goals.plan import GOAL, statistic_text
from sprag_study.worker.planning.goals.polish import MET
from sprag_study.worker.planning.goals.record import serve_derivatives
from sprag_study.worker.planning.goals.robust import Table
from sprag_study.worker.planning.rounds import Rows

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from sprag_study.service.reading.quantities import Units
    from sprag_study.service.results.curves import Fetch
    from sprag_study.service.storage.studies.records import RoundRecord
    from sprag_study.worker.arrays import Bools, Floats, Ints
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.planning.goals import Front
    from sprag_study.worker.planning.goals.plan import Goal, Limit, Variable
    from sprag_study.worker.study import Study

#: Designs that are answered unless more are asked for.
DESIGNS: Final = 2000


@dataclass(frozen=True, slots=True)
class Designs:
    """The designs of a study whose cases all have their rows.

    Attributes
    ----------
    numbers : int64 array, shape (designs,)
        Of each design, ascending.
    front : Front
        Aligned with ``numbers``; its ``cases`` are those of the study.
    exact : bool array, shape (designs,)
        Feasible, and equalities of real numbers met to 1e-6.
    infos : dict
        What goals and limits are about, by name: a result, its quantile over the drives, a yield.
    values : dict of float64 arrays, each shape (designs, operating points)
        The same of each design, SI or the code of a category.
    order : int64 array, shape (designs,)
        Positions of the designs: the best rank first, within a rank the best first goal.
    rounds : list of RoundRecord
    round : int64 array, shape (designs,)
        Which of ``rounds`` each design belongs to.
    pending : int
        Designs that are still to be run, or never were.
    regimes : list of lists or None
        Of each design those at its operating points, of the nominal drive; None for a search of runs of a given time.
    flags : list of lists of str
        Of each design those of all its cases, each once.
    fresh : tuple of Fresh
        The best designs of a search that has ended, with fresh drives.
    """

    study: Study
    plan: GoalPlan
    infos: dict[str, ResultInfo]
    numbers: Ints
    front: Front
    exact: Bools
    values: dict[str, Floats]
    order: Ints
    rounds: list[RoundRecord]
    round: Ints
    pending: int
    regimes: list[list[str | None]] | None
    flags: list[list[str]]
    fresh: tuple[Fresh, ...] = ()

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of designs, as `FrontReport` gives them."""
        flags = {"feasible": self.front.feasible, "failed": self.front.failed, "exact": self.exact}
        first = self.front.feasible & (self.front.rank == 0)
        counted = {name: int(np.count_nonzero(flag)) for name, flag in (flags | {"front": first}).items()}
        return {"known": len(self.numbers), "pending": self.pending, **counted}


def goal_units(study: Study) -> tuple[str, ...]:
    """The units of the goals of a search, in their order; none of any other study."""
    if study.kind != GOAL:
        return ()
    plan = goal_of(study)
    infos = infos_of(study, plan)
    return tuple(infos[goal.name].unit for goal in plan.best)


def goal_of(study: Study) -> GoalPlan:
    """The search of a study; FaultError for a study without a goal."""
    if study.plan is None or study.kind != GOAL:
        message = N_("the study has no goal, so that its cases are no designs")
        raise FaultError(
            "invalid-selection", message, [Fault(None, "conflict", message, allowed="a study whose spec has `goal`")]
        )
    return GoalPlan.from_json(study.plan)


def designs_of(study: Study, rounds: list[RoundRecord], fetch: Fetch, *, exact: bool = False) -> Designs:
    """All designs of ``study`` but those that serve derivatives only, ranked.

    Parameters
    ----------
    rounds : list of RoundRecord
        As `Studies.rounds` gives them.
    fetch : callable
        Gives rows by numbers of cases and names of results.
    exact : bool
        Whether designs must meet equalities to 1e-6 to be feasible, instead of within their bands.

    Raises
    ------
    FaultError
        For a study without a goal.
    """
    plan = goal_of(study)
    each, drives = plan.cases_each, 1 + plan.drives
    searched = searched_cases(study, rounds)
    whole = range(searched - searched % each)
    infos = models.study_results(study)
    regime = models.regime_info(infos)
    names = models.with_half_widths([*plan.results, *kind_columns(regime)[:1]], (info.name for info in infos))
    columns = fetch(np.arange(whole.stop, dtype=np.int64), names)
    endings = np.array([ending or WorkerEnding.CANCELLED for ending in columns.endings], dtype=object)
    ended = (endings != WorkerEnding.CANCELLED).reshape(-1, each).all(axis=1)
    known = ended & ~_for_derivatives(rounds, len(ended), each)
    kept = np.repeat(known, each)
    values = {name: column[kept] for name, column in columns.values.items()}
    rows = Rows(study.points(whole)[kept], models.usable(study.model, columns.endings, columns.flags)[kept], values)
    flags = np.array(columns.flags or [""] * whole.stop, dtype=object)[kept].reshape(-1, each).tolist()
    found = front(plan, rows, equality=MET if exact else None)
    numbers_ = np.flatnonzero(known)
    found.cases[:] = numbers_[:, None] * each + np.arange(0, each, drives)
    table = Table(plan, rows)
    designs = study.points(whole)[::each, : len(plan.vary)]
    goal = found.goals[:, 0] * (-1.0 if plan.best[0].max else 1.0) if plan.best else found.violation
    return Designs(
        study=study,
        plan=plan,
        infos=infos_of(study, plan),
        numbers=numbers_,
        front=found,
        exact=found.feasible & (found.miss <= MET),
        values={item.name: _where_counted(item, table.values(item)) for item in plan.items},
        order=np.lexsort((numbers_, goal, found.rank)),
        rounds=rounds,
        round=np.searchsorted([record.cases.start for record in rounds], found.cases[:, 0], side="right") - 1,
        pending=int(np.count_nonzero(~ended)),
        regimes=None if regime is None else _regimes(regime, values[regime.name].reshape(-1, each)[:, ::drives]),
        flags=[list(dict.fromkeys(name for text in own for name in text.split(",") if name)) for own in flags],
        fresh=fresh_designs(study, plan, rounds, fetch, names, designs) if plan.fresh else (),
    )


def _where_counted(item: Goal | Limit, values: Floats) -> Floats:
    """Values at the operating points that count for a goal or a limit, shape (designs, points), NaN at all others."""
    if not item.at:
        return values
    counted = np.full_like(values, np.nan)
    counted[:, list(item.at)] = values[:, list(item.at)]
    return counted


def _regimes(regime: ResultInfo, codes: Floats) -> list[list[str | None]]:
    """Names of regimes, None for a case without, from their codes."""
    cells = [[regime.cell(code) for code in own] for own in codes.tolist()]
    return [[None if cell is None else str(cell) for cell in own] for own in cells]


def _for_derivatives(rounds: Sequence[RoundRecord], designs: int, each: int) -> Bools:
    """Which designs the polish and the finish ran for their derivatives only."""
    marked = np.zeros(designs, dtype=np.bool_)
    for record, aside in zip(rounds, serve_derivatives([one.summary for one in rounds]), strict=True):
        marked[record.cases.start // each : record.cases.stop // each] |= aside
    return marked


def infos_of(study: Study, plan: GoalPlan) -> dict[str, ResultInfo]:
    """What goals and limits are about, by name: a result, its quantile over the drives, a yield."""
    known = models.results_by_name(study)
    found: dict[str, ResultInfo] = {}
    for item in plan.items:
        if item.conditions:
            found[item.name] = models.ResultInfo(item.name, "1", "share of the drawn drives that meet the conditions")
        elif item.quantile is not None:
            info = known[item.result]
            text = f"{info.description}; {100.0 * item.quantile:.10g} % quantile over the drawn drives"
            found[item.name] = replace(info, name=item.name, kind="real", description=text)
        elif item.statistic is not None:
            info = known[item.result]
            text = f"{info.description}; {statistic_text(item.statistic, item.deviations)}"
            found[item.name] = replace(info, name=item.name, kind="real", description=text)
        else:
            found[item.name] = known[item.result]
        if item.at or item.over:
            found[item.name] = replace(found[item.name], name=item.name)
    return found


def front_json(study_id: str, found: Designs, limit: int = DESIGNS) -> FrontReport:
    """The designs as an answer, at most ``limit`` of them."""
    plan, infos = found.plan, found.infos
    report: FrontReport = {
        "study": study_id,
        "variables": _variables(found),
        "best": [
            DesignGoal(
                result=goal.name,
                unit=infos[goal.name].unit,
                description=infos[goal.name].description,
                max=goal.max,
                **_counted(goal),
            )
            for goal in plan.best
        ],
        "subject_to": [_limit(limit_, infos[limit_.name]) for limit_ in plan.subject_to],
        "at": [dict(point) for point in plan.at],
        "over": plan.over,
        "generations": plan.generations,
        "counts": found.counts,
        "designs": [design_json(found, int(position)) for position in found.order[:limit]],
        "history": history(found.rounds),
    }
    if plan.names:
        report["names"] = list(plan.names)
    if found.fresh:
        report["fresh"] = [fresh_json(own, [goal.name for goal in plan.best]) for own in found.fresh]
    return report


def _variables(found: Designs) -> list[DesignVariable]:
    return [_variable(one, unit_of(found.study, one.paths[0])) for one in found.plan.vary]


def _variable(one: Variable, unit: str) -> DesignVariable:
    described: DesignVariable = {
        "name": one.paths[0],
        "paths": list(one.paths),
        "unit": unit,
        "low": one.low,
        "high": one.high,
        "values": list(one.values),
    }
    if isinstance(unit, Named):
        described["names"] = [unit.names[int(value)] for value in one.values]
    return described


def _limit(limit: Limit, info: ResultInfo) -> DesignLimit:
    value = info.cell(limit.value)
    named: Any = {"result": info.name, "unit": info.unit, limit.kind: value, "within": limit.within, **_counted(limit)}
    return cast("DesignLimit", named)


def _counted(item: Goal | Limit) -> Counted:
    """At which operating points a goal or a limit counts, and how, where that is not as usual."""
    counted: Counted = {"points": list(item.at)} if item.at else {}
    return {**counted, "over": item.over} if item.over else counted


def design_json(found: Designs, position: int) -> Design:
    """The design at a position."""
    ranked, record = found.front, found.rounds[found.round[position]]
    names = [one.paths[0] for one in found.plan.vary]
    units = {name: unit_of(found.study, name) for name in names}
    return {
        "design": int(found.numbers[position]),
        "cases": ranked.cases[position].tolist(),
        "round": record.round + 1,
        "phase": "polish" if record.summary.get("phase") == "polish" else "search",
        "variables": in_words(dict(zip(names, ranked.variables[position].tolist(), strict=True)), units),
        "goals": dict(zip((goal.name for goal in found.plan.best), numbers(ranked.goals[position] + 0.0), strict=True)),
        "results": {
            name: [found.infos[name].cell(value) for value in column[position].tolist()]
            for name, column in found.values.items()
        },
        "feasible": bool(ranked.feasible[position]),
        "failed": bool(ranked.failed[position]),
        "regimes": None if found.regimes is None else found.regimes[position],
        "flags": found.flags[position],
        "violation": _finite(ranked.violation[position]),
        "miss": _finite(ranked.miss[position]),
        "exact": bool(found.exact[position]),
        "rank": int(ranked.rank[position]),
    }


def worst_of(limit: Limit, values: Floats) -> Floats:
    """What is farthest on the wrong side of a limit among the operating points of each design; shape (designs,).

    ``values`` have the shape (designs, operating points); a missing one is the worst. Of a limit on the mean or the
    best of the points it is that.
    """
    if limit.over:
        return taken(limit, values, limit.over)
    return np.asarray(values[np.arange(len(values)), worst_places(limit, values)])


def worst_places(limit: Limit, values: Floats) -> NDArray[np.intp]:
    """The operating points of `worst_of`, shape (designs,), among those that count."""
    signs = {"at_least": -1.0, "at_most": 1.0}
    off = signs[limit.kind] * values if limit.kind in signs else np.abs(values - limit.value)
    off = np.where(np.isnan(values), np.inf, off)
    if limit.at:
        off[:, [place for place in range(off.shape[1]) if place not in limit.at]] = -np.inf
    return np.asarray(off.argmax(axis=1))


def further_of(found: Designs) -> Further:
    """What is known of each design beyond the row of its first case: goals, limits, and its place among all designs.

    Sorted by their rank they are in the order of `Designs.order`.
    """
    ranked, plan = found.front, found.plan
    values = {goal.name: ranked.goals[:, index] for index, goal in enumerate(plan.best)}
    for limit in plan.subject_to:
        if found.infos[limit.name].kind != "category":
            values.setdefault(limit.name, worst_of(limit, found.values[limit.name]))
    place = np.empty(len(found.numbers))
    place[found.order] = np.arange(len(found.order))
    own = {"rank": ranked.rank.astype(np.float64), "violation": ranked.violation, "miss": ranked.miss}
    infos = [found.infos[name] for name in values] + [models.ResultInfo(name, "1", "") for name in own]
    missing = {name: np.where(np.isfinite(column), column, np.nan) for name, column in (values | own).items()}
    return Further(tuple(infos), ranked.cases[:, 0], missing, {"rank": place})


def conditions_of(plan: GoalPlan, infos: Mapping[str, ResultInfo]) -> tuple[str, ...]:
    """The limits of a search as ranges of an `ExploreQuery`; those of categories as "violation <= 0"."""
    texts: dict[str, None] = {}
    for limit in plan.subject_to:
        info = infos[limit.name]
        unit = "" if info.unit == "1" else f" {info.unit}"
        if info.kind == "category":
            texts["violation <= 0"] = None
            continue
        if limit.kind != "at_most":
            texts[f"{limit.name} >= {limit.value - limit.within!r}{unit}"] = None
        if limit.kind != "at_least":
            texts[f"{limit.name} <= {limit.value + limit.within!r}{unit}"] = None
    return tuple(texts)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def history(rounds: Sequence[RoundRecord]) -> list[Generation]:
    """What was known before each round from the second on, and at the end."""
    names = ("generation", "phase", "feasible", "infeasible", "failed", "best", "hypervolume")
    return [
        cast("Generation", {"round": record.round, **{name: record.summary.get(name) for name in names}})
        for record in rounds
        if record.summary
    ]


def front_csv(found: Designs, study: Study, shown: Units, limit: int = DESIGNS) -> bytes:
    """A row for each design, at most ``limit``, in a reader's units; several operating points are numbered."""
    plan, points = found.plan, range(1, len(found.plan.at) + 1)
    about = ("round", "phase", "rank", "feasible", "failed", "exact", "violation", "miss")
    header = ["design", "case", *about, *(one.paths[0] for one in plan.vary)]
    header += [f"{goal.over or plan.over}.{goal.name}" for goal in plan.best if len(points) > 1]
    header += [name if len(points) == 1 else f"{name}.{number}" for name in found.values for number in points]
    own = found.regimes is not None and not any(item.result == "regime" for item in plan.items)
    header += ["regime" if len(points) == 1 else f"regime.{number}" for number in points if own] + ["flags"]
    fresh, about_fresh = {one.design: one for one in found.fresh}, fresh_columns(found.fresh, len(points))
    header += about_fresh
    rows: list[list[Any]] = []
    for position in found.order[:limit].tolist():
        design = cast("dict[str, Any]", design_json(found, position))
        row = [design["design"], design["cases"][0], *(design[name] for name in about), *design["variables"].values()]
        row += design["goals"].values() if len(points) > 1 else ()
        row += chain.from_iterable(design["results"].values())
        row += [*(design["regimes"] if own else ()), " ".join(design["flags"])]
        rows.append([*row, *fresh_cells(fresh.get(design["design"]), len(about_fresh))])
    columns = dict(zip(header, zip(*rows, strict=True) if rows else [()] * len(header), strict=True))
    units = {one.paths[0]: unit_of(study, one.paths[0]) for one in plan.vary}
    units |= dict(zip((f"{goal.over or plan.over}.{goal.name}" for goal in plan.best), goal_units(study), strict=True))
    units |= {
        name: found.infos[name.removesuffix(f".{number}")].unit
        for number in points
        for name in (*found.values, *(f"{one}.{number}" for one in found.values))
    }
    units |= {
        f"fresh.{name}{part}": units[name] for name in (*units,) for part in ("", ".low", ".high")
        if f"fresh.{name}{part}" in columns
    }  # fmt: skip
    return exports.read_table(columns, units, shown)


def goals_of(study: Study) -> list[Phrase]:
    """The goals of a search: ``Largest mean shaft speed``."""
    return [_goal_text(own) for own in goal_of(study).best]


def limits_of(study: Study) -> list[Phrase]:
    """The limits of its designs: ``Largest clutch torque at most 3 N·m``."""
    return [_limit_text(study, own) for own in goal_of(study).subject_to]


def _goal_text(goal: Goal) -> Phrase:
    name = Name(goal.name, within=True)
    return Phrase("Largest {name}", name=name) if goal.max else Phrase("Smallest {name}", name=name)


def _limit_text(study: Study, limit: Limit) -> Phrase:
    info = next((own for own in models.study_results(study) if own.name == limit.result), None)
    unit = models.SHARE if info is None else info.unit
    cell = limit.value if info is None else info.cell(limit.value)
    value = term(cell) if isinstance(cell, str) else Amount(limit.value, unit)
    texts = {
        "at_least": Phrase("{name} at least {value}", name=Name(limit.name), value=value),
        "at_most": Phrase("{name} at most {value}", name=Name(limit.name), value=value),
        "is": Phrase("{name} = {value}", name=Name(limit.name), value=value),
    }
    return texts[limit.kind]
