"""A study as a printable document: its inputs, its endings, the ranges of all results, and their curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from sprag.service.formats import REPORT_FORMATS, ReportFormat

if TYPE_CHECKING:
    from sprag.service.results.report.content import Report

__all__ = ["MEDIA_TYPES", "REPORT_FORMATS", "ReportFormat", "write_report"]

MEDIA_TYPES: Final[dict[ReportFormat, str]] = {"html": "text/html; charset=utf-8", "pdf": "application/pdf"}


def write_report(report: Report, form: ReportFormat) -> bytes:
    """The document. Only the libraries of the requested format are loaded."""
    writer: Callable[[Report], bytes]
    if form == "html":
        from sprag.service.results.report.html import html_report as writer
    else:
        from sprag.service.results.report.pdf import pdf_report as writer
    return writer(report)
