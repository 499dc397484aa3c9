"""The two pages of every kind of study: never more, in words of people, with numbers that can be typed back."""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any, Final

import pytest

from sprag_study.sentences import Amount, Sentence
from sprag_study.service import languages
from sprag_study.service.reading.numbers import in_language
from sprag_study.service.reading.reader import Choice
from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.reading.wording import unit_text
from sprag_study.service.report import Office, write_report
from sprag_study.service.report.blocks import said
from sprag_study.service.report.document import made_document, report_of, sections_of
from sprag_study.service.views.library import Library
from sprag_study.service.views.study_questions import ReportQuestion
from sprag_study.worker import models
from tests.service import refined_study
from tests.service.calibrating import calibration
from tests.service.http.web.test_accessibility import preset
from tests.service.report.test_report import pages
from tests.service.searching import search

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.report.content import Report
    from tests.service.conftest import Service

#: Kinds of studies that choose their own cases are run by formulas; all others are presets with made-up rows.
CHOOSING: Final = ("search", "calibration", "refined")
#: What makes documents differ: one axis and several, drawn drives, several motions; machines of a linkage, of several
#: parts, of a cam, and steps of an operation.
PRESETS: Final = (
    "one_pendulum", "two_pendulums", "tolerances", "two_motions", "six_bar_press", "four_cylinder_engine",
    "cam_machine", "question_operation",
)  # fmt: skip
KINDS: Final = (*CHOOSING, *PRESETS)
#: One that chooses its cases, one grid of a drive and one of a machine.
IN_ENGLISH: Final = ("search", "two_pendulums", "question_operation")
#: What stands in specs and in faults, and in no document.
CODES: Final = re.compile(r"[a-z]+_[a-z]|\b[a-z]+\.[0-9]|[a-z]\.[a-z]{3}|(?<![A-Za-zµ·])/[a-z]{3}")


def finished(service: Service, kind: str) -> str:
    """A finished study of that kind."""
    if kind == "search":
        return search(service)
    if kind == "calibration":
        return calibration(service)
    study_id = service.submit(refined_study.SPEC if kind == "refined" else {**preset(kind), "drives": 8}
                              if kind == "tolerances" else preset(kind))  # fmt: skip
    if kind == "refined":
        refined_study.fill(service, study_id)
    else:
        service.fill(study_id)
    return study_id


def amounts(part: Any) -> Iterator[Amount]:
    """Every amount in a part of a document."""
    if isinstance(part, Amount):
        yield part
    elif isinstance(part, Sentence):
        for own in part.parts.values():
            yield from amounts(own)
    elif isinstance(part, tuple):
        for own in part:
            yield from amounts(own)
    elif is_dataclass(part):
        for field in fields(part):
            yield from amounts(getattr(part, field.name))


def texts(part: Any) -> Iterator[str]:
    """Every text in a part of a document."""
    if isinstance(part, str):
        yield part
    elif isinstance(part, tuple):
        for own in part:
            yield from texts(own)
    elif is_dataclass(part):
        for field in fields(part):
            if field.name not in ("svg", "kind", "look"):
                yield from texts(getattr(part, field.name))


def can_be_typed_back(report: Report) -> int:
    """How many numbers the document prints; each is read back to its value within its digits."""
    read, count = report.reading, 0
    for one in amounts(tuple(sections_of(report))):
        if one.value is None:
            continue
        text, unit = str(said((one,), read)[0]), unit_text(read.unit(one.unit))
        typed = f"{text} {unit}" if one.bare and unit else text
        value = parse_quantity(in_language(typed), one.unit) if unit else _plain(typed)
        assert value == pytest.approx(one.value, rel=0.6 * 10.0 ** (1 - one.digits)), typed
        count += 1
    for number in report.headline.numbers:
        if isinstance(number.value, float) and not number.above:
            typed, unit = number.number(read), number.unit_text(read)
            value = parse_quantity(in_language(f"{typed} {unit}"), number.unit) if unit else _plain(typed)
            assert value == pytest.approx(number.value, rel=0.6 * 10.0 ** (1 - number.digits)), typed
            count += 1
    return count


def _plain(text: str) -> float:
    """A number without a unit, read as one of a quantity."""
    return parse_quantity(in_language(f"{text} m"), "m")


@pytest.mark.parametrize("kind", KINDS)
def test_a_report_has_two_pages_in_words_of_people_with_numbers_that_are_read_back(service: Service, kind: str) -> None:
    """In Ukrainian, whose texts are the longer ones; of a few kinds in English as well."""
    study_id = finished(service, kind)
    study = service.store.studies.study(study_id)
    names = {*study.base, *study.axis_paths, *(info.name for info in models.study_results(study))}
    everything = ReportQuestion(text=["A remark."], appendix=["all"])
    for code in ("en", "uk") if kind in IN_ENGLISH else ("uk",):
        with languages.language(code):
            library, choice = Library(service.store), Choice("workshop")
            report = report_of(library, study_id, choice)
            assert can_be_typed_back(report) > 5
            document = made_document(report)
            assert pages(write_report(document, Office(), "pdf")) == 2
            written = made_document(report_of(library, study_id, choice, everything)) if code == "uk" else document
        for text in texts(written.sections):
            assert not CODES.search(text.replace(study_id, "")), text
            assert not {name for name in names if "." in name and name in text}, text
