"""Files drawn for a request: pictures, with a policy that disables everything active, and attachments."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal

from starlette.requests import Request
from starlette.responses import Response

from sprag_study.service import languages
from sprag_study.service.figures import pictures
from sprag_study.service.formats import MEDIA_TYPES, Format, Picture
from sprag_study.service.http.respond import entity_tag, not_modified, tagged
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import Work
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.service.storage.studies.records import StudyRecord

#: Formats of what is drawn from rows and written as a table too.
DRAWN_FORMATS: Final = dict[Literal["json", "csv"] | Picture, str](
    [("json", MEDIA_TYPES["json"]), ("csv", MEDIA_TYPES["csv"]), *pictures.MEDIA_TYPES.items()]
)
#: Formats of the tables of one case.
TABLE_FORMATS: Final[dict[Literal["json", "csv"], str]] = {"json": MEDIA_TYPES["json"], "csv": MEDIA_TYPES["csv"]}
#: A map has its cells as a picture within it, which is data; everything else is disabled.
_PICTURE_POLICY: Final = "default-src 'none'; img-src data:; sandbox"


@dataclass(frozen=True, slots=True)
class Drawing:
    """A file to be drawn in another process: the function, its arguments, and the form of the answer."""

    draw: Callable[..., bytes]
    args: tuple[Any, ...]
    media_type: str
    headers: Mapping[str, str] = field(default_factory=dict)

    async def response(self, work: Work) -> Response:
        """The file."""
        return self._sent(await work.check(self.draw, *self.args))

    def here(self) -> Response:
        """The file, drawn by this process now."""
        return self._sent(self.draw(*self.args))

    def _sent(self, content: bytes) -> Response:
        return Response(content, media_type=self.media_type, headers=dict(self.headers))


def picture(draw: Callable[..., bytes], form: Picture, *shown: object) -> Drawing:
    """A picture, with a policy that disables everything active in it."""
    headers = {"Content-Security-Policy": _PICTURE_POLICY} if form == "svg" else {}
    return Drawing(draw, (*shown, form), pictures.MEDIA_TYPES[form], headers)


def table(content: bytes, form: Format, name: str) -> Response:
    """JSON data, or a small file to be saved under that name with the ending of its format."""
    headers = {} if form == "json" else attached(f"{name}.{form}")
    return Response(content, media_type=MEDIA_TYPES[form], headers=headers)


def attached(filename: str) -> dict[str, str]:
    """The headers of a file that is downloaded under that name."""
    return {"Content-Disposition": f'attachment; filename="{filename}"'}


async def conditional(
    work: Work, study_id: str, form: str, make: Callable[[StudyRecord], Response | Drawing]
) -> Response:
    """The answer of ``make``, or 304 when the client has it; it depends on the study's rows and the query."""

    def look() -> tuple[str, Callable[[], Response | Drawing]]:
        record = work.context.store.studies.get(study_id)
        return tag_of(work.request, record.id, record.revision, form), partial(make, record)

    return await unless_known(work, look)


async def unless_known(work: Work, look: Callable[[], tuple[str, Callable[[], Response | Drawing]]]) -> Response:
    """304 when the client has the version of the tag that ``look`` gives, else what the function beside it makes."""

    def answer() -> tuple[str, Response | Drawing, bool]:
        tag, make = look()
        unchanged = not_modified(work.request, tag)
        return tag, unchanged or make(), unchanged is not None

    tag, made, unchanged = await in_thread(answer)
    response = await made.response(work) if isinstance(made, Drawing) else made
    return response if unchanged else tagged(response, tag)


async def unchanging(work: Work, study_id: str, make: Callable[[], Awaitable[Response]]) -> Response:
    """The answer about a case, or 304: a case is what its study says, and studies never change."""
    tag = tag_of(work.request, study_id, models.ENGINE_VERSION)
    return not_modified(work.request, tag) or tagged(await make(), tag)


def tag_of(request: Request, *parts: object) -> str:
    """The entity tag of an answer to this address, in this language, that depends on ``parts``."""
    return entity_tag(request.url.path, request.url.query, languages.current(), *parts)
