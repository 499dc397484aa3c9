"""Planar linkages in specs: what is read, what is refused at its place, and lines of the form."""

from __future__ import annotations

import copy
from typing import Any

import pytest

from sprag_study.service.exports.inputs import choices
from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form.element_lines import element_of, elements_of, lines_of
from sprag_study.service.http.web.form.machine_spec import base_of, values_of_base
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.report import SpecError

ELEMENTS = "/base/mechanism/linkage/elements"


def spec() -> dict[str, Any]:
    return copy.deepcopy(preset_of("six_bar_press")["spec"])


def linkage_of(document: dict[str, Any]) -> dict[str, Any]:
    linkage: dict[str, Any] = document["base"]["mechanism"]["linkage"]
    return linkage


def test_a_linkage_is_read() -> None:
    document = spec()
    linkage = linkage_of(document)
    del linkage["elements"][3]["to"], linkage["elements"][3]["guide"], linkage["elements"][1]["branch"]
    del linkage["forward"]
    study = parse_spec(document).study
    assert study.structure == parse_spec(spec()).study.structure
    assert study.base["mechanism.linkage.elements.1.second"] == pytest.approx(0.13)
    assert study.structure is not None
    assert study.structure["mechanism"]["linkage"]["elements"][3] == {
        "kind": "RRP", "name": "R", "joints": ["D", "O"], "guides": ["frame"], "branch": "ahead",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("index", "field", "value", "code", "text"),
    [
        (1, "to", "Q", "conflict", "is no joint that stands before it in the list"),
        (1, "kind", "RRRR", "invalid-choice", "is not a valid choice"),
        (1, "branch", "ahead", "invalid-choice", "is not a valid choice"),
        (1, "first", None, "required", "is required"),
        (1, "angle", "3 deg", "unknown-field", "is not a field of an element of the kind RRR"),
        (2, "on", 3, "wrong-type", "must be a text"),
        (2, "on", "C.third", "conflict", "is no link that stands before it in the list"),
        (3, "name", "B", "conflict", "is the name of another joint or link"),
        (3, "name", "3", "invalid-text", "is not a valid name for an element"),
        (3, "to", "D", "conflict", "is not on frame, to which the guide is fixed"),
    ],
)
def test_a_fault_stands_at_its_field(index: int, field: str, value: Any, code: str, text: str) -> None:
    document = spec()
    element = linkage_of(document)["elements"][index]
    if value is None:
        del element[field]
    else:
        element[field] = value
    with pytest.raises(SpecError) as error:
        parse_spec(document)
    place = f"{ELEMENTS}/{index}/{field}"
    messages = [str(fault.message) for fault in error.value.faults if (fault.where, fault.code) == (place, code)]
    assert [message[: len(text)] for message in messages] == [text]


def test_the_working_part_and_links_that_do_not_reach() -> None:
    document = spec()
    linkage_of(document)["working"] = "D"
    with pytest.raises(SpecError, match="its travel is no stroke"):
        parse_spec(document)
    document = spec()
    linkage_of(document)["elements"][1]["first"] = "120 mm"
    with pytest.raises(SpecError) as error:
        parse_spec(document)
    (fault,) = error.value.faults
    assert (fault.where, fault.code) == ("/base/mechanism/linkage", "cannot-assemble")
    assert "the links of the group C (0.12 m and 0.13 m) are too short to go from A to B" in str(fault.message)


def test_inputs_tell_what_elements_are_attached_to() -> None:
    document = spec()
    del linkage_of(document)["working"], document["base"]["operation"]
    other = copy.deepcopy(document)
    linkage_of(other)["elements"][1]["branch"] = "right"
    texts, others = (choices(parse_spec(data).study, data) for data in (document, other))
    elements = "mechanism.linkage.elements"
    assert texts[elements] == "pivot B; RRR C (A, B, left); point D (C.first); RRP R (D, O, frame, ahead)"
    assert texts["mechanism.linkage.working"] == "none"
    assert {name for name in texts if texts[name] != others[name]} == {elements}


def test_an_axis_names_an_element() -> None:
    document = spec()
    document["axes"][0] = {"path": "mechanism.linkage.elements.7.second", "values": ["1 m"]}
    with pytest.raises(SpecError, match="there is no element 7: elements are numbered from 0 to 3"):
        parse_spec(document)


def test_lines_of_the_form_are_the_elements() -> None:
    base = spec()["base"]
    values = {"model": "machine-shaft"}
    values_of_base(base, values)
    lines = values["/base/mechanism/linkage/elements"].splitlines()
    assert lines[2] == "point D; on = C.first; along = 100 mm; across = 80 mm"
    faults: dict[str, list[str]] = {}
    assert parse_spec(spec() | {"base": base_of(values, faults)}).study.base == parse_spec(spec()).study.base
    assert not faults
    wrong: list[str] = []
    assert elements_of("pivot B; x 3 mm; y = 2 mm", wrong) == [{"kind": "pivot", "name": "B", "y": "2 mm"}]
    assert wrong == ["line 1 cannot be read at x 3 mm; allowed: lines such as RRR C; from = A; to = B; first = 200 mm"]
    assert lines_of(elements_of("RRP R; from = D; angle = = 2*x", [])) == "RRP R; from = D; angle = = 2*x"
    assert element_of(f"{ELEMENTS}/1/from") == "element 2, from: "
    assert element_of("/base/operation/steps/1/from") == ""
