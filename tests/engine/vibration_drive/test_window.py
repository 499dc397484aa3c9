"""Characteristics over a window: maxima, minima and means are those of the continuous solution, wherever it lies."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine.outcome import Trajectory
from sprag_study.engine.run import Run, Span
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, clutch, column, drive, one, periods

EXTREMA = {
    "shaft.speed.max": "shaft.speed",
    "shaft.speed.min": "shaft.speed",
    "shaft.acceleration.max": "shaft.acceleration",
    "torque.max": "torque",
    "power.useful.max": "power.useful",
    "power.clutch.max": "power.clutch",
} | {
    f"pendulums.0.{name}": f"pendulums.0.{quantity}"
    for name, quantity in (
        ("angle.max", "angle"), ("angle.min", "angle"), ("speed.max", "speed"), ("speed.min", "speed"),
        ("acceleration.max", "acceleration"), ("acceleration.min", "acceleration"), ("torque.max", "torque"),
        ("windup.max", "windup"),
    )
}  # fmt: skip


def machines() -> list[Columns]:
    """Machines with few and many, weak and violent contacts."""
    draw = np.random.default_rng(11)
    return [
        drive(
            1,
            excitation__frequency=draw.uniform(12.0, 36.0),
            excitation__amplitude_x=draw.uniform(1e-3, 4e-3),
            excitation__phase=draw.uniform(-3.0, 3.0),
            shaft__load=draw.uniform(0.0, 0.6),
            pendulums__0__backlash=draw.choice([0.0, 0.004]),
            **{"clutch.coefficients.1": draw.uniform(100.0, 3000.0)},
        )
        for _ in range(12)
    ]


def _sample(columns: Columns, start: float, end: float, points: int, duration: float) -> Trajectory:
    period = 1.0 / columns["excitation.frequency"]
    times = np.linspace(start * period, end * period, points)
    return trajectory(columns, periods(duration, 0.0, duration), times)


def _refined(columns: Columns, name: str, rough: Trajectory, duration: float) -> float:
    """The extremum of a variable by sampling, then by ever finer sampling about the best sample."""
    sign = -1.0 if name.endswith("min") else 1.0
    best = -math.inf
    frequency = columns["excitation.frequency"]
    path, low, high = rough, rough.times[0], rough.times[-1]
    for _ in range(3):
        values = sign * column(path, EXTREMA[name])
        k = int(np.argmax(values))
        best = max(best, float(values[k]))
        low, high = path.times[max(0, k - 1)], path.times[min(len(values) - 1, k + 1)]
        path = _sample(columns, low * frequency, high * frequency, 201, duration)
    return sign * best


@pytest.mark.parametrize("case", range(12))
def test_extrema_are_those_of_the_trajectory(case: int) -> None:
    columns = machines()[case]
    start, end = 3.37, 7.81
    row = one(columns, periods(8.0, start, end))
    rough = _sample(columns, start, end, 20_001, 8.0)
    for name in EXTREMA:
        expected = _refined(columns, name, rough, 8.0)
        scale = max(abs(row[name.replace("min", "max")]), 1e-9)
        assert row[name] == pytest.approx(expected, rel=0, abs=5e-9 * scale), name


@pytest.mark.parametrize("case", range(0, 12, 3))
def test_means_are_those_of_the_trajectory(case: int) -> None:
    columns = machines()[case]
    start, end = 3.37, 7.81
    row = one(columns, periods(8.0, start, end))
    path = _sample(columns, start, end, 40_001, 8.0)
    means = {
        "shaft.speed.mean": "shaft.speed", "torque.mean": "torque", "power.useful.mean": "power.useful",
        "power.clutch.mean": "power.clutch", "power.input.mean": "power.input", "power.loss.mean": "power.loss",
        "pendulums.0.angle.mean": "pendulums.0.angle", "pendulums.0.power.input": "pendulums.0.power.input",
    }  # fmt: skip
    for name, variable in means.items():
        values = column(path, variable)
        expected = np.trapezoid(values, path.times) / (path.times[-1] - path.times[0])
        assert row[name] == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(values).max()), name
    engaged = np.array([state in ("engaged", "beyond", "locked") for state in path.states["pendulums.0"]])
    rotating = np.array([state == "rotating" for state in path.states["shaft"]])
    assert row["fraction.driven"] == pytest.approx(engaged.mean(), abs=2e-3)
    assert row["pendulums.0.fraction.engaged"] == row["fraction.driven"]
    assert row["fraction.rotating"] == pytest.approx(rotating.mean(), abs=2e-3)
    assert row["pendulums.0.engagements"] == np.count_nonzero(engaged[1:] & ~engaged[:-1])


def _windows(columns: Columns, *edges: float) -> list[dict[str, float]]:
    """Results over adjoining windows, then over all of them together."""
    spans = [*itertools.pairwise(edges), (edges[0], edges[-1])]
    return [one(columns, periods(12.0, start, end)) for start, end in spans]


@pytest.mark.parametrize("case", range(4))
def test_windows_add_up(case: int) -> None:
    columns = machines()[case]
    edges = (2.123, 5.0, 5.4567, 9.99)
    *parts, whole = _windows(columns, *edges)
    lengths = np.diff(edges) / columns["excitation.frequency"]
    for name in ("shaft.turn", "pendulums.0.engagements"):
        assert sum(part[name] for part in parts) == pytest.approx(whole[name], rel=1e-9)
    for name in ("torque.mean", "power.input.mean", "power.loss.mean", "fraction.driven", "fraction.rotating"):
        total = sum(part[name] * length for part, length in zip(parts, lengths, strict=True))
        assert total == pytest.approx(whole[name] * lengths.sum(), rel=1e-8)
    for name in EXTREMA:
        pick = max if name.endswith("max") else min
        assert pick(part[name] for part in parts) == pytest.approx(whole[name], rel=1e-9, abs=1e-12)
    assert {part["run.events"] for part in parts} == {whole["run.events"]}


@pytest.mark.parametrize("frequency", [20.0, 17.3])
def test_seconds_are_as_good_as_periods(frequency: float) -> None:
    columns = drive(1, excitation__frequency=frequency)
    by_periods = one(columns, periods(10.0, 4.5, 9.25))
    seconds = Run(
        duration=Span(10.0 / frequency, "s"), window=(Span(4.5 / frequency, "s"), Span(9.25 / frequency, "s"))
    )
    by_seconds = one(columns, seconds)
    assert by_seconds == {name: pytest.approx(value, rel=1e-9, nan_ok=True) for name, value in by_periods.items()}


def test_default_window_is_the_last_third() -> None:
    columns = drive(1)
    by_default = one(columns, Run(duration=Span(12.0)))
    named = one(columns, periods(12.0, 8.0, 12.0))
    assert by_default == named


def test_window_over_the_whole_run() -> None:
    row = one(drive(1), periods(10.0, 0.0, 10.0))
    assert row["shaft.speed.min"] == 0.0
    assert row["pendulums.0.angle.max"] > 0.0 > row["pendulums.0.angle.min"]
    assert row["shaft.turn"] == pytest.approx(row["shaft.speed.mean"] * 10.0 / 20.0)
    path = _sample(drive(1), 0.0, 10.0, 3, 10.0)
    assert row["shaft.turn"] == pytest.approx(column(path, "shaft.angle")[-1], rel=1e-12)


def test_short_windows_have_no_efficiency() -> None:
    short = one(drive(1), periods(10.0, 8.1, 8.9))
    assert math.isnan(short["efficiency"])
    assert short["shaft.speed.mean"] > 0.0


def test_efficiency_is_taken_over_the_last_whole_periods() -> None:
    columns = drive(1)
    ragged = one(columns, periods(12.0, 5.3, 11.0))
    whole = one(columns, periods(12.0, 6.0, 11.0))
    assert ragged["efficiency"] == pytest.approx(whole["efficiency"], rel=1e-9)
    assert whole["efficiency"] == pytest.approx(whole["power.useful.mean"] / whole["power.input.mean"], rel=1e-9)


def test_irregularity_and_fractions() -> None:
    row = one(drive(1, shaft__load=0.6), periods(12.0, 4.0, 12.0))
    spread = row["shaft.speed.max"] - row["shaft.speed.min"]
    assert row["shaft.irregularity"] == pytest.approx(spread / row["shaft.speed.mean"], rel=1e-12)
    assert row["fraction.rotating"] + row["fraction.held"] == pytest.approx(1.0, abs=1e-15)
    assert 0.0 < row["fraction.held"] < 1.0


def test_a_shaft_that_never_turns_has_no_irregularity_and_no_run_up() -> None:
    row = one(drive(1, shaft__load=100.0), periods(6.0, 2.0, 6.0))
    assert row["fraction.held"] == 1.0
    assert math.isnan(row["shaft.irregularity"])
    assert math.isnan(row["runup.time"])
    assert row["shaft.speed.max"] == row["shaft.turn"] == row["efficiency"] == 0.0


def _period_means(columns: Columns, duration: int) -> NDArray[np.float64]:
    path = _sample(columns, 0.0, float(duration), duration + 1, float(duration))
    return np.diff(column(path, "shaft.angle"), prepend=0.0)[1:] * columns["excitation.frequency"]


@pytest.mark.parametrize("load", [0.02, 0.1])
def test_run_up_time(load: float) -> None:
    columns, duration = drive(1, shaft__load=load), 40
    row = one(columns, periods(float(duration), 30.0, float(duration)))
    means = np.concatenate([[0.0], _period_means(columns, duration)])
    k = int(np.flatnonzero(means >= 0.95 * means[-1])[0])
    share = (0.95 * means[-1] - means[k - 1]) / (means[k] - means[k - 1])
    assert row["runup.time"] == pytest.approx((k - 1 + share) / columns["excitation.frequency"], rel=1e-6)


def test_a_shaft_already_turning_has_no_run_up() -> None:
    assert math.isnan(one(drive(1, shaft__initial_speed=1.0), periods(6.0, 2.0, 6.0))["runup.time"])


def test_several_clutches() -> None:
    row = one(drive(2), periods(12.0, 4.0, 12.0))
    assert row["torque.mean"] == pytest.approx(row["pendulums.0.torque.mean"] + row["pendulums.1.torque.mean"])
    assert row["power.input.mean"] == pytest.approx(row["pendulums.0.power.input"] + row["pendulums.1.power.input"])
    assert row["torque.max"] <= row["pendulums.0.torque.max"] + row["pendulums.1.torque.max"]
    assert row["clutches.driving_max"] in (1.0, 2.0)
    engagements = row["pendulums.0.engagements"] + row["pendulums.1.engagements"]
    assert row["clutches.engagements_per_period"] == pytest.approx(engagements / 8.0)
    fractions = [row[f"pendulums.{i}.fraction.engaged"] for i in range(2)]
    assert max(fractions) <= row["fraction.driven"] <= sum(fractions) + 1e-12


def test_windows_of_a_batch_in_seconds_differ_in_periods() -> None:
    cases = [drive(1, excitation__frequency=f) for f in (15.0, 20.0, 31.0)]
    run = Run(duration=Span(0.5, "s"), window=(Span(0.2, "s"), Span(0.45, "s")))
    results = Results(batch_of(cases), run, 3)
    for case, columns in enumerate(cases):
        assert results.row(case) == pytest.approx(one(columns, run), nan_ok=True)
        path = trajectory(columns, run, np.array([0.2, 0.45]))
        turn = np.diff(column(path, "shaft.angle"))[0]
        assert results["shaft.turn"][case] == pytest.approx(turn, rel=1e-10)


def test_law_with_a_jump_counts_its_torque_from_the_first_moment() -> None:
    # A hard push that only the jump c_1 answers: the torque is c_1 or a little above from the start of every contact.
    row = one(drive(1) | clutch(0.8, 1e-6), periods(12.0, 4.0, 12.0))
    assert row["torque.max"] == pytest.approx(0.8, abs=1e-6)
    assert row["torque.mean"] == pytest.approx(0.8 * row["fraction.driven"], rel=1e-6)
