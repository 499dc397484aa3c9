"""The plan of a study that searches for designs: what varies, what is best, what must hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.limits import GENERATIONS, MAX_DRIVES, MAX_FRESH_DRIVES
from sprag_study.worker.planning.goals.linear import weighted_sum
from sprag_study.worker.spread import DRIVE

#: Value of "kind" in the plan.
GOAL: Final = "goal"
#: Bounds of a plan: designs of one generation, designs in all.
POPULATION = (4, 10_000)
MOST_DESIGNS = 1_000_000

Kind = Literal["is", "at_least", "at_most"]
#: What counts of several operating points.
Over = Literal["worst", "mean", "best"]
_OVER: tuple[Over, ...] = ("worst", "mean", "best")
_KINDS: tuple[Kind, ...] = ("is", "at_least", "at_most")
#: What of a result over the drawn drives a goal or a limit is about, beside a quantile: its mean or its deviation.
Statistic = Literal["mean", "deviation"]
STATISTICS: tuple[Statistic, ...] = ("mean", "deviation")


@dataclass(frozen=True, slots=True)
class Variable:
    """What a search varies: a range or a catalogue of values, SI. All of its parameters take the same value.

    Attributes
    ----------
    paths : tuple of str
    low, high : float
        The range, or the least and the largest of the values.
    values : tuple of float
        The values of a catalogue, ascending; none for a range.
    """

    paths: tuple[str, ...]
    low: float
    high: float
    values: tuple[float, ...] = ()

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Variable:
        """The variable as the plan has it; ValueError for an empty catalogue."""
        paths = tuple(str(path) for path in data["paths"])
        if "values" in data:
            values = tuple(sorted({float(value) for value in data["values"]}))
            _check(bool(values), "vary.values", [], "at least one value")
            return cls(paths, values[0], values[-1], values)
        return cls(paths, float(data["low"]), float(data["high"]))

    def has(self, value: float) -> bool:
        """Whether a value (SI) is one that it may have."""
        return value in self.values if self.values else self.low <= value <= self.high


class _Quantity:
    """What a goal or a limit is about: a result, a quantile, mean or deviation of it over the drives, or a yield."""

    __slots__ = ()

    result: str
    quantile: float | None
    conditions: tuple[Limit, ...]
    at: tuple[int, ...]
    where: str
    over: Over | None
    statistic: Statistic | None
    deviations: float

    @property
    def robust(self) -> bool:
        """Whether it is about the drawn drives."""
        return self.quantile is not None or self.statistic is not None or bool(self.conditions)

    @property
    def name(self) -> str:
        """Its name: "torque.max", "torque.max (95 % quantile, at idle)", "yield (torque.max at most 3)"."""
        if not self.conditions:
            return self.result + self._about
        words = {"is": "is", "at_least": "at least", "at_most": "at most"}
        held = (f"{one.result}{one._about} {words[one.kind]} {one.value:.6g}" for one in self.conditions)
        return f"yield ({' and '.join(held)})"

    @property
    def _about(self) -> str:
        drives = [] if self.quantile is None else [f"{100.0 * self.quantile:.10g} % quantile"]
        drives += [] if self.statistic is None else [statistic_text(self.statistic, self.deviations)]
        parts = [*drives, *([self.over] if self.over else []), *([f"at {self.where}"] if self.where else [])]
        return f" ({', '.join(parts)})" if parts else ""


@dataclass(frozen=True, slots=True)
class Goal(_Quantity):
    """A result that is to be as large (``max``) or as small as possible.

    Attributes
    ----------
    result : str
        "" for a yield.
    max : bool
    quantile : float, optional
        A quantile of the result over the drawn drives, 0 to 1; by default the result of the nominal drive.
    conditions : tuple of Limit
        The goal is the yield instead: the share of the drawn drives that meet them all at every operating point.
    at : tuple of int
        The operating points that count; by default all.
    where : str
        What these are called; "" for all.
    over : {"worst", "mean", "best"}, optional
        What counts of several points; by default as the plan says.
    statistic : {"mean", "deviation"}, optional
        Mean or standard deviation of the result over the drawn drives instead of a quantile.
    deviations : float
        How many deviations are added to the mean; 0 of a deviation.
    """

    result: str
    max: bool
    quantile: float | None = None
    conditions: tuple[Limit, ...] = ()
    at: tuple[int, ...] = ()
    where: str = ""
    over: Over | None = None
    statistic: Statistic | None = None
    deviations: float = 0.0

    @property
    def upwards(self) -> bool:
        """Whether larger values are better."""
        return self.max


@dataclass(frozen=True, slots=True)
class Limit(_Quantity):
    """What a result must be, at every operating point that counts; SI, or the code of a category.

    Attributes
    ----------
    result : str
    kind : {"is", "at_least", "at_most"}
    value : float
    within : float
        Half width of the band around ``value`` of an equality; 0 for a category or a count, which must be equal.
    quantile, conditions : as of `Goal`; neither goes with "is"
    at, where, statistic, deviations : as of `Goal`
    over : {"mean", "best"}, optional
        The mean or the best one of the points must meet it, instead of each; not with "is".
    """

    result: str
    kind: Kind
    value: float
    within: float = 0.0
    quantile: float | None = None
    conditions: tuple[Limit, ...] = ()
    at: tuple[int, ...] = ()
    where: str = ""
    over: Over | None = None
    statistic: Statistic | None = None
    deviations: float = 0.0

    @property
    def upwards(self) -> bool:
        """Whether larger values are better."""
        return self.kind == "at_least"

    def holds(self, values: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Where values meet it; a missing one (NaN) does not."""
        if self.kind == "at_least":
            return values >= self.value
        if self.kind == "at_most":
            return values <= self.value
        return np.abs(values - self.value) <= self.within

    @property
    def polished(self) -> bool:
        """Whether it is an equality of real numbers, which can be met more closely than by its band."""
        return self.kind == "is" and self.within > 0.0

    @property
    def scale(self) -> float:
        """What violations of the limit are divided by: its value, or where that is 0 its band or 1."""
        return abs(self.value) or self.within or 1.0

    def judged(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values at operating points, shape (designs, points), with those that do not count at the limit itself.

        Where the mean or the best one counts, it is at the first of the points, in the place of its value.
        """
        if not (self.at or self.over):
            return values
        judged, counted = np.full_like(values, self.value), self.counted(values.shape[1])
        judged[:, counted] = taken(self, values, self.over)[:, None] if self.over else values[:, counted]
        return judged

    def counted(self, points: int) -> list[int]:
        """The places of ``judged`` that hold what counts, of so many operating points."""
        return [0] if self.over else list(self.at or range(points))


@dataclass(frozen=True)
class GoalPlan:
    """A search for the best designs, in SI.

    Attributes
    ----------
    vary : tuple of Variable
    best : tuple of Goal
        Without one, any design within the limits will do.
    subject_to : tuple of Limit
    at : tuple of dict of float
        Operating points of each design: the same paths in each, at least one point, which may be empty.
    over : {"worst", "mean", "best"}
        How a goal is taken over the operating points, unless it says so itself. A limit must hold at each of them.
    population, generations, seed : int
    polish : bool
        Whether equalities are met to 1e-6 by further rounds after the last generation.
    finish : bool
        Whether the best design of a search for one goal is moved to the optimum beside it after that.
    growing : bool
        Whether a search for one goal that starts anew has generations of twice as many designs each time; one of k
        times the population counts as k of ``generations``.
    least_gain : float
        Share of the goal, 0 to 1: a search for one goal ends where starting anew has gained no more; 0: at its last
        generation.
    drives : int
        Drawn drives of each design at each operating point, beside the nominal one; 0 without tolerances.
    fresh : int
        Further drives, which the search has not seen, of its best designs at the end; their numbers follow those of
        the drawn drives.
    names : tuple of str
        What the operating points are called, "" for those without a name; () where none has one.
    start : tuple of tuple of float
        Known designs, values of the variables in their order, which the first generation has; at most a population.

    Raises
    ------
    ValueError
        If a field is out of its range; the message names it.
    """

    vary: tuple[Variable, ...]
    best: tuple[Goal, ...]
    subject_to: tuple[Limit, ...] = ()
    at: tuple[Mapping[str, float], ...] = ({},)
    over: Over = "worst"
    population: int = 100
    generations: int = 60
    seed: int = 1
    polish: bool = True
    drives: int = 0
    start: tuple[tuple[float, ...], ...] = ()
    finish: bool = False
    growing: bool = False
    least_gain: float = 0.0
    names: tuple[str, ...] = ()
    fresh: int = 0

    def __post_init__(self) -> None:
        _check_variables(self)
        _check_start(self)
        for i, limit in enumerate(self.subject_to):
            _check(math.isfinite(limit.value), f"subject_to.{i}.{limit.kind}", limit.value, "a finite number")
            within = f"subject_to.{i}.within"
            _check(0.0 <= limit.within < math.inf, within, limit.within, "a finite number of at least 0")
        _check_robust(self)
        _check(bool(self.best or self.subject_to), "best", [], "at least one goal, or a limit in subject_to")
        _check(len(self.names) in {0, len(self.at)}, "names", len(self.names), "a name for each operating point")
        _check(self.over in _OVER, "over", self.over, "worst, mean or best")
        for i, item in enumerate(self.items):
            _check_counted(i, item, len(self.at))
        for name, value, (low, high) in (
            ("population", self.population, POPULATION),
            ("generations", self.generations, GENERATIONS),
            ("seed", self.seed, (0, 2**63 - 1)),
            ("drives", self.drives, (0, MAX_DRIVES)),
            ("fresh", self.fresh, (0, MAX_FRESH_DRIVES if self.drives else 0)),
        ):
            _check(low <= value <= high, name, value, f"an integer from {low:,} to {high:,}")
        _check(0.0 <= self.least_gain <= 1.0, "least_gain", self.least_gain, "a share from 0 to 1")
        designs = self.population * self.generations
        _check(designs <= MOST_DESIGNS, "population", designs, f"at most {MOST_DESIGNS:,} times generations")

    @property
    def at_paths(self) -> tuple[str, ...]:
        """Paths of the operating points, in the order of the first of them."""
        return tuple(self.at[0])

    @property
    def paths(self) -> tuple[tuple[str, ...], ...]:
        """What each column of the points varies: the variables in their order, the paths of ``at``, the drive."""
        drive = ((DRIVE,),) if self.drives else ()
        return (*(one.paths for one in self.vary), *((path,) for path in self.at_paths), *drive)

    @property
    def cases_each(self) -> int:
        """Cases of each design: one for each operating point and drive, the drive varying fastest."""
        return len(self.at) * (1 + self.drives)

    @property
    def results(self) -> tuple[str, ...]:
        """Names of the results of goals and limits, each once."""
        inner = (condition for item in self.items for condition in item.conditions)
        return tuple(dict.fromkeys(item.result for item in (*self.items, *inner) if item.result))

    @property
    def items(self) -> tuple[Goal | Limit, ...]:
        """Goals, then limits."""
        return (*self.best, *self.subject_to)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> GoalPlan:
        """The plan as stored with its study.

        Raises
        ------
        ValueError
            As of the class, or if something is missing.
        """
        try:
            return cls(
                vary=tuple(Variable.from_json(one) for one in data["vary"]),
                best=tuple(_goal(one) for one in data.get("best", ())),
                subject_to=tuple(_limit(i, one) for i, one in enumerate(data.get("subject_to", ()))),
                at=tuple(_point(one) for one in data.get("at") or [{}]),
                over=data.get("over", "worst"),
                population=int(data["population"]),
                generations=int(data["generations"]),
                seed=int(data["seed"]),
                polish=bool(data.get("polish", True)),
                drives=int(data.get("drives", 0)),
                fresh=int(data.get("fresh", 0)),
                start=tuple(tuple(float(value) for value in one) for one in data.get("start", ())),
                finish=bool(data.get("finish", False)),
                growing=bool(data.get("growing", False)),
                least_gain=float(data.get("least_gain", 0.0)),
                names=tuple(str(name) for name in data.get("names", ())),
            )
        except KeyError as error:
            raise ValueError(f"goal: {error.args[0]} is missing") from error

    def to_json(self) -> dict[str, Any]:
        """The plan as plain JSON data, from which ``from_json`` makes an equal one."""
        vary = [
            {"paths": list(one.paths), "values": list(one.values)}
            if one.values
            else {"paths": list(one.paths), "low": one.low, "high": one.high}
            for one in self.vary
        ]
        return {
            "kind": GOAL,
            "vary": vary,
            "best": [{**_about(one), "max": one.max} for one in self.best],
            "subject_to": [_limit_json(one) for one in self.subject_to],
            "at": [dict(one) for one in self.at],
            "over": self.over,
            "population": self.population,
            "generations": self.generations,
            "seed": self.seed,
            "polish": self.polish,
            **({"drives": self.drives} if self.drives else {}),
            **({"fresh": self.fresh} if self.fresh else {}),
            **({"start": [list(one) for one in self.start]} if self.start else {}),
            **({"finish": True} if self.finish else {}),
            **({"growing": True} if self.growing else {}),
            **({"least_gain": self.least_gain} if self.least_gain else {}),
            **({"names": list(self.names)} if self.names else {}),
        }


def statistic_text(statistic: Statistic, deviations: float) -> str:
    """What a mean or a deviation is called: "mean of the drives - 3 sigma"."""
    sign = "-" if deviations < 0.0 else "+"
    return f"{statistic} of the drives" + (f" {sign} {abs(deviations):.6g} sigma" if deviations else "")


def taken(item: Goal | Limit, values: NDArray[np.float64], over: Over) -> NDArray[np.float64]:
    """What counts of values at operating points, shape (designs, points) in, (designs,) out.

    ``over`` is how, unless the goal or limit says so itself: the worst one or the mean, NaN where a value is missing,
    or the best one of those that are there.
    """
    counted = values[:, list(item.at)] if item.at else values
    over = item.over or over
    if over == "mean":
        mean: NDArray[np.float64] = weighted_sum(np.ones(counted.shape[1]), counted.T) / counted.shape[1]
        return mean
    if over == "best":
        best: NDArray[np.float64] = (np.fmax if item.upwards else np.fmin).reduce(counted, axis=1)
        return best
    worst: NDArray[np.float64] = counted.min(axis=1) if item.upwards else counted.max(axis=1)
    return worst


def _check(holds: bool, name: str, value: object, allowed: str) -> None:
    if not holds:
        raise ValueError(f"goal.{name} is {value}; allowed: {allowed}")


def _check_robust(plan: GoalPlan) -> None:
    for i, one in enumerate(plan.items):
        first = len(plan.best)
        name = f"best.{i}" if i < first else f"subject_to.{i - first}"
        _check(plan.drives > 0 or not one.robust, name, one.name, "a result, without drawn drives")
        quantile = one.quantile
        _check(quantile is None or 0.0 <= quantile <= 1.0, f"{name}.quantile", quantile, "0 to 1")
        _check(bool(one.result) != bool(one.conditions), name, one.result, "a result, or a yield")
        equal = isinstance(one, Limit) and one.kind == "is"
        _check(not (equal and one.robust and one.statistic is None), name, "is", "at_least or at_most")
        _check_statistic(name, one, plan.drives)


def _check_statistic(name: str, one: Goal | Limit, drives: int) -> None:
    known = one.statistic in STATISTICS and one.quantile is None and not one.conditions
    _check(one.statistic is None or known, f"{name}.statistic", one.statistic, "mean or deviation, of a result")
    _check(one.statistic is None or drives > 1, f"{name}.statistic", one.statistic, "none of a single drive")
    free = math.isfinite(one.deviations) and (one.statistic == "mean" or not one.deviations)
    _check(free, f"{name}.deviations", one.deviations, "a finite number, of a mean")
    polished = not isinstance(one, Limit) or one.kind != "is" or one.polished
    _check(one.statistic is None or polished, f"{name}.within", 0.0, "a band of real numbers")


def _check_counted(i: int, item: Goal | Limit, points: int) -> None:
    """Check at which operating points a goal or a limit, number ``i`` of all, counts, and how."""
    for inner in item.conditions:
        _check_counted(i, inner, points)
        _check(inner.over is None, f"items.{i}.over", inner.over, "none in a yield")
    inside = all(0 <= place < points for place in item.at) and len(set(item.at)) == len(item.at)
    _check(inside, f"items.{i}.at", item.at, f"operating points, each once, 0 to {points - 1}")
    _check(not (item.conditions and (item.at or item.over)), f"items.{i}.at", item.at, "none of a yield")
    free = isinstance(item, Goal) or (item.over != "worst" and not (item.over and item.kind == "is"))
    _check(
        (item.over is None or item.over in _OVER) and free, f"items.{i}.over", item.over, "mean or best, not with is"
    )


def _about(one: Goal | Limit) -> dict[str, Any]:
    """What a goal or a limit is about, as plain JSON data."""
    if one.conditions:
        return {"yield": [_limit_json(condition) for condition in one.conditions]}
    about: dict[str, Any] = {"result": one.result, **({} if one.quantile is None else {"quantile": one.quantile})}
    about |= {} if one.statistic is None else {"statistic": one.statistic}
    return {**about, **({"deviations": one.deviations} if one.deviations else {}), **_counted(one)}


def _counted(one: Goal | Limit) -> dict[str, Any]:
    """At which operating points it counts, and how, where that is not as usual."""
    at = {"at": list(one.at), "where": one.where} if one.at else {}
    return at | ({"over": one.over} if one.over else {})


def _limit_json(one: Limit) -> dict[str, Any]:
    return {**_about(one), one.kind: one.value, **({"within": one.within} if one.within else {})}


def _check_variables(plan: GoalPlan) -> None:
    _check(bool(plan.vary), "vary", [], "at least one variable")
    for i, one in enumerate(plan.vary):
        _check(bool(one.paths), f"vary.{i}.paths", [], "at least one path")
        if one.values:
            ascending = all(a < b for a, b in zip(one.values, one.values[1:], strict=False))
            finite = all(math.isfinite(value) for value in one.values)
            _check(ascending and finite, f"vary.{i}.values", list(one.values), "finite values, each once")
        else:
            finite = math.isfinite(one.low) and math.isfinite(one.high)
            _check(finite and one.low < one.high, f"vary.{i}.high", one.high, f"a finite number above {one.low}")
    _check(bool(plan.at), "at", [], "at least one operating point")
    for i, point in enumerate(plan.at):
        same = set(point) == set(plan.at[0])
        _check(same, f"at.{i}", sorted(point), f"the parameters of the first point, {sorted(plan.at[0])}")
        for path, value in point.items():
            _check(math.isfinite(value), f"at.{i}.{path}", value, "a finite number")
    seen: set[str] = set()
    for paths in plan.paths:
        for path in paths:
            _check(path not in seen, "vary", path, "each parameter once, in vary or in at")
            seen.add(path)


def _check_start(plan: GoalPlan) -> None:
    _check(len(plan.start) <= plan.population, "start", len(plan.start), f"at most {plan.population} designs")
    for i, design in enumerate(plan.start):
        _check(len(design) == len(plan.vary), f"start.{i}", list(design), "a value of each variable")
        for one, value in zip(plan.vary, design, strict=True):
            _check(one.has(value), f"start.{i}", value, f"a value that {one.paths[0]} may have")


def _point(data: Mapping[str, Any]) -> dict[str, float]:
    return {str(path): float(value) for path, value in data.items()}


def _limit(i: int, data: Mapping[str, Any]) -> Limit:
    kinds = [kind for kind in _KINDS if kind in data]
    _check(len(kinds) == 1, f"subject_to.{i}", sorted(data), "one of is, at_least and at_most")
    within, (result, quantile, conditions) = float(data.get("within", 0.0)), _read_about(data)
    further = *_read_counted(data), *_read_statistic(data)
    return Limit(result, kinds[0], float(data[kinds[0]]), within, quantile, conditions, *further)


def _goal(data: Mapping[str, Any]) -> Goal:
    result, quantile, conditions = _read_about(data)
    return Goal(result, bool(data["max"]), quantile, conditions, *_read_counted(data), *_read_statistic(data))


def _read_statistic(data: Mapping[str, Any]) -> tuple[Statistic | None, float]:
    return data.get("statistic"), float(data.get("deviations", 0.0))


def _read_counted(data: Mapping[str, Any]) -> tuple[tuple[int, ...], str, Over | None]:
    return tuple(int(place) for place in data.get("at", ())), str(data.get("where", "")), data.get("over")


def _read_about(data: Mapping[str, Any]) -> tuple[str, float | None, tuple[Limit, ...]]:
    if "yield" in data:
        return "", None, tuple(_limit(i, one) for i, one in enumerate(data["yield"]))
    quantile = data.get("quantile")
    return str(data["result"]), None if quantile is None else float(quantile), ()
