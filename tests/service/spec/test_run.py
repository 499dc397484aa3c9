"""The run of a spec: times in seconds and periods, the window inside the run, tolerance, reset."""

from __future__ import annotations

from typing import Any

import pytest

from sprag_study.service.faults import warned
from sprag_study.service.spec.run import in_periods, time_text
from sprag_study.worker.limits import MAX_PROBLEMS
from tests.service.spec_sample import parsed, problems


@pytest.mark.parametrize(
    ("value", "time"),
    [
        ("60 periods", [60.0, "periods"]),
        ("1 period", [1.0, "periods"]),
        ("0.5periods", [0.5, "periods"]),
        ("60 cycles", [60.0, "periods"]),
        ("1 cycle", [1.0, "periods"]),
        ("2 s", [2.0, "s"]),
        ("500 ms", [0.5, "s"]),
        ("1 min", [60.0, "s"]),
        (2.0, [2.0, "s"]),
        (2, [2.0, "s"]),
    ],
)
def test_durations(value: object, time: list[Any]) -> None:
    assert parsed({"/run/duration": value, "/run/window": ...}).study.run["duration"] == time


def test_times_in_periods_and_in_words() -> None:
    assert in_periods([2.0, "s"], 25.0) == 50.0
    assert in_periods([2.0, "periods"], 25.0) == 2.0
    assert time_text([2.0, "s"]) == "2 s"


@pytest.mark.parametrize(
    "value",
    [
        0,
        -1,
        "0 periods",
        "-1 periods",
        "60 turns",
        "60",
        "periods",
        "1e999 s",
        "60 Hz",
        True,
        None,
        [60],
        1e10,
        float("inf"),
    ],
)
def test_durations_that_are_refused(value: object) -> None:
    found = problems({"/run/duration": value, "/run/window": ...})
    assert list(found) == ["/run/duration"]
    assert "periods" in str(found["/run/duration"].allowed)


@pytest.mark.parametrize(
    ("run", "window"),
    [
        ({"duration": "60 periods"}, None),
        ({"window": [0, "60 periods"]}, [[0.0, "s"], [60.0, "periods"]]),
        ({"duration": "2 s", "window": ["1 s", 2]}, [[1.0, "s"], [2.0, "s"]]),
        ({"duration": "2 s", "window": ["1 period", "32 periods"]}, [[1.0, "periods"], [32.0, "periods"]]),
        ({"duration": "60 periods", "window": ["1 s", "60 periods"]}, [[1.0, "s"], [60.0, "periods"]]),
    ],
)
def test_windows(run: dict[str, Any], window: list[Any] | None) -> None:
    assert parsed({"/run": run}).study.run["window"] == window


@pytest.mark.parametrize(
    ("run", "at", "code"),
    [
        ({"window": ["40 periods", "61 periods"]}, "/window/1", "out-of-range"),
        ({"window": ["40 periods", "40 periods"]}, "/window", "invalid-range"),
        ({"window": ["40 periods", "30 periods"]}, "/window", "invalid-range"),
        ({"window": ["-1 periods", "30 periods"]}, "/window/0", "out-of-range"),
        ({"window": ["0 periods", "30 m"]}, "/window/1", "wrong-unit"),
        ({"window": "40 periods"}, "/window", "wrong-type"),
        ({"window": [1]}, "/window", "wrong-type"),
        ({"window": None}, "/window", "wrong-type"),
        # Across the axis of 16 .. 35 Hz only one end of it is wrong.
        ({"duration": "2 s", "window": ["1 period", "33 periods"]}, "/window/1", "out-of-range"),
        ({"duration": "60 periods", "window": ["0 s", "2 s"]}, "/window/1", "out-of-range"),
        ({"duration": "60 periods", "window": ["1 s", "20 periods"]}, "/window", "invalid-range"),
        ({"duration": "30000 s"}, "/duration", "out-of-range"),
        ({"duration": "1000001 periods"}, "/duration", "out-of-range"),
        ({"tolerance": 1e-15}, "/tolerance", "out-of-range"),
        ({"tolerance": 1e-3}, "/tolerance", "out-of-range"),
        ({"tolerance": 0}, "/tolerance", "out-of-range"),
        ({"tolerance": "1e-9"}, "/tolerance", "wrong-type"),
        ({"tolerance": float("nan")}, "/tolerance", "out-of-range"),
        ({"tolerance": True}, "/tolerance", "wrong-type"),
        ({"reset": "contacts"}, "/reset", "invalid-choice"),
        ({"reset": None}, "/reset", "invalid-choice"),
        ({"durration": 1}, "/durration", "unknown-field"),
    ],
)
def test_runs_that_are_refused(run: dict[str, Any], at: str, code: str) -> None:
    found = problems({"/run": run})
    assert list(found) == ["/run" + at]
    assert found["/run" + at].code == code


@pytest.mark.parametrize("value", [None, [], "60 periods", 60])
def test_a_run_is_an_object(value: object) -> None:
    assert list(problems({"/run": value})) == ["/run"]


def test_a_window_that_ends_with_the_run_in_the_other_unit() -> None:
    changes = {"/axes": [], "/base/excitation/frequency": "157 rad/s"}
    seconds = 50 / parsed(changes).study.base["excitation.frequency"]
    assert parsed(changes | {"/run": {"duration": seconds, "window": ["40 periods", "50 periods"]}}).warnings == ()


def test_a_window_shorter_than_a_period_is_said() -> None:
    (warning,) = parsed({"/run/window": ["59.5 periods", "60 periods"], "/axes": []}).warnings
    assert "shorter than one excitation period at 25 Hz" in warning


def test_a_run_whose_last_third_is_shorter_than_a_period_is_said() -> None:
    (warning,) = parsed({"/run": {"duration": "0.5 periods"}, "/axes": []}).warnings
    assert warning.startswith(
        "/run/duration: the window, its last third, is shorter than one excitation period at 25 Hz"
    )
    assert parsed({"/run": {"duration": "3 periods"}, "/axes": []}).warnings == ()


def test_the_extremes_of_tolerance_and_reset() -> None:
    for tolerance in (1e-14, 1e-4):
        assert parsed({"/run/tolerance": tolerance, "/run/reset": "literal"}).study.run["tolerance"] == tolerance


def test_what_is_wrong_beyond_the_problems_that_are_told_is_not_taken_for_right() -> None:
    """Found by made-up requests: a run that could not be read was compared with its window."""
    unknown = {f"field{number}": 0 for number in range(MAX_PROBLEMS)}
    told = problems({"/base/shaft": unknown, "/run": {"duration": "long", "window": ["x", 1]}})
    assert len(told) == MAX_PROBLEMS + 1


def test_a_run_until_it_is_settled() -> None:
    run = parsed({"/run": {"until": "settled"}}).study.run
    assert run == {
        "until": "settled", "at_most": 1000, "settled": 1e-8, "max_period": 32, "tolerance": 1e-9, "reset": "contact",
    }  # fmt: skip
    given = {"until": "settled", "at_most": "2000 periods", "settled": 1e-6, "max_period": 8, "tolerance": 1e-10}
    assert parsed({"/run": given | {"reset": "literal"}}).study.run == given | {"at_most": 2000, "reset": "literal"}


def test_a_run_without_duration_and_window_lasts_until_it_is_settled() -> None:
    for given in (
        {},
        {"tolerance": 1e-8},
        {"reset": "literal"},
        {"at_most": "2000 periods"},
        {"settled": 1e-6},
        {"max_period": 8},
    ):
        assert parsed({"/run": given}).study.run["until"] == "settled"


@pytest.mark.parametrize(
    ("run", "at", "code"),
    [
        ({"until": "steady"}, "/until", "invalid-choice"),
        ({"until": None}, "/until", "invalid-choice"),
        ({"until": "settled", "duration": "60 periods"}, "/until", "conflict"),
        ({"window": ["1 periods", "2 periods"], "at_most": "1000 periods"}, "/at_most", "conflict"),
        ({"max_period": 3, "duration": 1, "window": [0, 1]}, "/max_period", "conflict"),
        ({"at_most": 1000}, "/at_most", "wrong-type"),
        ({"at_most": "10 s"}, "/at_most", "wrong-type"),
        ({"at_most": "long"}, "/at_most", "not-a-number"),
        ({"at_most": "1000.5 periods"}, "/at_most", "out-of-range"),
        ({"at_most": "99 periods"}, "/at_most", "out-of-range"),
        ({"at_most": "100001 periods"}, "/at_most", "out-of-range"),
        ({"settled": 0}, "/settled", "out-of-range"),
        ({"settled": "1e-8"}, "/settled", "wrong-type"),
        ({"max_period": 0}, "/max_period", "out-of-range"),
        ({"max_period": 65}, "/max_period", "out-of-range"),
        ({"max_period": 2.5}, "/max_period", "wrong-type"),
        ({"until": "settled", "tolerance": 1}, "/tolerance", "out-of-range"),
    ],
)
def test_settled_runs_that_are_refused(run: dict[str, Any], at: str, code: str) -> None:
    found = problems({"/run": run})
    assert list(found) == ["/run" + at]
    assert found["/run" + at].code == code


def test_too_few_periods_for_irregular_motion_are_said() -> None:
    (warning,) = parsed({"/run": {"at_most": "900 periods"}, "/axes": []}).warnings
    assert (warned([warning])["warning_codes"], warning.split(":")[0]) == (["short-search"], "/run/at_most")
    assert parsed({"/run": {"at_most": "940 periods"}, "/axes": []}).warnings == ()
