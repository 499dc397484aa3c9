"""The part of a spec that refines curves and maps."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from sprag_study.service.http.web.form.fields import refine_fields
from sprag_study.service.jobs.preview import preview_json
from sprag_study.service.languages import language
from sprag_study.service.reading.faults import fault_text
from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.kinds.refine import REFINE as RECORD
from sprag_study.service.spec.longer import longer_spec
from sprag_study.service.spec.report import SpecError
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.planning import most_cases, planner_of
from sprag_study.worker.study import Study
from tests.service.spec_sample import changed, parsed, problems

AXES = [
    {"path": "excitation.frequency", "values": ["20 Hz", "25 Hz"]},
    {"path": "shaft.load", "adaptive": [0, "1600 N*mm"]},
]
REFINE = {"results": ["shaft.speed.mean", "torque.max"], "error": "1 %", "start": 5, "finest": "1/64"}


def refined(changes: dict[str, Any]) -> dict[str, Any]:
    """Changes of the sample that make it a refined study, and others."""
    return {"/axes": copy.deepcopy(AXES), "/refine": copy.deepcopy(REFINE), "/combine": ..., **changes}


def test_a_refined_study_has_its_plan_and_its_first_round() -> None:
    study = parsed(refined({})).study
    assert study.plan == {
        "kind": "refine", "results": ["shaft.speed.mean", "torque.max"], "error": 0.01, "start": 5, "finest": 64,
        "most": None, "adaptive": [{"paths": ["shaft.load"], "low": 0.0, "high": 1.6}],
        "fixed": [{"paths": ["excitation.frequency"], "values": [20.0, 25.0]}], "regime": False, "half_widths": [],
    }  # fmt: skip
    assert (study.combine, study.cases, most_cases(study)) == ("zip", 10, 130)
    assert study.axis_paths == ("excitation.frequency", "shaft.load")
    for frequency in (20.0, 25.0):
        loads = np.sort(study.points(range(10))[study.axes[0].array == frequency, 1])
        np.testing.assert_array_equal(loads, np.linspace(0.0, 1.6, 5))
    assert Study.from_text(study.to_text()) == study


def test_a_result_may_have_an_error_of_its_own() -> None:
    results = [
        "torque.max",
        {"result": "shaft.speed.mean", "error": "60 rpm"},
        {"result": "efficiency", "error": "2 %"},
    ]
    plan = parsed(refined({"/refine/results": results})).study.plan
    assert plan is not None
    assert plan["results"] == ["torque.max", "shaft.speed.mean", "efficiency"]
    assert plan["errors"] == {
        "shaft.speed.mean": {"value": pytest.approx(2.0 * np.pi), "absolute": True},
        "efficiency": {"value": 0.02, "absolute": False},
    }


def test_a_wrong_error_of_a_result_is_told_what_may_stand_there() -> None:
    results = [{"result": "shaft.speed.mean", "error": "small"}]
    with pytest.raises(SpecError, match=r'a number of rad/s, for example .*; or a share of its range, such as "2 %"'):
        parsed(refined({"/refine/results": results}))


def test_settled_studies_are_refined_by_their_regimes() -> None:
    study = parsed(refined({"/run": {}})).study
    assert study.plan is not None
    assert study.plan["regime"] is True
    assert study.plan["half_widths"] == ["shaft.speed.mean"]
    needed = set(planner_of(study.plan).results)
    assert {"regime", "regime.order", "shaft.speed.mean.half_width"} <= needed


def test_schema_and_form_name_the_defaults_that_the_reader_takes() -> None:
    fields = RECORD.schema()["properties"]
    given = {name: fields[name]["default"] for name in ("error", "finest")}
    plan = parsed(refined({"/refine": {"results": ["efficiency"]}})).study.plan
    assert parsed(refined({"/refine": {"results": ["efficiency"], **given}})).study.plan == plan
    assert {name: field.default for name, field in refine_fields().items() if name in given} == {
        name: str(default) for name, default in given.items()
    }


def test_ends_may_be_given_in_any_order_and_unit_and_fields_have_defaults() -> None:
    turned = [AXES[0], {"path": "shaft.load", "adaptive": ["1.6 N*m", "0 N*cm"]}]
    study = parsed(refined({"/axes": turned, "/refine": {"results": ["efficiency"]}})).study
    assert study.plan is not None
    assert study.plan["adaptive"] == [{"paths": ["shaft.load"], "low": 0.0, "high": 1.6}]
    assert (study.plan["error"], study.plan["start"], study.plan["finest"]) == (0.01, 17, 256)
    turned[0] = {"path": "excitation.frequency", "adaptive": ["20 Hz", "30 Hz"]}
    plan = parsed(refined({"/axes": turned, "/refine": {"results": ["efficiency"]}})).study.plan
    assert plan is not None
    assert plan["start"] == 9


def test_an_axis_includes_values_and_the_one_of_the_base() -> None:
    load = changed({})["base"]["shaft"]["load"]
    study = parsed(refined({"/axes/1/include": ["300 N*mm", "0.7 N*m", "base"]})).study
    assert study.plan is not None
    own = parse_quantity(load, "N*m")
    assert study.plan["adaptive"] == [
        {"paths": ["shaft.load"], "low": 0.0, "high": 1.6, "include": sorted([0.3, 0.7, own])}
    ]
    assert study.cases == 2 * (5 + len({0.3, 0.7, own} - set(np.linspace(0.0, 1.6, 5).tolist())))
    assert Study.from_text(study.to_text()) == study
    frequency = [{"path": "excitation.frequency", "adaptive": ["20 Hz", "30 Hz"], "include": [22]}, AXES[1]]
    assert parsed(refined({"/axes": frequency, "/refine/start": 9})).study.cases == 90


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"/axes/1/include": []}, "/axes/1/include", "wrong-type"),
        ({"/axes/1/include": [0.1 + 0.01 * k for k in range(17)]}, "/axes/1/include", "wrong-type"),
        ({"/axes/1/include": 0.3}, "/axes/1/include", "wrong-type"),
        ({"/axes/1/include": [0.3, "700 N*mm"]}, "/axes/1/include/0", "ambiguous-unit"),
        ({"/axes/1/include": ["0.3 N*m", "2 N*m"]}, "/axes/1/include/1", "out-of-range"),
        ({"/axes/1/include": ["0.3 N*m", "300 N*mm"]}, "/axes/1/include/1", "repeated"),
        ({"/axes/1/include": [0.3, 0.3]}, "/axes/1/include/1", "repeated"),
        ({"/axes/1/include": ["1e999 N*m"]}, "/axes/1/include/0", "out-of-range"),
        ({"/axes/1/include": ["many"]}, "/axes/1/include/0", "not-a-number"),
        ({"/axes/1/include": ["0.3 s"]}, "/axes/1/include/0", "wrong-unit"),
        ({"/axes/1/include": ["base"], "/base/shaft/load": "2 N*m"}, "/axes/1/include/0", "out-of-range"),
        (
            {
                "/axes/1/include": ["base"],
                "/axes/1/path": ["excitation.amplitude_x", "excitation.amplitude_y"],
                "/axes/1/adaptive": ["1 mm", "9 mm"],
                "/base/excitation/amplitude_y": "3 mm",
            },
            "/axes/1/include/0",
            "conflict",
        ),
        ({"/axes/1/include": [0.1, 0.2, 0.3], "/refine/most": 5}, "/refine/most", "out-of-range"),
        ({"/axes/0/include": ["20 Hz"]}, "/axes/0/include", "unknown-field"),
        ({"/refine/results": ...}, "/refine/results", "required"),
        ({"/refine/results": []}, "/refine/results", "wrong-type"),
        ({"/refine/results": ["shaft.sped.mean"]}, "/refine/results/0", "unknown-name"),
        ({"/refine/results": ["torque.max", "torque.max"]}, "/refine/results/1", "repeated"),
        ({"/refine/error": "30 %"}, "/refine/error", "out-of-range"),
        ({"/refine/error": "small"}, "/refine/error", "not-a-number"),
        ({"/refine/results/0": {"result": "efficiency"}}, "/refine/results/0/error", "required"),
        ({"/refine/results/0": {"result": "efficiency", "error": "30 %"}}, "/refine/results/0/error", "out-of-range"),
        ({"/refine/results/0": {"result": "efficiency", "error": -0.1}}, "/refine/results/0/error", "out-of-range"),
        ({"/refine/results/0": {"result": "efficiency", "error": "1 s"}}, "/refine/results/0/error", "wrong-type"),
        ({"/refine/start": 6}, "/refine/start", "out-of-range"),
        ({"/refine/start": 129}, "/refine/start", "out-of-range"),
        ({"/refine/finest": "1/60"}, "/refine/finest", "out-of-range"),
        ({"/refine/finest": "fine"}, "/refine/finest", "not-a-number"),
        ({"/refine/most": 0}, "/refine/most", "out-of-range"),
        ({"/refine/errors": 1}, "/refine/errors", "unknown-field"),
        ({"/axes/1/adaptive": [0.1]}, "/axes/1/adaptive", "wrong-type"),
        ({"/axes/1/adaptive": ["0.1 N*m", "100 N*mm"]}, "/axes/1/adaptive", "invalid-range"),
        ({"/axes/1/adaptive": [-1, 1]}, "/axes/1/adaptive/0", "out-of-range"),
        ({"/axes/0/path": "shaft.load", "/axes/0/values": [0.1]}, "/axes/1/path", "repeated"),
        ({"/axes/1": {"path": "shaft.load", "values": [0.1]}}, "/axes", "exactly-one"),
        ({"/axes": [{"points": "shaft.load\n0.1\n0.2"}]}, "/axes/0/points", "conflict"),
        ({"/axes/0": {"sample": {"size": 4}}}, "/axes/0/sample", "conflict"),
        ({"/combine": "zip"}, "/combine", "conflict"),
        ({"/exclude": []}, "/exclude", "conflict"),
        ({"/goal": {}}, "/goal", "conflict"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(changes: dict[str, Any], pointer: str, code: str) -> None:
    found = problems(refined({"/run": {}, **changes}))
    assert {where: fault.code for where, fault in found.items()} == {pointer: code}
    assert found[pointer].allowed or pointer == "/axes/1/path"


def test_too_many_points_are_refused() -> None:
    many = {"path": "excitation.frequency", "linspace": ["16 Hz", "35 Hz", 50_000]}
    fault = problems(refined({"/run": {}, "/axes/0": many, "/refine/finest": "1/4096"}))["/refine"]
    english = "finest: 4096 is not allowed; it must be at most 8,000,000 for all points of the finest grids and all"
    assert fault_text(fault).startswith(english)
    with language("uk"):
        assert fault_text(fault).startswith("finest: значення 4096 неприпустиме; має бути щонайбільше 8")


def test_a_refinement_needs_what_it_is_about() -> None:
    changes = refined({})
    del changes["/refine"]
    assert {where: fault.code for where, fault in problems(changes).items()} == {"/refine": "required"}


def test_a_preview_gives_what_there_can_be_at_most() -> None:
    made = preview_json(parsed(refined({})), Chunking())
    given = preview_json(parsed({}), Chunking())
    assert (made["cases"], made["most_cases"], made["most_rounds"]) == (10, 130, 5)
    assert (given["cases"], given["most_cases"], given["most_rounds"]) == (192, 192, 1)
    few = preview_json(parsed(refined({"/refine/most": 12})), Chunking())
    assert (few["cases"], few["most_cases"], few["most_rounds"]) == (10, 12, 3)
    assert preview_json(parsed(refined({"/refine/most": 8})), Chunking())["most_rounds"] == 1
    assert made["estimated_bytes"] > 10 * preview_json(parsed({"/axes": []}), Chunking())["estimated_bytes"]


def test_a_refined_study_is_not_extended_and_its_unsettled_cases_run_longer_as_a_list() -> None:
    found = parsed(refined({"/run": {}}))
    with pytest.raises(SpecError) as refused:
        parse_extended(found.spec, found.study, {"axes": [{"path": "shaft.load", "values": [2.0]}]})
    assert [fault.code for fault in refused.value.faults] == ["conflict"]
    longer = longer_spec(changed(refined({"/run": {}})), found.study, np.array([1, 3]))
    assert "refine" not in longer
    assert [len(axis["values"]) for axis in longer["axes"]] == [2, 2]
