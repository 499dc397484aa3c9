"""The start-up of one case with a ramp of the excitation frequency, of the load, or of both (docs/theory.md,
"Start-up").

A ramp is run by a kernel whose clock counts periods of the final frequency; the phase of its excitation, and the factor
on its load, are rows of their own. After the ramps the usual kernel goes on from the state and the phase there.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Trajectory
from sprag_study.engine.run import SettledRun, Span
from sprag_study.engine.vibration_drive.cases import (
    STOPS,
    Column,
    case_matrix,
    default_of,
    pendulum_count,
    scalars,
    stop_column,
    with_lengths,
)
from sprag_study.engine.vibration_drive.characteristics import characteristics, combined
from sprag_study.engine.vibration_drive.integration import Integration, integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.parameters import CYCLIC
from sprag_study.engine.vibration_drive.ramps import MOST_PERIODS, Ramps, StartUp, start_up_infos
from sprag_study.engine.vibration_drive.regimes import Regime, settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import sampled
from sprag_study.engine.vibration_drive.strobes import BEGIN, TURN, continued, from_rest
from sprag_study.engine.vibration_drive.sweep import whole_periods

Floats = NDArray[np.float64]

_TURN = 2.0 * math.pi
#: Excitation periods after the ramps that are computed first; where the speed is not reached, ``MOST_PERIODS`` follow.
_PERIODS = 1000
#: Windows in a row, to the end of the run, whose mean speeds must be within the share.
_STAYS = 10
#: What a motion shows after the speed is settled: a part of the time until then, and at least so many periods.
_AFTER, _AFTER_PERIODS = 0.25, 10.0


@dataclass(frozen=True, slots=True)
class _Stretch:
    """A part of a start-up in which the excitation's frequency and the load's factor change linearly, or not at all.

    Attributes
    ----------
    start, end : float
        Times in s from the start of the case.
    turns : float
        Turns that the phase of the excitation has made at its start.
    frequency, frequency_rate : float
        In Hz at its start, and in Hz/s.
    factor, factor_rate : float
        On the load at its start, and per s.
    """

    start: float
    end: float
    turns: float
    frequency: float
    frequency_rate: float
    factor: float
    factor_rate: float

    @property
    def ramped(self) -> bool:
        """Whether it needs a kernel with ramps."""
        return self.frequency_rate != 0.0 or self.factor_rate != 0.0


def _stretches(ramps: Ramps, frequency: float) -> list[_Stretch]:
    """The stretches of a start-up; the last one, without a ramp, is as long as is computed at most."""
    # A ramp from the final frequency is none.
    rise = ramps.frequency_time if ramps.start_frequency != frequency else 0.0
    loaded = ramps.load_time
    frequency_rate = (frequency - ramps.start_frequency) / rise if rise else 0.0
    factor_rate = 1.0 / loaded if loaded else 0.0
    turns, stretches = 0.0, []
    for start, end in pairwise(sorted({0.0, rise, loaded})):
        rises, loads = start < rise, start < loaded
        begin = ramps.start_frequency + frequency_rate * start if rises else frequency
        rate = frequency_rate if rises else 0.0
        factor = factor_rate * start if loads else 1.0
        stretches.append(_Stretch(start, end, turns, begin, rate, factor, factor_rate if loads else 0.0))
        turns += (begin + 0.5 * rate * (end - start)) * (end - start)
    last = max(rise, loaded)
    return [*stretches, _Stretch(last, last + MOST_PERIODS / frequency, turns, frequency, 0.0, 1.0, 0.0)]


@dataclass(frozen=True, slots=True)
class _Course:
    """A start-up up to some time: sums over each stretch, its motion, and the state at the end of the last ramp."""

    sums: list[Floats]
    motion: Trajectory
    state: Floats


class _Drive:
    """One case with its ramps."""

    def __init__(self, values: Mapping[str, float], ramps: Ramps, settings: SettledRun, start: Floats | None) -> None:
        self.values, self.settings = values, settings
        self.n, self.frequency = pendulum_count(values), values["excitation.frequency"]
        self.start = from_rest(1, self.n) if start is None else continued(start)
        self.stretches = _stretches(ramps, self.frequency)

    def run(self, until: float, times: Floats) -> _Course:
        """Run up to a time in s, with the motion at ``times``, which ascend up to there."""
        state, turn = self.start, 0.0
        sums: list[Floats] = []
        motions: list[Trajectory] = []
        done = 0
        for stretch in self.stretches:
            end = min(until, stretch.end)
            last = int(np.searchsorted(times, end, side="right"))
            found, motion = self._advance(stretch, end, times[done:last], state, turn)
            done = last
            sums.append(found.sums)
            motions.append(motion)
            if motion.ending is not Ending.OK or until <= stretch.end:
                break
            state = continued(found.strobes[:, 0])
            turn += float(found.strobes[0, 0, TURN])
        return _Course(sums, _joined(motions), state)

    def _advance(
        self, stretch: _Stretch, until: float, times: Floats, state: Floats, turn: float
    ) -> tuple[Integration, Trajectory]:
        """Run a stretch up to a time from a state in which the shaft has turned by ``turn``."""
        clock = (until - stretch.start) * self.frequency
        values = self._values(turn)
        run = replace(self.settings.run, duration=Span(clock + 1.0))
        matrix, rows = case_matrix(values, run, 1), state.copy()
        rows[:, BEGIN] = stretch.turns % 1.0
        if stretch.ramped:
            # The clock ends with a whole period, at which the state is recorded.
            rows[:, BEGIN] = math.ceil(clock) - clock
            matrix[0, Column.PHASE : Column.LOAD_SLOPE + 1] = (
                stretch.turns % 1.0, _TURN * stretch.frequency, _TURN * stretch.frequency_rate,
                stretch.factor, stretch.factor_rate,
            )  # fmt: skip
        begin = float(rows[0, BEGIN])
        matrix = with_lengths(matrix, rows[:, BEGIN], np.array([clock]), windowed=True)
        passed = times - stretch.start
        # A run that ends a rounding error beside a whole period ends there.
        last = float(np.sum(matrix[0, stop_column(STOPS - 1) : stop_column(STOPS)]))
        places = np.minimum(begin + passed * self.frequency, last)
        module = kernel_of(values, run.tolerance, ramped=stretch.ramped)
        found = integrate(module, matrix, run, starts=rows, strobes=1, times=places)
        passed = passed[: found.recorded]
        rate = _TURN * stretch.frequency + 0.5 * _TURN * stretch.frequency_rate * passed
        angle = _TURN * (stretch.turns % 1.0) + rate * passed
        factor = stretch.factor + stretch.factor_rate * passed
        motion = sampled(values, matrix, found, times, angle=angle, load_factor=factor)
        added = {"excitation.frequency": stretch.frequency + stretch.frequency_rate * passed, "load.factor": factor}
        motion.values[:, motion.names.index("shaft.angle")] += turn
        return found, replace(
            motion,
            names=(*added, *motion.names),
            units=("Hz", "1", *motion.units),
            values=np.column_stack([*added.values(), motion.values]),
        )

    def _values(self, turn: float) -> Mapping[str, float]:
        """The parameters; a load that swings with the angle of the shaft is where it is after ``turn``."""
        if not self.values.get(CYCLIC, 0.0) > 0.0:
            return self.values
        cycles, phase = (self.values.get(path, default_of(path)) for path in ("shaft.load_cycles", "shaft.load_phase"))
        assert cycles is not None
        assert phase is not None
        return {**self.values, "shaft.load_phase": math.remainder(phase + cycles * turn, _TURN)}

    def characteristics(self, sums: list[Floats], until: float) -> dict[str, float]:
        """The characteristics of all stretches together, up to a time in s."""
        run = replace(self.settings.run, duration=Span(until * self.frequency))
        matrix = with_lengths(
            case_matrix(self.values, run, 1), np.zeros(1), np.array([until * self.frequency]), windowed=True
        )
        lay = kernel_of(self.values, run.tolerance).LAYOUT
        names = [info.name for info in result_infos(self.n)]
        return dict(zip(names, characteristics(lay, matrix, combined(lay, sums))[0].tolist(), strict=True))


def _joined(motions: list[Trajectory]) -> Trajectory:
    """Motions that follow each other as one."""
    last = motions[-1]
    return replace(
        last,
        times=np.concatenate([motion.times for motion in motions]),
        values=np.vstack([motion.values for motion in motions]),
        states={name: [state for motion in motions for state in motion.states[name]] for name in last.states},
    )


@dataclass(frozen=True, slots=True)
class _Settled:
    """What a start-up comes to: regime, excitation periods whose means are compared, mean speed, largest torque."""

    regime: str
    window: int
    speed: float
    torque: float


def start_up(
    columns: Mapping[str, ArrayLike], ramps: Ramps, settings: SettledRun, points: int, start: Floats | None = None
) -> StartUp:
    """Run the start-up of one case, and find the motion to which it comes.

    Parameters
    ----------
    columns : mapping
        As for ``simulate``, scalars only.
    ramps : Ramps
    settings : SettledRun
        Of the search for the settled motion; its accuracy and reset are those of the start-up.
    points : int
        Samples of the motion.
    start : array, shape (1, strobes.width(n)), optional
        As ``starts`` of ``settle``; without it the case's own start.

    Returns
    -------
    StartUp

    Raises
    ------
    ValueError
        If a required parameter is missing or the number of pendulums or coefficients is out of range.
    """
    drive = _Drive(scalars(columns), ramps, settings, start)
    followed = _follow(drive, ramps.within)
    if isinstance(followed, Ending):
        nothing = Trajectory(np.empty(0), (), (), np.empty((0, 0)), {}, followed)
        return StartUp(False, "", (), {}, nothing, followed)
    whole, end, settled, periods = followed
    until = end if periods is None else periods / drive.frequency
    shown = min(end, until + max(_AFTER * until, _AFTER_PERIODS / drive.frequency))
    seen = drive.run(shown, np.linspace(0.0, shown, points)).motion
    way = whole if until == end else drive.run(until, np.empty(0))
    results = _results(drive, drive.characteristics(way.sums, until), settled, until, periods is not None)
    infos = start_up_infos(drive.n)
    ordered = {info.name: results[info.name] for info in infos}
    return StartUp(periods is not None, settled.regime, infos, ordered, seen, Ending.OK)


def _follow(drive: _Drive, within: float) -> tuple[_Course, float, _Settled, int | None] | Ending:
    """A start-up with the time up to which it was followed, the motion to which it comes, and the periods until its
    speed stays settled; or how it ended.
    """
    settled: _Settled | None = None
    for count in (_PERIODS, MOST_PERIODS):
        end = drive.stretches[-1].start + count / drive.frequency
        grid = np.arange(math.floor(end * drive.frequency * (1.0 + 1e-12)) + 1) / drive.frequency
        whole = drive.run(end, np.minimum(grid, end))
        if whole.motion.ending is not Ending.OK:
            return whole.motion.ending
        turns = whole.motion.values[:, whole.motion.names.index("shaft.angle")]
        if settled is None or not settled.regime:
            motion = _settled(drive, whole, turns)
            if isinstance(motion, Ending):
                return motion
            settled = motion
        periods = _settling_periods(turns, settled, drive.frequency, within)
        if periods is not None or not settled.speed > 0.0:
            break
    assert settled is not None
    return whole, end, settled, periods


def ramp_answers(columns: Mapping[str, float], tolerance: float) -> bytes:
    """Sums over a short ramp of frequency and load, which load its kernel; the same bytes on every sound processor."""
    length = 20.0 / columns["excitation.frequency"]
    ramps = Ramps(frequency_time=length, load_time=length)
    return _Drive(columns, ramps, SettledRun(tolerance=tolerance), None).run(length, np.empty(0)).sums[0].tobytes()


def _settled(drive: _Drive, whole: _Course, turns: Floats) -> _Settled | Ending:
    """The motion that follows the ramps; of a load that swings with the angle of the shaft, for which none is looked
    for, the mean of the last periods.
    """
    settings = drive.settings
    if drive.values.get(CYCLIC, 0.0) > 0.0:
        last = min(settings.max_period, len(turns) - 1)
        return _Settled("", last, (turns[-1] - turns[-1 - last]) * drive.frequency / last, math.nan)
    state = whole.state.copy()
    starts: Floats | None = state
    if len(drive.stretches) > 1:
        state[:, BEGIN] = drive.stretches[-1].turns % 1.0
        starts, _ = whole_periods(drive.values, settings, state)
    batch = settle(drive.values, settings, cases=1, starts=starts)
    ending, regime = ENDINGS[int(batch.endings[0])], Regime(int(batch.regimes[0]))
    if ending is not Ending.OK:
        return ending
    names = [info.name for info in settled_infos(drive.n)]
    values = dict(zip(names, batch.values[0].tolist(), strict=True))
    # Without a load the shaft coasts at the speed that this start gives it.
    speed = values["shaft.speed.from_rest" if regime is Regime.COASTING else "shaft.speed.mean"]
    window = int(batch.orders[0]) if regime.repeats else settings.max_period
    return _Settled(regime.name.lower(), max(window, 1), speed, values["torque.max"])


def _settling_periods(turns: Floats, settled: _Settled, frequency: float, within: float) -> int | None:
    """Periods from the start until the mean speed stays within its share of the settled one; None where it does not.

    ``turns`` are those of the shaft after each period of the final frequency.
    """
    count = settled.window
    if len(turns) <= count + _STAYS or not settled.speed > 0.0:
        return None
    means = (turns[count:] - turns[:-count]) * frequency / count
    off = np.flatnonzero(~(np.abs(means - settled.speed) <= within * settled.speed))
    first = int(off[-1]) + 1 if off.size else 0
    return first + count if first + _STAYS <= len(means) else None


def _results(
    drive: _Drive, seen: Mapping[str, float], settled: _Settled, until: float, reached: bool
) -> dict[str, float]:
    """Results by name, from the characteristics ``seen`` up to a time in s."""
    results = {
        "time": until if reached else math.nan, "duration": until, "speed.settled": settled.speed,
        "speed.max": seen["shaft.speed.max"], "turn": seen["shaft.turn"],
        "energy.input": seen["power.input.mean"] * until, "energy.useful": seen["power.useful.mean"] * until,
        "energy.loss": seen["power.loss.mean"] * until, "energy.stored": seen["power.stored.mean"] * until,
        "energy.reset": seen["reset.energy_lost"], "balance.energy": seen["balance.energy"],
        "torque.max": seen["torque.max"], "torque.settled": settled.torque,
    }  # fmt: skip
    for i in range(drive.n):
        own = f"pendulums.{i}"
        rate, arm = (drive.values.get(f"{own}.{name}", 0.0) for name in ("spring_rate", "spring_arm"))
        angle = max(seen[f"{own}.angle.max"], -seen[f"{own}.angle.min"])
        results |= {f"{own}.{name}": seen[f"{own}.{name}"] for name in ("torque.max", "windup.max", "engagements")}
        results |= {f"{own}.angle.max": angle, f"{own}.spring.torque.max": rate * arm * arm * angle}
    results["engagements"] = sum(results[f"pendulums.{i}.engagements"] for i in range(drive.n))
    return results
