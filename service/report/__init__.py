"""A study as a document to be shown: title block, machine, answers, chosen curves, inputs, versions."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from sprag.service.formats import REPORT_FORMATS, ReportFormat

if TYPE_CHECKING:
    from sprag.service.reading.reader import Choice
    from sprag.service.report.content import Report
    from sprag.service.report.document import TitleBlock
    from sprag.service.storage.store import Store
    from sprag.service.views.study_questions import ReportQuestion

__all__ = ["MEDIA_TYPES", "REPORT_FORMATS", "ReportFormat", "asked_report", "write_report"]

MEDIA_TYPES: Final[dict[ReportFormat, str]] = {"html": "text/html; charset=utf-8", "pdf": "application/pdf"}
#: Files that may be the logo in the folder of an office's templates, and their media types.
_LOGOS: Final = (("logo.svg", "image/svg+xml"), ("logo.png", "image/png"))


def asked_report(
    store: Store, study_id: str, choice: Choice, question: ReportQuestion, office: str
) -> tuple[Report, TitleBlock]:
    """The report that is asked for, with its title block in the language of the task; raises what `report_of` does."""
    from sprag.service.report.content import report_of
    from sprag.service.report.document import TitleBlock, today
    from sprag.service.views.curves import completed_query

    curves = question.x, question.y, question.by, question.at, question.of
    query = completed_query(store.studies.study(study_id), *curves) if any(curves) else None
    date = today() if question.date is None else question.date
    block = TitleBlock(office, question.project, question.author, question.number, date)
    return report_of(store, study_id, choice, query, question.point, saved=not question.y), block


def write_report(report: Report, block: TitleBlock, folder: str, form: ReportFormat) -> bytes:
    """The document; ``folder`` has the templates and the logo of an office, "" where it has none of its own."""
    from sprag.service.report.document import document_of

    document, place = document_of(report, block), Path(folder) if folder else None
    logo = None if place is None else next(((kind, (place / name).read_bytes()) for name, kind in _LOGOS
                                            if (place / name).is_file()), None)  # fmt: skip
    # Only the libraries of the requested format are loaded.
    if form == "html":
        from sprag.service.report.html import html_report as writer
    else:
        from sprag.service.report.pdf import pdf_report as writer
    return writer(document, place, logo)
