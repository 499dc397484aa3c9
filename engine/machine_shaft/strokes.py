"""The strokes of a mechanism: where they start and end, and how far one has come."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.machine_shaft.mechanisms import Mechanism, Values
from sprag_study.engine.machine_shaft.roots import bracketed_roots

Floats = NDArray[np.float64]

_TURN = 2.0 * np.pi


@dataclass(frozen=True, slots=True)
class Stroke:
    """The strokes of a mechanism in a block of cases.

    Attributes
    ----------
    start, end : arrays, shape (cases or 1, 1, 1)
        Angles at which the forward stroke starts and ends, ``end`` within a revolution after ``start``.
    length : array of that shape
        Length of a stroke in m.
    """

    mechanism: Mechanism
    values: Values
    start: Floats
    end: Floats
    length: Floats

    @classmethod
    def of(cls, mechanism: Mechanism, values: Values) -> "Stroke":
        """The strokes of ``mechanism``; NaN where it cannot be assembled."""
        with np.errstate(all="ignore"):
            start, end = mechanism.dead_centres(values)
            end = start + np.mod(end - start, _TURN)
            return cls(mechanism, values, start, end, mechanism.way(values, end))

    def take(self, rows: NDArray[np.int64]) -> "Stroke":
        """The strokes of some of the cases."""
        values = {name: value[rows] if len(value) > 1 else value for name, value in self.values.items()}
        own = (value[rows] if len(value) > 1 else value for value in (self.start, self.end, self.length))
        return Stroke(self.mechanism, values, *own)

    def fraction(self, phi: Floats) -> Floats:
        """Fraction of the stroke at ``phi``, 0 where the forward stroke starts, 1 where it ends."""
        return np.clip(self.mechanism.way(self.values, phi) / self.length, 0.0, 1.0)

    def forward(self, phi: Floats) -> NDArray[np.bool_]:
        """Whether the forward stroke is under way."""
        return np.asarray(np.mod(phi - self.start, _TURN) < self.end - self.start)

    def backward(self, phi: Floats) -> NDArray[np.bool_]:
        """Whether the return stroke is under way; in the dwells of a cam no stroke is."""
        start, length = self.mechanism.return_stroke(self.values)
        if start is None or length is None:
            return ~self.forward(phi)
        return np.asarray(np.mod(phi - start, _TURN) < length)

    def angles(self, fraction: Floats, *, forward: bool) -> Floats:
        """Angles at which a stroke has come to ``fraction`` (cases or 1, 1, n); NaN outside 0 .. 1."""
        low, high = (self.start, self.end) if forward else (self.end, self.start + _TURN)
        shape = np.broadcast_shapes(low.shape, high.shape, fraction.shape)
        low, high, target = (np.broadcast_to(part, shape) for part in (low, high, fraction))
        rising = 1.0 if forward else -1.0
        inside = (target > 0.0) & (target < 1.0)
        edge = np.where(inside, -1.0, 0.0)
        found = bracketed_roots(lambda phi: rising * (self.fraction(phi) - target), low, high, edge, -edge)
        return np.where(inside, found, np.nan)
