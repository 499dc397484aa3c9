"""Which studies a list has, and in what order, as parameters of an address."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Query

from sprag_study.service.answers.studies import StudyOrder
from sprag_study.service.faults import parameter_error
from sprag_study.service.storage.people.scopes import MAX_USER_NAME
from sprag_study.service.storage.studies.listing import StudyFilter
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_PAGE_TOKEN, MAX_SEARCH_LENGTH, MAX_TAG_LENGTH
from sprag_study.worker.states import StudyState

PageToken = Annotated[
    str | None, Query(min_length=1, max_length=MAX_PAGE_TOKEN, description="`next_page_token` of the page before")
]
Sort = Annotated[
    StudyOrder,
    Query(
        description="order: `newest`, `name`, `state` (waiting and running ones first), `cases` (most first), or "
        "`ended` (latest end first); a page token is for one order only",
        examples=["name"],
    ),
]


def wanted_studies(
    search: Annotated[
        str,
        Query(
            max_length=MAX_SEARCH_LENGTH,
            description="only studies in whose name, notes, tags or id each of these words occurs, whatever case and "
            "accents",
            examples=["feeder"],
        ),
    ] = "",
    state: Annotated[StudyState | None, Query(description="only studies in this state", examples=["finished"])] = None,
    tag: Annotated[
        str | None, Query(min_length=1, max_length=MAX_TAG_LENGTH, description="only studies with this tag")
    ] = None,
    owner: Annotated[
        str | None, Query(min_length=1, max_length=MAX_USER_NAME, description="only studies of this user")
    ] = None,
    model: Annotated[str | None, Query(min_length=1, max_length=40, description="only studies of this model")] = None,
    archived: Annotated[bool, Query(description="only archived studies; otherwise they are left out")] = False,
    deleted: Annotated[bool, Query(description="only deleted studies that can be restored")] = False,
) -> StudyFilter:
    """The filter that a request asks for; FaultError about a model that there is not."""
    if model and model not in models.model_names():
        raise parameter_error("model", "invalid-choice", "is not a model", model, ", ".join(models.model_names()))
    return StudyFilter(search, state, tag or "", owner or "", model or "", archived, deleted)


WantedStudies = Annotated[StudyFilter, Depends(wanted_studies)]
