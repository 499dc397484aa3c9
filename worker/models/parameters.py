"""The parameter at a flat path of a spec, from the catalogue of its model."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from sprag.worker.models.model import model_of

if TYPE_CHECKING:
    from sprag.engine.catalogue import Parameter
    from sprag.worker.study import Study

_INDEX: Final = re.compile(r"\.(\d+)(?=\.|$)")


def general_path(path: str) -> str:
    """``path`` with the catalogue's letters for its indices: ``pendulums.1.mass`` -> ``pendulums.N.mass``."""
    return _INDEX.sub(lambda match: ".N" if path[: match.start()].endswith("pendulums") else ".K", path)


def model_parameter(model: str, path: str) -> Parameter | None:
    """The entry of ``model``'s catalogue for a flat path of a spec; None when there is no such parameter."""
    general = general_path(path)
    # The clutch of one pendulum has the parameters of a common clutch.
    wanted = {general, general.removeprefix("pendulums.N.")} if ".clutch." in general else {general}
    return next((entry for entry in model_of(model).parameters() if entry.path in wanted), None)


def parameter_of(study: Study, path: str) -> Parameter | None:
    """The parameter at a flat path of a spec, for the machine of ``study``; None when there is none."""
    own = model_of(study.model).parameters_of(study)
    return own.get(path) if own else model_parameter(study.model, path)
