"""Readings that refinement and goals share: ends of a range, results and values of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag.sentences import Sentence, Typed
from sprag.service.reading.catalogue import result_of, unknown_result
from sprag.service.reading.limits import quoted
from sprag.service.reading.texts import quantity_text
from sprag.service.reading.units import QuantityError, example, parse_quantity
from sprag.service.spec.axes.axes import read_paths
from sprag.service.spec.fields import read_number
from sprag.service.spec.lists import refuse_mixed
from sprag.service.spec.report import Report, join

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.spec.machine.machine import Machine
    from sprag.worker.models import ResultInfo


def read_ends(
    report: Report, pointer: str, paths: Sequence[str], ends: Sequence[tuple[str, object]], machine: Machine
) -> tuple[float, float] | None:
    """The ends of a range (SI), the lower first; None, and the faults recorded, where they are none.

    ``ends`` are the two pointers, each with its value.
    """
    if refuse_mixed(report, ends, machine.parameters[paths[0]].unit):
        return None
    read: list[float] = []
    for where, value in ends:
        numbers = [read_number(report, where, value, machine.parameters[path]) for path in paths]
        if numbers[0] is None or None in numbers:
            return None
        read.append(numbers[0])
    low, high = sorted(read)
    if low == high:
        unit = machine.parameters[paths[0]].unit
        report.fault(pointer, "invalid-range", "begins where it ends", quantity_text(low, unit), allowed="two values")
        return None
    return low, high


def read_path_of(report: Report, pointer: str, data: object, machine: Machine) -> tuple[str, ...] | None:
    """The path or the tied paths of what varies, each once; None, and the faults recorded, where they are none."""
    paths = read_paths(report, join(pointer, "path"), data, machine)
    if paths is not None and len(set(paths)) < len(paths):
        report.fault(join(pointer, "path"), "repeated", "names the same path twice", list(paths))
        return None
    return paths


def read_result(report: Report, pointer: str, value: object, infos: Sequence[ResultInfo]) -> ResultInfo | None:
    """The result of that name; None, and a fault recorded, where there is none."""
    some = next((info.name for info in infos if info.kind == "real"), "")
    allowed = Sentence("the name of a result of this study, such as '{name}'", name=some)
    if not isinstance(value, str):
        missing = value is None
        report.fault(
            pointer, "required" if missing else "wrong-type",
            "is required" if missing else "must be the name of a result", value, allowed=allowed,
        )  # fmt: skip
        return None
    info = result_of(infos, value)
    if info is None:
        report.fault(pointer, "unknown-name", unknown_result(infos, value), value, allowed=allowed)
    return info


def read_value(report: Report, pointer: str, value: object, info: ResultInfo) -> float | None:
    """A value of a result (SI; of a category its number); None, and a fault recorded, where it is none."""
    if info.kind == "category":
        if value in info.categories:
            return float(info.categories.index(str(value)))
        report.fault(pointer, "invalid-choice", "is not a valid choice", value, allowed=quoted(info.categories))
        return None
    try:
        return parse_quantity(value, info.unit)
    except QuantityError as error:
        such = Sentence("a number of {unit}, for example {example}", unit=Typed(info.unit), example=example(info.unit))
        report.fault(pointer, error.code, error.message, value, allowed=such, unit=info.unit)
        return None


def read_results(report: Report, pointer: str, names: Sequence[Any], infos: Sequence[ResultInfo]) -> list[str]:
    """Names of results that are numbers, each once; faults are recorded."""
    found: list[str] = []
    for index, name in enumerate(names):
        where = join(pointer, index)
        info = read_result(report, where, name, infos)
        if info is None:
            continue
        if info.kind == "category":
            report.fault(where, "not-numeric", "is a category, not a number", name, allowed="a result with a number")
        elif name in found:
            report.fault(where, "repeated", "is named twice", name, allowed="each result once")
        else:
            found.append(name)
    return found
