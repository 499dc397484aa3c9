"""The document of a study with what its page asks beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sprag_study.service.report.chapters import chapters_of
from sprag_study.service.report.document import made_document, report_of

if TYPE_CHECKING:
    from sprag_study.service.reading.reader import Choice
    from sprag_study.service.report.blocks import Document
    from sprag_study.service.report.office import Office
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.study_questions import ReportQuestion


@dataclass(frozen=True, slots=True)
class Shown:
    """A document, and the chapters that it can have with their titles."""

    document: Document
    chapters: dict[str, str]


def shown_document(library: Library, study_id: str, choice: Choice, question: ReportQuestion, office: Office) -> Shown:
    """The document of a stored study with a place for each text of its author; raises as `document_of` does."""
    report = report_of(library, study_id, choice, question)
    return Shown(made_document(report, office, edited=True), chapters_of(report))
