"""Energy and momentum balances (docs/theory.md, "Characteristics"): they close, and they are computed from the run."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sprag_study.engine.endings import Ending
from sprag_study.engine.run import Reset
from sprag_study.engine.vibration_drive import characteristics as formulas
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import (
    Columns,
    Results,
    batch_of,
    clutch,
    column,
    drive,
    one,
    pendulum,
    periods,
)

DURATION, START = 12.35, 4.0

#: Near stall: the shaft is often held, turns at both ends of the windows used here, and is driven in short pushes.
NEAR_STALL = {"excitation.frequency": 16.0, "shaft.load": 0.6, "shaft.inertia": 5e-4}

#: Fixed examples of whole batches, so that hypothesis's overhead is paid once for many machines.
PROFILE = settings(
    max_examples=4, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck)
)


def random_machines(pendulums: int, seed: int, cases: int) -> list[Columns]:
    """Ordinary machines of every kind: loads from none to stall, clutches with and without jump, data that end."""
    draw = np.random.default_rng(seed)
    out = []
    for case in range(cases):
        columns: Columns = {
            "excitation.frequency": draw.uniform(12.0, 35.0),
            "excitation.amplitude_x": draw.uniform(0.0, 3e-3),
            "excitation.amplitude_y": draw.uniform(0.0, 3e-3),
            "excitation.phase": draw.uniform(-3.0, 3.0),
            "gravity": draw.choice([0.0, 9.80665]),
            "shaft.inertia": draw.uniform(1e-3, 5e-3),
            "shaft.load": draw.choice([0.0, draw.uniform(0.01, 0.8)]),
            "clutch.windup_limit": draw.choice([np.inf, draw.uniform(2e-3, 1e-2)]),
            **clutch(draw.choice([0.0, 0.3]), 200.0, draw.uniform(0.0, 500.0), 2e4),
        }
        for i in range(pendulums):
            columns |= pendulum(
                i,
                arm=draw.uniform(-0.04, 0.04),
                spring_rate=draw.uniform(6e3, 15e3),
                damping=draw.uniform(0.0, 0.02),
                # Without backlash and with a jump clutches can lock, but not in the same case as several of them.
                backlash=draw.uniform(1e-3, 1e-2) if pendulums > 1 or case % 4 else 0.0,
                initial_speed=draw.uniform(-3.0, 3.0),
            )
        out.append(columns)
    return out


@pytest.mark.parametrize("reset", ["contact", "literal"])
@pytest.mark.parametrize("pendulums", [1, 2, 3])
@PROFILE
@given(st.integers(0, 10**6))
def test_balances_close(pendulums: int, reset: Reset, seed: int) -> None:
    cases = random_machines(pendulums, seed, 32)
    results = Results(batch_of(cases), periods(DURATION, START, DURATION, tolerance=1e-9, reset=reset), len(cases))
    assert set(results.endings) == {Ending.OK}
    assert results["balance.energy"].max() < 1e-8
    assert results["balance.momentum"].max() < 1e-8


def _terms(columns: Columns, pendulums: int, samples: int) -> tuple[dict[str, float], dict[str, float]]:
    """The terms of both balances from a dense trajectory alone, by the trapezoidal rule (and energies at its ends)."""
    period = 1.0 / columns["excitation.frequency"]
    times = np.linspace(START * period, DURATION * period, samples)
    path = trajectory(columns, periods(DURATION, START, DURATION), times)

    def integral(values: np.ndarray) -> float:
        return float(np.trapezoid(values, times))

    shaft = column(path, "shaft.speed")
    rotating = np.array([state == "rotating" for state in path.states["shaft"]])
    torque = column(path, "torque")
    law = [columns[f"clutch.coefficients.{k}"] for k in range(4)]
    energy = 0.5 * columns["shaft.inertia"] * shaft**2
    for i in range(pendulums):
        own = {
            name: columns[f"pendulums.{i}.{name}"] for name in ("inertia", "mass", "arm", "spring_rate", "spring_arm")
        }
        phi, speed = column(path, f"pendulums.{i}.angle"), column(path, f"pendulums.{i}.speed")
        u = column(path, f"pendulums.{i}.windup")
        energy = energy + 0.5 * own["inertia"] * speed**2 + own["mass"] * 9.80665 * own["arm"] * np.cos(phi)
        energy = energy + 0.5 * own["spring_rate"] * own["spring_arm"] ** 2 * phi**2
        energy = energy + sum(c * u ** (k + 1) / (k + 1) for k, c in enumerate(law))
    work = {
        "input": integral(column(path, "power.input")),
        "loss": integral(column(path, "power.loss")),
        "useful": columns["shaft.load"] * integral(shaft),
        "stored": float(energy[-1] - energy[0]),
    }
    impulse = {
        "torque": integral(torque),
        "load": columns["shaft.load"] * integral(rotating.astype(float)),
        "shaft": columns["shaft.inertia"] * float(shaft[-1] - shaft[0]),
        "held": integral(np.where(rotating, 0.0, torque)),
    }
    return work, impulse


@pytest.mark.parametrize("pendulums", [1, 2])
def test_terms_agree_with_a_quadrature_of_the_trajectory(pendulums: int) -> None:
    columns = drive(pendulums) | NEAR_STALL
    row = one(columns, periods(DURATION, START, DURATION))
    length = (DURATION - START) / columns["excitation.frequency"]
    work, impulse = _terms(columns, pendulums, 200_001)
    assert row["power.input.mean"] * length == pytest.approx(work["input"], rel=1e-6)
    assert row["power.loss.mean"] * length == pytest.approx(work["loss"], rel=1e-6)
    assert row["power.useful.mean"] * length == pytest.approx(work["useful"], rel=1e-6)
    assert row["torque.mean"] * length == pytest.approx(impulse["torque"], rel=1e-6)
    assert row["fraction.rotating"] * length * columns["shaft.load"] == pytest.approx(impulse["load"], rel=1e-4)
    # The balance of these independent terms, to the accuracy of the quadrature; no term is negligible.
    assert work["input"] - work["loss"] - work["useful"] == pytest.approx(work["stored"], abs=1e-5 * work["input"])
    assert impulse["torque"] - impulse["load"] - impulse["held"] == pytest.approx(
        impulse["shaft"], abs=1e-4 * impulse["torque"]
    )
    assert min(abs(value) / work["input"] for value in work.values()) > 1e-4
    assert min(abs(value) / impulse["torque"] for value in impulse.values()) > 1e-4


@pytest.mark.parametrize(
    ("quantity", "balance"),
    [
        ("energy_2", "balance.energy"),
        ("turn_2", "balance.energy"),
        ("energy_lost", "balance.energy"),
        ("time_rotating", "balance.momentum"),
        ("speed_2", "balance.momentum"),
        ("sum_held", "balance.momentum"),
    ],
)
def test_residuals_tell_when_a_term_is_wrong(monkeypatch: pytest.MonkeyPatch, quantity: str, balance: str) -> None:
    columns = drive(1) | NEAR_STALL
    run = periods(12.45, START, 12.45, reset="literal")
    honest = one(columns, run)
    original = formulas._Cases.shaft

    def wrong(self: object, name: str) -> np.ndarray:
        value = original(self, name)  # type: ignore[arg-type]
        return value * (1.0 + 1e-3) if name == quantity else value

    monkeypatch.setattr(formulas._Cases, "shaft", wrong)
    spoilt = one(columns, run)
    assert honest[balance] < 1e-8
    assert spoilt[balance] > 1e-7


def test_lost_energy_is_what_the_clutch_held_at_a_literal_reset() -> None:
    row = one(drive(1) | NEAR_STALL, periods(DURATION, START, DURATION, reset="literal"))
    assert row["reset.energy_lost"] > 0.0
    assert one(drive(1) | NEAR_STALL, periods(DURATION, START, DURATION))["reset.energy_lost"] == 0.0


def test_a_machine_at_rest_has_balanced_books() -> None:
    row = one(drive(1, excitation__amplitude_x=0.0, excitation__amplitude_y=0.0), periods(4.0, 0.0, 4.0))
    assert row["balance.energy"] == row["balance.momentum"] == 0.0


def test_a_motion_that_has_died_away_is_not_judged_against_nothing() -> None:
    """Damped hard and not driven across, the drive keeps a motion of rounding; its balance is closed all the same."""
    columns = drive(1, excitation__amplitude_x=0.0, excitation__amplitude_y=1e-4)
    columns |= {"pendulums.0.initial_angle": 0.3, "pendulums.0.damping": 0.3}
    angles = [Results(columns, periods(end, end - 2.0, end), 1) for end in (4.0, 6.0, 8.0, 12.0, 20.0, 60.0)]
    assert angles[-1]["pendulums.0.angle.max"][0] < 1e-12
    assert max(float(results["balance.energy"][0]) for results in angles) < 1e-6
