"""Special points between two neighbouring points of a branch."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag_study.engine.continuation.problem import Kind

if TYPE_CHECKING:
    from sprag_study.engine.continuation.corrector import Corrector, Node

Test = Callable[["Node"], float]

#: Arc length to which a special point is located, and the most points computed for it.
PRECISION: Final = 1e-11
_TRIES = 60
#: Where else a point is tried, as parts of the bracket beside the estimate.
_ASIDE = (0.0, 1e-3, -1e-3, 1e-2, -1e-2, 0.1, -0.1)
#: Imaginary part from which on a multiplier counts as one of a complex pair.
_COMPLEX = 1e-6


def _fold(node: Node) -> float:
    return node.tangent[-1]


def _doubling(node: Node) -> float:
    """det(dF/dx + 1)."""
    product = complex(1.0)
    for value in node.multipliers:
        product *= value + 1.0
    return product.real


def _branching(node: Node) -> float:
    """det(dF/dx - 1), which also changes its sign at folds."""
    product = complex(1.0)
    for value in node.multipliers:
        product *= value - 1.0
    return product.real


def _torus(node: Node) -> float:
    """The product of mu_i mu_j - 1 over all pairs."""
    product = complex(1.0)
    for i, one in enumerate(node.multipliers):
        for other in node.multipliers[:i]:
            product *= one * other - 1.0
    return product.real


_TESTS: Final[dict[Kind, Test]] = {
    Kind.FOLD: _fold,
    Kind.DOUBLING: _doubling,
    Kind.BRANCHING: _branching,
    Kind.TORUS: _torus,
}


@dataclass(frozen=True, slots=True)
class Between:
    """The branch between two of its points, by the distance along the tangent of the first."""

    corrector: Corrector
    first: Node
    last: Node

    def node(self, length: float) -> Node | None:
        """The point that far along."""
        share = length / self.first.along(self.last.z)
        guess = [a + share * (b - a) for a, b in zip(self.first.z, self.last.z, strict=True)]
        return self.corrector.correct(self.first.map, guess, self.first.tangent)

    def specials(self) -> list[tuple[Kind, Node]]:
        """Points at which multipliers pass +1, -1 or the unit circle, in order along the branch."""
        found: list[tuple[Kind, Node]] = []
        for kind, test in _TESTS.items():
            before, after = test(self.first), test(self.last)
            if before * after >= 0.0:
                continue
            if kind == Kind.BRANCHING and any(other == Kind.FOLD for other, _ in found):
                continue
            node = self._root(test, before, after)
            if node is None or (kind == Kind.TORUS and not _pair_on_circle(node)):
                continue
            found.append((kind, node))
        return sorted(found, key=lambda pair: self.first.along(pair[1].z))

    def _root(self, test: Test, before: float, after: float) -> Node | None:
        """Where a test function is 0, by the Illinois variant of regula falsi."""
        low, high = 0.0, self.first.along(self.last.z)
        best: Node | None = None
        side = 0
        latest = high
        for _ in range(_TRIES):
            length = low + (high - low) * before / (before - after)
            # Where a period is halved the equations are singular right at the root.
            places = [length + share * (high - low) for share in _ASIDE]
            node, length = next(((found, place) for place in places if (found := self.node(place))), (None, length))
            if node is None:
                return best
            best, value = node, test(node)
            if value == 0.0 or abs(length - latest) < PRECISION:
                return best
            latest = length
            if value * before > 0.0:
                low, before = length, value
                after = 0.5 * after if side == 1 else after
                side = 1
            else:
                high, after = length, value
                before = 0.5 * before if side == -1 else before
                side = -1
        return best

    def grazing(self) -> tuple[Node, Node] | None:
        """The neighbouring points before and after the first change of the pattern; None where they are not found."""
        before, after = self.first, self.last
        low, high = 0.0, self.first.along(self.last.z)
        for _ in range(_TRIES):
            if high - low <= PRECISION * 10.0:
                break
            middle = 0.5 * (low + high)
            node = self.node(middle)
            if node is None:
                return None
            if node.pattern == self.first.pattern:
                before, low = node, middle
            else:
                after, high = node, middle
        return before, after


def _pair_on_circle(node: Node) -> bool:
    """Whether the multipliers nearest to the unit circle are a complex pair."""
    nearest = min(node.multipliers, key=lambda value: abs(abs(value) - 1.0))
    return abs(nearest.imag) > _COMPLEX
