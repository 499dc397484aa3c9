"""Strobes of settled motions at a phase of the excitation: bifurcation diagrams and Poincare sections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sprag.engine.vibration_drive.regimes import Regime
from sprag.worker.models.branches import machines_along
from sprag.worker.models.model import model_of
from sprag.worker.models.settled import settings_of, settled_study
from sprag.worker.models.swept import start_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag.worker.study import Study


@dataclass(frozen=True, slots=True)
class Sampling:
    """What is asked for: paths and values (SI, shape (m,)) of the parameter that varies, none for the case as it is;
    the phase as a part of the excitation period; the strobes of each motion.
    """

    paths: tuple[str, ...]
    values: NDArray[np.float64]
    phase: float
    count: int


@dataclass(frozen=True, slots=True)
class CaseSections:
    """Strobes of settled motions.

    Attributes
    ----------
    regimes : tuple of str, length m
        Names of the regimes; "" where a case did not end ok.
    orders : int64 array, shape (m,)
        Excitation periods in one turn of the orbit; 0 where there is none.
    names, units : tuples, length V
        Variables of a strobe.
    values : float64 array, shape (m, count, V)
        NaN beyond the strobes of one turn of a periodic motion.
    """

    regimes: tuple[str, ...]
    orders: NDArray[np.int64]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]


def run_sections(study: Study, case: int, asked: Sampling) -> CaseSections:
    """Settle one case for each value of a parameter; ValueError where its machine has no strobes."""
    return model_of(study.model).sections(study, case, asked)


def drive_sections(study: Study, case: int, asked: Sampling) -> CaseSections:
    """Those of a vibration drive; a study of runs of a given time is settled for it."""
    from sprag.engine.vibration_drive.automaton import Clutch
    from sprag.engine.vibration_drive.sections import sections
    from sprag.engine.vibration_drive.strobes import (
        ANGLE,
        CLUTCH,
        PENDULUM_WIDTH,
        SHAFT_SPEED,
        SHAFT_WIDTH,
        SPEED,
        WINDUP,
    )

    columns = machines_along(study, case, asked.paths)(asked.values)
    settings = settings_of(settled_study(study).run)
    # The case itself begins where it does in its study.
    starts = start_of(study, case) if len(asked.values) == 1 else None
    cases, phase, count = len(asked.values), asked.phase, asked.count
    found = sections(columns, settings, cases=cases, phase=phase, count=count, starts=starts)
    names, units, values = ["shaft.speed"], ["rad/s"], [found.strobes[:, :, SHAFT_SPEED]]
    for i in range((found.strobes.shape[2] - SHAFT_WIDTH) // PENDULUM_WIDTH):
        own = found.strobes[:, :, SHAFT_WIDTH + i * PENDULUM_WIDTH :]
        names += [f"pendulums.{i}.{name}" for name in ("angle", "speed", "windup")]
        units += ["rad", "rad/s", "rad"]
        free = own[:, :, CLUTCH] < Clutch.ENGAGED
        values += [own[:, :, ANGLE], own[:, :, SPEED], np.where(free, 0.0, own[:, :, WINDUP])]
    regimes = tuple(Regime(int(code)).name.lower() if code else "" for code in found.regimes)
    return CaseSections(regimes, found.orders, tuple(names), tuple(units), np.stack(values, axis=2))
