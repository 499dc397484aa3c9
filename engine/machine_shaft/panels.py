"""Gauss-Legendre panels over a cycle: integrals, running integrals, extrema and crossings of many cases at once.

A cycle is divided into panels at every jump and kink, so that all functions are smooth within a panel and are
represented by their values at its Gauss nodes. No node lies on a cut, so no value is taken at a jump. Sums are computed
term by term (``kernels``) instead of by a matrix product, whose rounding would depend on the number of cases computed
together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft import kernels
from sprag_study.engine.quadrature import gauss, product

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Gauss nodes of a panel.
NODES = 12
POSITIONS, WEIGHTS = gauss(NODES)


def _matrices() -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    x, w = POSITIONS, WEIGHTS
    degrees = np.arange(NODES)
    coefficients = (2 * degrees[:, None] + 1) / 2.0 * legendre.legvander(x, NODES - 1).T * w
    integral = np.zeros((NODES + 1, NODES))
    derivative = np.zeros((NODES - 1, NODES))
    for k in degrees:
        unit = np.eye(NODES)[k]
        integral[: k + 2, k] = legendre.legint(unit[: k + 1], lbnd=-1)
        if k:
            derivative[:k, k] = legendre.legder(unit[: k + 1])
    samples = np.concatenate([[-1.0], x, [1.0]])
    running = product(legendre.legvander(x, NODES), integral, coefficients)
    ends = product(legendre.legvander(np.array([-1.0, 1.0]), NODES - 1), coefficients)
    slopes = product(legendre.legvander(samples, NODES - 2), derivative, coefficients)
    return coefficients, integral, derivative, running, ends, slopes


SAMPLES = np.concatenate([[-1.0], POSITIONS, [1.0]])
COEFFICIENTS, INTEGRAL, _DERIVATIVE, RUNNING, _ENDS, _SLOPES = (np.ascontiguousarray(m) for m in _matrices())
#: The matrices of ``kernels.extremes``, with their outputs along the last axis.
_SAMPLED, _TO_SERIES, _TO_SLOPE = (
    np.ascontiguousarray(m.T) for m in (np.concatenate([_SLOPES, _ENDS]), COEFFICIENTS, _DERIVATIVE)
)
TAIL = COEFFICIENTS[-2:].copy()
_SLOPES_AT_NODES = np.ascontiguousarray(_SLOPES[1:-1])
_TOTAL = WEIGHTS[None, :].copy()


def apply(matrix: Floats, values: Floats) -> Floats:
    """``values @ matrix.T`` over the last axis, each sum in one fixed order."""
    out = np.empty((*values.shape[:-1], len(matrix)))
    rows = np.ascontiguousarray(values, dtype=np.float64).reshape(-1, values.shape[-1])
    kernels.product(matrix, rows, out.reshape(-1, len(matrix)))
    return out


def series(coefficients: Floats, t: Floats) -> Floats:
    """Legendre series of each row of ``coefficients`` (n, k) at its own ``t`` (n,)."""
    out = np.empty(len(t))
    kernels.series_values(coefficients, np.ascontiguousarray(t), out)
    return out


#: Cuts that are nearer, as a share of the cycle, are one: computed ones, and those that are given.
_COMPUTED, GIVEN = 1e-11, 1e-14


@dataclass(frozen=True, slots=True)
class Points:
    """Points in the cycle, one per case: panel, position -1 .. 1 within it, and angle in rad; all of shape (cases,)."""

    panel: Integers
    t: Floats
    angle: Floats


@dataclass(frozen=True, slots=True)
class Within:
    """Integrals from the start of each panel: to its nodes (cases, panels, NODES) and to its end (cases, panels)."""

    nodes: Floats
    ends: Floats


@dataclass(frozen=True, slots=True)
class Extremes:
    """Largest and smallest value of each case and where they are."""

    highest: Floats
    at_highest: Points
    lowest: Floats
    at_lowest: Points


class Panels:
    """Panels of a block of cases.

    The number of zero-length panels of a case depends on the other cases of its block. Values at their nodes are
    ignored, so that results do not depend on other cases.

    Attributes
    ----------
    cuts : array, shape (cases, panels + 1)
        Ends of the panels in rad, from 0 to the cycle. Panels of zero length are allowed and ignored. A first axis of
        length 1 means that all cases share them.
    angles : array, shape (cases, panels, NODES)
        Gauss nodes in rad.
    """

    def __init__(self, cuts: Floats) -> None:
        self.cuts = cuts
        self.half = 0.5 * (cuts[:, 1:] - cuts[:, :-1])
        # A node of a very short panel may round to its end, which belongs to the next one.
        within = np.where(self.half > 0.0, np.nextafter(cuts[:, 1:], 0.0), cuts[:, 1:])
        self.angles = np.minimum(cuts[:, :-1, None] + self.half[..., None] * (1.0 + POSITIONS), within[..., None])
        self.weights = self.half[..., None] * WEIGHTS

    @classmethod
    def over(cls, cycle: float, breaks: Sequence[Floats], panels: int, given: Sequence[Floats] = ()) -> "Panels":
        """``panels`` equal panels cut further at ``breaks``, arrays of shape (cases or 1, n); NaN is no break.

        Two breaks at almost the same angle are merged: the sliver between them would contain an unresolvable jump.
        Those that are ``given`` as numbers, ends of a narrow step for instance, are exact and stay apart.
        """
        parts = [np.linspace(0.0, cycle, panels + 1)[None, :], *[np.nan_to_num(b, nan=0.0) for b in breaks if b.size]]
        rows = max(part.shape[0] for part in (*parts, *given))
        cuts = np.concatenate([np.broadcast_to(part, (rows, part.shape[1])) for part in parts], axis=1)
        exact = _close_pairs(cycle, given, rows)
        if exact.size:
            near = (np.abs(cuts[:, :, None] - exact[:, None, :]) < _COMPUTED * cycle).any(axis=2)
            ends = np.full((rows, 2), np.nan)
            ends[:] = 0.0, cycle
            cuts = np.concatenate([np.where(near, np.nan, cuts), ends, exact], axis=1)
        cuts = np.sort(np.clip(np.where(np.isnan(cuts), 0.0, cuts), 0.0, cycle), axis=1)
        for column in range(1, cuts.shape[1]):
            this, before = cuts[:, column], cuts[:, column - 1]
            apart = np.full(rows, _COMPUTED)
            if exact.size:
                both = (exact == this[:, None]).any(axis=1) & ((exact == before[:, None]).any(axis=1))
                apart = np.where(both, GIVEN, _COMPUTED)
            cuts[:, column] = np.where(this - before < apart * cycle, before, this)
        cuts[:, -1] = cycle
        return cls(cuts)

    def take(self, rows: Integers) -> "Panels":
        """The panels of some of the cases."""
        return self if len(self.cuts) == 1 else Panels(self.cuts[rows])

    def integral(self, values: Floats) -> Floats:
        """Integral over the cycle for each case; ``values`` at the nodes, shape (cases, panels, NODES)."""
        out = np.empty(len(values))
        kernels.integrals(np.ascontiguousarray(values), self.half, WEIGHTS, out)
        return out

    def largest(self, values: Floats) -> Floats:
        """Largest size of the values at the nodes, shape (cases,)."""
        real = (self.half > 0.0)[..., None]
        return np.asarray(np.where(real, np.abs(values), 0.0).reshape(len(values), -1).max(axis=1))

    def within(self, values: Floats) -> "Within":
        """Integrals from each panel's own start."""
        totals = np.where(self.half > 0.0, self.half * apply(_TOTAL, values)[..., 0], 0.0)
        return Within(self.half[..., None] * apply(RUNNING, values), totals)

    def running(self, values: Floats) -> tuple[Floats, Floats]:
        """Integral from 0 to every node, shape (cases, panels, NODES), and to every cut, (cases, panels + 1)."""
        own = self.within(values)
        ends = np.zeros((own.ends.shape[0], own.ends.shape[1] + 1))
        np.cumsum(own.ends, axis=1, out=ends[:, 1:])
        return ends[:, :-1, None] + own.nodes, ends

    def slope(self, values: Floats) -> Floats:
        """Derivative by the angle at the nodes, of the polynomial of each panel; 0 in panels of zero length."""
        half = np.where(self.half > 0.0, self.half, np.inf)[..., None]
        return np.asarray(apply(_SLOPES_AT_NODES, values) / half)

    def periodic(self, slope: Floats, source: Floats) -> tuple[Floats, Floats]:
        """Periodic solution of ``T' = slope T + source``: T at the nodes and, shape (cases,), at the angle 0."""
        energy, start = np.empty(slope.shape), np.empty(len(slope))
        kernels.periodic_linear(
            np.ascontiguousarray(slope), np.ascontiguousarray(source), self.half, RUNNING, WEIGHTS, energy, start
        )
        return energy, start

    def roughness(self, values: Floats) -> Floats:
        """Sizes of the last two Legendre coefficients in each panel, (cases, panels), as a measure of its
        resolution.
        """
        tail = np.abs(apply(TAIL, values)).sum(axis=2)
        return np.asarray(np.where(self.half > 0.0, tail, 0.0))

    def middles(self, chosen: NDArray[np.bool_]) -> Floats:
        """Middles of the chosen panels of each case, (cases, most), NaN where a case has fewer."""
        middles = np.where(chosen, 0.5 * (self.cuts[:, :-1] + self.cuts[:, 1:]), np.nan)
        return np.sort(middles, axis=1)[:, : int(chosen.sum(axis=1).max(initial=0))]

    def starts(self, cases: int) -> Points:
        """The angle 0 of that many cases."""
        first = np.argmax(np.broadcast_to(self.half, (cases, self.half.shape[1])) > 0.0, axis=1)
        return Points(first, np.full(cases, -1.0), np.zeros(cases))

    def locate(self, case: int, angles: Floats) -> Points:
        """Panels of any number of ``angles`` in the cycle of one case; at a cut, the panel before it."""
        row = case if len(self.cuts) > 1 else 0
        cuts, half = self.cuts[row], self.half[row]
        first = int(np.argmax(half > 0.0))
        panel = np.clip(np.searchsorted(cuts, angles, side="left") - 1, first, len(half) - 1)
        t = np.clip((angles - cuts[panel]) / half[panel] - 1.0, -1.0, 1.0)
        return Points(panel, t, angles)

    def _rows(self, values: Floats, cases: Integers, panel: Integers) -> Floats:
        picked: Floats = values[cases if values.shape[0] > 1 else np.zeros_like(cases), panel]
        return picked

    def _half_at(self, cases: Integers, panel: Integers) -> Floats:
        return self._rows(self.half, cases, panel)

    def _angle(self, cases: Integers, panel: Integers, t: Floats) -> Floats:
        return self._rows(self.cuts, cases, panel) + self._half_at(cases, panel) * (1.0 + t)

    def at(self, values: Floats, points: Points) -> Floats:
        """Values at ``points``, from the polynomial through the nodes of the panel."""
        return self.at_rows(values, np.arange(len(points.t)), points)

    def at_rows(self, values: Floats, cases: Integers, points: Points) -> Floats:
        """Values at any number of ``points``, each for the case given by ``cases``."""
        return series(apply(COEFFICIENTS, self._rows(values, cases, points.panel)), points.t)

    def running_at(self, values: Floats, ends: Floats, points: Points) -> Floats:
        """Running integral at ``points``; ``values`` is the integrand and ``ends`` its integral to every cut."""
        return self.running_at_rows(values, ends, np.arange(len(points.t)), points)

    def running_at_rows(self, values: Floats, ends: Floats, cases: Integers, points: Points) -> Floats:
        """The same at any number of ``points``, each for the case given by ``cases``."""
        start = self._rows(ends, cases, points.panel)
        rows = apply(INTEGRAL, apply(COEFFICIENTS, self._rows(values, cases, points.panel)))
        return start + self._half_at(cases, points.panel) * series(rows, points.t)

    def extremes(self, values: Floats) -> Extremes:
        """Largest and smallest value over the cycle, of the continuous function and not of its nodes.

        The ends of a panel count with their values within that panel. A case with a NaN has no extremes.
        """
        shape = (2, len(values))
        value, t, panel = np.empty(shape), np.empty(shape), np.empty(shape, dtype=np.int64)
        kernels.extremes(
            np.ascontiguousarray(values), self.half, SAMPLES, _SAMPLED, _TO_SERIES, _TO_SLOPE, value, panel, t
        )
        cases = np.arange(len(values))
        high, low = (Points(panel[k], t[k], self._angle(cases, panel[k], t[k])) for k in range(2))
        return Extremes(value[0], high, value[1], low)

    def crossings(self, values: Floats, running: Floats, ends: Floats, level: Floats) -> "Crossings":
        """Where the running integral of ``values`` passes ``level`` (cases,).

        ``running`` and ``ends`` are from ``running``. The end of the cycle is taken to be its start again.
        """
        right = ends[:, 1:, None].copy()
        right[:, -1] = ends[:, :1]
        height = np.concatenate([ends[:, :-1, None], running, right], axis=2) - level[:, None, None]
        above = height >= 0.0
        case, panel, place = np.nonzero((above[..., 1:] != above[..., :-1]) & (self.half > 0.0)[..., None])
        start = ends[case, panel] - level[case]
        half = self._half_at(case, panel)
        rows = apply(INTEGRAL, apply(COEFFICIENTS, values[case, panel])) if len(case) else np.empty((0, NODES + 1))
        rows = half[:, None] * rows
        rows[:, 0] += start
        t = np.empty(len(case))
        before, after = height[case, panel, place], height[case, panel, place + 1]
        kernels.series_roots(rows, SAMPLES[place], SAMPLES[place + 1], before, after, t)
        return Crossings(case, panel, t, self._angle(case, panel, t), ~above[case, panel, place])


def _close_pairs(cycle: float, given: Sequence[Floats], rows: int) -> Floats:
    """Those of the ``given`` angles, and of the ends of the cycle, that lie nearer to another than computed ones may.

    Shape (rows, n); NaN where a case has fewer.
    """
    every = [np.broadcast_to(part, (rows, part.shape[1])) for part in (np.array([[0.0, cycle]]), *given) if part.size]
    known = np.sort(np.concatenate(every, axis=1), axis=1)
    gaps = np.diff(known, axis=1)
    close = (gaps >= GIVEN * cycle) & (gaps < _COMPUTED * cycle)
    chosen = np.zeros(known.shape, dtype=np.bool_)
    chosen[:, 1:] |= close
    chosen[:, :-1] |= close
    found = np.sort(np.where(chosen, known, np.nan), axis=1)
    return found[:, : int(chosen.sum(axis=1).max(initial=0))]


@dataclass(frozen=True, slots=True)
class Crossings:
    """Crossings of a level by all cases, in order of case and angle; all shape (n,)."""

    case: Integers
    panel: Integers
    t: Floats
    angle: Floats
    upward: NDArray[np.bool_]
