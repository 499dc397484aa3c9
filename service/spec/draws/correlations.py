"""The correlations of a spec: pairs of parameters whose draws depend on each other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.languages import N_
from sprag_study.service.spec.described import Described, Listed, Record
from sprag_study.service.spec.fields import expanded
from sprag_study.worker.limits import MAX_CORRELATIONS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.spec.node import Node

_COEFFICIENT: Final = Described("coefficient", "", "correlation of the normal scores", "number", -1.0, 1.0)
_PATH: Final = {"type": "string", "examples": ["pendulums.*.mass"]}
_PAIR: Final = Record(
    {
        "between": {"type": "array", "items": _PATH, "minItems": 2, "maxItems": 2, "description": "the two paths"},
        "coefficient": _COEFFICIENT,
    },
    required=("between", "coefficient"),
)
_PAIRS: Final = Listed("correlations", 0, MAX_CORRELATIONS, "parameters whose draws depend on each other", item=_PAIR)
#: JSON Schema of a list of correlations.
CORRELATIONS: Final = {**_PAIRS.schema(), "default": []}
#: Least eigenvalue of a usable matrix of correlations.
_LEAST: Final = 1e-9


def read_correlations(
    node: Node, columns: Mapping[str, int], dimensions: int
) -> tuple[NDArray[np.float64], list[dict[str, Any]]]:
    """The matrix of correlations, shape (dimensions, dimensions), and its pairs as plain JSON data.

    Parameters
    ----------
    columns : path -> number of its draw, for every parameter that is drawn
    """
    matrix = np.eye(dimensions)
    described: list[dict[str, Any]] = []
    for item in _PAIRS.read(node) or ():
        if not _PAIR.read(item):
            continue
        between = item["between"]
        pairs, coefficient = _read_pairs(between, columns), _COEFFICIENT.read(item)
        if coefficient is None or not pairs:
            continue
        if abs(coefficient) > 1.0 - _LEAST:
            item["coefficient"].refuse("conflict", "makes one of them a function of the other; derive it",
                                       allowed="between -1 and 1, both excluded")  # fmt: skip
            continue
        for a, b in pairs:
            if a == b or matrix[a, b]:
                between.refuse("repeated", "share one draw" if a == b else "are correlated already",
                               allowed="each pair once")  # fmt: skip
                break
            matrix[a, b] = matrix[b, a] = coefficient
        described.append({"between": list(between.value), "coefficient": coefficient})
    if node.sound and described:
        least = float(np.linalg.eigvalsh(matrix)[0])
        if least < _LEAST:
            message = Sentence(
                "contradict each other: the matrix of the correlations is not positive definite, its least eigenvalue "
                "is {least}",
                least=Amount(least, digits=3),
            )
            node.refuse("conflict", message, [pair["coefficient"] for pair in described],
                        allowed="coefficients closer to 0")  # fmt: skip
    return matrix, described


def _read_pairs(node: Node, columns: Mapping[str, int]) -> list[tuple[int, int]]:
    """The pairs of draws of two paths; two paths with ``*`` are paired number by number."""
    allowed, data = N_("two paths with tolerances, as in ['pendulums.0.mass', 'pendulums.0.inertia']"), node.value
    if not isinstance(data, list) or len(data) != 2 or not all(isinstance(path, str) for path in data):
        node.refuse("wrong-type", "must be a list of two paths", allowed=allowed)
        return []
    sides = []
    for path in data:
        known = list(dict.fromkeys(columns[name] for name in expanded(path, columns)))
        if not known:
            node.refuse("invalid-path", "has no tolerance", path, allowed=", ".join(columns) or allowed)
            return []
        sides.append(known)
    first, second = sides
    if len(first) == len(second):
        return list(zip(first, second, strict=True))
    if 1 in (len(first), len(second)):
        return [(a, b) for a in first for b in second]
    node.refuse("unequal-lengths", "stand for different numbers of parameters", allowed=allowed)
    return []
