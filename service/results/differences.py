"""Curves of several studies: how they differ from those of one of them, and all of them as a table."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.service import exports

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.curves import Curve, Curves

#: Curves of studies with their labels.
Drawn = list[tuple[str, "Curves"]]


def differences(drawn: Sequence[tuple[str, Curves]], reference: int) -> Drawn:
    """The curves of the other studies less those of the study at place ``reference``.

    A curve is compared with that of the same fixed parameters. Between two neighbouring points of the reference its
    value is interpolated linearly; outside its range, and beside a point without a result, the difference is NaN.
    """
    name, base = drawn[reference]
    by_values = {_key(curve.line.by): curve for curve in base.curves}
    found = []
    for place, (label, curves) in enumerate(drawn):
        if place == reference:
            continue
        less = [_less(curve, by_values.get(_key(curve.line.by))) for curve in curves.curves]
        found.append((f"{label} − {name}", replace(curves, curves=tuple(less), further=())))
    return found


def _key(by: Mapping[str, float]) -> tuple[tuple[str, str], ...]:
    """Fixed parameters as a key; numbers that agree to twelve digits are one."""
    return tuple((path, f"{value:.12g}") for path, value in sorted(by.items()))


def _less(curve: Curve, base: Curve | None) -> Curve:
    nothing = np.full(len(curve.line.x), np.nan)
    x = np.asarray(curve.line.x)
    y = {name: nothing if base is None else curve.known(name) - _at(base, name, x) for name in curve.y}
    # What is said of the curve itself is not said of its difference.
    return replace(curve, y=y, regimes=None, orders=None, refined=None, jumps=None)


def _at(base: Curve, name: str, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """A result of the reference at places ``x``, array of the same shape."""
    order = np.argsort(np.asarray(base.line.x), kind="stable")
    known, values = np.asarray(base.line.x)[order], base.known(name)[order]
    # Places that differ by rounding only are the same; numpy joins others by a line between their neighbours.
    after = np.searchsorted(known, x)
    low, high = known[np.maximum(after - 1, 0)], known[np.minimum(after, len(known) - 1)]
    nearest = np.where(x - low < high - x, low, high)
    x = np.where(np.isclose(x, nearest, rtol=1e-9, atol=1e-12 * float(np.ptp(known))), nearest, x)
    return np.interp(x, known, values, left=np.nan, right=np.nan)


def compared_csv(drawn: Sequence[tuple[str, Curves]], reading: Reading) -> bytes:
    """Every point of every curve as one row: study, fixed parameters, case, x, results, ending."""
    units: dict[str, str] = {}
    for _label, curves in drawn:
        units |= {**curves.selection.units, **{info.name: info.unit for info in curves.selection.results}}
    return exports.read_table(exports.stacked(_tables(drawn)), units, reading.units)


def _tables(drawn: Sequence[tuple[str, Curves]]) -> Iterator[dict[str, list[Any]]]:
    """The columns of each curve."""
    for label, curves in drawn:
        for curve in curves.curves:
            points = len(curve.endings)
            yield {
                "study": [label] * points,
                **curve.fixed(curves.selection.units),
                curves.selection.x: list(curve.line.x),
                **{info.name: curve.y[info.name].tolist() for info in curves.selection.results},
                **({} if curve.regimes is None else {"regime": curve.regimes}),
                **curve.ends(),
            }
