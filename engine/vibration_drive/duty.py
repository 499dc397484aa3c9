"""What the clutches of one case have to bear: cycles of torque, impacts, overrunning, slip (docs/theory.md, "Duty")."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.outcome import ClutchDuty, Duty, Engagement, TorqueCycles
from sprag_study.engine.vibration_drive.automaton import Clutch
from sprag_study.engine.vibration_drive.cases import pendulum_count
from sprag_study.engine.vibration_drive.engagements import engagements_of
from sprag_study.engine.vibration_drive.examined import Examined
from sprag_study.engine.vibration_drive.pieces import Pieces, extremes, largest
from sprag_study.engine.vibration_drive.rainflow_counts import Cycle, cycles, equivalent, spectrum

Floats = NDArray[np.float64]

_HOUR = 3600.0
#: Part of the largest torque below which a difference between steps is rounding.
_ROUNDING = 1e-6


@dataclass(frozen=True, slots=True)
class Rating:
    """What a freewheel may bear; NaN where it is not known.

    Attributes
    ----------
    torque : float
        Largest torque that it may transmit, in N*m.
    frequency : float
        Most engagements per time, in Hz.
    speed : float
        Largest speed at which it may overrun, in rad/s.
    exponent : float
        Of its Wöhler curve; NaN: no equivalent torque.
    """

    torque: float = math.nan
    frequency: float = math.nan
    speed: float = math.nan
    exponent: float = math.nan


_UNKNOWN = Rating()


def ratings_of(values: Mapping[str, float], exponent: float | None = None) -> list[Rating]:
    """What the parameters of a case say of its freewheels; an ``exponent`` counts for all of them."""
    ratings = []
    for i in range(pendulum_count(values)):
        names = ("rated_torque", "rated_frequency", "rated_speed", "fatigue_exponent")
        given = [float(values.get(f"pendulums.{i}.{name}", math.inf)) for name in names]
        torque, frequency, speed, of_clutch = (value if math.isfinite(value) else math.nan for value in given)
        ratings.append(Rating(torque, frequency, speed, of_clutch if exponent is None else exponent))
    return ratings


def duty_of(motion: Examined, ratings: Sequence[Rating] = ()) -> Duty:
    """The duty of the clutches in the examined part of a motion.

    Parameters
    ----------
    motion : Examined
    ratings : sequence of Rating
        Of each clutch; by default nothing is known of them.
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
        rows.append(_row(motion, part, clutch, own, torque, counted, ratings[clutch] if ratings else _UNKNOWN))
        every += [TorqueCycles(clutch, *each, each.number / hours) for each in spectrum(counted)]
    return Duty(motion.start, motion.end, motion.regime, tuple(rows), tuple(every), motion.ending)


def _row(
    motion: Examined, part: Pieces, clutch: int, engaged: list[Engagement], torque: Floats, counted: list[Cycle],
    rating: Rating,
) -> ClutchDuty:  # fmt: skip
    hours = (motion.end - motion.start) / _HOUR
    begun = [row for row in engaged if not math.isnan(row.impact_speed)]
    windup = part.windup(clutch)[part.states[:, clutch] >= Clutch.ENGAGED]
    free = part.states[:, clutch] == Clutch.FREE
    overrun = part.speed[free] - part.speeds[free, clutch]
    fastest = float(np.max(largest(overrun), initial=0.0))
    peak = max((row.torque_max for row in engaged), default=0.0)
    return ClutchDuty(
        clutch,
        len(begun) / hours,
        peak,
        max((row.torque_rate_max for row in engaged), default=0.0),
        _jump(torque, peak, repeats=motion.turn > 0),
        max((row.impact_speed for row in begun), default=0.0),
        fastest,
        max(0.0, -float(np.max(largest(-windup)))) if len(windup) else 0.0,
        max((row.windup_max for row in engaged), default=0.0),
        float(motion.losses[clutch]) * _HOUR,
        sum(each.number for each in counted) / hours,
        math.nan if math.isnan(rating.exponent) else equivalent(counted, rating.exponent, len(begun)),
        _margin(rating.torque, peak),
        _margin(rating.frequency, len(begun) / hours / _HOUR),
        _margin(rating.speed, fastest),
    )


def _margin(rating: float, load: float) -> float:
    """NaN without a load, as without a rating."""
    return rating / load if load > 0.0 else math.nan


def _jump(torque: Floats, peak: float, *, repeats: bool) -> float:
    """Largest jump of the transmitted torque between steps; 0 where there is only rounding."""
    before, after = np.sum(torque, axis=1), torque[:, 0]
    jumps = np.abs(after - np.roll(before, 1))[0 if repeats else 1 :]
    jump = float(np.max(jumps, initial=0.0))
    return jump if jump > _ROUNDING * peak else 0.0
