"""The basin of a case: a page, and the figure that it shows."""

from __future__ import annotations

from typing import Any, Final
from urllib.parse import urlencode

from fastapi import Request
from starlette.responses import Response

from sprag.service.faults import FaultError
from sprag.service.http.context import CaseNumber, Ctx, StudyId, study_with
from sprag.service.http.reading import read_as
from sprag.service.http.routers import page_router
from sprag.service.http.web.study import study_frame
from sprag.service.http.web.templates import page
from sprag.service.views import basin as basins
from sprag.service.views.case_questions import BasinQuestion
from sprag.service.views.cases import CASE_VIEWS
from sprag.service.views.setting import question_of, settings_of

router = page_router()

_FIELDS: Final = tuple(asked.alias for asked in settings_of(BasinQuestion))
#: Characters of a field that are read.
_LONGEST: Final = 80


@router.get("/studies/{study_id:study}/cases/{case:case}/basin")
def basin_page(context: Ctx, request: Request, study_id: StudyId, case: CaseNumber) -> Response:
    """The form of a basin, and to which regime the case comes from each start of its grid."""
    study = study_with(context, study_id, case)
    basins.require_basin(study)
    given = {name: request.query_params.get(name, "").strip()[:_LONGEST] for name in _FIELDS}
    texts = dict(given)
    faults: tuple[Any, ...] = ()
    asked = ""
    usual = basins.usual_ends(study)
    try:
        texts["x"], texts["y"] = basins.basin_paths(study, texts["x"] or None, texts["y"] or None)
        CASE_VIEWS["basin"].choose(study, case, question_of(BasinQuestion, texts))
        asked = urlencode({name: text for name, text in texts.items() if text})
    except FaultError as error:
        # The first look at a study without starts has no ranges yet.
        faults = error.faults if any(given.values()) else ()
    own = f"/studies/{study_id}/cases/{case}/basin"
    return page(
        "basin.html",
        status=422 if faults else 200,
        **study_frame(context, study_id),
        tab="/rows",
        case=case,
        given=texts,
        known=basins.initial_values(study),
        usual=usual,
        usual_points=BasinQuestion().points,
        faults=faults,
        figure=f"{own}/figure?{asked}{read_as()}" if asked else "",
        file=f"/api/v1{own}?{asked}",
    )
