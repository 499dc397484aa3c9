"""Components as one variable: the places of an axis have names, and all parameters of a component each."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest

from sprag_study.service.presets import preset_text
from sprag_study.service.reading.catalogue import axes_json
from sprag_study.service.reading.directions import ends_in_words
from sprag_study.service.spec.component_axes import with_fields
from sprag_study.service.spec.components import Component
from sprag_study.service.spec.design import design_spec, points_spec
from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.reuse import kin_hash, shared_cases
from sprag_study.worker.study import Study

BASE: dict[str, Any] = json.loads(preset_text("one_pendulum")[1])["base"]
CLUTCHES = [
    {"name": "FW 16", "coefficients": "0; 180; 0; 18000", "backlash": "0.3 deg", "price": "31 EUR"},
    {"name": "FW 20", "coefficients": "0; 210; 0; 20000", "backlash": "0.2 deg", "price": "41 EUR"},
    {"name": "FW 25", "coefficients": "0; 300", "backlash": "0.1 deg", "price": "58 EUR"},
]
SPRINGS = [
    {"name": "F-100", "spring_rate": "9 N/mm", "price": "7 EUR"},
    {"name": "F-120", "spring_rate": 9500, "price": "8 EUR"},
]
CLUTCH, SPRING = {"component": "clutch", "of": CLUTCHES}, {"component": "spring", "of": SPRINGS}
OTHER = {**SPRINGS[1], "price": "9 UAH"}
BACK = {**CLUTCHES[0], "coefficients": "0; -3"}
LOAD = {"path": "shaft.load", "values": [0.1, 0.2]}
SPEC: dict[str, Any] = {
    "sprag": 1, "model": "vibration-drive", "base": BASE, "axes": [CLUTCH, SPRING, LOAD],
    "quantities": {"cost": "clutch.price + 2 * spring.price + 3 EUR"},
}  # fmt: skip


def read(**changes: Any) -> Study:
    return parse_spec({**SPEC, **changes}).study


def faults(**changes: Any) -> list[tuple[str | None, str]]:
    with pytest.raises(SpecError) as caught:
        read(**changes)
    return [(fault.where, fault.code) for fault in caught.value.faults]


def test_each_place_has_all_parameters_of_its_component() -> None:
    study = read()
    assert study.shape == (3, 2, 2)
    assert study.axis_paths == ("clutch", "spring", "shaft.load")
    case = study.case_parameters(study.case_number((2, 1, 0)))
    assert (case["clutch.coefficients.1"], case["clutch.coefficients.3"]) == (300.0, 0.0)
    assert (case["pendulums.0.spring_rate"], case["shaft.load"]) == (9500.0, 0.1)
    assert np.isclose(case["pendulums.0.backlash"], np.radians(0.1), rtol=1e-15)
    assert (case["clutch.price"], case["spring.price"]) == (58.0, 8.0)
    assert [(one.name, one.unit) for one in study.quantities] == [("cost", "EUR")]
    assert Study.from_text(study.to_text()) == study
    sent = json.loads(json.dumps(axes_json(study)))  # as a service sends them
    assert [ends_in_words(axis) for axis in sent] == [("FW 16", "FW 25"), ("F-100", "F-120"), (0.1, 0.2)]


def test_the_cases_are_those_of_the_same_numbers_on_plain_axes() -> None:
    """Rows are reused between components and plain parameters, whatever the components are called."""
    named = read(axes=[CLUTCH], quantities={})
    base = copy.deepcopy(BASE)
    base["clutch"] = {"coefficients": [0.0, 210.0, 0.0, 20000.0]}
    plain = parse_spec({
        "sprag": 1, "model": "vibration-drive", "base": base,
        "axes": [{"path": "pendulums.0.backlash", "values": ["0.1 deg", "0.2 deg"]}],
    }).study  # fmt: skip
    kin = kin_hash(named, "7")
    assert kin == kin_hash(plain, "7")
    ours, theirs = shared_cases(named, plain)
    assert (ours.tolist(), theirs.tolist()) == ([1], [1])
    assert (case_keys(named, kin)[:, None] == case_keys(plain, kin)).tolist() == [
        [False] * 2,
        [False, True],
        [False] * 2,
    ]


def test_a_spec_with_names_gets_the_fields_of_stored_components() -> None:
    named = {**SPEC, "axes": [{"component": "spring", "of": ["F-120", SPRINGS[0]]}], "quantities": {}}
    stored = [Component("spring", "F-120", "", {"spring_rate": "9.5 N/mm"})]
    spec = with_fields(named, lambda: stored)
    assert spec["axes"][0]["of"] == [{"name": "F-120", "spring_rate": "9.5 N/mm"}, SPRINGS[0]]
    assert parse_spec(spec).study.components[0].names == ("F-120", "F-100")
    with pytest.raises(SpecError) as caught:
        with_fields({**named, "axes": [{"component": "spring", "of": ["F-12"]}]}, lambda: stored)
    (fault,) = caught.value.faults
    assert (fault.where, fault.code, fault.allowed) == ("/axes/0/of/0", "unknown-name", "F-120")
    assert "did you mean 'F-120'" in fault.message
    assert faults(axes=named["axes"]) == [("/axes/0/of/0", "unknown-name")]


@pytest.mark.parametrize(
    ("item", "found"),
    [
        ({"component": "belt", "of": SPRINGS}, [("/axes/0/component", "invalid-choice")]),
        ({"component": "motor", "of": SPRINGS}, [("/axes/0/component", "invalid-choice")]),
        ({"component": "spring", "of": []}, [("/axes/0/of", "wrong-type")]),
        ({"component": "spring", "of": [*SPRINGS, SPRINGS[0]]}, [("/axes/0/of/2", "repeated")]),
        ({"component": "spring", "of": [{"name": "F"}]}, [("/axes/0/of/0/spring_rate", "required")]),
        ({"component": "spring", "of": [{**SPRINGS[0], "length": "1 m"}]}, [("/axes/0/of/0/length", "unknown-field")]),
        ({"component": "spring", "of": [SPRINGS[0], OTHER]}, [("/axes/0/of/1", "wrong-unit")]),
        ({"component": "spring", "of": SPRINGS, "values": ["F-100", "F-12"]}, [("/axes/0/values/1", "invalid-choice")]),
        (
            {"component": "clutch", "of": [CLUTCHES[0], {**CLUTCHES[1], "windup_limit": "5 deg"}]},
            [("/axes/0/of/0", "required")],
        ),
        ({"component": "clutch", "of": [BACK]}, [("/axes/0/of/0", "no-clutch-law")]),
    ],
)  # fmt: skip
def test_faults(item: dict[str, Any], found: list[tuple[str, str]]) -> None:
    assert faults(axes=[item], quantities={}) == found


def test_components_of_one_kind_vary_once_and_their_parameters_not_beside_them() -> None:
    assert faults(axes=[SPRING, SPRING], quantities={}) == [("/axes/1/component", "repeated")]
    own = {"path": "pendulums.0.spring_rate", "values": [1.0, 2.0]}
    assert faults(axes=[SPRING, own], quantities={}) == [("/axes/1/path", "conflict")]


def test_cases_are_left_out_by_a_component_or_its_parameters() -> None:
    assert read(exclude=[{"clutch": {"is": "FW 20"}}]).cases == 8
    assert read(exclude=[{"clutch.coefficients.1": {"above": 200.0}}, {"clutch.price": {"above": 57.0}}]).cases == 4
    (fault,) = faults(exclude=[{"clutch": {"is": "FW 2"}}])
    assert fault == ("/exclude/0/clutch/is", "invalid-choice")


def test_further_studies_keep_the_names() -> None:
    study = read()
    one = parse_spec(design_spec(SPEC, study, 11)).study
    assert [one.components[0].names, one.components[1].names] == [("FW 25",), ("F-120",)]
    assert one.base["pendulums.0.spring_rate"] == 9500.0
    some = parse_spec(points_spec(SPEC, study, [0, 11, 0, 3])).study
    assert some.cases == 3
    assert some.axis_with("clutch").values == (0.0, 1.0, 0.0)
    for mine, theirs in zip(range(3), (0, 11, 3), strict=True):
        assert case_machine(some, mine) == case_machine(study, theirs)
    more = parse_extended(SPEC, study, {"axes": [{"path": "shaft.load", "values": [0.3]}]}).study
    assert more.shape == (3, 2, 3)
    assert more.components == study.components
