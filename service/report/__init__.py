"""A study as a document to be shown: title block, machine, answers, chosen curves, inputs, versions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from sprag.service.formats import REPORT_FORMATS, ReportFormat

if TYPE_CHECKING:
    from sprag.service.reading.reader import Choice
    from sprag.service.report.blocks import Document
    from sprag.service.views.library import Library
    from sprag.service.views.study_questions import ReportQuestion

__all__ = ["MEDIA_TYPES", "REPORT_FORMATS", "ReportFormat", "logo_of", "report_file", "write_report"]

MEDIA_TYPES: Final[dict[ReportFormat, str]] = {"html": "text/html; charset=utf-8", "pdf": "application/pdf"}
#: Files that may be the logo in the folder of an office's templates, and their media types.
_LOGOS: Final = (("logo.svg", "image/svg+xml"), ("logo.png", "image/png"))


def report_file(
    library: Library, study_id: str, choice: Choice, question: ReportQuestion, office: str, folder: str,
    form: ReportFormat,
) -> bytes:  # fmt: skip
    """The document of a study as a file; ``office`` and ``folder`` are those of the settings.

    Raises as `document_of` does.
    """
    from sprag.service.report.document import document_of

    return write_report(document_of(library, study_id, choice, question, office), folder, form)


def write_report(document: Document, folder: str, form: ReportFormat) -> bytes:
    """The document; ``folder`` has the templates and the logo of an office, "" where it has none of its own."""
    place = Path(folder) if folder else None
    # Only the libraries of the requested format are loaded.
    if form == "html":
        from sprag.service.report.html import html_report as writer
    else:
        from sprag.service.report.pdf import pdf_report as writer
    return writer(document, place, logo_of(place))


def logo_of(place: Path | None) -> tuple[str, bytes] | None:
    """Media type and picture of the logo in the folder of an office; None where there is none."""
    if place is None:
        return None
    return next(((kind, (place / name).read_bytes()) for name, kind in _LOGOS if (place / name).is_file()), None)
