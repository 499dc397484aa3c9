"""Strobes of settled motions of a vibration drive at a phase of the excitation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.worker.models.parameters import machines_along
from sprag_study.worker.models.sections import CaseSections, Sampling
from sprag_study.worker.models.vibration_drive.settled import settings_of, settled_study
from sprag_study.worker.models.vibration_drive.swept import start_of

if TYPE_CHECKING:
    from sprag_study.worker.study import Study


def sections_of(study: Study, case: int, asked: Sampling) -> CaseSections:
    """Strobes of one case for each value of a parameter; a study of runs of a given time is settled for it."""
    from sprag_study.engine.vibration_drive.automaton import Clutch
    from sprag_study.engine.vibration_drive.sections import sections
    from sprag_study.engine.vibration_drive.strobes import (
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
