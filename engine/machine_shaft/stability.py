"""Whether a steady cycle is stable: what becomes of a small deviation of the energy (docs/theory-machine-shaft.md)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.panels import Panels

Floats = NDArray[np.float64]

#: Growth over a cycle that is rounding error: as a share of all that grows and shrinks within it, and at least.
_ROUNDING, _LEAST = 1e-9, 1e-12


@dataclass(frozen=True, slots=True)
class Stability:
    """The stability of the cycles of a block of cases.

    Attributes
    ----------
    multiplier : array, shape (cases,)
        Factor by which a small deviation of the kinetic energy, or of the speed at the same angle, grows in a cycle: 1
        where no torque follows the speed.
    unstable : array of bool, shape (cases,)
        Where it grows by more than rounding errors.
    """

    multiplier: Floats
    unstable: NDArray[np.bool_]

    @classmethod
    def of(cls, panels: Panels, slope: Floats) -> "Stability":
        """That of cycles along which the torques have the derivative ``slope`` by the energy, (cases, panels, nodes).

        With dT/dphi = M(phi, T) a deviation d of T has dd/dphi = (dM/dT) d: a linear equation of one variable.
        """
        growth = panels.integral(slope)
        rounding = np.maximum(_ROUNDING * panels.integral(np.abs(slope)), _LEAST)
        return cls(elementary.exp(growth), np.asarray(growth > rounding))

    @classmethod
    def neutral(cls, cases: int) -> "Stability":
        """That of torques that do not follow the speed."""
        return cls(np.ones(cases), np.zeros(cases, dtype=np.bool_))
