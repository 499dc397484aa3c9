"""What people name: a study as ``latest``, others by an id or the beginning of one, a name or the beginning of one."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from sprag_study.service.client.matching import Named, meant
from sprag_study.service.client.wire import named
from sprag_study.worker.limits import MAX_SEARCH_LENGTH

if TYPE_CHECKING:
    from sprag_study.service.client.asynchronous.connection import AsyncConnection

LATEST: Final = "latest"
_WHOLE_ID: Final = re.compile(r"(st|sc)_[0-9a-f]{16,}")
_PAGE: Final = "500"
_DELETED: Final = ("deleted", "true")


async def study_of(connection: AsyncConnection, text: str, *, deleted: bool = False) -> str:
    """The id of the study that is meant: ``latest``, an id or the beginning of one, a name or the beginning of one.

    A text that fits no study is returned unchanged, and the service refuses it. Raises AmbiguousError where several
    studies fit; a whole name precedes the beginning of others. ArgumentError for an empty text. With ``deleted``, one
    of the studies that are deleted and can be restored is meant; ``latest`` was deleted last.
    """
    if _WHOLE_ID.fullmatch(named("study_id", text)):
        return text
    if text == LATEST and deleted:
        purged = {s["id"]: s["purge_at"] async for s in connection.items("/studies", "studies", [_DELETED])}
        return max(purged, key=lambda study_id: str(purged[study_id]), default=text)
    if text == LATEST:
        newest = (await connection.request("GET", "/studies", params=[("page_size", "1")]))["studies"]
        return str(newest[0]["id"]) if newest else text
    # Every study that fits contains the words of the text; archived ones are found too.
    asked = [("page_size", _PAGE), ("search", text[:MAX_SEARCH_LENGTH])]
    studies = []
    for more in ([_DELETED],) if deleted else ([], [("archived", "true")]):
        async for s in connection.items("/studies", "studies", [*asked, *more]):
            studies.append(Named(s["id"], s["name"], f"{s['id']} ({s['name'] or s['model']})"))
    return meant(text, studies, "studies", "st_")


async def schedule_of(connection: AsyncConnection, text: str) -> str:
    """The id of the schedule that is meant, otherwise as `study_of`."""
    if _WHOLE_ID.fullmatch(named("schedule_id", text)):
        return text
    found = (await connection.request("GET", "/schedules"))["schedules"]
    schedules = [Named(s["id"], s["name"], f"{s['id']} ({s['name']})") for s in found]
    return meant(text, schedules, "schedules", "sc_")
