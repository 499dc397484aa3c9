"""Figures as bytes that are ready to be sent, as for `sprag.service.jobs.answers`; and the motion of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag.service.http.web.figures.maps import map_figure
from sprag.service.http.web.figures.plotly import Data, plotly_figure
from sprag.service.jobs.answers import curves_drawn, map_of
from sprag.service.jobs.batch_answers import ribbon_of, yield_of
from sprag.service.jobs.explore import explored
from sprag.service.jobs.key_answers import answers_of
from sprag.service.jobs.reading import reading_of
from sprag.service.json_text import to_bytes
from sprag.service.languages import gettext
from sprag.service.reading.wording import number
from sprag.service.results.figures.answers import answers_figure
from sprag.service.results.figures.calibration import calibration_figure
from sprag.service.results.figures.curves import curves_figure
from sprag.service.results.figures.explore import explore_figure
from sprag.service.results.figures.front import front_figure, history_figure
from sprag.service.results.figures.motion import motion_figure, phase_figure
from sprag.service.results.figures.orders import motion_text
from sprag.service.results.figures.read import read_figure, read_map
from sprag.service.results.figures.ribbons import ribbon_figure, yield_figure
from sprag.service.results.key_answer_words import curve_name, curve_named
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.jobs.batch_answers import RibbonQuery, YieldQuery
    from sprag.service.jobs.library import Library
    from sprag.service.reading.reader import Choice, Reading
    from sprag.service.results.curves import CurveQuery
    from sprag.service.results.explore import ExploreQuery
    from sprag.service.results.figures.figure import Figure
    from sprag.worker.study import Study

#: Times at which a motion is sampled for a picture.
SAMPLES: Final = 6000


def _drawn(library: Library, study_id: str, figure: Figure, choice: Choice) -> Data:
    """A described figure of a study as its reader wants it."""
    return plotly_figure(read_figure(figure, reading_of(library.store, study_id, choice)))


def curves_json(library: Library, study_id: str, query: CurveQuery, choice: Choice, columns: int) -> bytes:
    """The figure of curves, as JSON text."""
    figure = curves_figure([("", curves_drawn(library, study_id, query))], columns)
    return to_bytes(_drawn(library, study_id, figure, choice))


def answers_json(
    library: Library,
    study_id: str,
    query: CurveQuery | None,
    point: str | None,
    curve: str,
    choice: Choice,
    columns: int,
) -> bytes:
    """The figure of the main results with the answers of the study marked, as JSON text."""
    found = answers_of(library, study_id, query, point)
    if found.drawn is None:
        return to_bytes({"data": [], "layout": {}})
    study = library.store.study(study_id)
    chosen = curve_named([curve_name(one, study) for one in found.curves], curve)
    return to_bytes(_drawn(library, study_id, answers_figure(found, columns, chosen=chosen), choice))


def explore_json(library: Library, study_id: str, query: ExploreQuery, x: str, y: str, choice: Choice) -> bytes:
    """The figure of two quantities of all cases, as JSON text; dragging selects a range of each."""
    figure = _drawn(library, study_id, explore_figure(explored(library, study_id, query), x, y), choice)
    return to_bytes({**figure, "layout": {**figure["layout"], "dragmode": "select"}})


def map_json(library: Library, study_id: str, query: CurveQuery, choice: Choice, contours: bool) -> bytes:
    """The figure of a map, as JSON text."""
    drawn = read_map(map_of(library, study_id, query), reading_of(library.store, study_id, choice))
    return to_bytes(map_figure(drawn, contours))


def front_json(
    library: Library, study_id: str, exact: bool, axes: tuple[str | None, str | None], choice: Choice
) -> bytes:
    """The figure of the designs of a search, as JSON text; dragging selects designs."""
    figure = _drawn(library, study_id, front_figure(library.fronts.of(study_id, exact=exact), *axes), choice)
    return to_bytes({**figure, "layout": {**figure["layout"], "dragmode": "select"}})


def calibration_json(library: Library, study_id: str, choice: Choice, columns: int) -> bytes:
    """The figure of a calibration, as JSON text."""
    figure = calibration_figure(library.calibrations.of(study_id), columns)
    return to_bytes(_drawn(library, study_id, figure, choice))


def search_json(library: Library, study_id: str, choice: Choice, columns: int) -> bytes:
    """The figure of how a search has come to its designs, as JSON text."""
    figure = history_figure(library.fronts.of(study_id, exact=False), columns)
    return to_bytes(_drawn(library, study_id, figure, choice))


def ribbon_json(library: Library, study_id: str, query: RibbonQuery, choice: Choice) -> bytes:
    """The figure of ribbons, as JSON text."""
    return to_bytes(_drawn(library, study_id, ribbon_figure(ribbon_of(library, study_id, query)), choice))


def yield_json(library: Library, study_id: str, query: YieldQuery, choice: Choice) -> bytes:
    """The figure of yields, as JSON text."""
    return to_bytes(_drawn(library, study_id, yield_figure(yield_of(library, study_id, query)), choice))


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
