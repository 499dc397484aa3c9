"""The starts of a spec."""

from __future__ import annotations

import copy
from typing import Any

import jsonschema
import pytest

from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.worker import models
from sprag_study.worker.models.starts import at_start
from tests.service.spec_sample import SPEC, changed

SPEED, ANGLE = "shaft.initial_speed", "pendulums.0.initial_angle"


def _spec(**starts: Any) -> dict[str, Any]:
    spec = copy.deepcopy(SPEC)
    spec.pop("run", None)
    return {**spec, "starts": {"ranges": {SPEED: ["0 rad/s", "300 rpm"]}, **starts}}


def test_starts_are_drawn_within_their_ranges() -> None:
    spec = _spec(count=16, seed=3, ranges={SPEED: [0, 30], "pendulums.*.initial_angle": ["-10 deg", "10 deg"]})
    study = parse_spec(spec).study
    starts = study.run["starts"]
    assert (starts["count"], starts["seed"]) == (16, 3)
    assert {SPEED, ANGLE} <= starts["values"].keys() == starts["ranges"].keys()
    for path, values in starts["values"].items():
        low, high = starts["ranges"][path]
        assert len(set(values)) == 15
        assert low <= min(values) < max(values) <= high
    assert starts["ranges"][ANGLE] == pytest.approx([-0.174533, 0.174533], abs=1e-6)
    assert parse_spec(spec).study == study
    assert parse_spec({**spec, "starts": {**spec["starts"], "seed": 4}}).study.run["starts"] != starts
    assert models.variant_of(study).endswith("-starts")


def test_the_number_and_the_seed_have_defaults() -> None:
    starts = parse_spec(_spec()).study.run["starts"]
    assert (starts["count"], starts["seed"], len(starts["values"][SPEED])) == (32, 1, 31)
    assert starts["ranges"][SPEED] == pytest.approx([0.0, 31.415926535], abs=1e-6)


def test_a_start_is_a_study_of_one_case() -> None:
    study = parse_spec(_spec(count=4)).study
    own, third = (at_start(study, 1, start) for start in (0, 3))
    assert own.cases == third.cases == 1
    assert "starts" not in own.run
    assert own.base == {**study.base, **study.case_parameters(1)}
    assert third.base == {**own.base, SPEED: study.run["starts"]["values"][SPEED][2]}
    with pytest.raises(IndexError, match=r"0 \.\. 3"):
        at_start(study, 1, 4)


@pytest.mark.parametrize(
    ("starts", "pointer", "code"),
    [
        ({"count": 1}, "/starts/count", "out-of-range"),
        ({"count": 5000}, "/starts/count", "out-of-range"),
        ({"seed": -1}, "/starts/seed", "out-of-range"),
        ({"ranges": None}, "/starts/ranges", "required"),
        ({"ranges": {}}, "/starts/ranges", "wrong-type"),
        ({"ranges": {"shaft.load": [0, 1]}}, "/starts/ranges/shaft.load", "invalid-path"),
        ({"ranges": {"pendulums.9.initial_angle": [0, 1]}}, "/starts/ranges/pendulums.9.initial_angle", "invalid-path"),
        ({"ranges": {SPEED: [0]}}, f"/starts/ranges/{SPEED}", "wrong-type"),
        ({"ranges": {SPEED: [3, 3]}}, f"/starts/ranges/{SPEED}", "invalid-range"),
        ({"ranges": {SPEED: [-1, 3]}}, f"/starts/ranges/{SPEED}/0", "out-of-range"),
        ({"ranges": {ANGLE: [0, 1], "pendulums.*.initial_angle": [0, 1]}},
         "/starts/ranges/pendulums.*.initial_angle", "repeated"),
        ({"many": 1}, "/starts/many", "unknown-field"),
    ],
)  # fmt: skip
def test_faults_of_starts_name_their_place(starts: dict[str, Any], pointer: str, code: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(_spec(**starts))
    assert [(fault.where, fault.code) for fault in error.value.faults] == [(pointer, code)]


def test_a_run_of_a_given_time_has_no_starts() -> None:
    with pytest.raises(SpecError) as error:
        parse_spec({**_spec(), "run": {"duration": "10 periods"}})
    assert [(fault.where, fault.code) for fault in error.value.faults] == [("/starts", "conflict")]


def test_the_schema_accepts_starts() -> None:
    check = jsonschema.Draft202012Validator(spec_schema())
    assert check.is_valid(_spec(count=16))
    assert not check.is_valid(_spec(count=1))
    assert not check.is_valid(_spec(many=1))


def test_states_of_clutches_are_in_a_study_only_where_they_are_given() -> None:
    spec = _spec()
    path = "pendulums.0.initial_clutch"
    assert path not in parse_spec(spec).study.base
    spec["base"]["pendulums"][0] |= {"initial_clutch": 2, "initial_windup": "0.01 rad"}
    base = parse_spec(spec).study.base
    assert (base[path], base["pendulums.0.initial_windup"]) == (2.0, 0.01)
    spec["base"]["pendulums"][0]["initial_clutch"] = 1.5
    with pytest.raises(SpecError) as error:
        parse_spec(spec)
    assert [fault.where for fault in error.value.faults] == ["/base/pendulums/0/initial_clutch"]


_PENDULUM = "/base/pendulums/0"


@pytest.mark.parametrize(
    ("changes", "pointer", "code", "allowed"),
    [
        ({f"{_PENDULUM}/initial_clutch": 3}, f"{_PENDULUM}/initial_clutch", "conflict", "0 free, 1 take up, 2 engaged"),
        ({f"{_PENDULUM}/initial_clutch": 4}, f"{_PENDULUM}/initial_clutch", "conflict", "0 free, 1 take up, 2 engaged"),
        ({f"{_PENDULUM}/initial_clutch": 1, f"{_PENDULUM}/initial_windup": "-0.006 rad"},
         f"{_PENDULUM}/initial_windup", "out-of-range", "-0.005 .. 0 rad"),
        ({f"{_PENDULUM}/initial_clutch": 1, f"{_PENDULUM}/initial_windup": 50},
         f"{_PENDULUM}/initial_windup", "out-of-range", "-0.005 .. 0 rad"),
        ({f"{_PENDULUM}/initial_clutch": 2, f"{_PENDULUM}/initial_windup": 50, "/base/clutch/windup_limit": 0.02},
         f"{_PENDULUM}/initial_windup", "out-of-range", "0 .. 0.02 rad"),
        # Where the windup has its default, the state is what is given.
        ({f"{_PENDULUM}/initial_clutch": 3, "/base/clutch/windup_limit": 0.02},
         f"{_PENDULUM}/initial_clutch", "out-of-range", "0.02 .. inf rad"),
        ({f"{_PENDULUM}/initial_clutch": 4, f"{_PENDULUM}/backlash": 0, "/base/clutch/coefficients": [0.1, 200],
          "/base/shaft/initial_speed": 20}, f"{_PENDULUM}/initial_speed", "conflict", "20 rad/s"),
        ({f"{_PENDULUM}/initial_clutch": 1, f"{_PENDULUM}/initial_windup": "-4 mrad",
          "/axes/2": {"path": "pendulums.0.backlash", "values": [0.005, 0.003]}},
         f"{_PENDULUM}/initial_windup", "out-of-range", "-0.003 .. 0 rad"),
        ({f"{_PENDULUM}/initial_windup": "-4 mrad",
          "/axes/2": {"path": "pendulums.0.initial_clutch", "values": [1, 2]}},
         f"{_PENDULUM}/initial_windup", "out-of-range", "0 .. inf rad"),
        ({f"{_PENDULUM}/initial_clutch": 1, f"{_PENDULUM}/initial_windup": "-4 mrad", f"{_PENDULUM}/backlash": ...,
          "/derive": {"pendulums.0.backlash": "0.3 * pendulums.0.arm / 3 m"}},
         f"{_PENDULUM}/initial_windup", "out-of-range", "-0.003 .. 0 rad"),
    ],
)  # fmt: skip
def test_states_in_which_no_motion_begins_are_refused(
    changes: dict[str, Any], pointer: str, code: str, allowed: str
) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(changed(changes))
    assert [(fault.where, fault.code, fault.allowed) for fault in error.value.faults] == [(pointer, code, allowed)]


def test_every_state_of_a_clutch_can_be_given() -> None:
    lock = {"backlash": 0, "initial_speed": 20, "initial_clutch": 4}
    for pendulum, clutch in (
        ({"initial_clutch": 0, "initial_windup": 3}, {}),
        ({"initial_clutch": 1, "initial_windup": -0.005}, {}),
        ({"initial_clutch": 2, "initial_windup": 0.02}, {"windup_limit": 0.02}),
        ({"initial_clutch": 3, "initial_windup": 0.03}, {"windup_limit": 0.02}),
        (lock, {"coefficients": [0.1, 200]}),
    ):
        spec = changed({"/base/shaft/initial_speed": 20})
        spec["base"]["pendulums"][0] |= pendulum
        spec["base"]["clutch"] |= clutch
        assert parse_spec(spec).study.base["pendulums.0.initial_clutch"] == pendulum["initial_clutch"]


def test_starts_leave_the_speeds_of_a_locked_pendulum_alone() -> None:
    spec = _spec(ranges={ANGLE: [0, 1], SPEED: [1, 2]})
    spec["base"]["pendulums"][0] |= {"backlash": 0, "initial_clutch": 4}
    spec["base"]["clutch"]["coefficients"] = [0.1, 200]
    with pytest.raises(SpecError) as error:
        parse_spec(spec)
    assert [(fault.where, fault.code) for fault in error.value.faults] == [(f"/starts/ranges/{SPEED}", "conflict")]


def test_null_is_not_a_missing_field() -> None:
    with pytest.raises(SpecError) as error:
        parse_spec({**_spec(), "starts": None, "run": None})
    found = {fault.where: (fault.code, fault.message) for fault in error.value.faults}
    assert found == dict.fromkeys(("/run", "/starts"), ("wrong-type", "must be an object"))


def test_a_million_runs_are_mentioned() -> None:
    spec = _spec(count=4096)
    assert not [text for text in parse_spec(spec).warnings if "runs" in text]
    spec["axes"][0]["linspace"][2] = 32
    (warning,) = (text for text in parse_spec(spec).warnings if "runs" in text)
    assert "384 cases with 4,096 starts each are 1,572,864 runs" in warning
