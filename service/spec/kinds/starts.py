"""The starts of a spec: how many of each case, and the ranges of the initial values from which they begin."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Sentence, joined, plural
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.limits import at_most
from sprag_study.service.spec.axes.axes import varied_values
from sprag_study.service.spec.described import Described, Record, named
from sprag_study.service.spec.draws.unit import unit_sample
from sprag_study.service.spec.fields import expanded
from sprag_study.service.spec.kinds.draft import Kind
from sprag_study.service.spec.lists import refuse_mixed
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.worker.limits import MAX_START_RANGES, MAX_STARTS
from sprag_study.worker.models import START_STATES, is_settled
from sprag_study.worker.models.vibration_drive.start_states import LOCKED, is_initial

if TYPE_CHECKING:
    from sprag_study.service.spec.kinds.draft import Draft
    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import Parameter
    from sprag_study.worker.study import Axis

_ALLOWED: Final = N_(
    'ranges of initial values, as in {"shaft.initial_speed": ["0 rad/s", "30 rad/s"]}; `*` stands for every pendulum'
)
STARTS: Final = Record(
    {
        **named(
            Described("count", "", "starts of each case, its own among them", "whole", 2, MAX_STARTS, 32),
            Described(
                "seed", "", "seed of the initial values, which are those of a scrambled Sobol sequence", "whole", 0,
                2**32 - 1, 1,
            ),
        ),
        "ranges": {
            "type": "object",
            "additionalProperties": {"type": "array", "items": QUANTITY, "minItems": 2, "maxItems": 2},
            "minProperties": 1,
            "description": _ALLOWED,
            "examples": [{"shaft.initial_speed": ["0 rad/s", "30 rad/s"]}],
        },
    },
    "many starts of each case, to find its coexisting regimes",
    required=("ranges",),
)  # fmt: skip

Ranges = dict[str, list[float]]


def _read(draft: Draft) -> None:
    """Read the starts into the run of the study: in SI, with the values of every start."""
    node = draft.spec["starts"]
    if not node.given or not STARTS.read(node, null=False):
        return
    settings, ranges = STARTS.values(node), _read_ranges(node["ranges"])
    _check_locked(node["ranges"], ranges, draft.axes or ())
    if not is_settled(draft.run):
        node.refuse("conflict", "needs runs until the motion is settled", None,
                    allowed="neither `duration` nor `window`")  # fmt: skip
    if node.sound and ranges:
        values = drawn(ranges, settings["count"], settings["seed"])
        draft.run["starts"] = {**settings, "ranges": ranges, "values": values}


#: Studies of coexisting regimes.
MANY_STARTS: Final = Kind({"starts": STARTS}, _read)


def drawn(ranges: Mapping[str, list[float]], count: int, seed: int) -> dict[str, list[float]]:
    """Initial values of the starts from 1 on, within the ranges."""
    unit = unit_sample("sobol", count, seed, len(ranges))[1:]
    values = {}
    for k, (path, (low, high)) in enumerate(ranges.items()):
        values[path] = np.clip(low + (high - low) * unit[:, k], low, high).tolist()
    return values


def _read_ranges(node: Node) -> Ranges:
    if not isinstance(node.value, Mapping) or not node.value:
        node.mistake("must be an object with a range or more", allowed=_ALLOWED)
        return {}
    machine = node.machine
    initial = {path: entry for path, entry in machine.parameters.items() if _can_vary(path)}
    ranges: Ranges = {}
    for name in node.value:
        paths = expanded(name, initial) if isinstance(name, str) else []
        if not paths and not machine.assumed(name):
            why = "is not an initial value" if name in machine.parameters else machine.why_not(name)
            node[name].refuse("invalid-path", why, name,
                              allowed=", ".join(initial) if initial else "none: no initial values")  # fmt: skip
        _add_range(node[name], {path: initial[path] for path in paths}, ranges)
    if len(ranges) > MAX_START_RANGES:
        message = plural("has {count} initial value", "has {count} initial values", len(ranges))
        node.refuse("too-many", message, None, allowed=at_most(MAX_START_RANGES))
    return ranges


def _check_locked(node: Node, ranges: Ranges, axes: tuple[Axis, ...]) -> None:
    """Record ranges of the speed of a pendulum that begins locked to the shaft, or of that shaft."""
    locked = [
        path.removesuffix("initial_clutch")
        for path in node.machine.parameters
        if path.endswith(".initial_clutch") and (varied_values(path, axes, node.machine.values) == LOCKED).any()
    ]
    for path in ranges:
        if path in (f"{prefix}initial_speed" for prefix in locked) or (locked and path == "shaft.initial_speed"):
            node[path].refuse(
                "conflict", "is that of a pendulum that begins locked to the shaft", path,
                allowed="ranges of other initial values, or clutches that begin in another state",
            )  # fmt: skip


def _can_vary(path: str) -> bool:
    return is_initial(path) and path.rpartition(".")[2] not in START_STATES


def _add_range(node: Node, parameters: Mapping[str, Parameter], ranges: Ranges) -> None:
    """Add the range of some initial values; faults are recorded."""
    for path, entry in parameters.items():
        if path in node.machine.derive:
            node.refuse("conflict", Sentence("{path} is derived from other parameters", path=path), path)
            return
        if path in ranges:
            node.refuse("repeated", "has two ranges", path, allowed="each initial value once")
            return
        if not isinstance(node.value, list) or len(node.value) != 2:
            allowed = joined(", ", ("[low, high]", range_sentence(entry)))
            node.refuse("wrong-type", "must be a list of two ends", allowed=allowed, unit=entry.unit)
            return
        if refuse_mixed(node.parts(), entry.unit):
            return
        low, high = (end.number(entry) for end in node.parts())
        if low is None or high is None:
            return
        if not low < high:
            node.refuse("invalid-range", "its low end must be below its high end", unit=entry.unit)
            return
        ranges[path] = [low, high]
