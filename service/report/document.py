"""A study as a document: its title block, two sheets, and the appendix that was asked for."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from typing import TYPE_CHECKING, Final

from sprag_study.service.faults import choice_of, refused
from sprag_study.service.languages import _, pgettext
from sprag_study.service.reading.limits import characters
from sprag_study.service.report.blocks import Block, Document, Section, Text, said
from sprag_study.service.report.chapters import appendix, chapters_of, further_figures
from sprag_study.service.report.content import AS_TYPED, Report
from sprag_study.service.report.office import Office
from sprag_study.service.report.sheets import sheets
from sprag_study.service.views.study_questions import CHAPTERS, ReportQuestion

if TYPE_CHECKING:
    from collections.abc import Iterator
    from datetime import datetime

    from sprag_study.service.reading.reader import Choice
    from sprag_study.service.views.library import Library

#: Most characters of a text of the author.
LONGEST_TEXT: Final = 2_000
#: No office: a document without a name, a logo and templates of its own, in UTC.
NOBODY: Final = Office()


def report_of(
    library: Library,
    study_id: str,
    choice: Choice = AS_TYPED,
    question: ReportQuestion | None = None,
    office: Office = NOBODY,
) -> Report:
    """What a document shows of a stored study, by default of the question with no settings.

    Raises StudyNotFoundError, SelectionError for curves, points, chapters and units that the study does not have, and
    DatabaseError where its rows are not those that were stored.
    """
    asked = ReportQuestion() if question is None else question
    for text in asked.text or ():
        if len(text) > LONGEST_TEXT:
            raise refused("text", "too-long", "is too long", allowed=characters(0, LONGEST_TEXT))
    for name in asked.appendix or ():
        choice_of("appendix", name, ("all", *CHAPTERS))
    return Report(library, study_id, choice, asked, office)


def document_of(
    library: Library,
    study_id: str,
    choice: Choice = AS_TYPED,
    question: ReportQuestion | None = None,
    office: Office = NOBODY,
) -> Document:
    """The document of a stored study; raises as `report_of` does."""
    return made_document(report_of(library, study_id, choice, question, office))


def made_document(report: Report, *, edited: bool = False) -> Document:
    """The document of what is known of a study; one that is ``edited`` has a place for each text of the author."""
    ended = report.office.moment(_computed(report))
    kept = (said(_without(section, edited=edited), report.reading) for section in sections_of(report))
    return Document(
        report.title,
        tuple(title_block(report.question, report.office)),
        tuple(section for section in kept if section.blocks),
        _(
            "computed by Sprag {version}, {time}",
            version=version("sprag-study"),
            time=ended,
        ),
    )


def sections_of(report: Report) -> Iterator[Section]:
    """The sections of a document with sentences and amounts, which `said` prints."""
    yield from sheets(report)
    further = further_figures(report)
    if further is not None:
        yield further
    yield from appendix(report)


def _computed(report: Report) -> datetime:
    """When the last of its rows came, as far as it is known."""
    record = report.record
    return record.finished_at or record.started_at or record.created_at


def title_block(question: ReportQuestion, office: Office) -> Iterator[tuple[str, str]]:
    """What the title block says, in its order; what is not given is left blank, to be written by hand."""
    if office.name:
        yield _("Office"), office.name
    if question.project:
        yield _("Project"), question.project
    yield _("Customer"), question.customer
    yield _("Quote"), question.quote
    yield pgettext("of a document", "Number"), question.number
    yield _("Author"), question.author
    yield _("Date"), office.today() if question.date is None else question.date
    yield _("Revision"), question.revision


def _without(section: Section, *, edited: bool) -> Section:
    """The section without texts of the author that are empty, unless they can be written."""

    def wanted(block: Block) -> bool:
        return edited or not (isinstance(block, Text) and block.look == "own" and not block.text)

    return Section(section.title, tuple(filter(wanted, section.blocks)), section.sheet)


@dataclass(frozen=True, slots=True)
class Shown:
    """A document, and the chapters that it can have with their titles."""

    document: Document
    chapters: dict[str, str]


def shown_document(library: Library, study_id: str, choice: Choice, question: ReportQuestion, office: Office) -> Shown:
    """The document of a stored study with a place for each text of its author; raises as `document_of` does."""
    report = report_of(library, study_id, choice, question, office)
    return Shown(made_document(report, edited=True), chapters_of(report))
