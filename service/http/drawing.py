"""Files drawn for a request: pictures, with a policy that disables everything active, and attachments."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import Response

from sprag.service.http.respond import entity_tag, not_modified, tagged
from sprag.service.http.work import Work
from sprag.service.jobs import answers
from sprag.service.results.defaults import drawn_numbers
from sprag.service.results.pictures import curves as pictures

if TYPE_CHECKING:
    from sprag.service.http.context import Context
    from sprag.service.storage.records import StudyRecord

#: matplotlib embeds its styles in the picture, which the pages' policy forbids; everything else is disabled.
_PICTURE_POLICY = "default-src 'none'; style-src 'unsafe-inline'; sandbox"


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


def picture(draw: Callable[..., bytes], form: pictures.Picture, *shown: object) -> Drawing:
    """A picture, with a policy that disables everything active in it."""
    headers = {"Content-Security-Policy": _PICTURE_POLICY} if form == "svg" else {}
    return Drawing(draw, (*shown, form), pictures.MEDIA_TYPES[form], headers)


def picture_of(form: str) -> pictures.Picture:
    """The kind of picture of that name."""
    return next(picture for picture in pictures.PICTURES if picture == form)


def attachment(content: bytes, media_type: str, filename: str) -> Response:
    """A small file, downloaded under that name."""
    return Response(content, media_type=media_type, headers=attached(filename))


def attached(filename: str) -> dict[str, str]:
    """The headers of a file that is downloaded under that name."""
    return {"Content-Disposition": f'attachment; filename="{filename}"'}


def placed(context: Context, drawing: Drawing) -> Response | Drawing:
    """A drawing of `sprag.service.jobs.answers`: made here where it has few numbers, otherwise left to another
    process.
    """
    _, study_id, query, *_ = drawing.args
    return drawing if drawn_numbers(context.store.study(study_id), query) > answers.FEW else drawing.here()


async def conditional(
    context: Context,
    work: Work,
    request: Request,
    study_id: str,
    form: str,
    make: Callable[[StudyRecord], Response | Drawing],
) -> Response:
    """The answer of ``make``, or 304 when the client has it; it depends on the study's rows and the query."""

    def look() -> tuple[str, Response | Drawing, bool]:
        record = context.store.get_study(study_id)
        tag = entity_tag(record.id, record.revision, request.url.path, request.url.query, form)
        unchanged = not_modified(request, tag)
        return tag, unchanged or make(record), unchanged is not None

    tag, made, unchanged = await run_in_threadpool(look)
    response = await made.response(work) if isinstance(made, Drawing) else made
    return response if unchanged else tagged(response, tag)
