"""The drawings of any machine that has one: of a study, or of the numbers of a form."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag_study.service.figures.drive_drawing import drive_drawings
from sprag_study.service.figures.linkage import machine_drawings
from sprag_study.worker import models
from sprag_study.worker.models import machine_shaft
from sprag_study.worker.models.parameters import model_parameter

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.service.figures.drawing import Drawing
    from sprag_study.worker.study import Study

#: Angle of the shaft in the drawing of a mechanism, in degrees.
USUAL_ANGLE: Final = 60.0
#: Width of the drawing of a mechanism between two columns of fields (px).
BETWEEN_FIELDS: Final = 252.0


def drawings(study: Study, angle: float = USUAL_ANGLE, width: float | None = None) -> tuple[Drawing, ...]:
    """The drawings of a study's base, a mechanism at an angle of its shaft (degrees); none of other models.

    Each has the dimensions that the machine has, with their symbols; that of a mechanism is at most ``width`` px wide.
    """
    if models.has_clutches(study):
        return rough_drawings(study.model, study.base)
    if study.model == machine_shaft.MODEL:
        return machine_drawings(study.structure or {}, study.base, angle, width)
    return ()


def rough_drawings(model: str, base: Mapping[str, float]) -> tuple[Drawing, ...]:
    """The drawings of a machine whose numbers (SI, by path) may be incomplete; none where that needs its structure."""
    if models.model_of(model).clutches is None:
        return ()
    entries = {path: model_parameter(model, path) for path in base}
    symbols = {path: entry.symbol for path, entry in entries.items() if entry is not None}
    return tuple(drawing.labelled(symbols) for drawing in drive_drawings(base))
