"""Meaning of paths and result names: units and descriptions, from the engine's catalogues."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.sentences import Amount, Named, Sentence, joined
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.worker.models import Parameter, ResultInfo
from sprag_study.worker.models.parameters import parameter_of, placed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.answers.studies import AxisInfo
    from sprag_study.worker.study import Axis, Study


def unit_of(study: Study, path: str) -> str:
    """SI unit of a flat path of a spec; "1" where it has none."""
    entry = parameter_of(study, path)
    return "1" if entry is None else placed(entry, path).unit


def range_sentence(parameter: Parameter) -> Sentence:
    """The allowed range of a parameter, as its `range_text`."""
    ends: list[Sentence] = []
    if parameter.low != -math.inf:
        ends.append(joined("", ("> " if parameter.low_open else ">= ", Amount(parameter.low, parameter.unit, 6))))
    if parameter.high != math.inf:
        ends.append(joined("", ("<= ", Amount(parameter.high, parameter.unit, 6))))
    if not ends:
        return Sentence("any finite number")
    return ends[0] if len(ends) == 1 else Sentence("{low} and {high}", low=ends[0], high=ends[1])


def result_of(infos: Iterable[ResultInfo], name: str) -> ResultInfo | None:
    """The entry of a result by its name; None for an unknown name."""
    return next((info for info in infos if info.name == name), None)


def unknown_result(infos: Iterable[ResultInfo], name: str) -> Sentence:
    """Message about an unknown result name, with the closest known one."""
    return Sentence("unknown result{hint}", hint=did_you_mean(name, [info.name for info in infos]))


def axes_json(study: Study) -> list[AxisInfo]:
    """The axes of a study as JSON data, without the full lists of values."""
    return [_axis_json(study, axis) for axis in study.axes]


def _axis_json(study: Study, axis: Axis) -> AxisInfo:
    values, unit = shown_values(study, axis), unit_of(study, axis.paths[0])
    info: AxisInfo = {
        "paths": list(axis.paths),
        "unit": unit,
        "values": values.size,
        "first": float(values[0]),
        "last": float(values[-1]),
        "least": float(values.min()),
        "largest": float(values.max()),
    }
    if isinstance(unit, Named):
        info["names"] = [unit.names[int(value)] for value in values.tolist()]
    return info


def shown_values(study: Study, axis: Axis) -> NDArray[np.float64]:
    """The values of an axis for people; of a study that chooses its cases each of its values once, ascending."""
    return axis.array if study.plan is None else np.unique(axis.array)
