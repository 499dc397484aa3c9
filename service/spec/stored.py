"""Specs that were accepted before: they are read as they were read then, whatever is asked about in new ones."""

from __future__ import annotations

import copy
import json
import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.reading.numbers import has_doubtful_point, with_decimal, with_decimals
from sprag_study.service.reading.printed import could_be_values, keyboard
from sprag_study.service.reading.together import AMBIGUOUS_UNIT, split_list
from sprag_study.service.spec.csv_text import has_units
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.report import SpecError
from sprag_study.worker.models.vibration_drive.settled import STRIBECK_LOAD, STRIBECK_SPEED

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.faults import Fault
    from sprag_study.worker.study import Study

#: Numbers farther apart than this (relative) were read differently, and not only computed by another version.
_APART: Final = 1e-3
#: Code of a list whose items could also be several values between blanks.
_BLANKS: Final = "invalid-text"
#: Speed at which a Stribeck load fell where none was given.
_SPEED: Final = "1 rad/s"
#: Fields with the text of a table.
_TABLES: Final = frozenset({"points", "csv"})


def accepted(spec: Mapping[str, Any], study: Study | None = None) -> dict[str, Any]:
    """A spec that was accepted before, without what is asked about now.

    Earlier versions read bare numbers beside quantities of another scale as SI, and points that could separate
    thousands as decimal points, so that is what they are: their unit, in the heading of a column where it is a table,
    and a further decimal are written. Blanks in the values of a list separated thousands, and are left out. Beside
    decimal commas such points separate thousands, unless the ``study`` that
    is stored with the spec shows that they were decimal. A Stribeck load without its speed had that of the engine.
    """
    settled = _settled(_with_speed(spec))
    if study is None or not any(map(has_doubtful_point, _texts(settled))):
        return settled
    earlier = {name: value if name == "name" else _with_decimals(value) for name, value in settled.items()}
    return earlier if _unlike(earlier, study) < _unlike(settled, study) else settled


def _with_speed(spec: Mapping[str, Any]) -> Mapping[str, Any]:
    """A spec with the speed that a Stribeck load had where none was given."""
    base = spec.get("base")
    shaft = base.get("shaft") if isinstance(base, Mapping) else None
    load, speed = (path.rpartition(".")[2] for path in (STRIBECK_LOAD, STRIBECK_SPEED))
    text = json.dumps(spec, default=str)
    if not isinstance(base, Mapping) or not isinstance(shaft, Mapping) or load not in text or speed in text:
        return spec
    return {**spec, "base": {**base, "shaft": {**shaft, speed: _SPEED}}}


def _settled(spec: Mapping[str, Any]) -> dict[str, Any]:
    settled: dict[str, Any] = dict(spec)
    before: dict[str, Any] = {}
    while settled != before and (unclear := _unclear(settled)):
        before, settled = settled, copy.deepcopy(settled)
        for fault in unclear:
            *parents, last = (part.replace("~1", "/").replace("~0", "~") for part in (fault.where or "").split("/")[1:])
            place: Any = settled
            for key in parents:
                place = place[int(key)] if isinstance(place, list) else place[key]
            index: Any = int(last) if isinstance(place, list) else last
            if fault.code == AMBIGUOUS_UNIT and last in _TABLES:
                place[index] = _with_heading(place[index], str(fault.value), str(fault.unit))
            elif fault.code == AMBIGUOUS_UNIT:
                place[index] = f"{place[index]!r} {fault.unit}"
            elif fault.code == _BLANKS:
                place[index] = "; ".join(map(keyboard, split_list(place[index])))
            else:
                place[index] = with_decimal(place[index], str(fault.value))
    return settled


def _with_heading(table: str, heading: str, unit: str) -> str:
    """A table with a unit in brackets behind one of its headings."""
    return re.sub(rf"(?<![\w.]){re.escape(heading)}(?![\w.])", rf"\g<0> [{unit}]", table, count=1)


def _unclear(spec: Mapping[str, Any]) -> list[Fault]:
    """The faults of bare numbers beside quantities of another scale, and of points and blanks that could separate
    thousands.
    """
    doubtful = any(
        has_doubtful_point(text) or has_units(text.partition("\n")[2]) or could_be_values(split_list(text)) is not None
        for text in _texts(spec)
    )
    if not _mixed(spec) and not doubtful:
        return []
    try:
        parse_spec(spec)
    except SpecError as error:
        return [
            fault
            for fault in error.faults
            if fault.code in {AMBIGUOUS_UNIT, "ambiguous-point"}
            or (fault.code == _BLANKS and could_be_values(split_list(str(fault.value))) is not None)
        ]
    return []


def _mixed(data: object) -> bool:
    """Whether a list, rows or an object have both numbers and texts."""
    items = list(data.values()) if isinstance(data, Mapping) else data if isinstance(data, list) else []
    every = [part for item in items for part in (item if isinstance(item, list) else [item])]
    return {str} < {type(item) for item in every} & {str, int, float} or any(map(_mixed, items))


def _texts(data: object) -> Iterator[str]:
    """Every text of some JSON data."""
    if isinstance(data, str):
        yield data
    for item in data.values() if isinstance(data, Mapping) else data if isinstance(data, list) else ():
        yield from _texts(item)


def _with_decimals(data: Any) -> Any:
    """Some JSON data with a further decimal in each number whose point could separate thousands."""
    if isinstance(data, str):
        return with_decimals(data)
    if isinstance(data, Mapping):
        return {name: _with_decimals(value) for name, value in data.items()}
    return list(map(_with_decimals, data)) if isinstance(data, list) else data


def _unlike(spec: Mapping[str, Any], study: Study) -> float:
    """How many numbers of the study that a spec describes are others than in the stored one; infinity for a wrong spec.

    Only what both have counts: a study that chooses its own cases has got more of them, and later versions have
    parameters that earlier ones did not have.
    """
    try:
        made = parse_spec(spec).study
    except SpecError:
        return math.inf
    pairs = [(new.array[: len(old)], old.array[: len(new)]) for new, old in zip(made.axes, study.axes, strict=False)]
    new, old = (
        dict(_numbers([each.base, each.run, each.structure, each.plan, each.spread and each.spread.to_json()]))
        for each in (made, study)
    )
    both = [place for place in new if place in old]
    pairs.append((np.array([new[place] for place in both]), np.array([old[place] for place in both])))
    return float(sum(np.count_nonzero(~np.isclose(one, other, _APART, 0.0)) for one, other in pairs))


def _numbers(data: object, place: tuple[object, ...] = ()) -> Iterator[tuple[tuple[object, ...], float]]:
    """The numbers of some JSON data with their places."""
    if isinstance(data, int | float):
        yield place, float(data)
    items = data.items() if isinstance(data, Mapping) else enumerate(data) if isinstance(data, list | tuple) else ()
    for key, item in items:
        yield from _numbers(item, (*place, key))
