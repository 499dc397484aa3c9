"""What the clutches of one case have to bear: cycles of torque, impacts, overrunning, slip (docs/theory.md, "Duty")."""

import math

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.outcome import ClutchDuty, Duty, Engagement, TorqueCycles
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.engagements import engagements_of
from sprag_study.engine.vibration_drive.examined import Examined
from sprag_study.engine.vibration_drive.pieces import Pieces, extremes, largest
from sprag_study.engine.vibration_drive.rainflow_counts import Cycle, cycles, equivalent, spectrum

Floats = NDArray[np.float64]

_HOUR = 3600.0
#: Part of the largest torque below which a difference between steps is rounding.
_ROUNDING = 1e-6


def duty_of(motion: Examined, exponent: float | None = None) -> Duty:
    """The duty of the clutches in the examined part of a motion.

    Parameters
    ----------
    motion : Examined
    exponent : float, optional
        Exponent of the Wöhler curve for the equivalent torques, above 0; without it they are NaN.
    """
    part, hours = motion.part, (motion.end - motion.start) / _HOUR
    if part is None or not len(part.length):
        return Duty(motion.start, motion.end, motion.regime, (), (), motion.ending)
    engaged = engagements_of(motion)
    rows, every = [], []
    for clutch in range(part.states.shape[1]):
        # Drag while a clutch overruns is no torque that it transmits.
        transmits = part.states[:, clutch, np.newaxis] >= Clutch.ENGAGED
        torque = np.where(transmits, part.torques[:, clutch], 0.0)
        counted = cycles(extremes(torque)[1].tolist(), repeats=motion.turn > 0)
        own = [row for row in engaged if row.clutch == clutch]
        rows.append(_row(motion, part, clutch, own, torque, counted, exponent))
        every += [TorqueCycles(clutch, *each, each.number / hours) for each in spectrum(counted)]
    return Duty(motion.start, motion.end, motion.regime, tuple(rows), tuple(every), motion.ending)


def _row(
    motion: Examined, part: Pieces, clutch: int, engaged: list[Engagement], torque: Floats, counted: list[Cycle],
    exponent: float | None,
) -> ClutchDuty:  # fmt: skip
    hours = (motion.end - motion.start) / _HOUR
    begun = [row for row in engaged if not math.isnan(row.impact_speed)]
    windup = part.windup(clutch)[part.states[:, clutch] >= Clutch.ENGAGED]
    free = part.states[:, clutch] == Clutch.FREE
    overrun = part.speed[free] - part.speeds[free, clutch]
    peak = max((row.torque_max for row in engaged), default=0.0)
    return ClutchDuty(
        clutch,
        len(begun) / hours,
        peak,
        max((row.torque_rate_max for row in engaged), default=0.0),
        _jump(torque, peak, repeats=motion.turn > 0),
        max((row.impact_speed for row in begun), default=0.0),
        float(np.max(largest(overrun), initial=0.0)),
        max(0.0, -float(np.max(largest(-windup)))) if len(windup) else 0.0,
        max((row.windup_max for row in engaged), default=0.0),
        float(motion.losses[clutch]) * _HOUR,
        sum(each.number for each in counted) / hours,
        math.nan if exponent is None else equivalent(counted, exponent, len(begun)),
    )


def _jump(torque: Floats, peak: float, *, repeats: bool) -> float:
    """Largest jump of the transmitted torque between steps; 0 where there is only rounding."""
    before, after = np.sum(torque, axis=1), torque[:, 0]
    jumps = np.abs(after - np.roll(before, 1))[0 if repeats else 1 :]
    jump = float(np.max(jumps, initial=0.0))
    return jump if jump > _ROUNDING * peak else 0.0
