"""Formulas give the same as text for generated code and as numbers, and their second coefficients are rates."""

from __future__ import annotations

import numpy as np
import pytest

from sprag_study.engine.taylor.straight import Term, horner, integral, slope
from sprag_study.engine.vibration_drive.clutch_law import stored_energy, torque
from sprag_study.engine.vibration_drive.formulas import base_series, drive, free_acceleration

NUMBERS = {name: 0.3 + 0.7 * position for position, name in enumerate("abcdefgh")}
TERMS = [Term(name) for name in NUMBERS]


def _value(term: str) -> float:
    return float(eval(term, {}, dict(NUMBERS)))


def test_text_and_numbers_agree() -> None:
    a, b, c, d, e, f, g, h = NUMBERS.values()
    A, B, C, D, E, F, G, H = TERMS
    assert _value(free_acceleration(*TERMS)) == free_acceleration(a, b, c, d, e, f, g, h)
    pairs, numbers = base_series(A, B, C, D, E, F, G), base_series(a, b, c, d, e, f, g)
    assert [[_value(term) for term in pair] for pair in pairs] == [list(pair) for pair in numbers]
    for k in range(2):
        assert _value(drive((A, B), (C, D), (E, F), (G, H), k)) == drive((a, b), (c, d), (e, f), (g, h), k)
    for function in (horner, integral):
        assert _value(function([A, B, C, D], E)) == function([a, b, c, d], e)


def _terms(t: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Base motion with 7 rad/s at the time ``t``, with some amplitudes and a phase of 0.4 rad."""
    sin, cos = float(np.sin(7.0 * t)), float(np.cos(7.0 * t))
    return base_series(3.0, 5.0, 7.0, sin, cos, float(np.sin(0.4)), float(np.cos(0.4)))


def test_second_coefficients_are_rates() -> None:
    def driven(t: float, k: int) -> float:
        angle, rate = 0.2 + 1.3 * t, 1.3
        s, c = float(np.sin(angle)), float(np.cos(angle))
        return drive(*_terms(t), (s, c * rate), (c, -s * rate), k)

    step = 1e-5
    for place in range(2):
        rate = (_terms(0.1 + step)[place][0] - _terms(0.1 - step)[place][0]) / (2.0 * step)
        assert _terms(0.1)[place][1] == pytest.approx(rate, rel=1e-8)
    assert driven(0.1, 1) == pytest.approx((driven(0.1 + step, 0) - driven(0.1 - step, 0)) / (2.0 * step), rel=1e-8)


def test_the_law_goes_on_straight() -> None:
    law, limit = [0.4, 200.0, -30.0, 2e4], 0.05
    end, rate = horner(law, limit), slope(law, limit)
    u = np.array([-0.01, 0.0, 0.03, limit, 0.08])
    straight = end + rate * (u[-1] - limit)
    assert torque(law, limit, u) == pytest.approx([0.0, 0.4, horner(law, 0.03), end, straight], rel=1e-15)
    energy = integral(law, limit) + 0.5 * (end + straight) * (u[-1] - limit)
    assert stored_energy(law, limit, u) == pytest.approx([0.0, 0.0, integral(law, 0.03), integral(law, limit), energy])
