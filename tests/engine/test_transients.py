"""Whether windows of runs of a given time are flagged where they are off the settled motion, and only there."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.not_settled import drives, judge, reference
from benchmarks.workloads import W1
from sprag_study.engine.run import Run, Span
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.engine.vibration_drive.transients import simulate_judged

SPEED = [info.name for info in result_infos(1)].index("shaft.speed.mean")


def test_windows_off_the_settled_motion_are_found_and_no_others() -> None:
    """The seeded short form of ``benchmarks/not_settled.py``."""
    parts = [judge(*reference(group), 1, Run())[:2] for group in ("W1", "R1")]
    parts.append(judge(*drives(40, 1, 11), 1, Run())[:2])
    off, flagged = (np.concatenate(part) for part in zip(*parts, strict=True))
    assert off.sum() >= 15
    assert (off & flagged).sum() >= 0.95 * off.sum()
    assert (flagged & ~off).sum() <= 0.05 * flagged.sum()


def near_an_unstable_orbit(periods: float) -> bool:
    """25 Hz, 2 mm, 0.2 N*m: at 26.05 rad/s for more than a hundred periods, then 22.84 for good."""
    columns = {**W1.columns(np.array([0])), "excitation.frequency": 25.0, "shaft.load": 0.2}
    columns |= {"excitation.amplitude_x": 2e-3, "excitation.amplitude_y": 2e-3}
    return bool(simulate_judged(columns, Run(duration=Span(periods)), cases=1).off[0])


@pytest.mark.parametrize(("periods", "off"), [(60.0, True), (120.0, True), (400.0, False)])
def test_a_window_at_an_unstable_orbit_is_off(periods: float, off: bool) -> None:
    assert near_an_unstable_orbit(periods) is off


def test_judging_changes_no_result_and_no_batch_changes_the_judgement() -> None:
    chosen = np.arange(0, 512, 9)
    columns, run = W1.columns(chosen), Run(duration=Span(1.5, "s"))
    whole = simulate_judged(columns, run, cases=len(chosen))
    np.testing.assert_array_equal(whole.batch.values, simulate(columns, run, cases=len(chosen)).values)
    turned = simulate_judged(W1.columns(chosen[::-1]), run, cases=len(chosen))
    part = simulate_judged(W1.columns(chosen[7:12]), run, cases=5)
    np.testing.assert_array_equal(whole.off, turned.off[::-1])
    np.testing.assert_array_equal(whole.off[7:12], part.off)
    np.testing.assert_array_equal(whole.spent[7:12], part.spent)
    assert 0 < whole.off.sum() < len(chosen)


def test_a_shaft_without_load_has_settled_when_nothing_drives_it_any_more() -> None:
    columns = {**W1.columns(np.arange(0, 512, 60)), "shaft.load": 0.0}
    short, long = (simulate_judged(columns, Run(duration=Span(periods)), cases=9) for periods in (5.0, 400.0))
    speeds = [batch.batch.values[:, SPEED] for batch in (short, long)]
    np.testing.assert_array_equal(short.off, speeds[0] < 0.99 * speeds[1])
    assert short.off.any()
    assert not long.off.any()


def test_a_pendulum_that_still_swings_up_against_a_held_shaft_is_off() -> None:
    columns = {**W1.columns(np.array([0])), "pendulums.0.backlash": 10.0, "shaft.load": 0.2}
    short, long = (simulate_judged(columns, Run(duration=Span(periods)), cases=1) for periods in (10.0, 200.0))
    assert short.off[0]
    assert not long.off[0]


def test_runs_shorter_than_a_period_are_judged_too() -> None:
    columns = W1.columns(np.arange(4))
    assert simulate_judged(columns, Run(duration=Span(0.5)), cases=4).off.all()
    assert simulate_judged(columns, Run(), cases=0).off.shape == (0,)
