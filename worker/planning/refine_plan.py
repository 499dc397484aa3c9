"""The plan of a refinement, its axes and the points of its grid. Plain values; no rows and no decisions."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Sentence
from sprag_study.worker.errors import WrongPlanError
from sprag_study.worker.models.usable import half_width

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    Bools = NDArray[np.bool_]
    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

#: Value of "kind" in the plan.
REFINE: Final = "refine"
#: Results of settled studies that tell regimes apart, and how a motion settles.
REGIME, ORDER = "regime", "regime.order"
MULTIPLIER, SETTLED_AFTER = "regime.multiplier", "regime.settled_after"
_MAX_FINEST: Final = 65_536
#: Numbers that a planner holds at most: results at every point of the finest grids.
_MAX_NUMBERS: Final = 8_000_000
#: Values at most that an axis includes.
MAX_INCLUDED: Final = 16
#: How far a value may be from a point of the grid, relative to the axis, that counts as this point.
SAME: Final = 1e-9


@dataclass(frozen=True)
class AdaptiveAxis:
    """An axis along which the planner chooses the values, from ``low`` to ``high`` (SI).

    It has positions 0 .. ``finest`` on its grid. The first round also has the values of ``include``, ascending. Those
    that are not on the grid have the positions behind it.
    """

    paths: tuple[str, ...]
    low: float
    high: float
    include: tuple[float, ...] = ()

    def at(self, positions: Ints, finest: int) -> Floats:
        """Values at positions: on the grid those of ``numpy.linspace`` with any power of two of intervals."""
        values = self.low + (self.high - self.low) * positions / finest
        values = np.where(positions == finest, self.high, values)
        beside = self.beside(finest) if self.include else np.zeros(0)
        return (
            np.where(positions > finest, beside[np.maximum(positions - finest - 1, 0)], values)
            if beside.size
            else values
        )

    def positions(self, values: Floats, finest: int) -> Ints:
        """Positions of values; ValueError for one that is neither on the grid nor included."""
        positions, valid = self._nearest(values, finest)
        if beside := self.beside(finest).tolist():
            near = np.abs(values[:, None] - beside) <= SAME * (self.high - self.low)
            other = ~valid & near.any(axis=1)
            positions[other] = finest + 1 + near[other].argmax(axis=1)
            valid |= other
        if not valid.all():
            raise ValueError(f"{self.paths[0]}: {values[~valid][0]} is not a point of this refinement")
        return positions

    def beside(self, finest: int) -> Floats:
        """The included values that are not on the grid."""
        values = np.array(self.include)
        return values[~self._nearest(values, finest)[1]]

    def included(self, finest: int) -> Ints:
        """Positions of the included values."""
        return self.positions(np.array(self.include), finest)

    def _nearest(self, values: Floats, finest: int) -> tuple[Ints, Bools]:
        """The nearest positions on the grid, and whether the values are there."""
        found = np.rint((values - self.low) / (self.high - self.low) * finest)
        valid = (found >= 0) & (found <= finest)
        positions = np.where(valid, found, 0).astype(np.int64)
        grid = np.where(positions == finest, self.high, self.low + (self.high - self.low) * positions / finest)
        return positions, valid & (np.abs(grid - values) <= SAME * (self.high - self.low))


@dataclass(frozen=True)
class FixedAxis:
    """An axis with given values (SI); each combination of all fixed axes is one curve or map."""

    paths: tuple[str, ...]
    values: tuple[float, ...]


@dataclass(frozen=True)
class ErrorBound:
    """The largest error of one result, which differs from that of the others.

    Attributes
    ----------
    value : float
        Relative to the range of the result over its curve or map, or in its unit (SI) where it is ``absolute``.
    absolute : bool
    """

    value: float
    absolute: bool = False


@dataclass(frozen=True)
class RefinePlan:
    """What a refinement asks for. The columns of its points are the fixed axes in their order, then the adaptive ones.

    Attributes
    ----------
    results : tuple of str
        Results that must be accurate to within the error.
    error : float
        Largest error, relative to the range of the result over its curve or map, of results without an error of their
        own.
    start : int
        Values of each adaptive axis in the first round: a power of two plus one.
    finest : int
        Intervals of the finest grid of each adaptive axis: a power of two.
    adaptive : tuple of AdaptiveAxis
        One for curves, two for maps.
    fixed : tuple of FixedAxis
    most : int or None
        Cases at most.
    regime : bool
        Whether the motions are settled: changes of regime and order are jumps, irregular motion scatters.
    half_widths : tuple of str
        Those of the results that have a half width ("NAME.half_width") where the motion is irregular.
    errors : dict of str to ErrorBound
        Results with an error of their own.

    Raises
    ------
    WrongPlanError
        With the name of the field, its value and what is allowed.
    """

    results: tuple[str, ...]
    error: float
    start: int
    finest: int
    adaptive: tuple[AdaptiveAxis, ...]
    fixed: tuple[FixedAxis, ...] = ()
    most: int | None = None
    regime: bool = False
    half_widths: tuple[str, ...] = ()
    errors: Mapping[str, ErrorBound] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check(bool(self.results), "results", list(self.results), "at least one name")
        _check(len(set(self.results)) == len(self.results), "results", list(self.results), "different names")
        _check(set(self.half_widths) <= set(self.results), "half_widths", list(self.half_widths), "names of results")
        _check(0.0 < self.error < 1.0, "error", self.error, "between 0 and 1, exclusive")
        _check(set(self.errors) <= set(self.results), "errors", list(self.errors), "errors of results")
        for name, bound in self.errors.items():
            valid = 0.0 < bound.value < (math.inf if bound.absolute else 1.0)
            _check(valid, f"errors {name}", bound.value, "above 0" if bound.absolute else "between 0 and 1, exclusive")
        _check(_power(self.finest) and self.finest <= _MAX_FINEST, "finest", self.finest, "a power of two up to 65,536")
        allowed = f"a power of two plus one, from 3 to {self.finest + 1}"
        _check(3 <= self.start <= self.finest + 1 and _power(self.start - 1), "start", self.start, allowed)
        _check(self.most is None or self.most >= 1, "most", self.most, "at least 1")
        _check(len(self.adaptive) in {1, 2}, "adaptive", len(self.adaptive), "one axis or two")
        for axis in self.adaptive:
            allowed = "finite numbers, the first below the second"
            valid = math.isfinite(axis.low) and math.isfinite(axis.high) and axis.low < axis.high
            _check(valid, f"adaptive {axis.paths[0]}", [axis.low, axis.high], allowed)
            name, listed = f"include {axis.paths[0]}", list(axis.include)
            _check(len(listed) <= MAX_INCLUDED, name, len(listed), f"at most {MAX_INCLUDED} values")
            _check(
                all(axis.low <= value <= axis.high for value in listed), name, listed, "between the ends of the axis"
            )
            _check(listed == sorted(set(listed)), name, listed, "different values, ascending")
        for fixed in self.fixed:
            _check(bool(fixed.values), f"fixed {fixed.paths[0]}", [], "at least one value")
            different = len(set(fixed.values)) == len(fixed.values)
            _check(different, f"fixed {fixed.paths[0]}", list(fixed.values), "different values")
        named = self.combinations * self.included_points
        _check(self.most is None or self.most >= named, "most", self.most, f"at least {named}, the included values")
        numbers = self.combinations * math.prod(self.sizes) * len(self.results)
        allowed = Sentence(
            "at most {most} for all points of the finest grids and all results, not {numbers}",
            most=_MAX_NUMBERS,
            numbers=numbers,
        )
        _check(numbers <= _MAX_NUMBERS, "finest", self.finest, allowed)

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> RefinePlan:
        """The plan from plain JSON data; the inverse of `to_json`."""
        if data.get("kind") != REFINE:
            raise ValueError(f"kind: {data.get('kind')!r} is not {REFINE!r}")
        adaptive = [
            AdaptiveAxis(tuple(a["paths"]), float(a["low"]), float(a["high"]), tuple(map(float, a.get("include", ()))))
            for a in data["adaptive"]
        ]
        fixed = [FixedAxis(tuple(a["paths"]), tuple(map(float, a["values"]))) for a in data.get("fixed", ())]
        most = data.get("most")
        return cls(
            results=tuple(data["results"]),
            error=float(data["error"]),
            start=int(data["start"]),
            finest=int(data["finest"]),
            adaptive=tuple(adaptive),
            fixed=tuple(fixed),
            most=None if most is None else int(most),
            regime=bool(data.get("regime", False)),
            half_widths=tuple(data.get("half_widths", ())),
            errors={name: ErrorBound(**bound) for name, bound in data.get("errors", {}).items()},
        )

    def to_json(self) -> dict[str, Any]:
        """The plan as plain JSON data, SI."""
        return {
            "kind": REFINE,
            "results": list(self.results),
            "error": self.error,
            "start": self.start,
            "finest": self.finest,
            "most": self.most,
            "adaptive": [
                {"paths": list(a.paths), "low": a.low, "high": a.high}
                | ({"include": list(a.include)} if a.include else {})
                for a in self.adaptive
            ],
            "fixed": [{"paths": list(a.paths), "values": list(a.values)} for a in self.fixed],
            "regime": self.regime,
            "half_widths": list(self.half_widths),
            **({"errors": {name: asdict(bound) for name, bound in self.errors.items()}} if self.errors else {}),
        }

    def asked(self, name: str) -> ErrorBound:
        """The largest error of a result."""
        return self.errors.get(name, ErrorBound(self.error))

    @property
    def paths(self) -> tuple[tuple[str, ...], ...]:
        """Paths of each column."""
        return (*(axis.paths for axis in self.fixed), *(axis.paths for axis in self.adaptive))

    @property
    def needed(self) -> tuple[str, ...]:
        """Every result that the planner must be told."""
        own = (REGIME, ORDER, MULTIPLIER, SETTLED_AFTER) if self.regime else ()
        widths = (half_width(name) for name in self.half_widths)
        return tuple(dict.fromkeys((*self.results, *own, *widths)))

    @property
    def most_cases(self) -> int:
        """Cases at most: ``most``, or every point of the finest grids."""
        points = self.combinations * self.grid_points
        return points if self.most is None else min(self.most, points)

    @property
    def combinations(self) -> int:
        """Number of curves or maps."""
        return math.prod(len(axis.values) for axis in self.fixed)

    @property
    def grid_points(self) -> int:
        """Points of the finest grid of one curve or map, and those of the first round that are not on it."""
        beside = [int((own > self.finest).sum()) for own in self.first]
        whole = math.prod(len(own) for own in self.first)
        on_grid = math.prod(len(own) - count for own, count in zip(self.first, beside, strict=True))
        return math.prod(self.finest + 1 for _ in self.adaptive) + whole - on_grid

    @property
    def sizes(self) -> tuple[int, ...]:
        """Positions of each adaptive axis: those of its grid, and of included values beside it."""
        return tuple(self.finest + 1 + axis.beside(self.finest).size for axis in self.adaptive)

    @cached_property
    def first(self) -> tuple[Ints, ...]:
        """Positions of the first round on each adaptive axis: ``start`` even ones, then the other included ones."""
        even = np.arange(self.start, dtype=np.int64) * (self.finest // (self.start - 1))
        included = [np.unique(axis.included(self.finest)) for axis in self.adaptive]
        return tuple(np.concatenate([even, own[~np.isin(own, even)]]) for own in included)

    @property
    def included_points(self) -> int:
        """Points of the first round of one curve or map with an included value."""
        if not any(axis.include for axis in self.adaptive):
            return 0
        others = [
            len(own) - len(np.unique(axis.included(self.finest)))
            for own, axis in zip(self.first, self.adaptive, strict=True)
        ]
        return math.prod(len(own) for own in self.first) - math.prod(others)

    @cached_property
    def _grid(self) -> Floats:
        """Values of the fixed axes, shape (combinations, axes); the last varies fastest."""
        axes = np.meshgrid(*(np.array(axis.values) for axis in self.fixed), indexing="ij")
        return np.stack([axis.ravel() for axis in axes], axis=1) if axes else np.empty((1, 0))

    def fixed_values(self, combination: int) -> dict[str, float]:
        """Values of the fixed axes by path of one curve or map."""
        values = self._grid[combination].tolist()
        return {path: value for axis, value in zip(self.fixed, values, strict=True) for path in axis.paths}

    def points(self, combinations: Ints, positions: Sequence[Ints]) -> Floats:
        """Points of curves or maps at positions along each adaptive axis, shape (m, columns)."""
        own = [axis.at(at, self.finest)[:, None] for axis, at in zip(self.adaptive, positions, strict=True)]
        return np.hstack([self._grid[combinations], *own])

    def places(self, points: Floats) -> tuple[Ints, list[Ints]]:
        """Combination and positions of points, the inverse of `points`; ValueError for a point not of the plan."""
        count = len(self.fixed)
        combination = np.zeros(len(points), dtype=np.int64)
        for column, axis in enumerate(self.fixed):
            same = points[:, column, None] == np.array(axis.values)
            if not same.any(axis=1).all():
                other = points[~same.any(axis=1)][0, column]
                raise ValueError(f"{axis.paths[0]}: {other} is not a value of this refinement")
            combination = combination * len(axis.values) + same.argmax(axis=1)
        own = [axis.positions(points[:, count + i], self.finest) for i, axis in enumerate(self.adaptive)]
        return combination, own


def half_widths_of(results: Iterable[str], names: Iterable[str]) -> tuple[str, ...]:
    """Those of the results for which there also is a result "NAME.half_width" among all ``names`` of a study."""
    every = set(names)
    return tuple(name for name in results if half_width(name) in every)


def _power(number: int) -> bool:
    return number >= 1 and number & (number - 1) == 0


def _check(valid: bool, name: str, value: object, allowed: str) -> None:
    if not valid:
        raise WrongPlanError(
            Sentence(
                "{name}: {value} is not allowed; it must be {allowed}", name=name, value=str(value), allowed=allowed
            )
        )
