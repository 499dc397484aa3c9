"""The filters of the audit log, for the API and the pages."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query

from sprag_study.service.storage.people.audit import TIME_ALLOWED

Since = Annotated[
    str | None, Query(max_length=40, description=f"from then on: {TIME_ALLOWED}", examples=["2027-01-31"])
]
Until = Annotated[str | None, Query(max_length=40, description="up to then; of a date the whole day")]
Actor = Annotated[str | None, Query(max_length=200, description="only changes by this user, token or schedule")]
Action = Annotated[str | None, Query(max_length=40, description="only this action", examples=["study.delete"])]
Target = Annotated[str | None, Query(max_length=200, description="only changes of this study, schedule, token or user")]
