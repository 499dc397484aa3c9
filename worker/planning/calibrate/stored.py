"""The answer of a calibration as plain JSON data, which is stored with its last round.

An ended calibration keeps its answer: a later version of the planner might read other values from the same rows.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, fields
from typing import Any, Final

import numpy as np

from sprag_study.worker.planning.calibrate.answer import Answer, Direction, NextPoint
from sprag_study.worker.planning.calibrate.lack_of_fit import Offset

_FLAGS: Final = frozenset({"at_bounds", "failed"})


def to_json(answer: Answer) -> dict[str, Any]:
    """The answer as JSON data; what is not finite becomes None, and is read as NaN."""
    plain = {one.name: getattr(answer, one.name) for one in fields(answer)}
    arrays = {name: _plain(value.tolist()) for name, value in plain.items() if isinstance(value, np.ndarray)}
    parts = {
        "directions": [asdict(one) for one in answer.directions],
        "next": None if answer.next is None else asdict(answer.next),
        "offsets": [asdict(one) for one in answer.offsets],
    }
    return plain | arrays | parts


def from_json(data: Mapping[str, Any]) -> Answer:
    """The answer that `to_json` wrote; KeyError or TypeError when it is not one."""
    read = dict(data)
    for name, value in data.items():
        if isinstance(value, list) and name not in {"directions", "offsets"}:
            read[name] = np.array(value, dtype=np.bool_ if name in _FLAGS else np.float64)
    read["directions"] = [
        Direction(tuple(one["parameters"]), tuple(one["changes"]), one["undetermined"]) for one in data["directions"]
    ]
    read["offsets"] = [Offset(**one) for one in data.get("offsets", ())]  # earlier answers have none
    following = data["next"]
    if following is not None:
        parts = (tuple(following[name]) for name in ("condition", "spread", "narrower"))
        condition, spread, narrower = parts
        read["next"] = NextPoint(condition, following["again"], spread, narrower)
    return Answer(**read)


def _plain(value: Any) -> Any:
    if isinstance(value, list):
        return [_plain(item) for item in value]
    return value if math.isfinite(value) else None
