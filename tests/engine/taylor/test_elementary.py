"""Sine, cosine, logarithm and exponential against those of the C library."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag.engine.compile.jit import compiled
from sprag.engine.taylor.elementary import cosine, exponential, logarithm, sine


@compiled
def _all(x: NDArray[np.float64], out: NDArray[np.float64]) -> None:
    for k in range(x.shape[0]):
        out[0, k] = sine(x[k])
        out[1, k] = cosine(x[k])
        out[2, k] = logarithm(x[k])
        out[3, k] = exponential(x[k])


def test_within_an_ulp_or_so() -> None:
    rng = np.random.default_rng(5)
    quarters = np.arange(-9, 10) * 0.25 * math.pi
    x = np.concatenate(
        [rng.uniform(-4.0, 4.0, 500), rng.uniform(-9e5, 9e5, 500), rng.uniform(-1e-9, 1e-9, 50), quarters]
    )
    out = np.empty((4, len(x)))
    _all(x, out)
    np.testing.assert_allclose(out[0], np.sin(x), rtol=0, atol=3e-16)
    np.testing.assert_allclose(out[1], np.cos(x), rtol=0, atol=3e-16)
    positive = np.concatenate([np.exp(rng.uniform(-700.0, 700.0, 500)), rng.uniform(0.5, 2.0, 500), [1.0, 5e-324]])
    out = np.empty((4, len(positive)))
    _all(positive, out)
    np.testing.assert_allclose(out[2], np.log(positive), rtol=3e-16)
    power = rng.uniform(-700.0, 700.0, 500)
    out = np.empty((4, len(power)))
    _all(power, out)
    np.testing.assert_allclose(out[3], np.exp(power), rtol=4e-16)


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (0.0, (0.0, 1.0, -math.inf, 1.0)),
        (math.inf, (None, None, math.inf, math.inf)),
        (-math.inf, (None, None, math.nan, 0.0)),
        (math.nan, (math.nan, math.nan, math.nan, math.nan)),
        (-800.0, (None, None, math.nan, 0.0)),
        (800.0, (None, None, math.log(800.0), math.inf)),
    ],
)
def test_at_the_ends(x: float, expected: tuple[float | None, ...]) -> None:
    out = np.empty((4, 1))
    _all(np.array([x]), out)
    for value, wanted in zip(out[:, 0].tolist(), expected, strict=True):
        if wanted is not None:
            assert value == pytest.approx(wanted, nan_ok=True)
