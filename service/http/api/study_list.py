"""Studies as a list: searched and sorted; what people write about them; deleted and restored."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query, Request
from starlette.responses import Response

from sprag_study.service.answers import studies as m
from sprag_study.service.answers.studies import StudyOrder
from sprag_study.service.http import views
from sprag_study.service.http.api.document import BODY_PROBLEMS, DELETES, body, next_page, problems
from sprag_study.service.http.context import Ctx, StudyId
from sprag_study.service.http.listing import PageToken, Sort, WantedStudies
from sprag_study.service.http.requests import IfMatch, Received, editions
from sprag_study.service.http.respond import json_response, page_response, tagged
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import Attended
from sprag_study.service.spec.labels import read_change
from sprag_study.worker.limits import MAX_PAGE_SIZE

router = api_router("studies")


@router.get("/studies", response_model=m.StudyPage, responses=next_page() | problems("invalid-parameter"))
def list_studies(
    context: Ctx,
    request: Request,
    wanted: WantedStudies,
    page_size: Annotated[int, Query(ge=1, le=MAX_PAGE_SIZE, description="most studies on the page")] = 50,
    page_token: PageToken = None,
    sort: Sort = StudyOrder.NEWEST,
) -> Response:
    """Studies, newest first or in another order: all but archived and deleted ones, or those that are searched for."""
    page = context.store.studies.page(page_size, page_token, wanted, sort)
    studies = [views.summary(record) for record in page.studies]
    return page_response(request, {"studies": studies, "next_page_token": page.next_token})


@router.patch(
    "/studies/{study_id:study}",
    response_model=m.StudySummary,
    responses=problems(*BODY_PROBLEMS, "study-not-found", "precondition-failed", "quota-exceeded"),
    openapi_extra=body(
        {
            "a name and a tag": {"name": "Feeder, softer clutch", "add_tags": ["customer 7"]},
            "archived": {"archived": True},
        },
        "StudyChange",
    ),
)
async def change_study(
    context: Ctx,
    work: Attended,
    study_id: StudyId,
    received: Received,
    if_match: IfMatch = None,
) -> Response:
    """Change what people write about a study: name, notes, tags, and whether it is archived.

    Fields that are left out are kept. Nothing that is computed changes, and its spec keeps the name with which it was
    submitted.
    """
    change = await work.read(read_change, received)
    record = await in_thread(context.store.studies.change, study_id, change, editions(if_match))
    return tagged(json_response(views.summary(record)), views.study_tag(record))


@router.delete(
    "/studies/{study_id:study}",
    **DELETES,
    responses=problems("invalid-parameter", "study-not-found", "wrong-state", "precondition-failed"),
)
def delete_study(
    context: Ctx,
    study_id: StudyId,
    if_match: IfMatch = None,
    at_once: Annotated[
        bool, Query(description="remove its results now, to make room on the disk; it cannot be restored")
    ] = False,
) -> Response:
    """Delete a study that has ended, or is held at its deadline, with all its results.

    It can be restored for `SPRAG_RESTORE_DAYS`, unless `at_once` is true.
    """
    context.store.studies.delete(study_id, at_once=at_once, read=editions(if_match))
    return Response(status_code=204)


@router.post(
    "/studies/{study_id:study}:restore",
    response_model=m.StudySummary,
    responses=problems("invalid-parameter", "study-not-found"),
)
def restore_study(context: Ctx, study_id: StudyId) -> Response:
    """Undo the deletion of a study, with all its results, until `purge_at`."""
    context.store.studies.restore(study_id)
    return json_response(views.summary(context.store.studies.get(study_id)))
