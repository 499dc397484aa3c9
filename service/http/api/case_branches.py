"""The motions of one case along a parameter: its branch, its bifurcation diagram, and its Poincare section."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import Query
from starlette.responses import Response

from sprag.service.answers.results import Branch
from sprag.service.answers.sections import Sections
from sprag.service.http.api.document import CASE_PROBLEMS, files, problems
from sprag.service.http.api.drawn_format import DrawnFormat
from sprag.service.http.context import CaseNumber, StartNumber, StudyId
from sprag.service.http.drawing import DRAWN_FORMATS, picture
from sprag.service.http.drawing import table as written
from sprag.service.http.routers import api_router
from sprag.service.http.work import Attended, Work
from sprag.service.reading.reader import Reading
from sprag.service.results import branches, sections
from sprag.service.results.figures.branch import branch_figure
from sprag.service.results.figures.read import read_figure
from sprag.service.results.figures.sections import diagram_figure, section_figure
from sprag.service.results.pictures.curves import draw_figure
from sprag.worker.models.abilities import run_branch, run_sections
from sprag.worker.models.starts import motion_of

if TYPE_CHECKING:
    from sprag.service.results.figures.figure import Figure
    from sprag.service.results.pictures.curves import Picture
    from sprag.worker.models.branches import Along
    from sprag.worker.models.sections import Sampling
    from sprag.worker.study import Study

router = api_router("cases", "/studies/{study_id:study}/cases")

Paths = Annotated[
    str,
    Query(
        description="path of the parameter, or several joined by commas that have one value",
        examples=["shaft.load"],
        max_length=400,
    ),
]
Low = Annotated[
    str | None,
    Query(alias="from", description="start of the range, SI or with a unit; by default the smallest on its axis"),
]
High = Annotated[
    str | None, Query(alias="to", description="end of the range, likewise; by default the largest on its axis")
]
Phase = Annotated[
    str | None,
    Query(description="phase of the excitation at the strobes, rad or with a unit; by default 0", examples=["90 deg"]),
]


@router.get(
    "/{case:case}/branch",
    response_model=Branch,
    responses={
        **files("The branch as JSON, its points as CSV, or a picture.", DRAWN_FORMATS.values()),
        **problems(*CASE_PROBLEMS, "too-costly"),
    },
)
async def get_branch(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    chosen: DrawnFormat,
    along: Paths,
    low: Low = None,
    high: High = None,
    y: Annotated[str | None, Query(description="the result that a picture shows")] = None,
    which: StartNumber = None,
) -> Response:
    """The periodic motions that the motion of one case becomes along a parameter, stable and unstable ones."""

    def look(study: Study) -> tuple[Along, str]:
        return branches.along_of(study, case, along, low, high), branches.result_of(study, y)

    study, (asked, result) = await work.case_of(study_id, case, look, which)
    if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
        content = await work.run_case(branches.branch_file, study, case, asked, chosen, which)
        return written(content, chosen, f"{study_id}-case-{case}-branch")
    made = await work.run_case(run_branch, *motion_of(study, case, which), asked)
    return await _drawn(work, chosen, branch_figure(made, study, asked, result), study, case)


@router.get(
    "/{case:case}/diagram",
    response_model=Sections,
    responses={
        **files("The strobes as JSON or CSV, or a picture.", DRAWN_FORMATS.values()),
        **problems(*CASE_PROBLEMS, "too-costly"),
    },
)
async def get_diagram(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    chosen: DrawnFormat,
    along: Paths,
    low: Low = None,
    high: High = None,
    phase: Phase = None,
    points: Annotated[
        int, Query(ge=2, le=sections.MAX_VALUES, description="equally spaced values of the parameter", examples=[20])
    ] = 200,
    strobes: Annotated[
        int, Query(ge=1, le=sections.MAX_STROBES, description="most strobes of each motion", examples=[16])
    ] = 64,
    y: Annotated[str | None, Query(description="the variable that a picture shows")] = None,
    which: StartNumber = None,
) -> Response:
    """Strobes of the settled motions of one case along a parameter, each from its own start: a bifurcation diagram."""

    def look(study: Study) -> tuple[Sampling, str]:
        asked = sections.diagram_of(study, case, along, (low, high), phase, (points, strobes))
        return asked, sections.variable_of(study, y)

    study, (asked, variable) = await work.case_of(study_id, case, look, which)
    if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
        content = await work.run_case(sections.sections_file, study, case, asked, chosen, False, which)
        return written(content, chosen, f"{study_id}-case-{case}-diagram")
    made = await work.run_case(run_sections, *motion_of(study, case, which), asked)
    return await _drawn(work, chosen, diagram_figure(made, study, asked, variable), study, case)


@router.get(
    "/{case:case}/section",
    response_model=Sections,
    responses={
        **files("The strobes as JSON or CSV, or a picture.", DRAWN_FORMATS.values()),
        **problems(*CASE_PROBLEMS, "too-costly"),
    },
)
async def get_section(
    work: Attended,
    study_id: StudyId,
    case: CaseNumber,
    chosen: DrawnFormat,
    phase: Phase = None,
    strobes: Annotated[int, Query(ge=1, le=sections.MAX_SECTION, description="most strobes", examples=[50])] = 1000,
    which: StartNumber = None,
) -> Response:
    """Strobes of the settled motion of one case at a phase of the excitation: its Poincare section."""

    def look(study: Study) -> Sampling:
        return sections.section_of(study, case, phase, strobes)

    study, asked = await work.case_of(study_id, case, look, which)
    if chosen == "json" or chosen == "csv":  # noqa: PLR1714 - narrows the type
        content = await work.run_case(sections.sections_file, study, case, asked, chosen, True, which)
        return written(content, chosen, f"{study_id}-case-{case}-section")
    made = await work.run_case(run_sections, *motion_of(study, case, which), asked)
    return await _drawn(work, chosen, section_figure(made, study, asked), study, case)


async def _drawn(work: Work, form: Picture, figure: Figure, study: Study, case: int) -> Response:
    figure = read_figure(figure, Reading(study.model))
    return await picture(draw_figure, form, figure, f"{study.name}, case {case}").response(work)
