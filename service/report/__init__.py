"""A study as a document to be shown: title block, machine, answers, chosen curves, inputs, versions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag_study.service.formats import REPORT_FORMATS, ReportFormat
from sprag_study.service.report.office import Office

if TYPE_CHECKING:
    from sprag_study.service.reading.reader import Choice
    from sprag_study.service.report.blocks import Document
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.study_questions import ReportQuestion

__all__ = ["MEDIA_TYPES", "REPORT_FORMATS", "Office", "ReportFormat", "report_file", "write_report"]

MEDIA_TYPES: Final[dict[ReportFormat, str]] = {"html": "text/html; charset=utf-8", "pdf": "application/pdf"}


def report_file(
    library: Library, study_id: str, choice: Choice, question: ReportQuestion, office: Office, form: ReportFormat
) -> bytes:
    """The document of a study as a file; raises as `document_of` does."""
    from sprag_study.service.report.document import document_of

    return write_report(document_of(library, study_id, choice, question, office), office, form)


def write_report(document: Document, office: Office, form: ReportFormat) -> bytes:
    """The document with the templates and the logo of an office."""
    # Only the libraries of the requested format are loaded.
    if form == "html":
        from sprag_study.service.report.html import html_report as writer
    else:
        from sprag_study.service.report.pdf import pdf_report as writer
    return writer(document, office.place, office.logo)
