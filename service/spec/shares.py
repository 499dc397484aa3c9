"""Shares in a spec: "2 %", or a plain number where only a share is possible."""

from __future__ import annotations

import math

from sprag.sentences import Amount, Sentence
from sprag.service.reading.units import QuantityError, split_quantity, to_float
from sprag.service.spec.report import Report


def read_share(report: Report, pointer: str, value: object, low: float, high: float) -> float | None:
    """A share between ``low`` and ``high``, a plain number or a text such as "1 %"; None, and a fault, for others."""
    ends = {"low": Amount(100 * low, digits=6), "high": Amount(100 * high, digits=6)}
    allowed = Sentence('{low} % to {high} %, as in "1 %" or 0.01', **ends)
    share = share_of(value)
    if share is None:
        report.fault(pointer, "not-a-number", "must be a share", value, allowed=allowed)
    elif not low <= share <= high:
        report.fault(pointer, "out-of-range", "is out of range", value, allowed=allowed)
    else:
        return share
    return None


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
