"""Start-ups with ramps of frequency and load, against an independent automaton, scipy and the run without ramps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.ramps import Ramps
from sprag_study.engine.vibration_drive.simulate import trajectory
from sprag_study.engine.vibration_drive.start_up import _Drive, start_up
from tests.engine.vibration_drive.drive import Columns, clutch, drive, one, pendulum, periods
from tests.engine.vibration_drive.reference_equations import Floats, sine_and_cosine
from tests.engine.vibration_drive.reference_run import Drive

SETTINGS = SettledRun(tolerance=1e-10)
#: Terms of the load that are no polynomial, harmonics, and a clutch that locks.
RICH: Columns = {
    "shaft.linear_load": 0.002, "shaft.quadratic_load": 1e-4, "shaft.bearing_damping": 1e-3,
    "shaft.stribeck_load": 0.05, "shaft.stribeck_speed": 2.0, "shaft.cyclic_load": 0.5, "shaft.load_cycles": 3.0,
    "shaft.load_phase": 0.4,
    **{f"shaft.load_table.{k}.{name}": value for k, row in enumerate(((0.0, 0.05), (2.0, 0.02), (9.0, 0.1)))
       for name, value in zip(("speed", "torque"), row, strict=True)},
    **{f"excitation.harmonics.0.{name}": value for name, value in (
        ("order", 2.0), ("amplitude_x", 3e-4), ("phase_x", 0.5), ("amplitude_y", 2e-4), ("phase_y", 1.0))},
    **clutch(0.05, 200.0, 0.0, 2e4), **pendulum(backlash=0.0, clutch_damping=0.02, overrunning_damping=1e-4),
    "excitation.phase": 0.7,
}  # fmt: skip


class RampedDrive(Drive):
    """The independent drive with ramps: the base's accelerations are second derivatives of its displacement, the load
    has a factor; the time is one more of its variables."""

    def __init__(self, columns: Columns, ramps: Ramps) -> None:
        super().__init__(columns, literal=False)
        self.ramps, self.now = ramps, 0.0
        self.start = np.append(self.start, 0.0)

    def excited(self, t: Any) -> tuple[Any, Any, Any]:
        """theta and its derivatives."""
        end, first = self.ramps.frequency_time, 2.0 * math.pi * self.ramps.start_frequency
        slope = (self.nu - first) / end if end else 0.0
        within = t <= end if isinstance(t, float) else np.mean(t) <= end
        if end and within:
            return first * t + 0.5 * slope * t**2, first + slope * t, slope
        return 0.5 * (first + self.nu) * end + self.nu * (t - end), self.nu, 0.0

    def base(self, t: Any) -> tuple[Any, Any]:
        sin, cos = sine_and_cosine(t)
        theta, rate, slope = self.excited(t)
        x = y = 0.0 * t
        for m, along, phase_x, upright, phase_y in ((1.0, self.d, 0.0, self.b, self.chi), *self.overtones):
            turned = m * theta
            x = x - along * (m * slope * sin(turned + phase_x) + (m * rate) ** 2 * cos(turned + phase_x))
            y = y + upright * (m * slope * cos(turned + phase_y) - (m * rate) ** 2 * sin(turned + phase_y))
        return x, y

    def useful(self, speed: Any, angle: Any) -> Any:
        end = self.ramps.load_time
        risen = np.minimum(self.now / end, 1.0) if end else 1.0
        return risen * super().useful(speed, angle)

    def holds(self, y: Any) -> Any:
        self.now = y[-1]
        return super().holds(y)

    def torques(self, t: Any, y: Any) -> tuple[list[Any], Any]:
        self.now = y[-1]
        return super().torques(t, y)

    def rates(self, t: float, state: Floats) -> Floats:
        out = super().rates(t, state)
        out[-1] = 1.0
        return out


def compare(columns: Columns, ramps: Ramps, count: int) -> None:
    """Both over so many periods of the final frequency: states after each, and what they did on the way."""
    machine = RampedDrive(columns, ramps)
    reference = machine.run(count, (0, count))
    times = np.arange(1, count + 1) / columns["excitation.frequency"]
    course = _Drive(columns, ramps, SETTINGS, None)
    seen = course.run(times[-1], times)
    expected = np.array(reference.values)
    columns_of = [seen.motion.names.index(name) for name in ("pendulums.0.angle", "pendulums.0.speed", "shaft.speed")]
    both = seen.motion.values[:, columns_of], expected[:, [0, 1, machine.shaft]]
    assert np.max(np.abs(both[0] - both[1]), axis=0) == pytest.approx(np.zeros(3), abs=1e-8)
    results = course.characteristics(seen.sums, float(times[-1]))
    for name, value in reference.mean.items():
        assert results[name] == pytest.approx(value, rel=1e-7, abs=1e-9), name
    for name in ("torque.max", "shaft.speed.max", "pendulums.0.angle.max"):
        assert results[name] == pytest.approx(reference.largest[name], rel=1e-7), name
    assert results["pendulums.0.engagements"] == machine.window_engagements
    assert results["balance.energy"] < 1e-9
    assert results["balance.momentum"] < 1e-9


def test_a_ramp_of_the_frequency_and_of_the_load_agree_with_an_independent_automaton() -> None:
    period = 0.05
    compare(drive(), Ramps(6 * period, 0.0, 9 * period), 12)


def test_every_load_every_harmonic_and_a_lock_are_ramped() -> None:
    columns = {**drive(), **RICH}
    compare(columns, Ramps(8 * 0.05, 4.0, 8 * 0.05), 8)


def test_without_a_ramp_it_is_the_run_bit_for_bit() -> None:
    times = np.linspace(0.0, 2.0, 301)
    motion = _Drive(drive(), Ramps(), SETTINGS, None).run(2.0, times).motion
    plain = trajectory(drive(), periods(40, 0, 40, tolerance=1e-10), times)
    assert motion.names == ("excitation.frequency", "load.factor", *plain.names)
    assert np.array_equal(motion.values[:, 2:], plain.values)
    assert motion.states == plain.states
    assert np.all(motion.values[:, :2] == [20.0, 1.0])


@pytest.mark.parametrize("ramps", [Ramps(0.51, 20.0), *(Ramps(0.05 * k, 0.0, 0.35) for k in range(1, 12, 2))])
def test_every_time_is_met_whatever_the_ends_of_the_ramps_are(ramps: Ramps) -> None:
    times = np.arange(25) / 20.0
    motion = _Drive(drive(), ramps, SETTINGS, None).run(times[-1], times).motion
    assert motion.times.tolist() == times.tolist()
    assert np.all(np.diff(motion.values[:, motion.names.index("shaft.angle")]) >= 0.0)


def test_it_ends_where_the_mean_speed_of_each_turn_stays_at_the_settled_one() -> None:
    made = start_up(drive(), Ramps(0.5), SETTINGS, 400)
    times = np.arange(71) / 20.0
    motion = _Drive(drive(), Ramps(0.5), SETTINGS, None).run(times[-1], times).motion
    means = np.diff(motion.values[:, motion.names.index("shaft.angle")]) * 20.0
    settled = one(drive(), periods(400, 300, 400))["shaft.speed.mean"]
    off = np.flatnonzero(np.abs(means - settled) > 0.02 * settled)
    assert made.reached
    assert made.results["speed.settled"] == pytest.approx(settled, rel=1e-6)
    assert made.results["time"] == pytest.approx((off[-1] + 2) / 20.0)
    assert made.motion.times[-1] == pytest.approx(made.results["time"] + 0.5)
    stalled = start_up(drive(shaft__load=50.0), Ramps(0.5), SETTINGS, 20)
    assert (stalled.reached, stalled.results["speed.settled"]) == (False, 0.0)
    assert math.isnan(stalled.results["time"])


def test_through_the_resonance_of_a_pendulum_as_scipy_goes() -> None:
    """A clutch that never engages: a forced oscillator whose frequency passes its own, 24 Hz, within 40 periods."""
    columns = drive(excitation__frequency=40.0, **{"excitation.amplitude_x": 1e-4, "excitation.amplitude_y": 0.0})
    columns |= pendulum(backlash=10.0, damping=0.02)
    ramp, nu = 1.0123, 2.0 * math.pi * 40.0
    slope = (nu - 2.0 * math.pi * 4.0) / ramp

    def rates(t: float, y: Floats) -> list[float]:
        theta, rate, bend = 8.0 * math.pi * t + 0.5 * slope * t**2, 8.0 * math.pi + slope * t, slope
        if t > ramp:
            theta, rate, bend = (8.0 * math.pi + nu) * ramp / 2.0 + nu * (t - ramp), nu, 0.0
        x = -1e-4 * (rate**2 * math.cos(theta) + bend * math.sin(theta))
        moment = 0.015 * (x * math.cos(y[0]) + 9.80665 * math.sin(y[0]))
        return [y[1], (moment - 22.5 * y[0] - 0.02 * y[1]) / 1e-3]

    times = np.linspace(0.0, ramp + 0.2, 300)
    y, seen = np.zeros(2), []
    for part in (times[times <= ramp], times[times > ramp]):
        begin, end = (0.0, ramp) if part[0] == 0.0 else (ramp, times[-1])
        solved = solve_ivp(rates, (begin, end), y, "DOP853", part, rtol=1e-12, atol=1e-14)
        seen.append(solved.y[0])
        y = solve_ivp(rates, (begin, end), y, "DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    expected = np.concatenate(seen)
    angle = _Drive(columns, Ramps(ramp, 4.0), SETTINGS, None).run(times[-1], times).motion
    values = angle.values[:, angle.names.index("pendulums.0.angle")]
    forced = 0.015 * 1e-4 * nu**2 / abs(22.5 - 0.015 * 9.80665 - 1e-3 * nu**2)
    assert np.max(np.abs(expected)) > 2.5 * forced
    assert np.max(np.abs(values - expected)) < 1e-8 * np.max(np.abs(expected))
