"""Specs that must be refused, and what the refusal has to name; for commands and for HTTP."""

from __future__ import annotations

import json
from typing import Any

BASE: dict[str, Any] = {
    "sprag": 1,
    "model": "vibration-drive",
    "base": {
        "excitation": {"frequency": "25 Hz", "amplitude_x": "2 mm", "amplitude_y": "2 mm"},
        "pendulums": [
            {
                "inertia": "1e-3 kg*m^2",
                "mass": "0.5 kg",
                "arm": "30 mm",
                "spring_rate": "9000 N/m",
                "spring_arm": "50 mm",
                "damping": "0.01 N*m*s/rad",
                "backlash": "0.005 rad",
            }
        ],
        "shaft": {"inertia": "2e-3 kg*m^2", "load": "0.1 N*m"},
        "clutch": {"coefficients": [0, 200, 0, 20000]},
    },
    "run": {"duration": "6 periods"},
    "axes": [{"path": "shaft.load", "values": [0, 0.1]}],
}


def changed(path: str, value: object) -> str:
    """The base spec as JSON text with the field at a JSON Pointer set to ``value``."""
    spec = json.loads(json.dumps(BASE))
    *parents, last = path.strip("/").split("/")
    place: Any = spec
    for key in parents:
        place = place[int(key)] if isinstance(place, list) else place[key]
    place[last] = value
    return json.dumps(spec)


#: Text of a wrong spec, and what the message has to name.
WRONG: dict[str, tuple[str, str]] = {
    "NaN": (changed("/base/shaft/load", float("nan")), "/base/shaft/load"),
    "Infinity": (changed("/base/shaft/load", float("inf")), "/base/shaft/load"),
    "1e999": (json.dumps(BASE).replace('"0.1 N*m"', "1e999"), "/base/shaft/load"),
    "negative inertia": (changed("/base/shaft/inertia", -1), "/base/shaft/inertia"),
    "unknown field": (changed("/base/shaft/lode", 1), "/base/shaft/lode"),
    "wrong unit": (changed("/base/shaft/load", "0.1 kg"), "/base/shaft/load"),
    "empty axis": (changed("/axes", [{"path": "shaft.load", "values": []}]), "/axes/0"),
    "a billion cases": (
        changed("/axes", [{"path": p, "linspace": [1, 2, 1000]} for p in ("shaft.load", "shaft.inertia", "gravity")]),
        "/axes",
    ),
    "40 levels": ('{"sprag":1,"base":' + "[" * 40 + "]" * 40 + "}", "nested"),
    "duplicate axis": (
        changed("/axes", [{"path": "shaft.load", "values": [1]}, {"path": "shaft.load", "values": [2]}]),
        "/axes/1",
    ),
    "window outside the run": (changed("/run/window", ["4 periods", "9 periods"]), "/run/window"),
    "law negative in its range": (changed("/base/clutch/coefficients", [0, 200, -1e5, 0]), "/base/clutch"),
    "unreachable fit": (
        changed("/base/clutch", {"data": [[0.01, 1], [0.02, 5], [0.03, 2], [0.04, 9]], "accuracy": 1e-9}),
        "/base/clutch",
    ),
    "no JSON": ("{", "line 1"),
    "a list": ("[]", "object"),
    "nothing": ("", "JSON"),
    "field twice": ('{"sprag": 1, "sprag": 1}', "/sprag"),
    "half a character": ('{"sprag": 1, "name": "\\ud800"}', "/name"),
}
