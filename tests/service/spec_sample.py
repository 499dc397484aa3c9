"""The spec of the documentation, to be changed and parsed by the tests of the spec."""

from __future__ import annotations

import copy
from functools import cache
from typing import Any

import jsonschema
import pytest

from sprag_study.service.faults import Fault
from sprag_study.service.spec.document import ParsedSpec, SpecError, parse_spec
from sprag_study.service.spec.schema.document import spec_schema

#: The example of the spec's own documentation.
SPEC: dict[str, Any] = {
    "sprag": 1,
    "model": "vibration-drive",
    "name": "Feeder motor: speed against load",
    "base": {
        "excitation": {"frequency": "25 Hz", "amplitude_x": "2 mm", "amplitude_y": "2 mm", "phase": "0 deg"},
        "pendulums": [
            {
                "inertia": "1e-3 kg*m^2",
                "mass": "0.5 kg",
                "arm": "30 mm",
                "spring_rate": "9000 N/m",
                "spring_arm": "50 mm",
                "damping": "0.01 N*m*s/rad",
                "backlash": "0.005 rad",
                "initial_angle": 0,
                "initial_speed": 0,
            }
        ],
        "shaft": {"inertia": "2e-3 kg*m^2", "load": "0.1 N*m", "initial_speed": 0},
        "clutch": {"coefficients": [0, 200, 0, 20000]},
    },
    "run": {"duration": "60 periods", "window": ["40 periods", "60 periods"], "tolerance": 1e-9, "reset": "contact"},
    "axes": [
        {"path": "excitation.frequency", "linspace": ["16 Hz", "35 Hz", 16]},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "linspace": ["1 mm", "3 mm", 4]},
        {"path": "shaft.load", "values": [0.02, 0.1, "0.3 N*m"]},
    ],
    "combine": "grid",
}


def changed(changes: dict[str, Any]) -> dict[str, Any]:
    """The sample spec with fields at JSON Pointers replaced; `...` takes a field away."""
    spec: Any = copy.deepcopy(SPEC)
    for pointer, value in changes.items():
        *parents, last = pointer.strip("/").split("/")
        place = spec
        for key in parents:
            place = place[int(key)] if isinstance(place, list) else place[key]
        if value is ...:
            del place[last]
        elif isinstance(place, list) and int(last) == len(place):
            place.append(value)
        else:
            place[int(last) if isinstance(place, list) else last] = value
    return dict(spec)


def parsed(changes: dict[str, Any]) -> ParsedSpec:
    """What the sample spec with changes comes out as."""
    return parse_spec(changed(changes))


def problems(changes: dict[str, Any]) -> dict[str, Fault]:
    """Problems of the sample spec with changes, by their pointers (which must differ)."""
    with pytest.raises(SpecError) as caught:
        parse_spec(changed(changes))
    found = {str(fault.where): fault for fault in caught.value.faults}
    assert len(found) == len(caught.value.faults)
    assert str(caught.value)
    return found


@cache
def schema() -> jsonschema.Draft202012Validator:
    """The JSON Schema of specs. That it is valid itself, which takes half a second, has its own test."""
    return jsonschema.Draft202012Validator(spec_schema())
