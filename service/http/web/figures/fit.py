"""A clutch fit as a picture inside the page: measured points, fitted law, and below them the residuals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.reading.wording import number
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.models import ClutchFit

WIDTH: Final = 560
_LEFT, _RIGHT, _TOP, _LAW, _GAP, _REST = 64.0, 12.0, 10.0, 190.0, 26.0, 80.0
_LINE_POINTS: Final = 120


@dataclass(frozen=True, slots=True)
class Tick:
    """A tick: its position in the picture, and its label."""

    at: float
    text: str


@dataclass(frozen=True, slots=True)
class FitChart:
    """Geometry of the picture, in its own units; the template draws it.

    ``windup``, ``torque`` and ``accuracy`` are the ends of its axes (SI), where the numbers of a reader stand.
    """

    width: float
    height: float
    left: float
    right: float
    law: tuple[float, float]
    rest: tuple[float, float]
    points: list[tuple[float, float]]
    line: str
    residuals: list[tuple[float, float]]
    zero: float
    band: tuple[float, float]
    windup: float
    torque: tuple[float, float]
    accuracy: float

    def x_ticks(self, reading: Reading) -> list[Tick]:
        """Numbers of the windup."""
        return _ticks((0.0, self.windup), (self.left, self.right), "rad", reading)

    def torque_ticks(self, reading: Reading) -> list[Tick]:
        """Numbers of the torque and of its residuals."""
        shown = number(reading.value(self.accuracy, "N*m"), 3)
        rest = [Tick(self.band[0], shown), Tick(self.zero, "0"), Tick(self.band[1], f"−{shown}")]
        return _ticks(self.torque, (self.law[1], self.law[0]), "N*m", reading) + rest


def fit_chart(fit: ClutchFit, clutch: Mapping[str, Any], backlash: float) -> FitChart:
    """The picture of ``fit`` for a clutch of a spec; ``backlash`` (rad) is what the fit subtracted from the angles."""
    rows = np.array([[parse_quantity(a, "rad"), parse_quantity(t, "N*m")] for a, t in clutch["data"]])
    offset = backlash if clutch.get("angles_include_backlash") else 0.0
    windup, torque = np.maximum(rows[:, 0] - offset, 0.0), rows[:, 1]
    u = np.linspace(0.0, fit.windup_limit, _LINE_POINTS)
    law = models.clutch_torque(fit.coefficients, fit.windup_limit, u)
    low, high = min(float(torque.min()), float(law.min()), 0.0), max(float(torque.max()), float(law.max()))
    most = max(fit.max_residual, fit.accuracy) * 1.15
    right, law_end = WIDTH - _RIGHT, _TOP + _LAW
    rest = (law_end + _GAP, law_end + _GAP + _REST)

    def x(value: float) -> float:
        return _LEFT + (right - _LEFT) * value / fit.windup_limit

    def y(value: float) -> float:
        return law_end - _LAW * (value - low) / ((high - low) or 1.0)

    def r(value: float) -> float:
        return (rest[0] + rest[1]) / 2.0 - value / most * _REST / 2.0

    return FitChart(
        WIDTH,
        rest[1] + 44.0,
        _LEFT,
        right,
        (_TOP, law_end),
        rest,
        [(round(x(a), 1), round(y(t), 1)) for a, t in zip(windup.tolist(), torque.tolist(), strict=True)],
        " ".join(f"{x(a):.1f},{y(t):.1f}" for a, t in zip(u.tolist(), law.tolist(), strict=True)),
        [(round(x(a), 1), round(r(v), 1)) for a, v in zip(windup.tolist(), fit.residuals, strict=True)],
        round(r(0.0), 1),
        (round(r(fit.accuracy), 1), round(r(-fit.accuracy), 1)),
        fit.windup_limit,
        (low, high),
        fit.accuracy,
    )


def _ticks(ends: tuple[float, float], places: tuple[float, float], si: str, reading: Reading) -> list[Tick]:
    """Round numbers of the reader between two ends (SI), which stand at these places."""
    low, high = (reading.value(end, si) for end in ends)
    size = (places[1] - places[0]) / ((high - low) or 1.0)
    return [Tick(places[0] + (value - low) * size, number(value, 4)) for value in _round_steps(low, high)]


def _round_steps(low: float, high: float, wanted: int = 5) -> Sequence[float]:
    """Round numbers from ``low`` to ``high``, about ``wanted`` of them."""
    if not high > low:
        return [low]
    rough = (high - low) / wanted
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(size * factor for factor in (1.0, 2.0, 5.0, 10.0) if size * factor >= rough)
    return [index * step for index in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]
