"""Reading single fields of a spec: numbers with units and ranges, whole numbers, flags, objects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from sprag.service.spec.node import Node
from sprag.service.spec.report import Report, join
from sprag.worker.models import Parameter

#: Fields of a spec about tolerances.
TOLERANCE_FIELDS: Final = ("tolerances", "drives", "seed", "draws", "correlations")
#: Fields of a spec that say which cases a study has.
WHICH_CASES: Final = frozenset({"axes", "combine", "exclude", "refine", "goal", "calibrate", *TOLERANCE_FIELDS})


def read_exact(report: Report, pointer: str, value: object, parameter: Parameter) -> Fraction | None:
    return Node(report, pointer, value).exact(parameter)


def read_number(report: Report, pointer: str, value: object, parameter: Parameter) -> float | None:
    return Node(report, pointer, value).number(parameter)


def read_whole(report: Report, pointer: str, value: object, low: int, high: int) -> int | None:
    return Node(report, pointer, value).whole(low, high)


def read_flag(report: Report, pointer: str, value: object) -> bool | None:
    return Node(report, pointer, value).flag()


def read_share(report: Report, pointer: str, value: object, low: float, high: float) -> float | None:
    return Node(report, pointer, value).share(low, high)


def nodes(report: Report, items: Iterable[tuple[str, object]]) -> list[Node]:
    return [Node(report, p, v) for p, v in items]


def values_of(items: Sequence[Node] | None) -> Any:
    return None if items is None else [item.value for item in items]


def read_one(report: Report, pointer: str, found: Mapping[str, Any], names: Sequence[str]) -> str | None:
    return Node(report, pointer, found).one_of(names)


def read_object(
    report: Report, pointer: str, value: object, known: Iterable[str], *, given: bool = False
) -> Mapping[str, Any] | None:
    node = Node(report, pointer, value)
    return node.value if node.has(tuple(known), null=not given) else None


def read_parameters(
    report: Report, pointer: str, data: Mapping[str, Any], parameters: Mapping[str, Parameter]
) -> dict[str, float]:
    """Read the numbers of an object by the path of their parameter, with defaults; invalid ones are left out.

    Parameters
    ----------
    parameters : name of the field -> its `placed` parameter
    """
    found: dict[str, float] = {}
    for name, parameter in parameters.items():
        if name in data:
            number = read_number(report, join(pointer, name), data[name], parameter)
        elif parameter.default is None:
            missing(report, join(pointer, name), parameter)
            number = None
        else:
            number = parameter.default
        if number is not None:
            found[parameter.path] = number
    return found


def missing(report: Report, pointer: str, parameter: Parameter) -> None:
    Node(report, pointer).lacks(parameter)
