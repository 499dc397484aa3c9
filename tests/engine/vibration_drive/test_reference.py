"""Published and independently computed cases (tests/data/reference)."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, clutch, pendulum, periods

DATA = Path(__file__).resolve().parents[2] / "data" / "reference"
DRIVE = json.loads((DATA / "vibration_drive.json").read_text(encoding="utf-8"))
LONG = json.loads((DATA / "long_run.json").read_text(encoding="utf-8"))
GROUPS = {"one_pendulum": 1, "two_pendulums": 2}
CASES = [(group, position) for group in GROUPS for position in range(len(DRIVE[group]))]


def _columns(case: dict[str, Any], pendulums: int) -> Columns:
    base = DRIVE["base"]
    own = base["pendulum"]
    columns: Columns = {
        "gravity": base["g"],
        "excitation.frequency": case["excitation_angular_frequency"] / (2.0 * math.pi),
        "excitation.amplitude_x": case["amplitude"],
        "excitation.amplitude_y": case["amplitude"],
        "excitation.phase": base["phase"],
        "shaft.inertia": base["shaft_inertia"],
        "shaft.load": case["load"],
        **clutch(*base["clutch_coefficients"]),
        **pendulum(0, **own),
    }
    if pendulums == 2:
        columns |= pendulum(1, **(own | {"spring_rate": base["second_pendulum_spring_rate"]}))
    return columns


@pytest.fixture(scope="module")
def computed() -> dict[str, Results]:
    """Every case of each group, in one batch a group."""
    start, end = DRIVE["base"]["window_periods"]
    run = periods(DRIVE["base"]["duration_periods"], start, end, tolerance=1e-9)
    return {
        group: Results(batch_of([_columns(case, count) for case in DRIVE[group]]), run, len(DRIVE[group]))
        for group, count in GROUPS.items()
    }


def _value(row: dict[str, float], name: str) -> float:
    """A result under its name in the reference, which has the largest modulus of an angle or speed."""
    if name == "events":
        return row["run.events"]
    if name.endswith(".max_abs"):
        quantity = name.removesuffix(".max_abs")
        return max(row[f"{quantity}.max"], -row[f"{quantity}.min"])
    return row[name]


@pytest.mark.parametrize(("group", "position"), CASES)
def test_case_agrees(computed: dict[str, Results], group: str, position: int) -> None:
    reference = DRIVE[group][position]
    results = computed[group]
    assert results.endings[position] is Ending.OK
    row = results.row(position)
    allowed = max(1e-8, 1000.0 * reference["sensitivity"])
    expected = reference["results"]
    found = {name: _value(row, name) for name in expected}
    assert found.pop("events") == expected["events"]
    assert found == {name: pytest.approx(expected[name], rel=allowed) for name in found}


def test_typical_agreement_is_far_better_than_the_limit(computed: dict[str, Results]) -> None:
    errors = [
        abs(_value(computed[group].row(position), name) / expected - 1.0)
        for group, position in CASES
        for name, expected in DRIVE[group][position]["results"].items()
    ]
    assert np.median(errors) < 1e-11


@pytest.fixture(scope="module")
def long_run() -> Results:
    """The long runs: 250 periods, evaluated over the last 50."""
    base = LONG["base"]
    own = {name: base["pendulum"][name] for name in ("mass", "arm", "inertia", "damping", "backlash")}
    arm = 0.05
    rate = base["pendulum"]["spring_rate_times_arm_squared"] / arm**2
    cases = [
        {
            "excitation.frequency": float(base["frequency_hz"]),
            "excitation.amplitude_x": base["amplitude_x"],
            "excitation.amplitude_y": base["amplitude_y"],
            "excitation.phase": float(base["phase"]),
            "shaft.inertia": base["shaft_inertia"],
            "shaft.load": case["load"],
            **clutch(*map(float, base["clutch_coefficients"])),
            **pendulum(0, **own, spring_rate=rate, spring_arm=arm),
        }
        for case in LONG["cases"]
    ]
    start, end = base["window_periods"]
    return Results(batch_of(cases), periods(end, start, end, tolerance=1e-9), len(cases))


@pytest.mark.parametrize("position", range(len(LONG["cases"])))
def test_long_run(long_run: Results, position: int) -> None:
    expected = LONG["cases"][position]
    row = long_run.row(position)
    assert row["shaft.speed.mean"] == pytest.approx(expected["speed_mean"], rel=1.5e-5)
    assert row["power.input.mean"] == pytest.approx(expected["power_input"], rel=1.5e-5)
    assert row["power.useful.mean"] == pytest.approx(expected["power_useful"], rel=1.5e-5)
    assert row["efficiency"] == pytest.approx(expected["efficiency"], abs=0.6e-4)
