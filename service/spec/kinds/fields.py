"""Readings that refinement and goals share: ends of a range, results and values of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import result_of, unknown_result
from sprag_study.service.reading.limits import number_in, quoted
from sprag_study.service.reading.texts import quantity_text
from sprag_study.service.reading.units import example, parse_quantity
from sprag_study.service.spec.axes.axes import read_paths
from sprag_study.service.spec.lists import refuse_mixed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import ResultInfo

#: JSON Schema of the name of a result.
RESULT: Final[dict[str, Any]] = {"type": "string", "examples": ["shaft.speed.mean", "efficiency", "torque.max"]}


def read_ends(node: Node, paths: Sequence[str], ends: Sequence[Node]) -> tuple[float, float] | None:
    """The ends of a range (SI), the lower first; None, and the faults recorded, where ``node`` has none."""
    parameters = [node.machine.parameters[path] for path in paths]
    unit = parameters[0].unit
    if refuse_mixed(ends, unit):
        return None
    read = [end.number_in(parameters) for end in ends]
    known = [end for end in read if end is not None]
    if len(known) < len(read):
        return None
    low, high = sorted(known)
    if low == high:
        node.refuse("invalid-range", "begins where it ends", quantity_text(low, unit), allowed="two values")
        return None
    return low, high


def read_path_of(node: Node) -> tuple[str, ...] | None:
    """The path or the tied paths of what varies, each once; None, and the faults recorded, where they are none."""
    paths = read_paths(node)
    if paths is not None and len(set(paths)) < len(paths):
        node.refuse("repeated", "names the same path twice", list(paths))
        return None
    return paths


def read_result(node: Node) -> ResultInfo | None:
    """The result of that name; None, and a fault recorded, where there is none."""
    infos = node.report.results
    some = next((info.name for info in infos if info.kind == "real"), "")
    allowed = Sentence("the name of a result of this study, such as '{name}'", name=some)
    if not isinstance(node.value, str):
        node.mistake("must be the name of a result", allowed=allowed)
        return None
    info = result_of(infos, node.value)
    if info is None and node.value in node.report.further:
        node.refuse("unknown-name", "is a result where `run` has `loads`", allowed=N_('"loads": true in `run`'))
    elif info is None:
        node.refuse("unknown-name", unknown_result(infos, node.value), allowed=allowed)
    return info


def read_numeric_result(node: Node) -> ResultInfo | None:
    """The result of that name that is a number; None, and a fault recorded, where there is none."""
    info = read_result(node)
    if info is not None and info.kind == "category":
        node.refuse("not-numeric", "is a category, not a number", allowed="a result with a number")
        return None
    return info


def read_value(node: Node, info: ResultInfo, *, share: bool = False) -> float | None:
    """A value of a result (SI; of a category its number); None, and a fault recorded, where it is none.

    ``share`` says that a share of the range, which the caller reads, could stand there too.
    """
    if info.kind == "category":
        if node.value in info.categories:
            return float(info.categories.index(str(node.value)))
        node.refuse("invalid-choice", "is not a valid choice", allowed=quoted(info.categories))
        return None
    such = Sentence("{number}, for example {example}", number=number_in(info.unit), example=example(info.unit))
    such = Sentence('{value}; or a share of its range, such as "2 %"', value=such) if share else such
    return node.parsed(lambda value: parse_quantity(value, info.unit), allowed=such, unit=info.unit)
