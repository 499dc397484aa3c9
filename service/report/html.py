"""The document as HTML: one self-contained file with embedded pictures, ready to be printed."""

from __future__ import annotations

import base64
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

from jinja2 import ChoiceLoader, Environment, FileSystemLoader, PackageLoader, StrictUndefined
from markupsafe import Markup

from sprag_study.service.languages import _, current

if TYPE_CHECKING:
    from pathlib import Path

    from sprag_study.service.report.blocks import Document


def html_report(document: Document, folder: Path | None, logo: tuple[str, bytes] | None) -> bytes:
    """The page. ``folder`` may have a template of the office's own; ``logo`` is a media type and a picture."""
    package = PackageLoader("sprag_study.service.report")
    environment = Environment(
        loader=package if folder is None else ChoiceLoader([FileSystemLoader(folder), package]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["embedded"] = embedded
    mark = None if logo is None else embedded(logo[1], logo[0])
    template = environment.get_template("report.html")
    text = template.render(
        document=document, logo=mark, language=current(), page=page_numbers(), style=style(), sheet_of=sheet_of, _=_
    )
    return text.encode("utf-8")


@cache
def style() -> Markup:
    """The style of the sheets, which the page of a document has as a file."""
    return Markup((files("sprag_study.service.report") / "static" / "document.css").read_text("utf-8"))  # noqa: S704 - ours


def sheet_of(number: int, count: int) -> str:
    """Which of the sheets it is."""
    return _("{number} of {count}", number=number, count=count)


def page_numbers() -> tuple[str, str, str]:
    """What stands before the number of a page, between it and the number of pages, and after that."""
    before, between, after = _("Page {page} of {pages}", page="\0", pages="\0").split("\0")
    return before, between, after


def embedded(picture: bytes, media_type: str = "image/svg+xml") -> str:
    """A picture as an address that contains it."""
    return f"data:{media_type};base64,{base64.b64encode(picture).decode('ascii')}"
