"""Shares in a spec: "2 %", or a plain number where only a share is possible."""

from __future__ import annotations

import math

from sprag_study.service.reading.units import QuantityError, split_quantity, to_float


def share_of(value: object) -> float | None:
    """The number of "2 %", 0.02 or "0.02"; None for anything else."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return float(value) if math.isfinite(value) else None
    return in_percent(value, plain=True)


def in_percent(value: object, *, plain: bool = False) -> float | None:
    """The number of a text "2 %", also of one without a unit where ``plain``; None for anything else."""
    if not isinstance(value, str):
        return None
    try:
        number, unit = split_quantity(value)
    except QuantityError:
        return None
    if unit == "%":
        return to_float(number) / 100.0
    return to_float(number) if plain and not unit else None
