"""Descriptions of a spec's objects: what they name is what they have, and all faults are told at once."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from sprag_study.service.spec.described import Field, Listed, Record, Variants, below
from sprag_study.service.spec.document import SPEC, SpecError, parse_spec
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.worker.models import model_names
from tests.service.spec_sample import changed


def records(field: Field) -> Iterator[Record]:
    """Every record of a description."""
    if isinstance(field, Record):
        yield field
    inside = field.fields.values() if isinstance(field, Record) else ()
    inside = (*inside, *(field.ways if isinstance(field, Variants) else ()))
    for part in (*inside, *((field.item,) if isinstance(field, Listed) else ())):
        yield from records(part)


@pytest.mark.parametrize("model", model_names())
def test_a_record_refers_to_its_own_fields(model: str) -> None:
    every = [*records(SPEC), *records(part_of(model).base())]
    assert len(every) > 10
    for record in every:
        assert {*record.required, *record.either, *record.some} <= record.fields.keys()
        for name, field in record.described.items():
            assert field.name == name
        schema = record.schema()
        assert list(schema["properties"]) == list(record.fields)
        assert schema["additionalProperties"] is False


@pytest.mark.parametrize(
    ("path", "help"),
    [
        ("operation.over", "against the shaft's angle, or the fraction of the stroke, or recorded over time"),
        ("parts.3.operation.indicator.over", "against the shaft's angle, or the volume as fraction of the stroke, or "
                                             "recorded over time"),
        ("drive.stages.0.kind", "kind of the stage"),
        ("drive.torque.interpolation", "how rows of the table are joined: without overshoot, or by straight lines"),
    ],
)  # fmt: skip
def test_an_entry_is_found_by_its_path(path: str, help: str) -> None:
    assert getattr(below(part_of("machine-shaft").base(), path), "help", None) == help


def test_nothing_describes_a_path_that_there_is_not() -> None:
    assert below(part_of("machine-shaft").base(), "drive.nothing.at.all") is None


def test_both_ends_of_a_range_are_told() -> None:
    sample = {"sample": "random", "count": 4, "ranges": [{"path": "shaft.load", "from": "1 kg", "to": "2 mm"}]}
    with pytest.raises(SpecError) as error:
        parse_spec(changed({"/axes": [sample], "/combine": ...}))
    assert [fault.where for fault in error.value.faults] == ["/axes/0/ranges/0/from", "/axes/0/ranges/0/to"]


def test_values_beside_a_wrong_sweep_are_told() -> None:
    axes = [
        {"path": "shaft.load", "values": [0.1, 0.2], "sweep": "up"},
        {"path": "excitation.frequency", "values": [20, 30, 20]},
    ]
    with pytest.raises(SpecError) as error:
        parse_spec(changed({"/axes": axes, "/combine": "union"}))
    assert {fault.where for fault in error.value.faults} == {"/axes/0/sweep", "/axes/1/values/2"}
