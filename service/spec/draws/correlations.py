"""The correlations of a spec: pairs of parameters whose draws depend on each other."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.sentences import Amount, Sentence
from sprag.service.languages import N_
from sprag.service.spec.draws.described import COEFFICIENT, CORRELATIONS
from sprag.service.spec.fields import read_object
from sprag.service.spec.report import Report, join

if TYPE_CHECKING:
    from numpy.typing import NDArray

_FIELDS: Final = ("between", "coefficient")
#: Least eigenvalue of a usable matrix of correlations.
_LEAST: Final = 1e-9


def read_correlations(
    report: Report, data: object, columns: Mapping[str, int], dimensions: int, pointer: str = "/correlations"
) -> tuple[NDArray[np.float64], list[dict[str, Any]]]:
    """The matrix of correlations, shape (dimensions, dimensions), and its pairs as plain JSON data.

    Parameters
    ----------
    columns : path -> number of its draw, for every parameter that is drawn
    """
    matrix = np.eye(dimensions)
    described: list[dict[str, Any]] = []
    before = report.found
    for index, item in enumerate(CORRELATIONS.read(report, pointer, data) or ()):
        where = join(pointer, index)
        found = read_object(report, where, item, _FIELDS)
        if found is None:
            continue
        pairs = _read_pairs(report, join(where, "between"), found.get("between"), columns)
        coefficient = COEFFICIENT.read(report, where, found)
        if coefficient is None or not pairs:
            continue
        if abs(coefficient) > 1.0 - _LEAST:
            report.fault(
                join(where, "coefficient"), "conflict", "makes one of them a function of the other; derive it",
                coefficient, allowed="between -1 and 1, both excluded",
            )  # fmt: skip
            continue
        for a, b in pairs:
            if a == b or matrix[a, b]:
                report.fault(
                    join(where, "between"), "repeated", "share one draw" if a == b else "are correlated already",
                    found["between"], allowed="each pair once",
                )  # fmt: skip
                break
            matrix[a, b] = matrix[b, a] = coefficient
        described.append({"between": list(found["between"]), "coefficient": coefficient})
    if report.found == before and described:
        least = float(np.linalg.eigvalsh(matrix)[0])
        if least < _LEAST:
            report.fault(
                pointer, "conflict",
                Sentence(
                    "contradict each other: the matrix of the correlations is not positive definite, its least "
                    "eigenvalue is {least}",
                    least=Amount(least, digits=3),
                ),
                [one["coefficient"] for one in described], allowed="coefficients closer to 0",
            )  # fmt: skip
    return matrix, described


def _read_pairs(report: Report, pointer: str, data: object, columns: Mapping[str, int]) -> list[tuple[int, int]]:
    """The pairs of draws of two paths; two paths with ``*`` are paired number by number."""
    allowed = N_("two paths with tolerances, as in ['pendulums.0.mass', 'pendulums.0.inertia']")
    if not isinstance(data, list) or len(data) != 2 or not all(isinstance(path, str) for path in data):
        report.fault(pointer, "wrong-type", "must be a list of two paths", data, allowed=allowed)
        return []
    sides = []
    for path in data:
        expression = re.compile(re.escape(path).replace(r"\*", "[0-9]+"))
        known = list(dict.fromkeys(column for name, column in columns.items() if expression.fullmatch(name)))
        if not known:
            report.fault(pointer, "invalid-path", "has no tolerance", path, allowed=", ".join(columns) or allowed)
            return []
        sides.append(known)
    first, second = sides
    if len(first) == len(second):
        return list(zip(first, second, strict=True))
    if 1 in (len(first), len(second)):
        return [(a, b) for a in first for b in second]
    report.fault(pointer, "unequal-lengths", "stand for different numbers of parameters", data, allowed=allowed)
    return []
