"""The field `sweep` of an axis: what it makes of a study, and where it is refused."""

from __future__ import annotations

from typing import Any

import pytest

from sprag_study.service.spec.design import design_spec
from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.longer import longer_spec
from tests.service.spec_sample import changed, parsed, schema

AXIS: dict[str, Any] = {"path": "excitation.frequency", "linspace": ["16 Hz", "35 Hz", 5]}
STARTS: dict[str, Any] = {"count": 4, "ranges": {"shaft.initial_speed": ["0 rad/s", "30 rad/s"]}}
SETTLED: dict[str, Any] = {"/run": {"until": "settled"}}
LOADS: dict[str, Any] = {"path": "shaft.load", "values": [0.1, 0.2]}


def spec(way: object = "both", axis: dict[str, Any] = AXIS, others: tuple[Any, ...] = (LOADS,)) -> dict[str, Any]:
    return SETTLED | {"/axes": [{**axis, "sweep": way}, *others]}


@pytest.mark.parametrize(("way", "values"), [("up", (0.0,)), ("down", (1.0,)), ("both", (0.0, 1.0))])
def test_a_swept_axis_adds_an_axis_of_directions(way: str, values: tuple[float, ...]) -> None:
    study = parsed(spec(way)).study
    assert study.sweep == "excitation.frequency"
    assert study.axes[-1].paths == ("sweep",)
    assert study.axes[-1].values == values
    assert study.shape == (5, 2, len(values))
    assert study.case_parameters(len(values) - 1)["sweep"] == values[-1]
    schema().validate(changed(spec(way)))


@pytest.mark.parametrize(
    ("changes", "where", "code"),
    [
        (spec("sideways"), "/axes/0/sweep", "invalid-choice"),
        (spec(None), "/axes/0/sweep", "invalid-choice"),
        (spec(others=({**LOADS, "sweep": "up"},)), "/axes/1", "repeated"),
        (spec() | {"/combine": "zip"}, "/axes/0/sweep", "conflict"),
        (spec() | {"/combine": "union"}, "/axes/0/sweep", "conflict"),
        (spec() | {"/exclude": [{"shaft.load": {"is": 0.1}}]}, "/axes/0/sweep", "conflict"),
        (spec() | {"/tolerances": [{"path": "shaft.load", "plus_minus": "5 %"}]}, "/axes/0/sweep", "conflict"),
        (spec(others=({"path": "shaft.load", "adaptive": [0.1, 0.2]},)), "/axes/0/sweep", "conflict"),
        (SETTLED | {"/axes": [{"axes": [{**AXIS, "sweep": "up"}]}, LOADS]}, "/axes/0", "conflict"),
        (spec() | {"/run": {"duration": "60 periods"}}, "/axes/0/sweep", "not-used"),
        (spec() | {"/starts": STARTS}, "/axes/0/sweep", "conflict"),
        (spec(axis={"path": "shaft.initial_speed", "values": [0, 1]}), "/axes/0/sweep", "conflict"),
        (spec(axis={"path": "excitation.frequency", "values": [20]}), "/axes/0/sweep", "nothing-varies"),
    ],
)
def test_what_cannot_be_swept_is_refused(changes: dict[str, Any], where: str, code: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec(changed(changes))
    assert (where, code) in {(fault.where, fault.code) for fault in refused.value.faults}


def test_a_machine_shaft_has_no_sweep() -> None:
    from sprag_study.service.presets import preset_text
    from sprag_study.service.spec.text import load_spec

    press = load_spec(preset_text("press")[1], "toml")
    assert isinstance(press, dict)
    press["axes"] = [{**press["axes"][0], "sweep": "up"}]
    with pytest.raises(SpecError) as refused:
        parse_spec(press)
    assert {(fault.where, fault.code) for fault in refused.value.faults} == {("/axes/0/sweep", "not-used")}


def test_extended_and_longer_studies_are_swept_in_the_same_way() -> None:
    old = parsed(spec("down"))
    new = parse_extended(old.spec, old.study, {"axes": [{"path": "shaft.load", "values": [0.3]}]}).study
    assert (new.sweep, new.shape, new.axes[-1].values) == ("excitation.frequency", (5, 3, 1), (1.0,))
    with pytest.raises(SpecError) as refused:
        parse_extended(old.spec, old.study, {"cases": [{"path": "shaft.load", "values": [0.3]}]})
    assert refused.value.faults[0].code == "conflict"
    with pytest.raises(SpecError) as refused:
        parse_extended(old.spec, old.study, {"axes": [{"path": "shaft.load", "values": [0.3], "sweep": "up"}]})
    assert refused.value.faults[0].where == "/axes/0/sweep"
    longer = parse_spec(longer_spec(old.spec, old.study, [3])).study  # type: ignore[arg-type]
    assert (longer.axes, longer.sweep, longer.run["at_most"]) == (old.study.axes, old.study.sweep, 4000)


def test_a_case_of_a_sweep_is_a_design_of_its_own() -> None:
    old = parsed(spec())
    alone = parse_spec(design_spec(old.spec, old.study, 7)).study
    assert alone.sweep is None
    assert alone.cases == 1
    assert alone.base["excitation.frequency"] == old.study.case_parameters(7)["excitation.frequency"]
