"""What the speed varies by and what that is owed to: works, shares of the four squares, harmonics.

The coefficient of fluctuation of energy is (T_max - T_min) over the work of a cycle (R. S. Khurmi, J. K. Gupta, *Theory
of Machines*, chapter 16).
"""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.compile.jit import compiled
from sprag_study.engine.machine_shaft.panels import WEIGHTS, Panels
from sprag_study.engine.machine_shaft.spec import HARMONICS

Floats = NDArray[np.float64]

#: Work of a cycle below this share of the largest work within it is a rounding error.
_NO_WORK = 1e-9


def shares(known: dict[str, Floats]) -> dict[str, Floats]:
    """Amplitude of omega^2 and the share of each S in the sum of the four amplitudes."""
    out = {"omega_squared.amplitude": 0.5 * (np.square(known["omega.max"]) - np.square(known["omega.min"]))}
    amplitudes = [known[f"s{k}.amplitude"] for k in range(1, 5)]
    total = sum(amplitudes)
    with np.errstate(invalid="ignore", divide="ignore"):
        return out | {f"s{k}.share": amplitude / total for k, amplitude in enumerate(amplitudes, start=1)}


def energy_coefficient(fluctuation: Floats, work: Floats, largest: Floats) -> Floats:
    """Fluctuation of energy over the ``work`` of a cycle; NaN where that is zero."""
    done = np.abs(work) > _NO_WORK * largest
    return np.where(done, fluctuation / np.where(done, np.abs(work), 1.0), np.nan)


def harmonics(panels: Panels, cycle: float, values: dict[str, Floats]) -> dict[str, Floats]:
    """Amplitudes of the first harmonics of the cycle, by ``NAME.harmonics.K``.

    The K-th amplitude of f is the modulus of (2/cycle) * integral of f exp(-2 pi i K phi/cycle).
    """
    unit = (2.0 * np.pi / cycle) * panels.angles
    cosine, sine = elementary.cos(unit), elementary.sin(unit)
    out: dict[str, Floats] = {}
    for name, given in values.items():
        found = np.empty((len(given), HARMONICS))
        _harmonics(np.ascontiguousarray(given), cosine, sine, panels.half, WEIGHTS, found)
        out |= {f"{name}.harmonics.{k + 1}": 2.0 / cycle * found[:, k] for k in range(HARMONICS)}
    return out


@compiled
def _harmonics(values: Floats, cosine: Floats, sine: Floats, half: Floats, weights: Floats, out: Floats) -> None:
    """Moduli of the integrals of ``values`` times exp(i k u), with ``cosine`` and ``sine`` of u at the nodes."""
    count = out.shape[1]
    sums = np.empty((2, count))
    for case in range(len(values)):
        row = case if len(half) > 1 else 0
        sums[:] = 0.0
        for p in range(values.shape[1]):
            if half[row, p] > 0.0:
                for j in range(values.shape[2]):
                    part = half[row, p] * weights[j] * values[case, p, j]
                    c, s = cosine[row, p, j], sine[row, p, j]
                    re, im = c, s
                    for k in range(count):
                        sums[0, k] += part * re
                        sums[1, k] += part * im
                        re, im = re * c - im * s, re * s + im * c
        for k in range(count):
            out[case, k] = np.sqrt(np.square(sums[0, k]) + np.square(sums[1, k]))
