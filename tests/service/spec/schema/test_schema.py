"""The JSON Schema of a spec: it accepts what is a spec and refuses what every reader can see is none."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from sprag_study.service.spec.axes.axes import AXIS
from sprag_study.service.spec.described import schema_of
from sprag_study.service.spec.document import SpecError, format_of, load_spec, parse_spec
from sprag_study.service.spec.machine.clutch import CLUTCH
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.run import RUN
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.worker.models import model_names, parameter_catalogue
from tests.service.spec_sample import SPEC, changed


@pytest.fixture(scope="module")
def validator() -> Any:
    schema = spec_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(json.loads(json.dumps(schema)))


def test_it_accepts_the_examples(validator: Any, examples: Path) -> None:
    validator.validate(SPEC)
    for name in ("one_pendulum.json", "two_pendulums.toml", "measured_clutch.json"):
        validator.validate(load_spec((examples / name).read_bytes(), format_of(name)))
    printed = changed({"/run/tolerance": "1·10⁻⁹"})
    validator.validate(printed)
    assert parse_spec(printed).study.run["tolerance"] == 1e-9


@pytest.mark.parametrize(
    "changes",
    [
        {"/extra": 1},
        {"/base/extra": 1},
        {"/base/excitation/extra": 1},
        {"/base/pendulums/0/extra": 1},
        {"/base/shaft/extra": 1},
        {"/base/clutch/extra": 1},
        {"/run/max_steps": 1},
        {"/axes/0/extra": 1},
        {"/sprag": 2},
        {"/model": "other"},
        {"/name": ""},
        {"/combine": "product"},
        {"/base": ...},
        {"/base/excitation": ...},
        {"/base/shaft/inertia": ...},
        {"/base/shaft/inertia": 0},
        {"/base/shaft/inertia": True},
        {"/base/shaft/load": -1},
        {"/base/shaft/load": ["0.1 N*m"]},
        {"/base/pendulums": []},
        {"/base/pendulums": [SPEC["base"]["pendulums"][0]] * 9},
        {"/base/clutch/coefficients": []},
        {"/base/clutch/data": [[0, 1], [1, 2]]},
        {"/base/clutch": {"data": [[0, 1], [1, 2]]}},
        {"/base/clutch": {"data": [[0, 1], [1, 2, 3]], "accuracy": 1}},
        {"/run/tolerance": 1},
        {"/run/tolerance": "1e-9"},
        {"/run/reset": "never"},
        {"/run/until": "settled"},
        {"/run": {"until": "steady"}},
        {"/run": {"at_most": 1000}},
        {"/run": {"duration": 1, "max_period": 2}},
        {"/run": {"max_period": 65}},
        {"/run/window": ["1 periods"]},
        {"/axes/0/linspace": [1, 2]},
        {"/axes/0/linspace": [1, 2, 0]},
        {"/axes/0/values": [1, 2]},
        {"/axes/2/values": []},
        {"/axes/2/values": ...},
        {"/axes/1/path": []},
        {"/derive": {"shaft.inertia": 3}},
        {"/derive": []},
        {"/base/clutch/coefficients": [0, None]},
    ],
)
def test_it_refuses_what_the_reader_refuses(validator: Any, changes: dict[str, Any]) -> None:
    spec = changed(changes)
    assert not validator.is_valid(spec)
    with pytest.raises(SpecError):
        parse_spec(spec)


@pytest.mark.parametrize(
    "changes",
    [
        {"/base/gravity": 0},
        {"/base/shaft/load": 0},
        {"/base/clutch/windup_limit": "3 deg"},
        {"/base/clutch": {"data": [[0, 0], ["1 deg", 2], ["2 deg", "4 N*m"]], "accuracy": 1, "max_degree": 2}},
        {"/run": {"duration": 2}},
        {"/run": {"until": "settled"}},
        {"/run": {"at_most": "2000 periods", "settled": 1e-6, "max_period": 8, "tolerance": 1e-8}},
        {"/axes/0": {"path": "gravity", "range": [0, 10, 1]}},
        {"/axes/0": {"path": "gravity", "geomspace": [1, 10, 3]}},
        {"/name": ..., "/axes": ..., "/run": ..., "/combine": ...},
        {
            "/base/pendulums/0/inertia": ...,
            "/base/shaft/inertia": ...,
            "/base/clutch/coefficients": [0, None],
            "/derive": {
                "pendulums.*.inertia": "1 kg*m^2",
                "shaft.inertia": "1 kg*m^2",
                "clutch.coefficients.1": "200 N*m/rad",
            },
        },
    ],
)
def test_it_accepts_what_the_reader_accepts(validator: Any, changes: dict[str, Any]) -> None:
    validator.validate(changed(changes))
    parse_spec(changed(changes))


def test_it_follows_the_catalogue() -> None:
    for model in model_names():
        text = json.dumps(schema_of(part_of(model).base()))
        for entry in parameter_catalogue(model):
            if not entry.path.startswith(("clutch.", "constants.", "shaft.load_table.", "excitation.harmonics.")):
                assert f'"{entry.path.split(".")[-1]}"' in text
                assert json.dumps(entry.range_text())[1:-1] in text
    with pytest.raises(ValueError, match="unknown model"):
        part_of("other")


def test_the_parts_stand_alone() -> None:
    for part in (AXIS.schema(), CLUTCH.schema(), RUN):
        jsonschema.Draft202012Validator.check_schema(part)
