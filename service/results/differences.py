"""Curves of several studies: how they differ from those of one of them, and all of them as a table."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.service import exports
from sprag_study.service.reading.directions import in_words
from sprag_study.service.results.curves import flag_names

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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
    # Places that differ by rounding only are the same.
    near = np.clip(np.searchsorted(known, x), 1, max(len(known) - 1, 1)) if len(known) > 1 else np.ones(len(x), int)
    left, right = near - 1, np.minimum(near, len(known) - 1)
    width = known[right] - known[left]
    share = np.divide(x - known[left], width, out=np.zeros(len(x)), where=width > 0.0)
    share = np.where(np.abs(share) < 1e-9, 0.0, np.where(np.abs(share - 1.0) < 1e-9, 1.0, share))
    outside = (share < 0.0) | (share > 1.0) | ((width == 0.0) & ~np.isclose(x, known[left], rtol=1e-9, atol=0.0))
    between = values[left] + share * (values[right] - values[left])
    found: NDArray[np.float64] = np.where(share == 0.0, values[left], np.where(share == 1.0, values[right], between))
    return np.where(outside, np.nan, found)


def compared_csv(drawn: Sequence[tuple[str, Curves]], reading: Reading) -> bytes:
    """Every point of every curve as one row: study, fixed parameters, case, x, results, ending."""
    columns: dict[str, list[Any]] = {"study": []}
    units: dict[str, str] = {}
    for label, curves in drawn:
        chosen = curves.selection
        units |= {**chosen.units, **{info.name: info.unit for info in chosen.results}}
        for curve in curves.curves:
            points = len(curve.endings)
            parts: dict[str, list[Any]] = {
                "study": [label] * points,
                **{path: [value] * points for path, value in in_words({**curve.line.by, **curve.line.at}).items()},
                "case": curve.line.cases.tolist(),
                chosen.x: list(curve.line.x),
                **{info.name: curve.y[info.name].tolist() for info in chosen.results},
                **({} if curve.regimes is None else {"regime": curve.regimes}),
                "flags": [" ".join(names) for names in flag_names(curve.flags or [""] * points)],
                "ending": curve.endings,
            }
            rows = len(columns["study"])
            for name in dict.fromkeys([*columns, *parts]):
                # A parameter that is not fixed in every study is empty in the others.
                columns.setdefault(name, [None] * rows).extend(parts.get(name, [None] * points))
    return exports.read_table(columns, units, reading.units)
