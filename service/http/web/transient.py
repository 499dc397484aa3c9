"""The page of a transient: the run-up of a machine shaft, a step of its load, or its coasting."""

from __future__ import annotations

from typing import Annotated, Any, Final
from urllib.parse import urlencode

from fastapi import Query
from starlette.responses import Response

from sprag.service.faults import FaultError
from sprag.service.http.context import CaseNumber, StudyId, study_with
from sprag.service.http.reading import read_as
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.languages import N_
from sprag.service.views.transient import course_of, require_transients
from sprag.worker.models.abilities import has_motor, run_transient, shape_of_transients
from sprag.worker.models.transients import RESULTS

router = page_router()

_POINTS: Final = 2000
_KINDS: Final = {
    "run-up": N_("run-up from rest"),
    "load-step": N_("step of the load"),
    "coasting": N_("coasting, drive off"),
}

Text = Annotated[str, Query(max_length=80)]


@router.get("/studies/{study_id:study}/cases/{case:case}/transient")
async def transient_page(
    work: Attended, study_id: StudyId, case: CaseNumber, kind: Text = "", load: Text = "", angle: Text = "",
    torque: Text = "", within: Text = "", revolutions: Text = "",
) -> Response:  # fmt: skip
    """The form of a transient, its results and its figure."""
    study = await in_thread(study_with, work.context, study_id, case)
    require_transients(study)
    given = {"load": load, "angle": angle, "torque": torque, "within": within, "revolutions": revolutions}
    faults: tuple[Any, ...] = ()
    made, query = None, ""
    if kind:
        try:
            course = course_of(study, case, kind, given)
        except FaultError as error:
            faults = error.faults
        else:
            query = urlencode({"kind": kind, **{name: text.strip() for name, text in given.items() if text.strip()}})
            await work.load(shape_of_transients(study))
            made = await work.run_case(run_transient, study, case, course, 2)
    own = f"/studies/{study_id}/cases/{case}/transient"
    frame = await in_thread(study_frame, work.context, study_id)
    return page(
        "transient.html",
        status=422 if faults else 200,
        **frame,
        tab="/rows",
        case=case,
        kinds=_KINDS,
        kind=kind or "coasting",
        given=given,
        motor=has_motor(study),
        faults=faults,
        made=made,
        results=[] if made is None else [(*info, made.results[info[0]]) for info in RESULTS],
        figure=f"{own}/figure?{query}&points={_POINTS}{read_as()}" if query else "",
        file=f"/api/v1{own}?{query}",
    )
