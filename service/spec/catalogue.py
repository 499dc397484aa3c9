"""Meaning of paths and result names: units and descriptions, from the engine's catalogues."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from sprag.service.spec.fields import placed
from sprag.service.spec.report import did_you_mean
from sprag.worker import models
from sprag.worker.models import Parameter, ResultInfo

if TYPE_CHECKING:
    from sprag.service.answers.studies import AxisInfo
    from sprag.worker.study import Study

_INDEX = re.compile(r"\.(\d+)(?=\.|$)")


def general_path(path: str) -> str:
    """``path`` with the catalogue's letters for its indices: ``pendulums.1.mass`` -> ``pendulums.N.mass``."""
    return _INDEX.sub(lambda match: ".N" if path[: match.start()].endswith("pendulums") else ".K", path)


def model_parameter(model: str, path: str) -> Parameter | None:
    """The entry of ``model``'s catalogue for a flat path of a spec; None when there is no such parameter."""
    general = general_path(path)
    # The clutch of one pendulum has the parameters of a common clutch.
    wanted = {general, general.removeprefix("pendulums.N.")} if ".clutch." in general else {general}
    return next((entry for entry in models.parameter_catalogue(model) if entry.path in wanted), None)


def parameter_of(study: Study, path: str) -> Parameter | None:
    """The parameter at a flat path of a spec, for the machine of ``study``; None when there is none."""
    own = models.parameters_of(study)
    return own.get(path) if own else model_parameter(study.model, path)


def unit_of(study: Study, path: str) -> str:
    """SI unit of a flat path of a spec; "1" where it has none."""
    entry = parameter_of(study, path)
    return "1" if entry is None else placed(entry, path).unit


def result_of(infos: Iterable[ResultInfo], name: str) -> ResultInfo | None:
    """The entry of a result by its name; None for an unknown name."""
    return next((info for info in infos if info.name == name), None)


def unknown_result(infos: Iterable[ResultInfo], name: str) -> str:
    """Message about an unknown result name, with the closest known one."""
    return f"unknown result{did_you_mean(name, [info.name for info in infos])}"


def axes_json(study: Study) -> list[AxisInfo]:
    """The axes of a study as JSON data, without the full lists of values."""
    return [
        {
            "paths": list(axis.paths),
            "unit": unit_of(study, axis.paths[0]),
            "values": len(axis),
            "first": float(axis.array[0]),
            "last": float(axis.array[-1]),
        }
        for axis in study.axes
    ]
