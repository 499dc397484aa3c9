"""Cases with a known answer (docs/theory.md, "Checks with known answers"), worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sprag_study.engine.run import Run, Span
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import Columns, clutch, column, drive, one, pendulum, periods

G = 9.80665
#: A backlash that nothing reaches: the clutch never transmits torque.
NEVER = 1000.0


def swinging(**changes: float) -> Columns:
    """A pendulum whose clutch never engages, beside a shaft at rest."""
    return {
        "excitation.frequency": 20.0, "shaft.inertia": 2e-3, "shaft.load": 1.0, **clutch(0.0, 200.0),
        **pendulum(0, backlash=NEVER),
    } | changes  # fmt: skip


# 1. Forced small oscillation.


@pytest.mark.parametrize("frequency", [12.0, 20.0, 31.0])
def test_forced_small_oscillation(frequency: float) -> None:
    j, m, arm, stiffness, damping, d = 1e-3, 0.5, 0.03, 9000.0 * 0.05**2, 0.05, 1e-8
    nu = 2.0 * math.pi * frequency
    amplitude = m * arm * d * nu**2 / math.hypot(stiffness - m * G * arm - j * nu**2, damping * nu)
    columns = swinging() | {
        "excitation.frequency": frequency, "excitation.amplitude_x": d, "pendulums.0.damping": damping,
    }  # fmt: skip
    # The transient decays as exp(-25 t): 1e-13 of it is left after 1.2 s. Nonlinear terms are of the order amplitude^2.
    start = math.ceil(1.2 * frequency)
    row = one(columns, periods(start + 4.0, start, start + 4.0, tolerance=1e-9))
    assert amplitude**2 < 1e-9
    assert row["pendulums.0.angle.amplitude"] == pytest.approx(amplitude, rel=1e-8)
    assert row["pendulums.0.speed.max"] == pytest.approx(amplitude * nu, rel=1e-8)
    assert row["pendulums.0.acceleration.max"] == pytest.approx(amplitude * nu**2, rel=1e-8)
    assert row["power.input.mean"] == pytest.approx(damping * nu**2 * amplitude**2 / 2.0, rel=1e-8)
    assert row["power.loss.mean"] == pytest.approx(damping * nu**2 * amplitude**2 / 2.0, rel=1e-8)
    assert row["torque.max"] == row["shaft.speed.max"] == row["efficiency"] == 0.0


# 2. Free decay.


@pytest.mark.parametrize(("arm", "damping"), [(0.03, 0.01), (0.03, 0.1), (-0.03, 0.02)])
def test_free_decay(arm: float, damping: float) -> None:
    j, start = 1e-3, 1e-6
    rate = damping / (2.0 * j)
    omega = math.sqrt((9000.0 * 0.05**2 - 0.5 * G * arm) / j - rate**2)
    columns = swinging() | {
        "pendulums.0.arm": arm, "pendulums.0.damping": damping, "pendulums.0.initial_angle": start,
    }  # fmt: skip
    times = np.linspace(0.0, 0.25, 41)
    path = trajectory(columns, Run(duration=Span(0.25, "s"), tolerance=1e-9), times)
    decay = start * np.exp(-rate * times)
    angle = decay * (np.cos(omega * times) + rate / omega * np.sin(omega * times))
    speed = -decay * (omega + rate**2 / omega) * np.sin(omega * times)
    np.testing.assert_allclose(column(path, "pendulums.0.angle"), angle, rtol=0, atol=1e-10 * start)
    np.testing.assert_allclose(column(path, "pendulums.0.speed"), speed, rtol=0, atol=1e-10 * start * omega)


# 3. Kapitza's pendulum: no spring, vertical vibration, point mass on 0.1 m at 50 Hz, g = 9.81 m/s^2.

ARM, FREQUENCY, ROUND_G = 0.1, 50.0, 9.81
NU = 2.0 * math.pi * FREQUENCY


def kapitza(b: float, start: float) -> Columns:
    """The inverted pendulum without friction."""
    return {
        "gravity": ROUND_G, "excitation.frequency": FREQUENCY, "excitation.amplitude_y": b,
        "shaft.inertia": 1.0, "shaft.load": 1.0, **clutch(1.0),
        **pendulum(0, inertia=1.0 * ARM**2, mass=1.0, arm=ARM, spring_rate=0.0, damping=0.0, backlash=NEVER,
                   initial_angle=start),
    }  # fmt: skip


def growth_of_kapitza(b: float) -> float:
    """Half the trace of one period's linear map, by two runs: above 1 the upright position is unstable."""
    small = 1e-7
    period = np.array([1.0 / FREQUENCY])
    run = periods(1.0, 0.0, 1.0, tolerance=1e-9)
    by_angle = trajectory(kapitza(b, small), run, period)
    by_speed = trajectory(kapitza(b, 0.0) | {"pendulums.0.initial_speed": small * NU}, run, period)
    first = column(by_angle, "pendulums.0.angle")[0] / small
    second = column(by_speed, "pendulums.0.speed")[0] / (small * NU)
    return 0.5 * float(first + second)


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_a_base_at_rest_drives_nothing(gravity: float) -> None:
    """Not even by rounding: what is supplied is exactly nothing, and there is no efficiency."""
    machine = drive(1, gravity=gravity, excitation__amplitude_x=0.0, excitation__amplitude_y=0.0)
    for speed, load in ((3.0, 0.02), (8.0, 0.02), (11.0, 0.2)):
        row = one(machine | {"pendulums.0.initial_speed": speed, "shaft.load": load}, periods(8.0, 0.0, 8.0))
        assert row["power.input.mean"] == 0.0
        assert math.isnan(row["efficiency"])
        assert row["power.clutch.mean"] > 0.0


def test_kapitza_thresholds() -> None:
    averaged = math.sqrt(2.0 * ROUND_G * ARM) / NU
    assert averaged == pytest.approx(4.45861e-3, abs=5e-9)
    assert growth_of_kapitza(4.46055e-3 - 1e-8) > 1.0
    assert growth_of_kapitza(4.46055e-3 + 1e-8) < 1.0
    # At the averaged threshold itself the pendulum still falls.
    assert growth_of_kapitza(averaged) > 1.0


@pytest.mark.parametrize(("b", "stays"), [(4.42e-3, False), (4.52e-3, True)])
def test_kapitza_falls_or_stays(b: float, stays: bool) -> None:
    row = one(kapitza(b, 1e-4), periods(400.0, 0.0, 400.0, tolerance=1e-9))
    largest = max(row["pendulums.0.angle.max"], -row["pendulums.0.angle.min"])
    assert (largest < 0.01) == stays


# 4. Parametric form x'' + 0.1 x' + (1 + p cos 2t) sin x = 0.


def parametric(p: float, angle: float, speed: float = 0.0) -> Columns:
    """A hanging pendulum with J = M = g = 1, l = -1 and b nu^2 = p, nu = 2, chi = -pi/2 (y'' = b nu^2 cos nu t)."""
    return {
        "gravity": 1.0, "excitation.frequency": 1.0 / math.pi, "excitation.amplitude_y": p / 4.0,
        "excitation.phase": -math.pi / 2.0, "shaft.inertia": 1.0, "shaft.load": 1.0, **clutch(1.0),
        **pendulum(0, inertia=1.0, mass=1.0, arm=-1.0, spring_rate=0.0, damping=0.1, backlash=NEVER,
                   initial_angle=angle, initial_speed=speed),
    }  # fmt: skip


def largest_multiplier(p: float) -> float:
    """Largest modulus of a Floquet multiplier of the rest position, from the engine's own period map."""
    small = 1e-7
    period = np.array([math.pi])
    run = periods(1.0, 0.0, 1.0, tolerance=1e-9)
    columns = [trajectory(parametric(p, small), run, period), trajectory(parametric(p, 0.0, small), run, period)]
    matrix = [[column(c, f"pendulums.0.{name}")[0] / small for c in columns] for name in ("angle", "speed")]
    return float(np.abs(np.linalg.eigvals(np.array(matrix))).max())


def test_parametric_threshold() -> None:
    assert largest_multiplier(0.20011 - 2e-5) < 1.0
    assert largest_multiplier(0.20011 + 2e-5) > 1.0


def test_parametric_motion_against_the_equation_itself() -> None:
    times = np.linspace(0.0, 20.0 * math.pi, 101)
    solution = solve_ivp(
        lambda t, x: [x[1], -0.1 * x[1] - (1.0 + 0.3 * math.cos(2.0 * t)) * math.sin(x[0])],
        (0.0, times[-1]), [1.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    path = trajectory(parametric(0.3, 1.0), periods(20.0, 0.0, 20.0, tolerance=1e-9), times)
    np.testing.assert_allclose(column(path, "pendulums.0.angle"), solution.y[0], rtol=0, atol=1e-8)


# 5. Capture of a free shaft by one pendulum, weightless and without spring.

J, J_E, W0 = 1e-3, 2e-3, 10.0
#: One period is long enough for flight and contact.
RATE = 40.0
REDUCED = J * J_E / (J + J_E)


def capture(backlash: float, *law: float) -> dict[str, float]:
    """One push: the pendulum flies at W0 onto the shaft at rest, which nothing loads."""
    columns = {
        "gravity": 0.0, "excitation.frequency": RATE, "shaft.inertia": J_E, "shaft.load": 0.0, **clutch(*law),
        **pendulum(0, inertia=J, mass=0.0, arm=0.0, spring_rate=0.0, damping=0.0, backlash=backlash, initial_speed=W0),
    }  # fmt: skip
    return one(columns, periods(1.0, 0.0, 1.0))


@pytest.mark.parametrize("backlash", [0.0, 1e-3, 0.05])
def test_capture_by_a_linear_clutch(backlash: float) -> None:
    k = 200.0
    row = capture(backlash, 0.0, k)
    assert row["pendulums.0.speed.min"] == pytest.approx(W0 * (J - J_E) / (J + J_E), rel=1e-9)
    assert row["shaft.speed.max"] == pytest.approx(2.0 * J * W0 / (J + J_E), rel=1e-9)
    assert row["torque.max"] == pytest.approx(W0 * math.sqrt(k * REDUCED), rel=1e-9)
    assert row["pendulums.0.engagements"] == 1.0
    assert row["run.events"] == (1.0 if backlash == 0.0 else 2.0)
    # The contact lasts half a period of the reduced oscillator.
    assert row["fraction.driven"] == pytest.approx(RATE * math.pi * math.sqrt(REDUCED / k), rel=1e-9)
    assert row["torque.mean"] == pytest.approx(RATE * J_E * row["shaft.speed.max"], rel=1e-9)


@pytest.mark.parametrize(
    "law", [(0.0, 200.0), (0.5, 200.0), (0.0, 0.0, 3e3), (0.0, 50.0, 0.0, 2e5), (1.0, 10.0, 100.0, 1e4)]
)
def test_capture_winds_every_law_up_to_the_kinetic_energy(law: tuple[float, ...]) -> None:
    row = capture(2e-3, *law)
    u = row["pendulums.0.windup.max"]
    stored = sum(c * u ** (k + 1) / (k + 1) for k, c in enumerate(law))
    assert stored == pytest.approx(REDUCED * W0**2 / 2.0, rel=5e-9)
    assert row["torque.max"] == pytest.approx(sum(c * u**k for k, c in enumerate(law)), rel=1e-9)
    assert row["shaft.speed.max"] == pytest.approx(2.0 * J * W0 / (J + J_E), rel=1e-9)


def test_capture_beyond_the_data_goes_on_straight() -> None:
    limit, k, cubic = 5e-3, 50.0, 2e5
    columns = {
        "gravity": 0.0, "excitation.frequency": RATE, "shaft.inertia": J_E, "shaft.load": 0.0,
        **clutch(0.0, k, 0.0, cubic), "clutch.windup_limit": limit,
        **pendulum(0, inertia=J, mass=0.0, arm=0.0, spring_rate=0.0, damping=0.0, backlash=0.0, initial_speed=W0),
    }  # fmt: skip
    row = one(columns, periods(1.0, 0.0, 1.0))
    end, rate = k * limit + cubic * limit**3, k + 3.0 * cubic * limit**2
    over = row["pendulums.0.windup.max"] - limit
    stored = k * limit**2 / 2.0 + cubic * limit**4 / 4.0 + end * over + rate * over**2 / 2.0
    assert over > 0.0
    assert row["torque.max"] == pytest.approx(end + rate * over, rel=1e-9)
    assert stored == pytest.approx(REDUCED * W0**2 / 2.0, rel=5e-9)
    assert 0.0 < row["pendulums.0.fraction.beyond_data"] < row["pendulums.0.fraction.engaged"]


def test_a_load_that_holds_the_shaft_returns_the_pendulum() -> None:
    # The clutch is then a spring against a wall: the pendulum comes back as fast as it went.
    columns = {
        "gravity": 0.0, "excitation.frequency": RATE, "shaft.inertia": J_E, "shaft.load": 50.0, **clutch(0.0, 200.0),
        **pendulum(0, inertia=J, mass=0.0, arm=0.0, spring_rate=0.0, damping=0.0, backlash=0.01, initial_speed=W0),
    }  # fmt: skip
    row = one(columns, periods(1.0, 0.0, 1.0))
    assert row["torque.max"] == pytest.approx(W0 * math.sqrt(200.0 * J), rel=1e-9)
    assert row["pendulums.0.speed.min"] == pytest.approx(-W0, rel=1e-9)
    assert row["fraction.held"] == 1.0
    assert row["shaft.turn"] == 0.0
