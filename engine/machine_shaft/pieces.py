"""Pieces of the cycle on which formulas are verified to be as smooth as their samples suggest.

A cycle is subdivided until, on every piece, each formula is a polynomial of a degree below the number of Gauss nodes,
up to an error bounded by its enclosure. Panels that agree with a formula at the nodes of such pieces agree with it
everywhere.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.formulas.expressions import Expression
from sprag_study.engine.machine_shaft.enclosures import Program
from sprag_study.engine.machine_shaft.panels import NODES, POSITIONS, WEIGHTS, Panels, Points
from sprag_study.engine.machine_shaft.roots import switches
from sprag_study.engine.machine_shaft.strokes import Stroke

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Bools = NDArray[np.bool_]
Part = Literal["inertia", "drive", "resistance"]

#: Allowed error of a piece relative to the integral of the formula's modulus, or for an inertia to its value.
_PRECISION = 1e-11
#: The same for pieces that cannot be subdivided further.
_DOUBT = 1e-8
#: Most pieces per revolution and case, and the shortest relative length.
_MOST, _SHORTEST = 4096, 2e-15
#: Closest distance of pieces to a cut relative to the cycle, which is the accuracy of the cut.
_ROUNDING = 4e-16
_ROUNDS = 64


@dataclass(frozen=True, slots=True)
class Formula:
    """A formula of a machine with the numbers of a block of cases.

    Attributes
    ----------
    part : {"inertia", "drive", "resistance"}
        The field it enters.
    expression : Expression
    constants : mapping
        Values of its names beside ``phi`` and ``x``, each of shape (cases or 1, 1, 1).
    stroke : Stroke or None
        The stroke of which ``x`` is the fraction.
    ahead : array, shape (cases or 1, 1, 1), optional
        Its ``phi`` is ``ratio`` times the shaft's angle plus this one, in rad, counted over the ``cycle``; None: they
        are the same.
    cycle : float
        In rad.
    ratio : float
    """

    part: Part
    expression: Expression
    constants: Mapping[str, Floats]
    stroke: Stroke | None = None
    ahead: Floats | None = None
    cycle: float = 2.0 * np.pi
    ratio: float = 1.0

    @property
    def cases(self) -> int:
        """1 if all cases share it."""
        sizes = [len(value) for value in (*self.constants.values(), *(() if self.ahead is None else (self.ahead,)))]
        if self.stroke is not None:
            sizes += [len(self.stroke.start), *(len(value) for value in self.stroke.values.values())]
        return max(sizes, default=1)

    def own_angle(self, cases: Integers, phi: Floats) -> Floats:
        """The formula's own angle at the angles ``phi`` (n, 1, m) of the shaft for the case of each row."""
        if self.ahead is None:
            return phi
        return np.asarray(np.mod(self.ratio * phi + _rows(self.ahead, cases), self.cycle))

    def ways(self, cases: Integers, phi: Floats) -> Floats | None:
        """``x`` there; None if there is none."""
        return None if self.stroke is None else self.stroke.take(cases).fraction(self.own_angle(cases, phi))

    def variables(self, cases: Integers, phi: Floats) -> dict[str, tuple[Floats, Floats | float]]:
        """Variables of the expression there."""
        names: dict[str, tuple[Floats, Floats | float]] = {"phi": (self.own_angle(cases, phi), 0.0)}
        ways = self.ways(cases, phi)
        if ways is not None:
            names["x"] = (ways, 0.0)
        return names | {name: (_rows(value, cases), 0.0) for name, value in self.constants.items()}


def _rows(values: Floats, cases: Integers) -> Floats:
    return values[cases] if len(values) > 1 else values


@dataclass(frozen=True, slots=True)
class Pieces:
    """Pieces of the cycle for one formula, shortest where it is least smooth, without those that are whole panels.

    Attributes
    ----------
    formula : Formula
    case : array, shape (n,)
        0 throughout where all cases share the formula.
    low, high : arrays, shape (n,)
        Ends in rad.
    breaks : array, shape (cases or 1, m)
        Jumps and kinks inside panels, in rad; NaN where a case has fewer.
    unknown : array of bool, shape (cases or 1,)
        Where the formula cannot be enclosed.
    """

    formula: Formula
    case: Integers
    low: Floats
    high: Floats
    breaks: Floats
    unknown: Bools

    def of(self, rows: Integers) -> tuple[Integers, Floats, Floats]:
        """The pieces of the cases ``rows``: each one's place in ``rows``, and its ends."""
        if len(self.unknown) == 1:
            return np.repeat(np.arange(len(rows)), len(self.low)), np.tile(self.low, len(rows)), np.tile(
                self.high, len(rows))  # fmt: skip
        place = np.full(len(self.unknown), -1)
        place[rows] = np.arange(len(rows))
        own = place[self.case] >= 0
        return place[self.case[own]], self.low[own], self.high[own]


def pieces(formula: Formula, panels: Panels, cycle: float) -> Pieces:
    """Subdivide the panels' cycle until ``formula`` is verified on every piece."""
    rows = max(formula.cases, len(panels.cuts))
    program = Program(formula.expression, list(formula.constants))
    case, panel = np.nonzero(np.broadcast_to(panels.half > 0.0, (rows, panels.half.shape[1])))
    cuts = np.broadcast_to(panels.cuts, (rows, panels.cuts.shape[1]))
    inner = _ROUNDING * cycle
    low, high = cuts[case, panel] + inner, cuts[case, panel + 1] - inner
    whole, done, doubt = np.ones(len(case), dtype=np.bool_), np.zeros(rows), np.zeros(rows)
    count = np.zeros(rows, dtype=np.int64)
    found: list[tuple[Integers, Floats, Floats]] = []
    for _ in range(_ROUNDS):
        error, least = _errors(program, formula, case, low, high)
        good, size = _judge(formula, error, least, case, high - low, done)
        short = ~good & (high - low <= _SHORTEST * cycle)
        if short.any():
            np.add.at(doubt, case[short], _left(formula, case[short], low[short], high[short], error[short]))
        kept = (good | short) & ~whole
        found.append((case[kept], low[kept], high[kept]))
        np.add.at(count, case, kept)
        if formula.part == "inertia":
            done = size
        else:
            np.add.at(done, case[good], (least * (high - low))[good])
        active = ~(good | short)
        count_active = count + np.bincount(case[active], minlength=rows)
        doubt[count_active > _MOST * round(cycle / (2.0 * np.pi))] = np.inf
        active &= np.isfinite(doubt)[case]
        if not active.any():
            break
        middle = 0.5 * (low + high)[active]
        case = np.concatenate([case[active], case[active]])
        low, high = np.concatenate([low[active], middle]), np.concatenate([middle, high[active]])
        whole = np.zeros(len(case), dtype=np.bool_)
    doubt[case[active]] = np.inf
    case, low, high = (np.concatenate(parts) for parts in zip(*found, strict=True))
    breaks = _breaks(formula, rows, case, low, high)
    return Pieces(formula, case, low, high, breaks, ~(doubt <= _DOUBT * done))


def _errors(program: Program, formula: Formula, case: Integers, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    constants = [np.broadcast_to(_rows(value, case)[:, 0, 0], case.shape) for value in formula.constants.values()]
    columns = np.stack(constants, axis=1) if constants else np.empty((len(case), 0))
    ways = formula.ways(case, _nodes(low, high))
    if formula.ahead is not None:
        # A piece does not cross the end of the formula's own cycle, which is a cut.
        middle = 0.5 * (low + high)
        there = formula.own_angle(case, middle[:, None, None])[:, 0, 0]
        if formula.ratio == 1.0:
            low, high = low + (there - middle), high + (there - middle)
        else:
            low, high = there - formula.ratio * (middle - low), there + formula.ratio * (high - middle)
    return program.over(low, high, columns, None if ways is None else ways[:, 0, :])


def _nodes(low: Floats, high: Floats) -> Floats:
    """Gauss nodes of pieces, shape (n, 1, NODES)."""
    half = 0.5 * (high - low)
    return np.asarray((low + half)[:, None, None] + half[:, None, None] * POSITIONS)


def _judge(
    formula: Formula, error: Floats, least: Floats, case: Integers, length: Floats, done: Floats
) -> tuple[Bools, Floats]:
    """Which pieces are verified, and each case's size of the formula as far as it is known."""
    size = done.copy()
    if formula.part == "inertia":
        np.maximum.at(size, case, least)
        return np.asarray(error <= _PRECISION * size[case]), size
    np.add.at(size, case, least * length)
    return np.asarray(error * length <= _PRECISION * size[case]), size


def _left(formula: Formula, case: Integers, low: Floats, high: Floats, error: Floats) -> Floats:
    """Bound of the error of pieces that cannot be subdivided further; a pole is judged by the values beside it."""
    length = 1.0 if formula.part == "inertia" else high - low
    phi = _nodes(low, high)
    values = np.broadcast_to(np.abs(formula.expression.evaluate(formula.variables(case, phi))[0]), phi.shape)
    return np.asarray(np.where(np.isfinite(error), error, values.max(axis=(1, 2))) * length)


def _breaks(formula: Formula, rows: int, case: Integers, low: Floats, high: Floats) -> Floats:
    """Jumps and kinks within pieces."""
    found: list[tuple[Integers, Floats]] = []
    for index in range(formula.expression.switch_count if len(case) else 0):

        def sign(phi: Floats, own: Integers, index: int = index) -> Floats:
            value = formula.expression.switch(index, formula.variables(own, phi))
            return np.where(np.broadcast_to(value, phi.shape) >= 0.0, 1.0, -1.0)

        before, after = low[:, None, None], high[:, None, None]
        changed = np.nonzero((sign(before, case) != sign(after, case))[:, 0, 0])[0]
        if changed.size:
            own = case[changed]
            place = switches(partial(sign, own=own), before[changed], after[changed])
            found.append((own, place[:, 0, 0]))
    if not found:
        return np.full((rows, 0), np.nan)
    own, angle = (np.concatenate(parts) for parts in zip(*found, strict=True))
    order = np.argsort(own, kind="stable")
    own, angle = own[order], angle[order]
    position = np.arange(len(own)) - np.searchsorted(own, own)
    breaks = np.full((rows, int(position.max()) + 1), np.nan)
    breaks[own, position] = angle
    return breaks


def missed(
    own: Pieces,
    rows: Integers,
    panels: Panels,
    values: Floats,
    exact: Callable[[Integers, Floats], Floats],
    largest: Floats,
) -> Bools:
    """Panels whose polynomials do not represent their function, shape (cases, panels).

    Parameters
    ----------
    own : Pieces
    rows : array, shape (cases,)
        The cases of the panels, among those of the pieces.
    panels : Panels
    values : array, shape (cases, panels, NODES)
        The field that the formula enters, at the panels' nodes.
    exact : callable
        Returns that field for indices into ``rows`` (n,) at angles (n, 1, m).
    largest : array, shape (cases,)
        Largest size of the field if that is the inertia, else the largest work.
    """
    wrong = np.zeros((len(rows), panels.half.shape[1]), dtype=np.bool_)
    place, low, high = own.of(rows)
    middle, _ = _located(panels, place, 0.5 * (low + high)[:, None])
    wider = np.broadcast_to(panels.half, wrong.shape)[place, middle.panel] > 0.5 * (high - low) * (1.0 + 1e-9)
    place, low, high = place[wider], low[wider], high[wider]
    if not place.size:
        return wrong
    phi, half = _nodes(low, high), 0.5 * (high - low)
    truth = np.broadcast_to(exact(place, phi), phi.shape)[:, 0, :]
    points, cases = _located(panels, place, phi[:, 0, :])
    error = truth - panels.at_rows(values, cases, points).reshape(truth.shape)
    # The angle itself is rounded, which matters for a steep formula.
    rounding = np.abs(np.diff(truth, axis=1)).sum(axis=1) * np.finfo(float).eps * panels.cuts[0, -1]
    panel = points.panel.reshape(truth.shape)
    if own.formula.part == "inertia":
        limit = 1e-10 * largest[place] + rounding / half
        bad = ~(np.abs(error).max(axis=1) <= limit)
    else:
        signed, size = half * np.abs((error * WEIGHTS).sum(axis=1)), half * (np.abs(error) * WEIGHTS).sum(axis=1)
        total = np.zeros(wrong.shape)
        np.add.at(total, (place, panel[:, NODES // 2]), signed)
        limit = 1e-10 * largest[place] + rounding
        bad = ~((total[place, panel[:, NODES // 2]] <= limit) & (size <= 100.0 * limit))
    wrong[np.repeat(place[bad], NODES), panel[bad].ravel()] = True
    return wrong


def _located(panels: Panels, cases: Integers, phi: Floats) -> tuple[Points, Integers]:
    """Panels of the angles (n, m) of the cases (n,), and each angle's case, both flat."""
    panel, t = np.empty(phi.shape, dtype=np.int64), np.empty(phi.shape)
    for case in np.unique(cases):
        chosen = cases == case
        points = panels.locate(int(case), phi[chosen].ravel())
        panel[chosen], t[chosen] = points.panel.reshape(-1, phi.shape[1]), points.t.reshape(-1, phi.shape[1])
    return Points(panel.ravel(), t.ravel(), phi.ravel()), np.repeat(cases, phi.shape[1])


def courses(panels: Panels, values: Floats, cases: Integers, phi: Floats) -> Floats:
    """Values at the angles ``phi`` (n, 1, m) of ``cases`` (n,), from those at the nodes (cases, panels, nodes)."""
    points, every = _located(panels, cases, phi[:, 0, :])
    return panels.at_rows(values, every, points).reshape(phi.shape)
