"""The motion of the chosen row as a small picture, in the colours of the page."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from starlette.responses import Response

from sprag.service.figures.motion import motion_figure
from sprag.service.figures.read import read_figure
from sprag.service.figures.svg import svg
from sprag.service.http.context import CaseNumber, StudyId
from sprag.service.http.drawing import PICTURE_POLICY, unchanging
from sprag.service.http.reading import FileChoice
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.work import Attended
from sprag.service.languages import _
from sprag.service.reading.reader import Phrase
from sprag.service.views.library import reading_of
from sprag.worker import models
from sprag.worker.models.starts import motion_of

if TYPE_CHECKING:
    from sprag.service.reading.reader import Reading
    from sprag.worker.study import Study

router = page_router()

_WIDTH: Final = 350
#: Panels that are shown of a motion, its periods, and times at which it is sampled.
_PANELS: Final = 2
_PERIODS: Final = 3
_SAMPLES: Final = 900


@router.get("/studies/{study_id:study}/rows/{case:case}/motion.svg")
async def row_motion(
    work: Attended, study_id: StudyId, case: CaseNumber, choice: FileChoice, dark: bool = False
) -> Response:
    """The last periods of the motion of a case, on light or on ``dark`` paper."""
    study, _found = await work.case_of(study_id, case, lambda _study: None)

    async def make() -> Response:
        reading = await in_thread(reading_of, work.context.store, study_id, choice)
        drawn = await work.run_case(small_motion, *motion_of(study, case, None), reading, dark)
        headers = {"Content-Security-Policy": PICTURE_POLICY}
        return Response(drawn, media_type="image/svg+xml", headers=headers)

    return await unchanging(work, study_id, make)


def small_motion(study: Study, case: int, reading: Reading, dark: bool) -> str:
    """Run the case again and draw the end of its motion. For the computing process."""
    extent = models.extent(study, case)
    start = 0.0 if extent.along == "angle" else max(extent.end - _PERIODS * extent.period, 0.0)
    made = models.run_trajectory(study, case, start, extent.end, _SAMPLES)
    figure = motion_figure(made, models.presentation_of(study), columns=1)
    if made.times.size < 2:
        figure = replace(figure, note=Phrase("There is no motion in this part."))
    figure = replace(figure, panels=figure.panels[:_PANELS])
    drawn = svg(read_figure(figure, reading), width=_WIDTH, label=_("Motion of case {case}", case=case))
    start_of_parts = drawn.index(">") + 1
    named = '<svg xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" '
    opening = drawn[:start_of_parts].replace("<svg ", named, 1)
    return f"{opening}<style>{_colours(dark)}</style>{drawn[start_of_parts:]}"


@lru_cache(maxsize=2)
def _colours(dark: bool) -> str:
    """The variables of the style of the pages."""
    style = (files("sprag.service.http.web") / "static" / "sprag.css").read_text(encoding="utf-8")
    return "".join(re.findall(r":root \{[^}]*\}", style)[: 1 + dark])
