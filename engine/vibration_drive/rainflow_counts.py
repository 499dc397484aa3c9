"""Cycles of a load by rainflow counting (ASTM E1049-85, section 5.4), and the load that does the same damage."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import rainflow

from sprag_study.engine import elementary

#: Part of the largest range below which ranges are rounding.
_ROUNDING = 1e-6
#: Part of the largest range to which ranges and means are rounded where cycles are compared.
_ALIKE = 1e-3


class Cycle(NamedTuple):
    """Its range from valley to peak, the mean of both, and how often it occurs; a half cycle counts as 0.5."""

    size: float
    mean: float
    number: float


def cycles(history: Sequence[float], *, repeats: bool) -> list[Cycle]:
    """The cycles of a load as they close, without those whose range is below a millionth of the largest.

    Parameters
    ----------
    history : sequence
        Values of the load in order, with all its peaks and valleys.
    repeats : bool
        Whether the load repeats itself after the last value. It is then counted from its largest value on (5.4.5), so
        that every cycle is closed and several repetitions have as many times the cycles.
    """
    values = list(history)
    if repeats and values:
        top = values.index(max(values))
        values = [*values[top:], *values[: top + 1]]
    # The package finds no turning points in two values; the last one twice changes nothing else.
    values += values[-1:]
    counted = [Cycle(*each) for *each, _, _ in rainflow.extract_cycles(values)]
    least = _ROUNDING * max((cycle.size for cycle in counted), default=0.0)
    return [cycle for cycle in counted if cycle.size > least]


def spectrum(counted: Sequence[Cycle]) -> list[Cycle]:
    """Cycles whose ranges and means are the same when rounded to a thousandth of the largest range as one, with the
    means of both; the largest ranges first.
    """
    unit = _ALIKE * max((cycle.size for cycle in counted), default=0.0)
    alike: dict[tuple[int, int], list[Cycle]] = {}
    for cycle in counted:
        alike.setdefault((round(cycle.size / unit), round(cycle.mean / unit)), []).append(cycle)
    rows = []
    for members in alike.values():
        count = sum(member.number for member in members)
        size, mean = (sum(member[k] * member.number for member in members) / count for k in range(2))
        rows.append(Cycle(size, mean, count))
    return sorted(rows, reverse=True)


def equivalent(counted: Sequence[Cycle], exponent: float, number: float) -> float:
    """The range that does the same damage as the cycles when it occurs ``number`` times, by Miner's rule with the given
    exponent of the Wöhler curve; 0 without cycles, NaN for a ``number`` of 0.
    """
    if not number > 0.0:
        return math.nan
    top = max((cycle.size for cycle in counted), default=0.0)
    if not top > 0.0:
        return 0.0
    shares = elementary.power([cycle.size / top for cycle in counted], exponent)
    damage = math.fsum(cycle.number * share for cycle, share in zip(counted, shares.tolist(), strict=True))
    return top * float(elementary.power(damage / number, 1.0 / exponent))
