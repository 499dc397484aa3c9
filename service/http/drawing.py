"""Files that are drawn for a request: pictures, which can do nothing but be looked at, and attachments."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from starlette.responses import Response

from service.http.work import Work
from service.results.pictures import curves as pictures

#: matplotlib puts its styles into the picture, which the pages' policy forbids; a picture can do nothing else.
_PICTURE_POLICY = "default-src 'none'; style-src 'unsafe-inline'; sandbox"


@dataclass(frozen=True, slots=True)
class Drawing:
    """A file that is still to be drawn, in another process: by what, from what, and how it is sent."""

    draw: Callable[..., bytes]
    args: tuple[Any, ...]
    media_type: str
    headers: Mapping[str, str]

    async def response(self, work: Work) -> Response:
        """The file."""
        content = await work.check(self.draw, *self.args)
        return Response(content, media_type=self.media_type, headers=dict(self.headers))


def picture(draw: Callable[..., bytes], form: pictures.Picture, *shown: object) -> Drawing:
    """A picture of something, with a policy under which it can do nothing but be looked at."""
    headers = {"Content-Security-Policy": _PICTURE_POLICY} if form == "svg" else {}
    return Drawing(draw, (*shown, form), pictures.MEDIA_TYPES[form], headers)


def picture_of(form: str) -> pictures.Picture:
    """The kind of picture of that name."""
    return next(picture for picture in pictures.PICTURES if picture == form)


def attachment(content: bytes, media_type: str, filename: str) -> Response:
    """A small file to be saved under that name."""
    headers = {"Content-Disposition": f'attachment; filename="{filename}"'}
    return Response(content, media_type=media_type, headers=headers)
