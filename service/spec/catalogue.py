"""What a path or a result name of a study means: its unit and its sentence, from the engine's catalogues."""

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
    """The entry of a flat path in a spec in the catalogue of ``model``; None when it has no such parameter."""
    general = general_path(path)
    # A clutch of one pendulum has the parameters of the common one.
    wanted = {general, general.removeprefix("pendulums.N.")} if ".clutch." in general else {general}
    return next((entry for entry in models.parameter_catalogue(model) if entry.path in wanted), None)


def parameter_of(study: Study, path: str) -> Parameter | None:
    """The parameter at a flat path in a spec of the machine of ``study``; None when it has none there."""
    own = models.parameters_of(study)
    return own.get(path) if own else model_parameter(study.model, path)


def unit_of(study: Study, path: str) -> str:
    """SI unit of a flat path in a spec, "1" where it has none."""
    entry = parameter_of(study, path)
    return "1" if entry is None else placed(entry, path).unit


def result_of(infos: Iterable[ResultInfo], name: str) -> ResultInfo | None:
    """The entry of a result name; None for an unknown name."""
    return next((info for info in infos if info.name == name), None)


def unknown_result(infos: Iterable[ResultInfo], name: str) -> str:
    """Message about a result name that does not exist, with the nearest one."""
    return f"unknown result{did_you_mean(name, [info.name for info in infos])}"


def axes_json(study: Study) -> list[AxisInfo]:
    """The axes of a study as JSON data, without all their values."""
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
