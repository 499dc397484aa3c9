"""The inputs in which studies differ, for pages and for the client."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

#: More studies are not compared at once.
MOST_COMPARED: Final = 10


def differing(specs: Sequence[Mapping[str, Any]]) -> dict[str, tuple[Any, ...]]:
    """The values by JSON Pointer that are not the same in all specs, the name left out; None where a spec has none."""
    flat = [dict(_leaves({key: value for key, value in spec.items() if key != "name"}, "")) for spec in specs]
    pointers = dict.fromkeys(pointer for leaves in flat for pointer in leaves)
    found = {pointer: tuple(leaves.get(pointer) for leaves in flat) for pointer in pointers}
    return {pointer: values for pointer, values in found.items() if any(value != values[0] for value in values)}


def unique_names(names: Sequence[str], ids: Sequence[str]) -> list[str]:
    """Names of studies that tell them apart: with the id where several have the name, the id where one has none."""
    return [
        (name if names.count(name) == 1 else f"{name} ({own})") if name else own
        for name, own in zip(names, ids, strict=True)
    ]


def _leaves(data: object, pointer: str) -> Iterator[tuple[str, object]]:
    if isinstance(data, Mapping) and data:
        for key, value in data.items():
            yield from _leaves(value, f"{pointer}/{str(key).replace('~', '~0').replace('/', '~1')}")
    elif isinstance(data, list) and any(isinstance(item, Mapping | list) for item in data):
        for index, value in enumerate(data):
            yield from _leaves(value, f"{pointer}/{index}")
    else:
        yield pointer, data
