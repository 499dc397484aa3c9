"""Every abnormal ending, and that nothing hangs or raises, whatever valid parameters are given."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import Run, Span
from sprag_study.engine.vibration_drive.cases import Column, case_matrix
from sprag_study.engine.vibration_drive.parameters import CURVE, PARAMETERS
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, clutch, drive, one, pendulum, periods

RUN = periods(6.0, 3.0, 6.0)

FLYING: Columns = (
    drive(1)
    | pendulum(0, mass=0.0, spring_rate=0.0, damping=0.0, initial_speed=1e6, backlash=1000.0, inertia=1.0)
    | {"excitation.frequency": 0.5}
)
STIFF: Columns = drive(1) | pendulum(0, inertia=1e-12, spring_rate=1e12, spring_arm=1e3)


@pytest.mark.parametrize(
    ("ending", "columns", "run"),
    [
        (Ending.DIVERGED, FLYING, RUN),
        (Ending.ACCURACY_NOT_REACHED, STIFF, RUN),
        (Ending.CHATTER, drive(1), periods(6.0, 3.0, 6.0, max_events_per_period=2)),
        (Ending.STEP_BUDGET, drive(1), periods(6.0, 3.0, 6.0, max_steps=20)),
    ],
    ids=lambda value: str(value) if isinstance(value, Ending) else "",
)
def test_abnormal_ending(ending: Ending, columns: Columns, run: Run) -> None:
    results = Results(columns, run, 1)
    assert results.endings == [ending]
    row = results.row(0)
    assert row.pop("run.steps") > 0.0
    assert row.pop("run.events") >= 0.0
    assert all(math.isnan(value) for value in row.values())
    assert ending.sentence.endswith(".")


def test_a_trajectory_that_ends_early_says_so() -> None:
    times = np.linspace(0.0, 0.3, 31)
    path = trajectory(drive(1), periods(6.0, 3.0, 6.0, max_steps=40), times)
    assert path.ending is Ending.STEP_BUDGET
    assert 0 < len(path.times) < 31
    assert path.values.shape[0] == len(path.times) == len(path.states["shaft"])
    assert np.isfinite(path.values).all()
    whole = trajectory(drive(1), RUN, times)
    assert whole.ending is Ending.OK
    np.testing.assert_array_equal(whole.values[: len(path.times)], path.values)


def test_neighbours_are_untouched() -> None:
    cases = [drive(1) | {"pendulums.0.initial_speed": 0.0}, FLYING, drive(1) | {"pendulums.0.initial_speed": 1.0}]
    results = Results(batch_of(cases), RUN, 3)
    assert [str(ending) for ending in results.endings] == ["ok", "diverged", "ok"]
    assert results.row(0) == one(cases[0], RUN)
    assert results.row(2) == one(cases[2], RUN)


def test_budget_counts_events_in_one_period_only() -> None:
    row = one(drive(1), RUN)
    enough = math.ceil(row["run.events"] / 6.0 * 2.0)
    assert one(drive(1), periods(6.0, 3.0, 6.0, max_events_per_period=enough)) == row


def test_a_step_budget_of_exactly_the_steps_needed_is_enough_but_for_the_last() -> None:
    row = one(drive(1), RUN)
    steps = int(row["run.steps"])
    assert one(drive(1), periods(6.0, 3.0, 6.0, max_steps=steps + 1)) == row
    assert Results(drive(1), periods(6.0, 3.0, 6.0, max_steps=steps - 1), 1).endings == [Ending.STEP_BUDGET]


# Extremes.

#: Results that may be null in a case that ended well: nothing turned or nothing was put in.
MAY_BE_NULL = {"shaft.irregularity", "efficiency", "runup.time"}


def test_an_event_at_the_very_end_of_a_period() -> None:
    """The shaft stops when the first period is over, to the last digit; then no time is left for a step to its end."""
    given = (p.path for p in PARAMETERS if p.path.rpartition(".")[2] not in CURVE)
    ones = dict.fromkeys((path.replace("N", "0") for path in given), 1.0) | clutch(0.0, 200.0, 0.0, 2e4)
    start = {f"pendulums.0.{name}": 0.0 for name in ("backlash", "initial_angle", "initial_windup", "initial_clutch")}
    loads = [0.9999999, 1.0, 1.0000001]
    results = Results(
        ones | start | {"gravity": 1.333774675151071e-05, "shaft.load": np.array(loads)}, periods(3.0, 1.0, 3.0), 3
    )
    assert results.endings == [Ending.OK] * 3
    before, there, after = results.values[:, results.names.index("shaft.speed.mean")]
    assert before > there > after > before - 1e-6


def _wide(low: float, high: float) -> st.SearchStrategy[float]:
    """Over all magnitudes of a positive range, and zero where allowed."""
    return st.floats(math.log10(low), math.log10(high)).map(lambda exponent: 10.0**exponent)


def _any(path: str) -> st.SearchStrategy[float]:
    """Any valid value of a parameter: ordinary, zero, and out to the bounds of its range."""
    parameter = next(p for p in PARAMETERS if p.path == path)
    top = parameter.high
    positive = _wide(1e-9, top)
    choices = [positive, _wide(1e-3, 1.0), st.just(top)]
    if not parameter.low_open:
        choices.append(st.just(max(parameter.low, 0.0)))
    if parameter.low < 0.0:
        choices += [positive.map(lambda value: -value), st.just(parameter.low)]
    return st.one_of(choices)


@cache  # examining the strategies takes longer than drawing from them
def _machine(pendulums: int) -> st.SearchStrategy[Columns]:
    paths = {p.path.replace("N", str(i)): p.path for p in PARAMETERS for i in range(pendulums)}
    return st.fixed_dictionaries({path: _any(generic) for path, generic in paths.items()})


LAWS = [(0.0, 200.0, 0.0, 2e4), (1.0,), (0.0, 1e-6), (1e3, 1e9), (0.0, 0.0, 1e12), (0.0, 0.0, 0.0, 1.0)]


@pytest.mark.parametrize("reset", ["contact", "literal"])
@pytest.mark.parametrize("pendulums", [1, 2])
@settings(max_examples=8, derandomize=True, deadline=None, database=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_extreme_machines_end(pendulums: int, reset: Any, data: st.DataObject) -> None:
    cases = [data.draw(_machine(pendulums)) for _ in range(12)]
    law = data.draw(st.sampled_from(LAWS))
    limit = data.draw(st.sampled_from([math.inf, 1e-9, 1e-3, 1.0]))
    columns = batch_of(cases) | clutch(*law) | {"clutch.windup_limit": limit}
    run = periods(3.0, 1.0, 3.0, reset=reset, max_steps=2000, max_events_per_period=200)
    results = Results(columns, run, len(cases))
    for case, ending in enumerate(results.endings):
        assert ending in ENDINGS
        row = results.row(case)
        assert not any(math.isinf(value) for value in row.values())
        if ending is Ending.OK:
            assert {name for name, value in row.items() if math.isnan(value)} <= MAY_BE_NULL
            rounding = 1e-12 * row["shaft.speed.max"]
            assert row["shaft.speed.max"] + rounding >= row["shaft.speed.mean"] >= row["shaft.speed.min"] - rounding


def test_the_step_budget_follows_the_duration_and_the_fastest_motion_of_each_case() -> None:
    columns = drive(1, excitation__frequency=[20.0, 100.0, 0.01])

    def budgets(run: Run, **changes: float) -> list[float]:
        found: list[float] = case_matrix(columns | changes, run, 3)[:, Column.MOST_STEPS].tolist()
        return found

    rate = math.sqrt(200.0 * (1.0 / 1e-3 + 1.0 / 2e-3)) / (2.0 * math.pi)  # of pendulum and shaft on the clutch
    assert budgets(periods(60.0, 0.0, 60.0)) == pytest.approx([5e6, 5e6, 6e3 * rate / 0.01])
    assert budgets(periods(1e6, 0.0, 1.0)) == pytest.approx([1e8 * rate / 20.0, 1e8, 1e8 * rate / 0.01])
    assert budgets(Run(duration=Span(1e4, "s"))) == pytest.approx([1e6 * rate, 1e8, 1e6 * rate])
    assert budgets(periods(1e6, 0.0, 1.0, max_steps=7)) == [7.0] * 3
    stiff = budgets(Run(duration=Span(1e4, "s")), **{"pendulums.0.spring_rate": 1e12})
    assert stiff == pytest.approx([1e9] * 3), "what is faster than 1 kHz is hardly meant"
    # One call gives those of a whole batch.
    assert Run().step_budget(np.array([1.0, 1e6])).tolist() == [5e6, 1e8]
    assert Run(max_steps=7).step_budget(np.array([1.0, 1e6])).tolist() == [7.0, 7.0]


def test_a_slow_excitation_has_steps_for_the_motion_of_the_pendulum_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a run of 20,000 periods at 0.5 Hz, which takes more than five million steps."""
    monkeypatch.setattr("sprag_study.engine.run._LEAST_STEPS", 200)
    slow = drive(1, excitation__frequency=0.1, excitation__amplitude_x=1.0, excitation__amplitude_y=0.0)
    hanging = slow | clutch(0.0, 1e-3) | pendulum(0, arm=-0.03, spring_rate=0.0) | {"excitation.frequency": 0.01}
    for columns in (slow, hanging):
        assert one(columns, periods(3.0, 1.0, 3.0))["run.steps"] > 100 * 3


def test_a_run_with_more_steps_than_the_least_budget_ends_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a run of 300,000 periods does, which takes 7.2 million steps: the duration gives the budget, not the floor."""
    monkeypatch.setattr("sprag_study.engine.run._LEAST_STEPS", 200)
    row = one(drive(1), periods(30.0, 10.0, 30.0))
    assert row["run.steps"] > 400
    assert Results(drive(1), periods(30.0, 10.0, 30.0, max_steps=200), 1).endings == [Ending.STEP_BUDGET]
