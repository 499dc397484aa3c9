"""The part of a spec that describes a goal."""

from __future__ import annotations

from typing import Any

import pytest

from sprag_study.service.spec.kinds.goal import read_goal, read_points, read_variables
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.worker import models
from sprag_study.worker.planning.goals import GoalPlan
from tests.service.spec_sample import SPEC, parsed

GOAL: dict[str, Any] = {
    "vary": [
        {"path": "pendulums.0.spring_rate", "from": "15 N/mm", "to": "5 N/mm"},
        {"path": "pendulums.0.arm", "values": ["20 mm", "25 mm", "30 mm"]},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "from": "1 mm", "to": "3 mm"},
    ],
    "best": [{"result": "efficiency", "max": True}, {"result": "shaft.irregularity"}],
    "subject_to": [
        {"result": "shaft.speed.mean", "is": "8 rad/s", "within": "2 %"},
        {"result": "torque.max", "at_most": "5000 N*mm"},
        {"result": "regime", "is": "periodic"},
        {"result": "regime.order", "is": 1},
    ],
    "at": [{"shaft.load": "0.2 N*m"}, {"shaft.load": 0.3}],
    "population": 20,
}


def read(changes: dict[str, Any]) -> tuple[dict[str, Any] | None, Report]:
    """The plan of the goal with other fields, and the report."""
    data = {name: value for name, value in {**GOAL, **changes}.items() if value is not ...}
    report = Report({"goal": data})
    report.machine = part_of("vibration-drive").read_base(Node(report, "/base", SPEC["base"]))
    goal = Node(report, "", {"goal": data})["goal"]
    variables = read_variables(goal)
    points = read_points(goal, variables)
    if variables is None or points is None:
        return None, report
    report.results = models.study_results(parsed({"/run": {}, "/axes": []}).study)
    return read_goal(goal, variables, points), report


def test_a_goal_is_read_in_si() -> None:
    plan, report = read({})
    assert not report.faults
    assert plan == {
        "kind": "goal",
        "vary": [
            {"paths": ["pendulums.0.spring_rate"], "low": 5000.0, "high": 15000.0},
            {"paths": ["pendulums.0.arm"], "values": [0.02, 0.025, 0.03]},
            {"paths": ["excitation.amplitude_x", "excitation.amplitude_y"], "low": 0.001, "high": 0.003},
        ],
        "best": [{"result": "efficiency", "max": True}, {"result": "shaft.irregularity", "max": False}],
        "subject_to": [
            {"result": "shaft.speed.mean", "is": 8.0, "within": 0.16},
            {"result": "torque.max", "at_most": 5.0},
            {"result": "regime", "is": 1.0},
            {"result": "regime.order", "is": 1.0},
        ],
        "at": [{"shaft.load": 0.2}, {"shaft.load": 0.3}],
        "over": "worst",
        "population": 20,
        "generations": 60,
        "seed": 1,
        "polish": True,
    }


@pytest.mark.parametrize(
    ("fields", "plan"),
    [
        ({}, {"growing": True, "finish": True, "least_gain": 0.001}),
        ({"polish": False, "least_gain": "2 %"}, {"growing": True, "least_gain": 0.02}),
        ({"least_gain": 0}, {"growing": True, "finish": True}),
    ],
)
def test_a_search_for_one_goal_says_how_it_ends(fields: dict[str, Any], plan: dict[str, Any]) -> None:
    read_plan, report = read({"best": [{"result": "efficiency", "max": True}], **fields})
    assert not report.faults
    assert read_plan is not None
    new = ("growing", "finish", "least_gain")
    assert {name: read_plan[name] for name in new if name in read_plan} == plan
    again = GoalPlan.from_json(read_plan).to_json()
    assert {name: again[name] for name in new if name in again} == plan


ARM, SPRING = "pendulums.0.arm", "pendulums.0.spring_rate"


def test_known_designs_have_the_values_of_the_base_unless_others_are_given() -> None:
    plan, report = read({"start": [{}, {ARM: "25 mm", "excitation.amplitude_y": 0.0025}]})
    assert not report.faults
    assert plan is not None
    assert plan["start"] == [[9000.0, 0.03, 0.002], [9000.0, 0.025, 0.0025]]
    assert GoalPlan.from_json(plan).to_json()["start"] == plan["start"]


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"start": {}}, "/goal/start", "wrong-type"),
        ({"start": ["base"]}, "/goal/start/0", "wrong-type"),
        ({"start": [{"shaft.inertia": 1}]}, "/goal/start/0/shaft.inertia", "invalid-path"),
        ({"start": [{}, {ARM: "26 mm"}]}, f"/goal/start/1/{ARM}", "out-of-range"),
        ({"start": [{SPRING: "20 N/mm"}]}, f"/goal/start/0/{SPRING}", "out-of-range"),
        ({"start": [{SPRING: "8 mm"}]}, f"/goal/start/0/{SPRING}", "wrong-unit"),
        ({"start": [{SPRING: "8 N/mm"}, {SPRING: 9}]}, f"/goal/start/1/{SPRING}", "ambiguous-unit"),
        ({"start": [{}] * 5, "population": 4}, "/goal/start", "too-many"),
        (
            {"start": [{"excitation.amplitude_x": 0.001, "excitation.amplitude_y": 0.002}]},
            "/goal/start/0/excitation.amplitude_x",
            "conflict",
        ),
        (
            {"start": [{}], "vary": [{"path": "shaft.inertia", "from": 1, "to": 2}]},
            "/goal/start/0",
            "out-of-range",
        ),
    ],
)
def test_a_known_design_is_one_of_the_search(changes: dict[str, Any], pointer: str, code: str) -> None:
    _plan, report = read(changes)
    assert [(str(fault.where), fault.code) for fault in report.faults] == [(pointer, code)]


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"vary": ...}, "/goal/vary", "required"),
        ({"vary": [{"path": "shaft.load", "from": 0.1}]}, "/goal/vary/0/to", "required"),
        ({"vary": [{"path": "shaft.load", "from": 0.1, "to": 0.1}]}, "/goal/vary/0", "invalid-range"),
        ({"vary": [{"path": "shaft.load"}]}, "/goal/vary/0", "exactly-one"),
        ({"vary": [{"path": "shaft.load", "from": 0.1, "to": 1, "values": [1]}]}, "/goal/vary/0", "exactly-one"),
        ({"vary": [*GOAL["vary"], GOAL["vary"][0]]}, "/goal/vary/3/path", "repeated"),
        ({"vary": [{"path": "shaft.lod", "from": 0.1, "to": 1}]}, "/goal/vary/0/path", "invalid-path"),
        ({"best": [{"result": "efficency"}]}, "/goal/best/0/result", "unknown-name"),
        ({"best": [{"result": "regime"}]}, "/goal/best/0/result", "not-numeric"),
        ({"best": [{"result": "efficiency", "max": 1}]}, "/goal/best/0/max", "wrong-type"),
        ({"best": GOAL["best"][:1] * 2}, "/goal/best/1/result", "repeated"),
        ({"best": [], "subject_to": []}, "/goal", "empty"),
        ({"least_gain": "101 %"}, "/goal/least_gain", "out-of-range"),
        ({"least_gain": "little"}, "/goal/least_gain", "not-a-number"),
        ({"subject_to": [{"result": "torque.max"}]}, "/goal/subject_to/0", "exactly-one"),
        ({"subject_to": [{"result": "torque.max", "at_most": "5 m"}]}, "/goal/subject_to/0/at_most", "wrong-unit"),
        ({"subject_to": [{"result": "regime", "at_most": 1}]}, "/goal/subject_to/0/at_most", "not-numeric"),
        ({"subject_to": [{"result": "regime.order", "is": 1.5}]}, "/goal/subject_to/0/is", "not-a-number"),
        ({"subject_to": [{"result": "regime", "is": "round"}]}, "/goal/subject_to/0/is", "invalid-choice"),
        (
            {"subject_to": [{"result": "shaft.speed.mean", "is": 0.0}]},
            "/goal/subject_to/0/within",
            "required",
        ),
        (
            {"subject_to": [{"result": "shaft.speed.mean", "is": 0.0, "within": "2 %"}]},
            "/goal/subject_to/0/within",
            "out-of-range",
        ),
        (
            {"subject_to": [{"result": "torque.max", "at_most": 1, "within": "1 %"}]},
            "/goal/subject_to/0/within",
            "not-used",
        ),
        ({"at": [{"shaft.load": 0.2}, {"shaft.inertia": 0.2}]}, "/goal/at/1", "conflict"),
        ({"at": [{"shaft.load": "0.2 N*m"}, {"shaft.load": "200 N*mm"}]}, "/goal/at/1", "repeated"),
        ({"at": [{"pendulums.0.arm": 0.2}]}, "/goal/at/0/pendulums.0.arm", "repeated"),
        ({"at": [{"shaft.lod": 0.2}]}, "/goal/at/0/shaft.lod", "invalid-path"),
        ({"at": [0.2]}, "/goal/at/0", "wrong-type"),
        ({"population": 3}, "/goal/population", "out-of-range"),
        ({"population": 1000, "generations": 10_000}, "/goal/generations", "too-many"),
        ({"over": "sum"}, "/goal/over", "invalid-choice"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(changes: dict[str, Any], pointer: str, code: str) -> None:
    plan, report = read(changes)
    assert plan is None
    assert [(fault.where, fault.code) for fault in report.faults] == [(pointer, code)]


@pytest.mark.parametrize(("within", "wide"), [("99 %", False), ("150 %", True), ("9 rad/s", True)])
def test_an_equality_that_0_fulfils_is_warned_of(within: str, wide: bool) -> None:
    _, report = read({"subject_to": [{"result": "shaft.speed.mean", "is": "8 rad/s", "within": within}]})
    assert [warning.code for warning in report.warnings] == ["wide-limit"] * wide
