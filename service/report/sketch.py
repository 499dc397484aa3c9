"""The drawings of a study's machine as pictures that stand alone, in the colours of paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.figures.drawing import svg
from sprag.service.figures.drawings import drawings

if TYPE_CHECKING:
    from sprag.worker.study import Study


def sketches(study: Study) -> list[tuple[str, bytes]]:
    """What each picture is, and the picture as SVG; nothing for machines that have none."""
    return [(drawing.title, svg(drawing, alone=True).encode()) for drawing in drawings(study)]
