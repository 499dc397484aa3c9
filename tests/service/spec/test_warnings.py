"""What is allowed but said: unstable pendulums, impossible inertias, slips of units."""

from __future__ import annotations

import re
from typing import Any, get_args

import pytest

from sprag_study.service.faults import WarningCode, warned
from tests.service.spec_sample import parsed


def warnings(changes: dict[str, Any]) -> list[str]:
    return list(parsed({"/axes": []} | changes).warnings)


def code(warning: str) -> str:
    """The code of a warning."""
    (found,) = warned([warning])["warning_codes"]
    assert found in get_args(WarningCode)
    return str(found)


def test_nothing_is_said_about_a_plausible_study() -> None:
    assert warnings({}) == []
    assert parsed({}).warnings == ()


def test_a_spring_too_weak_is_said_with_its_numbers() -> None:
    (warning,) = warnings({"/base/pendulums/0/spring_rate": 40})
    assert (code(warning), warning.split(":")[0]) == ("falls-over", "/base/pendulums/0")
    assert "0.1 N*m/rad" in warning
    assert "0.1471 N*m/rad" in warning
    assert "cases" not in warning


def test_a_hanging_or_weightless_pendulum_needs_no_spring() -> None:
    assert warnings({"/base/pendulums/0/spring_rate": 0, "/base/pendulums/0/arm": "-30 mm"}) == []
    assert warnings({"/base/pendulums/0/spring_rate": 0, "/base/gravity": 0}) == []


@pytest.mark.parametrize(
    ("axes", "combine", "says"),
    [
        ([{"path": "pendulums.0.spring_rate", "values": [9000, 40, 20]}], "grid", r"0\.05 N\*m/rad.*in 2 of 3 cases"),
        (
            [
                {"path": "pendulums.0.spring_rate", "values": [40, 60]},
                {"path": "shaft.load", "values": [0.1, 0.2, 0.3]},
                {"path": "gravity", "values": [0, 5, 9.81]},
            ],
            "grid",
            "in 3 of 18 cases",
        ),
        (
            [{"path": "pendulums.0.spring_rate", "values": [40, 60]}, {"path": "gravity", "values": [5, 60]}],
            "zip",
            r"0\.15 N\*m/rad.*0\.9 N\*m/rad.*in 1 of 2 cases",
        ),
        (
            [{"path": f"pendulums.0.{name}", "linspace": [0.01, 1, 700]} for name in ("spring_rate", "spring_arm")],
            "grid",
            "worst case of the axes",
        ),
    ],
)
def test_the_axes_are_looked_at(axes: list[Any], combine: str, says: str) -> None:
    (warning,) = warnings({"/axes": axes, "/combine": combine})
    assert re.search(says, warning)


def test_an_inertia_that_no_body_has() -> None:
    (warning,) = warnings({"/base/pendulums/0/inertia": "4e-4 kg*m^2"})
    assert code(warning) == "impossible-inertia"
    assert "0.0004 kg*m^2" in warning
    assert "0.00045 kg*m^2" in warning
    assert warnings({"/base/pendulums/0/inertia": "4.5e-4 kg*m^2"}) == []


@pytest.mark.parametrize(
    ("pointer", "value", "kind", "says"),
    [
        ("excitation/frequency", 1500, "implausible-value", "1500 Hz is more than 1000 Hz"),
        ("excitation/frequency", "0.01 Hz", "slow-excitation", "0.1 Hz"),
        ("excitation/amplitude_y", 2, "implausible-value", "2 m is more than 0.1 m"),
        ("excitation/phase", 90, "implausible-value", "degrees"),
        ("pendulums/0/backlash", 3, "implausible-value", "degrees"),
        ("pendulums/0/spring_arm", 50, "implausible-value", "mm"),
        ("pendulums/0/initial_angle", -20, "implausible-value", "-20 rad"),
        ("shaft/load", 1e5, "implausible-value", "N*mm"),
    ],
)
def test_slips_of_units(pointer: str, value: object, kind: str, says: str) -> None:
    (warning,) = warnings({f"/base/{pointer}": value})
    assert (code(warning), warning.split(":")[0]) == (kind, f"/base/{pointer}")
    assert says in warning


def test_slips_on_an_axis_and_not_in_what_it_replaces() -> None:
    axes = [{"path": "excitation.frequency", "values": [1500, 25]}]
    (warning,) = warnings({"/axes": axes, "/base/excitation/frequency": 3000})
    assert warning.startswith("/axes/0 (excitation.frequency): 1500 Hz")
    assert (
        warnings({"/axes": [{"path": "excitation.frequency", "values": [25]}], "/base/excitation/frequency": 3e3}) == []
    )


def test_a_start_that_vibration_along_y_never_leaves() -> None:
    upright = {"/base/excitation/amplitude_x": 0, "/base/excitation/amplitude_y": 0.002}
    (warning,) = warnings(upright)
    assert code(warning) == "stays-upright"
    assert warnings(upright | {"/base/pendulums/0/initial_angle": 0.01}) == []
    for path in ("pendulums.0.initial_angle", "excitation.amplitude_x"):
        (warning,) = warnings(upright | {"/axes": [{"path": path, "values": [0, 0.001, 0.002]}]})
        assert warning.endswith("(in 1 of 3 cases)")
    together = [{"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": [0, 0.001]}]
    assert warnings({"/axes": together}) == []


def test_a_base_that_does_not_move() -> None:
    still = {"/base/excitation/amplitude_x": 0, "/base/excitation/amplitude_y": 0}
    assert [code(warning) for warning in warnings(still)] == ["nothing-moves"]
    assert warnings(still | {"/axes": [{"path": "excitation.amplitude_x", "values": [0, 0.001]}]}) == []


def test_a_part_of_a_load_that_is_not_there() -> None:
    (share,) = warnings({"/base/shaft/cyclic_load": 0.5, "/base/shaft/load": 0})
    assert share == "/base/shaft/cyclic_load: has no effect: shaft.load is 0"
    (speed,) = warnings({"/base/shaft/stribeck_speed": "2 rad/s"})
    assert speed == "/base/shaft/stribeck_speed: has no effect: shaft.stribeck_load is 0"
    assert [code(warning) for warning in (share, speed)] == ["no-effect", "no-effect"]
    assert warnings({"/base/shaft/cyclic_load": 0.5}) == []
    assert warnings({"/base/shaft/stribeck_speed": "2 rad/s", "/base/shaft/stribeck_load": "0.1 N*m"}) == []
    axes = [{"path": "shaft.load", "values": [0, 0.1]}]
    assert warnings({"/base/shaft/cyclic_load": 0.5, "/base/shaft/load": 0, "/axes": axes}) == []


def test_the_clutch_law_and_the_fit_have_their_say() -> None:
    (jump,) = warnings({"/base/clutch": {"coefficients": [0.5, 200]}})
    assert jump.startswith("/base/clutch: c_1 = 0.5 N*m")
    (varied,) = warnings({"/axes": [{"path": "clutch.coefficients.0", "values": [0.25, 0.5]}]})
    assert varied.startswith("/axes/0: c_1 = 0.25 N*m")
    (few,) = warnings({"/base/clutch": {"data": [[0.01, 2.0], [0.02, 5.0]], "accuracy": 0.1}})
    assert few.startswith("/base/clutch: degree 2")
    assert [code(warning) for warning in (jump, varied, few)] == ["law-jumps", "law-jumps", "too-few-rows"]
