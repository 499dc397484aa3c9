"""The engine against scipy on random machines: every state, integral, extremum and count, by an independent automaton.

A case is allowed a hundred times what a change of 1e-12 in its frequency does to it; one so sensitive that nothing can
be concluded is not counted.
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from sprag_study.engine.endings import Ending
from sprag_study.engine.run import Reset
from sprag_study.engine.vibration_drive.simulate import trajectory
from tests.engine.vibration_drive.drive import Columns, Results, batch_of, clutch, column, drive, pendulum, periods
from tests.engine.vibration_drive.reference_run import Accumulating, Drive

DURATION, START = 4, 1
NUDGE = 1e-12

#: Fixed examples; shrinking a machine takes minutes and says little. ``SPRAG_TEST_EXAMPLES=20`` draws more of each.
PROFILE = settings(
    max_examples=int(os.environ.get("SPRAG_TEST_EXAMPLES", "2")),
    derandomize=True,
    deadline=None,
    database=None,
    phases=(Phase.explicit, Phase.generate),
    suppress_health_check=list(HealthCheck),
)


def compare(columns: Columns, reset: Reset = "contact", means: float = 3e-8) -> bool:
    """Run both and compare everything that both compute; False for a case too sensitive to conclude anything.

    ``means`` is the relative error of means and states that is allowed besides the sensitivity.
    """
    run = periods(DURATION, START, DURATION, tolerance=1e-9, reset=reset)
    nudged = columns | {
        "excitation.frequency": columns["excitation.frequency"] * (1.0 + NUDGE),
        "shaft.inertia": columns["shaft.inertia"] * (1.0 + NUDGE),
    }
    both = Results(batch_of([columns, nudged]), run, 2)
    assert both.endings[0] is Ending.OK
    row, other = both.row(0), both.row(1)
    sensitivity = max(
        abs(other[name] - row[name]) / max(abs(row[name]), 1e-6)
        for name in row
        if name.endswith((".mean", ".max", ".min"))
    )
    if not sensitivity < 1e-7:
        return False
    machine = Drive(columns, literal=reset == "literal")
    try:
        reference = machine.run(DURATION, (START, DURATION))
    except Accumulating:
        return False
    allowed = 3e-8 + 100.0 * sensitivity

    assert row["run.events"] == reference.events
    assert row["clutches.engagements_per_period"] * (DURATION - START) == pytest.approx(machine.window_engagements)
    closely = means + 100.0 * sensitivity
    for name, value in reference.mean.items():
        scale = abs(reference.largest[name.replace(".mean", ".max")]) if name in _SCALED else abs(value)
        assert row[name] == pytest.approx(value, rel=0, abs=closely * scale + 1e-12), name
    for name, value in reference.largest.items():
        expected = -value if name.endswith(".min") else value
        assert row[name] == pytest.approx(expected, rel=allowed, abs=1e-10), name
    _compare_states(columns, reset, machine, closely)
    return True


_SCALED = {"shaft.speed.mean", "torque.mean", "power.clutch.mean", *(f"pendulums.{i}.angle.mean" for i in range(8))}


def _compare_states(columns: Columns, reset: Reset, machine: Drive, allowed: float) -> None:
    """Angles, speeds and automaton states at the end of every period."""
    n = machine.n
    times = np.arange(1, DURATION + 1) * machine.period
    path = trajectory(columns, periods(DURATION, START, DURATION, reset=reset), times)
    assert len(path.times) == DURATION
    names = [f"pendulums.{i}.{q}" for q in ("angle", "speed") for i in range(n)] + ["shaft.angle", "shaft.speed"]
    found = np.column_stack([column(path, name) for name in names])
    expected = np.array([[*y[: 2 * n], y[3 * n], y[machine.shaft]] for y in machine.out.values])
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-6)
    np.testing.assert_array_less(np.abs(found - expected) / scale, allowed)
    states = zip(path.states["shaft"], *(path.states[f"pendulums.{i}"] for i in range(n)), strict=True)
    assert list(states) == machine.out.states


def _drives(pendulums: int, **own: st.SearchStrategy[float]) -> st.SearchStrategy[Columns]:
    """Random drives near the ordinary one; ``own`` replaces the strategy of a pendulum's field."""
    fields: dict[str, st.SearchStrategy[float]] = {
        "inertia": st.floats(8e-4, 1.3e-3),
        "mass": st.floats(0.3, 0.6),
        "arm": st.floats(0.02, 0.04),
        "spring_rate": st.floats(6000.0, 14000.0),
        "spring_arm": st.just(0.05),
        "damping": st.floats(0.003, 0.02),
        "backlash": st.floats(1e-3, 1e-2),
    } | own
    whole = {
        "excitation.frequency": st.floats(14.0, 32.0),
        "excitation.amplitude_x": st.floats(5e-4, 3e-3),
        "excitation.amplitude_y": st.floats(0.0, 3e-3),
        "excitation.phase": st.floats(-3.0, 3.0),
        "shaft.inertia": st.floats(1e-3, 4e-3),
        "shaft.load": st.floats(0.02, 0.6),
    }
    parts = [
        st.fixed_dictionaries({f"pendulums.{i}.{name}": value for name, value in fields.items()})
        for i in range(pendulums)
    ]
    return st.builds(
        lambda head, *tail: {k: v for part in (head, *tail) for k, v in part.items()} | clutch(0.0, 200.0, 0.0, 2e4),
        st.fixed_dictionaries(whole),
        *parts,
    )


@PROFILE
@given(_drives(1), st.sampled_from(["contact", "literal"]))
def test_one_pendulum(columns: Columns, reset: Reset) -> None:
    assume(compare(columns, reset))


@PROFILE
@given(_drives(2))
def test_two_pendulums(columns: Columns) -> None:
    assume(compare(columns))


@PROFILE
@given(_drives(3))
def test_three_pendulums(columns: Columns) -> None:
    assume(compare(columns))


@PROFILE
@given(_drives(1, backlash=st.just(0.0)), st.sampled_from(["contact", "literal"]))
def test_without_backlash(columns: Columns, reset: Reset) -> None:
    assume(compare(columns, reset))


@PROFILE
@given(_drives(1), st.floats(0.02, 1.5), st.sampled_from(["contact", "literal"]))
def test_torque_that_jumps_at_engagement(columns: Columns, first: float, reset: Reset) -> None:
    assume(compare(columns | {"clutch.coefficients.0": first}, reset))


@PROFILE
@given(_drives(1, backlash=st.just(0.0)), st.floats(0.02, 1.5), st.sampled_from(["contact", "literal"]))
def test_locking(columns: Columns, first: float, reset: Reset) -> None:
    assume(compare(columns | {"clutch.coefficients.0": first}, reset))


@PROFILE
@given(_drives(2, backlash=st.just(0.0)), st.floats(0.02, 1.5), st.floats(0.02, 1.5))
def test_locking_of_two(columns: Columns, first: float, load: float) -> None:
    different = {"pendulums.0.spring_rate": 7000.0}
    assume(compare(columns | {"clutch.coefficients.0": first, "shaft.load": load} | different))


@PROFILE
@given(_drives(2), st.floats(1e-3, 6e-3))
def test_windup_beyond_the_data(columns: Columns, limit: float) -> None:
    assume(compare(columns | {"clutch.windup_limit": limit}))


@PROFILE
@given(_drives(2))
def test_without_load(columns: Columns) -> None:
    assume(compare(columns | {"shaft.load": 0.0}))


@PROFILE
@given(
    _drives(
        1,
        initial_angle=st.floats(-0.1, 0.1),
        # A speed of 1e-290 rad/s is a contact for scipy and rest for the engine, which counts one event less.
        initial_speed=st.floats(-10.0, 10.0).map(lambda speed: speed if abs(speed) > 1e-6 else 0.0),
        backlash=st.sampled_from([0.0, 4e-3]),
    ),
    st.floats(0.0, 5.0),
    st.sampled_from([0.0, 0.4]),
)
def test_started_in_motion(columns: Columns, shaft: float, first: float) -> None:
    assume(compare(columns | {"shaft.initial_speed": shaft, "clutch.coefficients.0": first}))


@pytest.mark.parametrize(
    ("columns", "reset"),
    [
        (drive(1, gravity=0.0), "contact"),
        (drive(1, pendulums__0__arm=-0.03), "literal"),
        (drive(1, **{"shaft.load": 0.6}), "contact"),
        (
            drive(1, excitation__amplitude_x=0.0, excitation__amplitude_y=0.0, **pendulum(0, initial_speed=8.0)),
            "literal",
        ),
        (drive(2, **pendulum(1, arm=-0.03, spring_rate=12000.0)), "contact"),
    ],
    ids=["weightless", "hanging", "near-stall", "free decay", "one up, one down"],
)
def test_special_machines(columns: Columns, reset: Reset) -> None:
    assert compare(columns, reset)
