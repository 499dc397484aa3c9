"""Users and their quotas, and the filters of the audit log, for the API and the pages."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from fastapi import Query

from sprag_study.service.answers import filled
from sprag_study.service.answers.people import QuotaUse, User
from sprag_study.service.storage.people.audit import TIME_ALLOWED
from sprag_study.service.storage.people.people import Quota

if TYPE_CHECKING:
    from sprag_study.service.storage.people.people import People, UserRecord

Since = Annotated[
    str | None, Query(max_length=40, description=f"from then on: {TIME_ALLOWED}", examples=["2027-01-31"])
]
Until = Annotated[str | None, Query(max_length=40, description="up to then; of a date the whole day")]
Actor = Annotated[str | None, Query(max_length=200, description="only changes by this user, token or schedule")]
Action = Annotated[str | None, Query(max_length=40, description="only this action", examples=["study.delete"])]
Target = Annotated[str | None, Query(max_length=200, description="only changes of this study, schedule, token or user")]


def quota_json(people: People, name: str, own: Quota) -> QuotaUse:
    """The quotas of a user, and what is used of them."""
    quota, used = own.over(people.default_quota), people.usage(name)
    return {
        "cases": used.cases,
        "most_cases": quota.cases or None,
        "bytes": used.bytes,
        "most_bytes": quota.bytes or None,
        "most_checks": quota.checks or None,
    }


def user_json(people: People, record: UserRecord) -> User:
    """A user as JSON data."""
    return filled(User, record, quota=quota_json(people, record.name, record.quota))
