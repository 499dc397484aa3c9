"""Derived parameters: formulas of other parameters in SI numbers, evaluated case by case.

Formulas are stored with a study as ``{path: formula}``; the names in a formula are flat paths of other parameters. The
parser is that of the formulas of machine shafts.
"""

from __future__ import annotations

from functools import lru_cache
from graphlib import CycleError, TopologicalSorter
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.engine.formulas.expressions import CONSTANTS, MAX_LENGTH, RESERVED, Expression, ExpressionError, Node

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    Columns = Mapping[str, NDArray[np.float64]]

__all__ = [
    "CONSTANTS",
    "MAX_LENGTH",
    "RESERVED",
    "CircularError",
    "Expression",
    "ExpressionError",
    "Node",
    "evaluate",
    "evaluation_order",
    "needed",
    "sources",
]


class CircularError(ValueError):
    """Formulas that need each other; ``paths`` is the circle, its first path repeated at its end."""

    def __init__(self, paths: Sequence[str]) -> None:
        super().__init__(" -> ".join(paths))
        self.paths = tuple(paths)


def evaluation_order(uses: Mapping[str, Iterable[str]]) -> tuple[str, ...]:
    """The derived paths in an order in which each follows those that its formula uses.

    Parameters
    ----------
    uses : derived path -> paths in its formula

    Raises
    ------
    CircularError
        When a formula needs its own value, directly or through others.
    """
    graph = {path: sorted(name for name in uses[path] if name in uses) for path in sorted(uses)}
    try:
        return tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        # Each path of graphlib's circle is used by the next one.
        raise CircularError(error.args[1][::-1]) from None


@lru_cache(maxsize=64)
def _compiled(formulas: tuple[tuple[str, str], ...], names: frozenset[str]) -> tuple[tuple[str, Expression], ...]:
    found = {path: Expression(text, names) for path, text in formulas}
    return tuple((path, found[path]) for path in evaluation_order({path: own.used for path, own in found.items()}))


def _expressions(derive: Mapping[str, str], names: Iterable[str]) -> tuple[tuple[str, Expression], ...]:
    """The formulas in the order of evaluation; ``names`` are all paths of the study."""
    return _compiled(tuple(derive.items()), frozenset(names))


def sources(derive: Mapping[str, str], names: Iterable[str], paths: Iterable[str]) -> frozenset[str]:
    """The paths from which the values of ``paths`` follow: those that are not derived, and what the others use."""
    found = set(paths)
    for path, expression in reversed(_expressions(derive, names)):
        if path in found:
            found.remove(path)
            found |= expression.used
    return frozenset(found)


def needed(derive: Mapping[str, str], names: Iterable[str], paths: Iterable[str]) -> dict[str, str]:
    """The formulas that the values of ``paths`` need."""
    found = set(paths)
    for path, expression in reversed(_expressions(derive, names)):
        if path in found:
            found |= expression.used
    return {path: text for path, text in derive.items() if path in found}


def evaluate(
    derive: Mapping[str, str], base: Mapping[str, float], columns: Columns, cases: int
) -> dict[str, NDArray[np.float64]]:
    """Values of the derived parameters, SI.

    Parameters
    ----------
    derive : path -> formula in SI numbers
    base : path -> SI number, of every parameter
    columns : path -> values, shape (cases,), of the parameters that vary
    cases : number of cases

    Returns
    -------
    dict
        Path -> float64 array, shape (cases,), in the order of ``derive``; not finite where a formula has no value. A
        value depends on its own case only, bit for bit.
    """
    values: dict[str, NDArray[np.float64]] = dict(columns)
    for path, expression in _expressions(derive, base):
        for name in expression.used:
            if name not in values:
                # A column even for a constant: a power of an array is rounded differently from that of a number.
                values[name] = np.full(cases, base[name])
        value, _ = expression.evaluate({name: (values[name], 0.0) for name in expression.used})
        # Adding zero makes negative zeros positive and, of one number, a column.
        values[path] = np.broadcast_to(np.asarray(value, dtype=np.float64), (cases,)) + 0.0
    return {path: values[path] for path in derive}
