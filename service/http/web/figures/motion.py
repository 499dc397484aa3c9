"""The motion of a case as figures for the browser."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag.service.figures.motion import motion_figure, phase_figure
from sprag.service.figures.orders import motion_text
from sprag.service.figures.read import read_figure
from sprag.service.http.web.figures.plotly import Data, plotly_figure
from sprag.service.languages import gettext
from sprag.service.reading.wording import number
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.reading.reader import Reading
    from sprag.worker.study import Study

#: Times at which a motion is sampled for a picture.
SAMPLES: Final = 6000


def motion_figures(
    study: Study, case: int, start: float, end: float, columns: int, reading: Reading
) -> dict[str, Data]:
    """Run the case again and draw it, over the angle with so many panels in a row. For the computing process."""
    made = models.run_trajectory(study, case, start, end, SAMPLES)
    shown = models.presentation_of(study)
    if made.times.size == 0 or made.times[-1] == start < end:
        empty = {"data": [], "layout": {}, "note": _no_motion(study, case, made.ending)}
        return {"motion": empty, **({"phase": empty} if shown.portrait else {})}
    figures = {"motion": motion_figure(made, shown, columns=columns)}
    if shown.portrait:
        figures["phase"] = phase_figure(made, shown)
    return {name: plotly_figure(read_figure(figure, reading)) for name, figure in figures.items()}


def _no_motion(study: Study, case: int, ending: str) -> str:
    """Why a part has no motion: the run stopped earlier."""
    extent = models.extent(study, case)
    if extent.along == "angle":
        return gettext("There is no motion: the case ended with {ending}.", ending=motion_text(ending))
    times = models.run_trajectory(study, case, 0.0, extent.end, SAMPLES).times
    last = float(times[-1]) if times.size else 0.0
    when = gettext("about t = {time} s", time=number(last, 3)) if last > 0.0 else "t = 0"
    return gettext(
        "There is no motion in this part: the run stopped at {when} with {ending}.",
        when=when,
        ending=motion_text(ending),
    )
