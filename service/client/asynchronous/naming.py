"""Studies named by people: ``latest``, an id or the beginning of one, a name or the beginning of one."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from sprag.service.client.errors import AmbiguousError
from sprag.worker.limits import MAX_SEARCH_LENGTH

if TYPE_CHECKING:
    from sprag.service.client.asynchronous.connection import AsyncConnection

LATEST: Final = "latest"
_WHOLE_ID: Final = re.compile(r"st_[0-9a-f]{16,}")
_PAGE: Final = "500"


async def study_of(connection: AsyncConnection, text: str) -> str:
    """The id of the study that is meant: ``latest``, an id or the beginning of one, a name or the beginning of one.

    A text that fits no study is returned unchanged, and the service refuses it. Raises AmbiguousError where several
    studies fit; a whole name precedes the beginning of others. ValueError for an empty text.
    """
    if not text.strip():
        raise ValueError("the id or name of a study is needed")
    if _WHOLE_ID.fullmatch(text):
        return text
    if text == LATEST:
        newest = (await connection.request("GET", "/studies", params=[("page_size", "1")]))["studies"]
        return str(newest[0]["id"]) if newest else text
    # Every study that fits contains the words of the text; archived ones are found too.
    asked = [("page_size", _PAGE), ("search", text[:MAX_SEARCH_LENGTH])]
    studies = []
    for more in ([], [("archived", "true")]):
        async for study in connection.items("/studies", "studies", [*asked, *more]):
            studies.append(study)
    wanted = text.casefold()
    for fits in (
        [s for s in studies if s["name"] == text],
        [s for s in studies if s["id"].startswith((text, f"st_{text}")) or s["name"].casefold().startswith(wanted)],
    ):
        if len(fits) == 1:
            return str(fits[0]["id"])
        if fits:
            raise AmbiguousError(text, [f"{study['id']} ({study['name'] or study['model']})" for study in fits])
    return text
