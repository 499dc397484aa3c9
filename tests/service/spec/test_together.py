"""Quantities that are typed together: a unit at the end of a list or a range, and what is asked about."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest

from sprag_study.service.cli.extend import _values
from sprag_study.service.faults import FaultError
from sprag_study.service.http.web.form import calibration
from sprag_study.service.http.web.form.check import check_form
from sprag_study.service.http.web.form.entries import list_of
from sprag_study.service.http.web.form.machine_spec import base_of
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.languages import language
from sprag_study.service.reading.faults import fault_text
from sprag_study.service.reading.reader import Reading
from sprag_study.service.reading.together import question, questions, with_last_unit
from sprag_study.service.results.explore import ExploreQuery, plan_of
from sprag_study.service.results.selection import locate_values
from sprag_study.service.results.tolerances.conditions import read_conditions
from sprag_study.service.spec.components import faults_of
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.stored import accepted
from sprag_study.service.views.branch import range_of
from sprag_study.service.views.trajectory import span
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from tests.service.spec_sample import SPEC, changed, parsed, problems

LOAD = "shaft.load"
PATH = {"/axes/0/path": LOAD}


def form(**fields: str) -> dict[str, str]:
    """The sample spec in the form, with one axis, of the load, given by these fields."""
    values = values_of(changed({"/axes": [{"path": LOAD, "values": [1]}]}))
    return values | {f"/axes/0/{name}": text for name, text in fields.items()}


def loads(**fields: str) -> list[float]:
    study = parse_spec(spec_of(form(**fields))[0]).study
    return study.columns(range(study.cases))[LOAD].tolist()


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0; 50; 100; 200 N*mm", [0.0, 0.05, 0.1, 0.2]),
        ("100; 200; 300 N*mm", [0.1, 0.2, 0.3]),
        ("100\n200 N·mm", [0.1, 0.2]),
        ("0,5; 1,25 Н·мм", [0.0005, 0.00125]),
        ("0; 0.1; 0.2 N*m", [0.0, 0.1, 0.2]),
        ("50 N*mm; 100; 200 Nmm", [0.05, 0.1, 0.2]),  # one unit, in two spellings
        ("1; 2; 5", [1.0, 2.0, 5.0]),
        ("0; 1 N*m; 2000 N*mm", [0.0, 1.0, 2.0]),  # nothing is nothing in every unit
    ],
)
def test_a_unit_at_the_end_of_a_list_holds_for_the_bare_numbers(text: str, expected: list[float]) -> None:
    assert loads(way="values", values=text) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "place", "asked"),
    [
        ("1 N*mm; 2; 3 N*cm", 1, "2 in N*m, in N*mm or in N*cm?"),
        ("1 N*mm; 2; 3", 1, "2 in N*m or in N*mm?"),
        ("50; 1 N*m; 100 N*mm", 0, "50 in N*m or in N*mm?"),
    ],
)
def test_a_number_between_other_units_is_asked_about(text: str, place: int, asked: str) -> None:
    checked = check_form(form(way="values", values=text), Chunking(0, 2, 60.0))
    assert asked in checked.faults["/axes/0/values"][0]
    assert checked.preview is None
    assert problems({"/axes": [{"path": LOAD, "values": list_of(text)}]})[f"/axes/0/values/{place}"]


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"way": "linspace", "from": "100", "to": "1000 N*mm", "count": "4"}, [0.1, 0.4, 0.7, 1.0]),
        ({"way": "geomspace", "from": "10", "to": "1000 N*mm", "count": "3"}, [0.01, 0.1, 1.0]),
        ({"way": "range", "from": "0", "to": "1000 N*mm", "step": "250"}, [0.0, 0.25, 0.5, 0.75, 1.0]),
        ({"way": "range", "from": "0", "to": "1000", "step": "250 N*mm"}, [0.0, 0.25, 0.5, 0.75, 1.0]),
        ({"way": "range", "from": "500", "to": "1000 N*mm", "step": "0.25 N*m"}, None),
        ({"way": "range", "from": "0 N*mm", "to": "1000", "step": "250"}, None),
        ({"way": "linspace", "from": "100 N*mm", "to": "1000", "count": "4"}, None),
    ],
)
def test_ends_and_steps(fields: dict[str, str], expected: list[float] | None) -> None:
    if expected is None:
        checked = check_form(form(**fields), Chunking(0, 2, 60.0))
        assert any("in N*m or in N*mm?" in text for texts in checked.faults.values() for text in texts)
    else:
        assert loads(**fields) == pytest.approx(expected, rel=1e-12)


ENDS = {"from": 100, "to": "1000 N*mm"}


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"/axes": [{"path": LOAD, "values": [50, "100 N*mm"]}]}, "/axes/0/values/0"),
        ({"/axes": [{"path": LOAD, "linspace": [100, "1000 N*mm", 4]}]}, "/axes/0/linspace/0"),
        ({"/axes": [{"path": LOAD, "geomspace": ["100 N*mm", 1, 4]}]}, "/axes/0/geomspace/1"),
        ({"/axes": [{"path": LOAD, "range": [0, "1000 N*mm", 100]}]}, "/axes/0/range/2"),
        ({"/axes": [{"sample": "sobol", "count": 4, "ranges": [{"path": LOAD, **ENDS}]}]}, "/axes/0/ranges/0/from"),
        ({"/axes": [{"sample": "sobol", "count": 4, "ranges": [{"path": LOAD, "nominal": 1, "plus_minus": "5 N*mm"}]}]},
         "/axes/0/ranges/0/nominal"),
        ({"/axes": [{"path": LOAD, "adaptive": [100, "1000 N*mm"]}], "/refine": {"results": ["efficiency"]}},
         "/axes/0/adaptive/0"),
        ({"/exclude": [{LOAD: {"is": [1, "20 N*mm"]}}]}, f"/exclude/0/{LOAD}/is/0"),
        ({"/exclude": [{LOAD: {"above": 1, "below": "2000 N*mm"}}]}, f"/exclude/0/{LOAD}/above"),
        ({"/tolerances": [{"path": LOAD, "values": [0.1, "20 N*mm"]}], "/axes": []}, "/tolerances/0/values/0"),
        ({"/tolerances": [{"path": "pendulums.0.arm", "plus_minus": 0.2}]}, "/tolerances/0/plus_minus"),
        ({"/run/window": [40, "60 periods"]}, "/run/window/0"),
        ({"/base/clutch": {"data": [[0, 0], ["1 deg", 5], [0.04, "8 N*m"]], "accuracy": 1}}, "/base/clutch/data/2/0"),
        ({"/base/clutch": {"coefficients": [25, 400, "30 N*mm/rad^2"]}}, "/base/clutch/coefficients/0"),
    ],
)  # fmt: skip
def test_items_of_a_spec_are_asked_about(changes: dict[str, Any], pointer: str) -> None:
    fault = problems(changes)[pointer]
    assert fault.code == "ambiguous-unit"
    assert " or in " in fault.message
    with language("uk"):
        assert fault_text(fault).startswith("без одиниці поруч зі значеннями, що її мають: ")


def test_the_question_names_number_and_units() -> None:
    fault = problems({"/axes": [{"path": LOAD, "values": [50, "100 N*mm"]}]})["/axes/0/values/0"]
    assert "50 in N*m or in N*mm?" in fault.message
    assert (fault.value, fault.allowed, fault.unit) == (50, "50 N*m, 50 N*mm", "N*m")
    assert [one.allowed for one in questions([12, "100 rpm"], ["rad/s"] * 2)] == ["12 rad/s, 12 rpm"]
    coefficient = problems({"/base/clutch": {"coefficients": [25, 400, "30 N*mm/rad^2"]}})
    assert "400 in N*m/rad or in N*mm/rad?" in coefficient["/base/clutch/coefficients/1"].message


@pytest.mark.parametrize("values", [[0, "100 N*mm"], [1, "2 N*m"], ["1 N*m", "100 N*mm"], [1, 2]])
def test_what_is_certain_is_not_asked_about(values: list[Any]) -> None:
    parsed({"/axes": [{"path": LOAD, "values": values}]})
    assert question(values, "N*m") is None


GOAL = {
    "vary": [{"path": "excitation.frequency", "from": "20 Hz", "to": "35 Hz"}],
    "best": [{"result": "efficiency", "max": True}],
    "at": [{LOAD: "100 N*mm"}, {LOAD: "200 N*mm"}],
    "subject_to": [{"result": "torque.max", "is": "3 N*m", "within": "0.1 N*m"}],
}


def goal(**changes: Any) -> dict[str, Any]:
    spec = {key: value for key, value in SPEC.items() if key not in {"axes", "combine", "run"}}
    return {**copy.deepcopy(spec), "goal": {**GOAL, **changes}}


@pytest.mark.parametrize(
    ("part", "pointer"),
    [
        ({"vary": [{"path": LOAD, **ENDS}], "at": []}, "/goal/vary/0/from"),
        ({"vary": [{"path": LOAD, "values": ["1 N*mm", 2]}], "at": []}, "/goal/vary/0/values/1"),
        ({"at": [{LOAD: 100}, {LOAD: "200 N*mm"}]}, f"/goal/at/0/{LOAD}"),
        ({"subject_to": [{"result": "torque.max", "is": 3, "within": "100 N*mm"}]}, "/goal/subject_to/0/is"),
    ],
)
def test_goals_are_asked_about(part: dict[str, Any], pointer: str) -> None:
    with pytest.raises(FaultError) as caught:
        parse_spec(goal(**part))
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [(pointer, "ambiguous-unit")]


def test_goals_in_the_form() -> None:
    values = values_of(goal()) | {
        "/goal/at/0/values": "100; 300 N*mm",
        "/goal/subject_to/0/value": "3000",
        "/goal/subject_to/0/within": "100 N*mm",
        "/goal/vary/0/values": "1200 to 1800 rpm",
    }
    plan = parse_spec(spec_of(values)[0]).study.plan
    assert plan is not None
    assert [point[LOAD] for point in plan["at"]] == pytest.approx([0.1, 0.3])
    assert plan["subject_to"][0]["is"] == pytest.approx(3.0)
    assert (plan["vary"][0]["low"], plan["vary"][0]["high"]) == pytest.approx((20.0, 30.0))


def test_samples_exclusions_tolerances_and_windows_in_the_form() -> None:
    values = form(way="values", values="100; 200 N*mm") | {
        "ranges": "1", "/sample/sample": "sobol", "/sample/count": "4",
        "/sample/ranges/0/path": "pendulums.0.mass", "/sample/ranges/0/from": "400", "/sample/ranges/0/to": "600 g",
        "exclude": "1", "/exclude/0/path": LOAD, "/exclude/0/kind": "is", "/exclude/0/value": "100; 150 N*mm",
        "batch": "on", "/tolerances/pendulums/0/damping/plus_minus": "9; 10; 11 N*mm*s/rad",
        "/tolerances/pendulums/0/damping/distribution": "values",
        "/run/until": "time", "/run/window/0": "40", "/run/window/1": "60 periods",
    }  # fmt: skip
    spec, faults = spec_of(values)
    assert not faults
    assert spec["exclude"] == [{LOAD: {"is": ["100 N*mm", "150 N*mm"]}}]
    assert spec["tolerances"][0]["values"] == ["9 N*mm*s/rad", "10 N*mm*s/rad", "11 N*mm*s/rad"]
    assert spec["run"]["window"] == ["40 periods", "60 periods"]
    assert spec["axes"][1]["ranges"][0] == {"path": "pendulums.0.mass", "from": "400 g", "to": "600 g"}


def test_steps_of_a_shaft_and_unknown_parameters_of_a_calibration() -> None:
    fields = {"model": "machine-shaft", "/base/operation": "steps", "/base/operation/quantity": "torque",
              "/base/operation/steps": "0; 90; 5\n90; 180; 10\n180; 270 deg; 20 kN*m"}  # fmt: skip
    steps = base_of(fields, {})["operation"]["steps"]
    assert [step["value"] for step in steps] == ["5 kN*m", "10 kN*m", "20 kN*m"]
    assert [step[name] for step in steps for name in ("from", "to")] == [
        "0 deg", "90 deg", "90 deg", "180 deg", "180 deg", "270 deg",
    ]  # fmt: skip
    ends = {"unknown": "1", "/calibrate/unknown/0/path": LOAD, "/calibrate/unknown/0/from": "100"}
    spec, _form = calibration.form_with_spec(SPEC, {**ends, "/calibrate/unknown/0/to": "1000 N*mm"})
    assert spec["calibrate"]["unknown"] == [{"path": LOAD, "from": "100 N*mm", "to": "1000 N*mm"}]


def test_steps_of_a_spec_are_asked_about() -> None:
    base = {
        "mean_speed": "100 rpm",
        "drive": {"inertia": "1 kg*m^2"},
        "operation": {"quantity": "torque", "steps": [{"from": 0, "to": "1 rad", "value": 5},
                                                      {"from": 2, "to": "180 deg", "value": "20 kN*m"}]},
    }  # fmt: skip
    with pytest.raises(FaultError) as caught:
        parse_spec({"sprag": 1, "model": "machine-shaft", "base": base})
    found = {fault.where: fault.message for fault in caught.value.faults if fault.code == "ambiguous-unit"}
    assert set(found) == {"/base/operation/steps/0/value", "/base/operation/steps/1/from"}
    assert "5 in N*m or in kN*m?" in found["/base/operation/steps/0/value"]


def test_the_command_and_the_page_extend_alike() -> None:
    assert _values("50;100;200 N*mm") == _values("50,100,200 N*mm") == ["50 N*mm", "100 N*mm", "200 N*mm"]
    assert list_of("50; 100; 200 N*mm") == ["50 N*mm", "100 N*mm", "200 N*mm"]
    old = parsed({"/axes": [{"path": LOAD, "values": ["100 N*mm"]}]})
    new = parse_extended(old.spec, old.study, {"axes": [{"path": LOAD, "values": _values("50;200 N*mm")}]})
    assert sorted(new.study.columns(range(3))[LOAD]) == pytest.approx([0.05, 0.1, 0.2])
    assert "not-monotonic" not in {getattr(text, "code", "") for text in new.warnings}


def test_selections_ranges_and_conditions() -> None:
    study = parsed({"/axes": [{"path": LOAD, "values": ["100 N*mm", "200 N*mm"]}]}).study
    infos = models.study_results(study)
    with pytest.raises(FaultError) as caught:
        locate_values(study, [(LOAD, "100"), (LOAD, "200 N*mm")])
    assert "100 in N*m or in N*mm?" in caught.value.faults[0].message
    with pytest.raises(FaultError) as caught:
        plan_of(study, ExploreQuery(where=(f"{LOAD} >= 100", f"{LOAD} <= 200 N*mm")))
    assert caught.value.faults[0].code == "ambiguous-unit"
    with pytest.raises(FaultError) as caught:
        read_conditions(infos, ["torque.max >= 100", "torque.max <= 200 N*mm"])
    assert caught.value.faults[0].code == "ambiguous-unit"
    assert span(study, 0, "40", "60 periods") == span(study, 0, "40 periods", "60 periods")
    with pytest.raises(FaultError) as caught:
        span(study, 0, "0.5 ms", "2")
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [("to", "ambiguous-unit")]


def test_ends_of_a_branch() -> None:
    study = parsed({"/axes": [{"path": LOAD, "values": ["100 N*mm", "200 N*mm"]}], "/run": {}}).study
    along = range_of(study, 0, LOAD, "50", "500 N*mm")
    assert (along.low, along.high) == pytest.approx((0.05, 0.5))


def test_components_are_asked_about() -> None:
    faults = faults_of("clutch", {"coefficients": "25; 400 N*mm/rad"})
    assert [(fault.code, fault.value) for fault in faults] == [("ambiguous-unit", "25")]
    assert not faults_of("clutch", {"coefficients": "0; 400 N*m/rad"})


def test_a_list_that_goes_up_and_down_is_pointed_out() -> None:
    def found(values: list[Any], **more: Any) -> list[Any]:
        warnings = parsed({"/axes": [{"path": LOAD, "values": values}], **more}).warnings
        return [text for text in warnings if getattr(text, "code", "") == "not-monotonic"]

    (warning,) = found([0, 50, 100, 0.2])
    assert "0.2 N*m" in warning
    assert "100 N*m" in warning
    with language("uk"):
        said = Reading("vibration-drive").warning(warning)
    assert said.startswith("Момент навантаження: ")
    assert "0,2 Н·м" in said
    assert not found([0, 0.05, 0.1])
    assert not found([0.3, 0.2, 0.1])
    assert not found([0.3, 0.2])


def test_sentences_say_the_least_and_the_largest_value() -> None:
    values = form(way="values", values="200; 0; 300; 100 N*mm")
    checked = check_form(values, Chunking(0, 2, 60.0))
    assert checked.preview is not None
    axis = checked.preview["axes"][0]
    assert (axis["least"], axis["largest"]) == pytest.approx((0.0, 0.3))
    assert (axis["first"], axis["last"]) == pytest.approx((0.2, 0.1))


def test_what_was_accepted_before_is_read_as_it_was() -> None:
    spec = changed({"/axes": [{"path": LOAD, "values": [0.05, "100 N*mm", 0.2]}],
                    "/base/clutch/coefficients": [25, "400 N*mm/rad", 3]})  # fmt: skip
    before = json.dumps(spec)
    settled = accepted(spec)
    assert json.dumps(spec) == before
    assert settled["axes"][0]["values"] == ["0.05 N*m", "100 N*mm", "0.2 N*m"]
    assert parse_spec(settled).study.axes[0].values == pytest.approx((0.05, 0.1, 0.2))
    assert accepted(SPEC) == SPEC
    again = parse_spec(spec_of(values_of(settled))[0]).study
    assert np.array_equal(again.axes[0].array, parse_spec(settled).study.axes[0].array)


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (["1", "", "2 mm"], ["1 mm", "", "2 mm"]),
        (["1", "2 %"], ["1", "2 %"]),
        (["1", "2 foo"], ["1", "2 foo"]),
        (["= 2*k", "1", "2 mm"], ["= 2*k", "1 mm", "2 mm"]),
        (["10", "60 периодов"], ["10 периодов", "60 периодов"]),
        ([], []),
    ],
)
def test_only_a_unit_holds_for_others(texts: list[str], expected: list[str]) -> None:
    assert with_last_unit(texts) == expected


@pytest.mark.parametrize("text", ["100 200 300 N*mm", "100 200 N*mm", "100 200"])
def test_blanks_between_values_are_asked_about(text: str) -> None:
    """Blanks separate thousands only where no group could be a value by itself."""
    checked = check_form(form(way="values", values=text), Chunking())
    assert checked.faults["/axes/0/values"][0].startswith("could be one value or several; got 100 200")
    with pytest.raises(FaultError, match="invalid option"):
        _values(text)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 000 N*mm", [1.0]),
        ("100\u202f200 N*mm", [100.2]),
        ("100 200; 300 000 N*mm", [100.2, 300.0]),
        ("0.1\t0.2 N*m", [0.1, 0.2]),
    ],
)
def test_blanks_that_separate_thousands_for_certain(text: str, expected: list[float]) -> None:
    assert loads(way="values", values=text) == expected


def test_the_ends_of_a_range_settle_their_points_together() -> None:
    ends = {"way": "linspace", "from": "0,5", "to": "1.000 N*mm", "count": "3"}
    assert loads(**ends) == [0.0005, 0.50025, 1.0]
    study = parsed({"/axes": [{"path": LOAD, "linspace": ["0,5 N*mm", "1.000 N*mm", 3]}]}).study
    assert study.columns(range(3))[LOAD].tolist() == [0.0005, 0.50025, 1.0]


@pytest.mark.parametrize("text", ["20.000; 25.000", "20.000; 25.000 N*mm"])
def test_points_of_a_list_that_could_separate_thousands_are_told(text: str) -> None:
    checked = check_form(form(way="values", values=text), Chunking())
    assert checked.parsed is not None
    told = [*checked.notes, *checked.parsed.warnings]
    assert [warning for warning in told if "is read as 20; write 20000 if its point separates thousands" in warning]
    certain = check_form(form(way="values", values="20.000; 25.5 N*mm"), Chunking())
    assert certain.parsed is not None
    assert not [warning for warning in (*certain.notes, *certain.parsed.warnings) if "is read as" in warning]
