"""The starts of a spec: how many of each case, and the ranges of the initial values from which they begin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.sentences import Sentence, joined, plural
from sprag.service.languages import N_
from sprag.service.reading.catalogue import range_sentence
from sprag.service.reading.limits import at_most
from sprag.service.spec.axes.axes import varied_values
from sprag.service.spec.described import Described, named, schemas
from sprag.service.spec.draws.tolerances import expanded
from sprag.service.spec.draws.unit import unit_sample
from sprag.service.spec.fields import nodes, read_number, read_object
from sprag.service.spec.lists import refuse_mixed
from sprag.service.spec.node import Node
from sprag.service.spec.report import Report, join
from sprag.service.spec.schema.quantity import QUANTITY, Schema, object_schema
from sprag.worker.limits import MAX_START_RANGES, MAX_STARTS
from sprag.worker.models import START_STATES, is_settled
from sprag.worker.models.vibration_drive.start_states import LOCKED, is_initial

if TYPE_CHECKING:
    from sprag.service.spec.machine.machine import Machine
    from sprag.worker.models import Parameter
    from sprag.worker.study import Axis

SETTINGS: Final = named(
    Described("count", "", "starts of each case, its own among them", "whole", 2, MAX_STARTS, 32),
    Described("seed", "", "seed of the initial values, which are those of a scrambled Sobol sequence", "whole", 0,
              2**32 - 1, 1),
)  # fmt: skip
_ALLOWED: Final = N_(
    'ranges of initial values, as in {"shaft.initial_speed": ["0 rad/s", "30 rad/s"]}; `*` stands for every pendulum'
)


def read_starts(
    report: Report, found: Mapping[str, Any], machine: Machine, axes: tuple[Axis, ...] | None, run: Mapping[str, Any]
) -> dict[str, Any]:
    """The part of a study's run that its starts are: ``{"starts": ...}``, SI, with the values of every start.

    Empty without starts, or, with the faults recorded, where they are invalid.
    """
    if "starts" not in found:
        return {}
    data = read_object(report, "/starts", found["starts"], (*SETTINGS, "ranges"), given=True)
    if data is None:
        return {}
    before = report.found
    settings = {name: field.read(Node(report, "/starts", data)) for name, field in SETTINGS.items()}
    ranges = _read_ranges(report, data.get("ranges"), machine)
    _check_locked(report, ranges, machine, axes or ())
    if not is_settled(run):
        report.fault(
            "/starts", "conflict", "needs runs until the motion is settled", allowed="neither `duration` nor `window`"
        )
    if report.found > before or not ranges:
        return {}
    return {"starts": {**settings, "ranges": ranges, "values": drawn(ranges, settings["count"], settings["seed"])}}


def drawn(ranges: Mapping[str, list[float]], count: int, seed: int) -> dict[str, list[float]]:
    """Initial values of the starts from 1 on, within the ranges."""
    unit = unit_sample("sobol", count, seed, len(ranges))[1:]
    values = {}
    for k, (path, (low, high)) in enumerate(ranges.items()):
        values[path] = np.clip(low + (high - low) * unit[:, k], low, high).tolist()
    return values


def _read_ranges(report: Report, data: object, machine: Machine) -> dict[str, list[float]]:
    if not isinstance(data, Mapping) or not data:
        report.fault(
            "/starts/ranges",
            "required" if data is None else "wrong-type",
            "is required" if data is None else "must be an object with a range or more",
            data,
            allowed=_ALLOWED,
        )
        return {}
    initial = {path: entry for path, entry in machine.parameters.items() if _can_vary(path)}
    ranges: dict[str, list[float]] = {}
    for name, ends in data.items():
        pointer = join("/starts/ranges", name)
        paths = expanded(name, initial) if isinstance(name, str) else []
        if not paths:
            if not machine.assumed(name):
                report.fault(
                    pointer, "invalid-path",
                    "is not an initial value" if name in machine.parameters else machine.why_not(name),
                    name, allowed=", ".join(initial) if initial else "none: no initial values",
                )  # fmt: skip
            continue
        _add_range(report, pointer, ends, {path: initial[path] for path in paths}, machine, ranges)
    if len(ranges) > MAX_START_RANGES:
        report.fault(
            "/starts/ranges", "too-many",
            plural("has {count} initial value", "has {count} initial values", len(ranges)),
            allowed=at_most(MAX_START_RANGES),
        )  # fmt: skip
    return ranges


def _check_locked(report: Report, ranges: Mapping[str, list[float]], machine: Machine, axes: tuple[Axis, ...]) -> None:
    """Record ranges of the speed of a pendulum that begins locked to the shaft, or of that shaft."""
    locked = [
        path.removesuffix("initial_clutch")
        for path in machine.parameters
        if path.endswith(".initial_clutch") and (varied_values(path, axes, machine.values) == LOCKED).any()
    ]
    for path in ranges:
        if path in (f"{prefix}initial_speed" for prefix in locked) or (locked and path == "shaft.initial_speed"):
            report.fault(
                join("/starts/ranges", path), "conflict", "is that of a pendulum that begins locked to the shaft", path,
                allowed="ranges of other initial values, or clutches that begin in another state",
            )  # fmt: skip


def _can_vary(path: str) -> bool:
    return is_initial(path) and path.rpartition(".")[2] not in START_STATES


def _add_range(
    report: Report,
    pointer: str,
    ends: object,
    parameters: Mapping[str, Parameter],
    machine: Machine,
    ranges: dict[str, list[float]],
) -> None:
    """Add the range of some initial values; faults are recorded."""
    for path, entry in parameters.items():
        if path in machine.derive:
            report.fault(pointer, "conflict", Sentence("{path} is derived from other parameters", path=path), path)
            return
        if path in ranges:
            report.fault(pointer, "repeated", "has two ranges", path, allowed="each initial value once")
            return
        if not isinstance(ends, list) or len(ends) != 2:
            report.fault(
                pointer, "wrong-type", "must be a list of two ends", ends,
                allowed=joined(", ", ("[low, high]", range_sentence(entry))), unit=entry.unit,
            )  # fmt: skip
            return
        if refuse_mixed(nodes(report, [(join(pointer, k), end) for k, end in enumerate(ends)]), entry.unit):
            return
        low, high = (read_number(report, join(pointer, k), end, entry) for k, end in enumerate(ends))
        if low is None or high is None:
            return
        if not low < high:
            report.fault(pointer, "invalid-range", "its low end must be below its high end", ends, unit=entry.unit)
            return
        ranges[path] = [low, high]


def starts_schema() -> Schema:
    """JSON Schema of the starts."""
    ends = {"type": "array", "items": QUANTITY, "minItems": 2, "maxItems": 2}
    ranges = {
        "type": "object",
        "additionalProperties": ends,
        "minProperties": 1,
        "description": _ALLOWED,
        "examples": [{"shaft.initial_speed": ["0 rad/s", "30 rad/s"]}],
    }
    return object_schema(
        {**schemas(SETTINGS), "ranges": ranges},
        required=("ranges",),
        description="many starts of each case, to find its coexisting regimes",
    )
