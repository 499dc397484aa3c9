"""The report as a tagged PDF, typeset by Typst from a template, which an office can replace by its own."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from dataclasses import asdict
from functools import partial
from importlib.resources import as_file, files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final, cast

from sprag_study.service.extras import naming_extra
from sprag_study.service.faults import FaultError
from sprag_study.service.languages import _, current
from sprag_study.service.report.blocks import Document, Image, Section
from sprag_study.service.report.html import page_numbers, sheet_of

if TYPE_CHECKING:
    from sprag_study.service.report.blocks import Block

TEMPLATE: Final = "report.typ"
#: The conformance asked for: PDF for everybody, with tags, a title, a language and descriptions of pictures.
_STANDARD: Final = "ua-1"
_UNPRINTABLE: Final = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
_ENDINGS: Final = {"image/svg+xml": "svg", "image/png": "png"}


def pdf_report(document: Document, folder: Path | None, logo: tuple[str, bytes] | None) -> bytes:
    """The document: the same bytes for the same study and template, where its fonts have all characters.

    Raises
    ------
    MissingExtraError
        Without the extra `report`.
    FaultError
        When the office's own template is wrong.
    """
    with naming_extra("A report as PDF", "report"):
        import typst
    with TemporaryDirectory(prefix="sprag-report-") as name:
        place = Path(name)
        own = None if folder is None else folder / TEMPLATE
        if own is not None and own.is_file():
            shutil.copytree(own.parent, place, dirs_exist_ok=True)
        else:
            with as_file(files("sprag_study.service.report") / "templates" / TEMPLATE) as template:
                shutil.copy(template, place / TEMPLATE)
        data: dict[str, Any] = {
            "title": document.title,
            "foot": document.foot,
            "particulars": document.particulars,
            "sections": list(_sections(document.sections, place)),
            "logo": None,
            "language": current(),
            "words": {
                "author": _("Author"),
                "logo": _("Logo"),
                "report": _("Report"),
                "sheet": _("Sheet"),
                "first": sheet_of(1, 2),
                "page": page_numbers(),
            },
        }
        if logo is not None:
            data["logo"] = f"logo.{_ENDINGS[logo[0]]}"
            (place / data["logo"]).write_bytes(logo[1])
        (place / "report.json").write_text(json.dumps(_printable(data), ensure_ascii=False), encoding="utf-8")
        fonts = [] if folder is None else [str(folder)]
        compiled: Callable[..., bytes] = partial(
            cast("Any", typst.compile), str(place / TEMPLATE), root=name, format="pdf", timestamp=0, font_paths=fonts
        )
        try:
            try:
                made = compiled(pdf_standards=_STANDARD, ignore_system_fonts=True)
            except typst.TypstError:
                # The standard refuses characters that the fonts lack: the fonts of the system may have them.
                made = compiled(ignore_system_fonts=False)
        except typst.TypstError as error:
            raise FaultError("unavailable", f"The report cannot be typeset: {error}") from error
    return made


def _printable(data: Any) -> Any:
    """The data with a sign for every character that no font has."""
    if isinstance(data, str):
        return _UNPRINTABLE.sub("?", data)
    if isinstance(data, dict):
        return {name: _printable(value) for name, value in data.items()}
    return [_printable(item) for item in data] if isinstance(data, list | tuple) else data


def _sections(sections: tuple[Section, ...], place: Path) -> Iterator[dict[str, Any]]:
    """The sections as plain data; pictures are files beside it."""
    count = 0
    for section in sections:
        blocks = []
        for block in section.blocks:
            if isinstance(block, Image):
                count += 1
                (place / f"picture-{count}.svg").write_bytes(block.svg)
            blocks.append(_plain(block, f"picture-{count}.svg"))
        yield {"title": section.title, "sheet": section.sheet, "blocks": blocks}


def _plain(block: Block, file: str) -> dict[str, Any]:
    fields = {name: value for name, value in asdict(block).items() if not isinstance(value, bytes)}
    return {**fields, "file": file} if isinstance(block, Image) else fields
