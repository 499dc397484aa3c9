"""What studies have in common and the inputs in which they differ, for pages and for the client."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

#: More studies are not compared at once.
MOST_COMPARED: Final = 10
#: Axes without a parameter: the drives of a batch, and the directions of a sweep.
NO_PARAMETERS: Final = frozenset({"drive", "sweep"})
#: Axes of components, which are others in each study.
COMPONENTS: Final = frozenset({"spring", "clutch", "motor"})


def differing(specs: Sequence[Mapping[str, Any]]) -> dict[str, tuple[Any, ...]]:
    """The values by JSON Pointer that are not the same in all specs, the name left out; None where a spec has none."""
    flat = [dict(_leaves({key: value for key, value in spec.items() if key != "name"}, "")) for spec in specs]
    pointers = dict.fromkeys(pointer for leaves in flat for pointer in leaves)
    found = {pointer: tuple(leaves.get(pointer) for leaves in flat) for pointer in pointers}
    return {pointer: values for pointer, values in found.items() if any(value != values[0] for value in values)}


def common_axes(studies: Sequence[Sequence[tuple[Sequence[str], int]]]) -> list[str]:
    """The parameters that vary in all studies, each once, as the first study names them.

    An axis is its paths and its number of values.
    """
    varying = [{path for paths, count in axes if count > 1 for path in paths} for axes in studies]
    shared = set[str].intersection(*varying).difference(NO_PARAMETERS, COMPONENTS)
    return [paths[0] for paths, _count in studies[0] if paths[0] in shared]


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
