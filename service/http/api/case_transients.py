"""The transients of one case: run-up from rest, a step of the load, coasting."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import Query
from starlette.responses import Response

from sprag.service.answers.transients import Transient
from sprag.service.http.api.document import CASE_PROBLEMS, files, one_of, problems
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.context import CaseNumber, StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, picture, table
from sprag.service.http.routers import api_router
from sprag.service.http.work import Attended
from sprag.service.reading.reader import Reading
from sprag.service.results import transients
from sprag.service.results.figures.read import read_figure
from sprag.service.results.figures.transient import transient_figure
from sprag.service.results.pictures.curves import draw_figure
from sprag.worker.limits import MAX_TRAJECTORY_POINTS, MIN_TRAJECTORY_POINTS
from sprag.worker.models.abilities import run_transient, shape_of_transients
from sprag.worker.models.transients import KINDS

if TYPE_CHECKING:
    from sprag.worker.models.transients import Course
    from sprag.worker.study import Study

router = api_router("cases", "/studies/{study_id:study}/cases")

Kind = Annotated[
    str,
    Query(description="which transient it is", examples=["run-up"], json_schema_extra=one_of(KINDS)),
]
Load = Annotated[
    str | None, Query(description="factor on the torque of all operations during it; by default 1", examples=["1.5"])
]
Angle = Annotated[
    str | None, Query(description="angle of the shaft at which it begins, rad or with a unit; by default 0")
]
Torque = Annotated[
    str | None,
    Query(description="constant driving torque of a run-up, N*m or with a unit; required without a motor"),
]
Within = Annotated[
    str | None,
    Query(
        description="share of the first difference in speed from the steady cycle at which that counts as reached; "
        "by default 0.01 with a motor, otherwise 0"
    ),
]
Revolutions = Annotated[str | None, Query(description="most revolutions that are computed; by default 1000")]


@router.get(
    "/{case:case}/transient",
    response_model=Transient,
    responses={
        **files("The transient as JSON, its values over time as CSV, or a picture.", DRAWN_FORMATS.values()),
        **problems(*CASE_PROBLEMS, "too-costly"),
    },
)
async def get_transient(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    chosen: DrawnFormat,
    kind: Kind,
    load: Load = None,
    angle: Angle = None,
    torque: Torque = None,
    within: Within = None,
    revolutions: Revolutions = None,
    points: Annotated[
        int,
        Query(ge=MIN_TRAJECTORY_POINTS, le=MAX_TRAJECTORY_POINTS, description="equally spaced times", examples=[50]),
    ] = 1000,
) -> Response:
    """The run-up from rest of one machine shaft, a step of its load, or its coasting, over time."""
    given = {"load": load, "angle": angle, "torque": torque, "within": within, "revolutions": revolutions}

    def look(study: Study) -> Course:
        return transients.course_of(study, case, kind, given)

    study, course = await work.case_of(study_id, case, look)
    await work.load(shape_of_transients(study))
    if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
        content = await work.run_case(transients.transient_file, study, case, course, points, chosen)
        return table(content, chosen, f"{study_id}-case-{case}-{kind}")
    made = await work.run_case(run_transient, study, case, course, points)
    return await picture(
        draw_figure, chosen, read_figure(transient_figure(made), Reading(study.model)), f"{study.name}, case {case}"
    ).response(work)
