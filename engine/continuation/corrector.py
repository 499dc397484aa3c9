"""Points of a branch: derivatives by differences, Newton's method with a border, tangents."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.engine.continuation.linear import Matrix, Vector, dot, eigenvalues, norm, solve

if TYPE_CHECKING:
    from sprag_study.engine.continuation.problem import Pattern, ReturnMap

#: Scaled disturbance for central differences.
DISTURBANCE = 1e-6
#: Largest residual and largest last step of an accepted point, both scaled.
RESIDUAL = 1e-10
_STEPS = 10
#: A longer step, or one that is not this much shorter than the first of two, ends Newton's method.
_LONGEST, _SHORTER = 0.5, 0.9


@dataclass(frozen=True, slots=True)
class Derivative:
    """The map at a point: ``image`` (n,), ``by_point`` (n, n), ``by_parameter`` (n,) per scaled parameter."""

    image: Vector
    by_point: Matrix
    by_parameter: Vector


@dataclass(frozen=True, slots=True)
class Node:
    """A fixed point: ``z`` is the point with the scaled parameter behind it, ``tangent`` a unit vector along the
    branch, both shape (n + 1,); ``map`` is the return map in the section of the point.
    """

    map: ReturnMap
    z: Vector
    tangent: Vector
    multipliers: tuple[complex, ...]
    residual: float
    pattern: Pattern

    def at(self, length: float) -> Vector:
        """The place that far along the tangent."""
        return [a + length * b for a, b in zip(self.z, self.tangent, strict=True)]

    def along(self, z: Sequence[float]) -> float:
        """How far along the tangent a place is."""
        return dot(self.tangent, [b - a for a, b in zip(self.z, z, strict=True)])


@dataclass(frozen=True, slots=True)
class Corrector:
    """Finds points of a branch; ``scale`` is the change of the parameter that counts as 1."""

    scale: float

    def correct(self, map_: ReturnMap, guess: Sequence[float], border: Sequence[float]) -> Node | None:
        """The fixed point near ``guess`` in the plane through it that is normal to ``border``; None where Newton's
        method does not find one. Its tangent points to the side of ``border``.
        """
        z = list(guess)
        before = math.inf
        for number in range(_STEPS):
            value = self.derivative(map_, z)
            if value is None:
                return None
            residuals = [image - x for image, x in zip(value.image, z, strict=False)]
            matrix = _bordered(value, border)
            missed = dot(border, [a - b for a, b in zip(guess, z, strict=True)])
            step = solve(matrix, [*(-r for r in residuals), missed])
            if step is None:
                return None
            size = max(map(abs, step))
            z = [a + b for a, b in zip(z, step, strict=True)]
            residual = max(map(abs, residuals), default=0.0)
            if residual < RESIDUAL and size < RESIDUAL:
                tangent = _tangent(matrix)
                return None if tangent is None else self._node(map_, z, tangent, value, residual)
            if size > _LONGEST or (number > 1 and size > _SHORTER * before):
                return None
            before = size
        return None

    def _node(self, map_: ReturnMap, z: Vector, tangent: Vector, value: Derivative, residual: float) -> Node:
        multipliers = eigenvalues(value.by_point)
        pattern = map_.pattern(np.array(z[:-1]), z[-1] * self.scale)
        return Node(map_, z, tangent, multipliers, residual, pattern)

    def tangent_at(self, map_: ReturnMap, z: Sequence[float], border: Sequence[float]) -> Vector | None:
        """The tangent of the branch by the derivatives at a place near it, on the side of ``border``."""
        value = self.derivative(map_, z)
        return None if value is None else _tangent(_bordered(value, border))

    def derivative(self, map_: ReturnMap, z: Sequence[float]) -> Derivative | None:
        """The map and its derivatives at a place; None where a point has no image."""
        n = len(z) - 1
        low, high = map_.bounds
        rows = np.tile(np.array(z), (2 * n + 3, 1))
        for j in range(n + 1):
            rows[1 + 2 * j, j] += DISTURBANCE
            rows[2 + 2 * j, j] -= DISTURBANCE
        # At the edge of the allowed values one side only.
        parameters = np.clip(rows[:, n] * self.scale, low, high)
        width = (parameters[-2] - parameters[-1]) / self.scale
        images = map_.images(np.ascontiguousarray(rows[:, :n]), parameters)
        if not width > 0.0 or not np.all(np.isfinite(images)):
            return None
        by_point = (images[1 : 2 * n + 1 : 2] - images[2 : 2 * n + 1 : 2]) / (2.0 * DISTURBANCE)
        by_parameter = (images[-2] - images[-1]) / width
        return Derivative(images[0].tolist(), by_point.T.tolist(), by_parameter.tolist())

    def transported(self, node: Node) -> Node | None:
        """The same orbit in a better section, where the map has one; None where its tangent is not found there."""
        rows = np.array([node.z, node.at(DISTURBANCE), node.at(-DISTURBANCE)])
        found = node.map.moved(np.ascontiguousarray(rows[:, :-1]), rows[:, -1] * self.scale)
        if found is None:
            return node
        map_, points = found
        if not np.all(np.isfinite(points)):
            return None
        direction = [*((points[1] - points[2]) / (2.0 * DISTURBANCE)).tolist(), node.tangent[-1]]
        size = norm(direction)
        return self.correct(map_, [*points[0].tolist(), node.z[-1]], [part / size for part in direction])


def _bordered(value: Derivative, border: Sequence[float]) -> Matrix:
    """The matrix of Newton's method for fixed points in a plane normal to ``border``."""
    rows = [[*row, last] for row, last in zip(value.by_point, value.by_parameter, strict=True)]
    for i, row in enumerate(rows):
        row[i] -= 1.0
    return [*rows, list(border)]


def _tangent(matrix: Matrix) -> Vector | None:
    """The unit vector that all rows but the last map to 0, on the side of the last one."""
    found = solve(matrix, [*[0.0] * (len(matrix) - 1), 1.0])
    if found is None:
        return None
    size = norm(found)
    return [part / size for part in found]
