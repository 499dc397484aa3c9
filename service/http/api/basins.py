"""The basin of a case: to which regime it comes from each start of a grid of two initial values."""

from __future__ import annotations

from starlette.responses import Response

from sprag.service.answers.results import BasinData
from sprag.service.http.api.document import CASE_PROBLEMS, files, problems
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.basin_query import AskedBasin
from sprag.service.http.context import CaseNumber, StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, picture
from sprag.service.http.drawing import table as written
from sprag.service.http.routers import api_router
from sprag.service.http.work import Attended
from sprag.service.reading.reader import Reading
from sprag.service.results import basins
from sprag.service.results.pictures.curves import draw_basin

router = api_router("cases", "/studies/{study_id:study}/cases")


@router.get(
    "/{case:case}/basin",
    response_model=BasinData,
    responses={
        **files("The grid as JSON or CSV, or a picture.", DRAWN_FORMATS.values()),
        **problems(*CASE_PROBLEMS, "too-costly"),
    },
)
async def get_basin(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    asked: AskedBasin,
    chosen: DrawnFormat,
) -> Response:
    """To which regime a settled case comes from each start of a grid. The case is run from all of them for this."""
    study, query = await work.case_of(study_id, case, lambda study: asked.of(study, case))
    if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
        content = await work.run_case(basins.basin_file, study, case, query, chosen)
        return written(content, chosen, f"{study_id}-case-{case}-basin")
    made = await work.run_case(basins.basin_of, study, case, query)
    units = basins.units_of(study, query)
    title = f"{study.name}, case {case}"
    return await picture(draw_basin, chosen, made, query.paths, units, Reading(study.model), title).response(work)
