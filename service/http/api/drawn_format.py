"""The format of what is drawn from rows, and the language of a picture: data are the same in all languages."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import Depends, Query, Request

from sprag_study.service import languages
from sprag_study.service.faults import choice_of
from sprag_study.service.formats import PICTURES, Picture
from sprag_study.service.http.api.document import format_query
from sprag_study.service.http.asked import one_of
from sprag_study.service.http.drawing import DRAWN_FORMATS
from sprag_study.service.http.respond import choose_format


def language_query(of: str) -> Any:
    """The query parameter ``language`` of what has texts for people."""
    return Query(
        max_length=20,
        description=f"language of {of}",
        examples=["uk"],
        json_schema_extra=one_of(languages.available()),
    )


async def _drawn_format(
    request: Request,
    form: Annotated[str | None, format_query(DRAWN_FORMATS)] = None,
    language: Annotated[str, language_query("a picture; JSON and CSV are the same in all")] = languages.ENGLISH,
) -> Literal["json", "csv"] | Picture:
    """The requested format. A picture is drawn in the requested language, in which this request goes on."""
    chosen = choose_format(request, form, DRAWN_FORMATS)
    choice_of("language", language, languages.available())
    if chosen in PICTURES:
        languages.use(language)
    return chosen


DrawnFormat = Annotated[Literal["json", "csv"] | Picture, Depends(_drawn_format)]
