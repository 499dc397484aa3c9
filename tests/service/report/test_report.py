"""Reports: what they say is what the rows say."""

from __future__ import annotations

import hashlib
import json
import re
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.service.faults import FaultError
from sprag_study.service.presets import preset_text
from sprag_study.service.reading.reader import Choice
from sprag_study.service.reading.wording import number
from sprag_study.service.report import Office, write_report
from sprag_study.service.report.blocks import Document, Image, Section, Table, Text
from sprag_study.service.report.content import AS_TYPED, Report, ranges
from sprag_study.service.report.document import document_of, report_of
from sprag_study.service.report.drawn import drawing_images, image
from sprag_study.service.report.pdf import pdf_report
from sprag_study.service.spec.document import load_spec
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.rows import digests
from sprag_study.service.storage.tables import results_table
from sprag_study.service.views.library import Library
from sprag_study.service.views.study_questions import ReportQuestion
from sprag_study.worker import models
from tests.faults import refused

if TYPE_CHECKING:
    from pathlib import Path

    from tests.service.conftest import Service

API = "/api/v1"


def pages(pdf: bytes) -> int:
    """Pages of a PDF."""
    (count,) = re.findall(rb"/Type/Pages/Count (\d+)", pdf)
    return int(count)


def chapter(service: Service, study_id: str, name: str, title: str, choice: Choice = AS_TYPED) -> Section:
    """A chapter of the appendix of a report."""
    document = document_of(Library(service.store), study_id, choice, ReportQuestion(appendix=[name]))
    (found,) = document.appendix
    assert found.title == title
    return found


def test_ranges_are_those_of_the_rows(service: Service) -> None:
    study_id = service.submit()
    rows = service.fill(study_id)
    infos = models.study_results(service.store.studies.study(study_id))
    found = ranges("vibration-drive", infos, service.store.rows.blocks(study_id, size=2))
    for index, row in enumerate(found):
        column = rows.values[:, index]
        assert row.known == int(np.isfinite(column).sum())
        assert (row.least, row.largest) == (np.nanmin(column), np.nanmax(column))
        assert (row.least_case, row.largest_case) == (np.nanargmin(column), np.nanargmax(column))
        assert row.mean == pytest.approx(np.nanmean(column), rel=1e-12)


def test_rows_of_any_number_are_those_that_were_stored(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    """A report has the ranges of all rows, also of a study whose answers look over the rows that they need only."""
    study_id = service.submit()
    service.fill(study_id)
    monkeypatch.setattr(digests, "LOOKED_OVER", 2)
    record = service.store.studies.get(study_id)
    table = results_table(record.model, record.variant)
    speed = sa.update(table).where(table.c.case_number == 1).values(shaft_speed_mean=1e9)
    with service.store.session.write() as connection:
        assert connection.execute(speed).rowcount == 1
    with refused(DatabaseError, "database-damaged"):
        report_of(Library(service.store), study_id)
    service.fill(study_id)
    assert report_of(Library(service.store), study_id).ranges[0].largest < 1e9


def test_the_page_holds_everything_and_needs_nothing_else(service: Service, spec: dict[str, Any]) -> None:
    spec["name"] = "<script>alert(1)</script>"
    study_id = service.submit(spec)
    service.fill(study_id)
    asked = {"appendix": "all", "customer": "<b>Acme</b>", "text": "<i>own</i>"}
    response = service.http.get(f"{API}/studies/{study_id}/report", params={**asked, "format": "html", "units": "si"})
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    assert "default-src 'none'" in response.headers["content-security-policy"]
    page = response.text
    assert "<script" not in page
    for escaped in ("&lt;script&gt;", "&lt;b&gt;Acme", "&lt;i&gt;own"):
        assert escaped in page
    assert re.findall(r'(?:src|href)="(?!data:)', page) == []
    for wanted in (study_id, "Load torque", "Excitation frequency", "Mass", "chatter", "60 periods"):
        assert wanted in page
    largest = report_of(Library(service.store), study_id).ranges[0].largest
    assert number(largest, 6) in page
    coded = service.http.get(f"{API}/studies/{study_id}/report", params={**asked, "format": "html", "names": "codes"})
    for wanted in ("shaft.load", "pendulums.0.mass", "run.duration"):
        assert wanted in coded.text
        assert wanted not in page


def test_the_document_is_tagged_and_the_same_for_the_same_study(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    address = f"{API}/studies/{study_id}/report?format=pdf"
    response = service.http.get(address)
    assert response.headers["content-type"] == "application/pdf"
    for wanted in (b"/StructTreeRoot", b"/Marked true", b"pdfuaid:part", b"/Lang"):
        assert wanted in response.content
    assert pages(response.content) == 2
    assert service.http.get(address).content == response.content
    assert 3 < pages(service.http.get(f"{address}&appendix=all").content) <= 12


def test_an_office_has_its_own_template_and_logo(service: Service, tmp_path: Path) -> None:
    study_id = service.submit()
    service.fill(study_id)
    document = document_of(Library(service.store), study_id, office=Office("Own office"))
    (tmp_path / "report.html").write_text("{{ document.particulars[0][1] }} {{ logo }}", encoding="utf-8")
    (tmp_path / "logo.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>', "utf-8")
    page = write_report(document, Office(folder=str(tmp_path)), "html").decode()
    assert page.startswith("Own office data:image/svg+xml;base64,")
    plain = write_report(document, Office(), "pdf")
    assert write_report(document, Office(folder=str(tmp_path)), "pdf") != plain  # with the logo
    (tmp_path / "report.typ").write_text('#set document(title: "x")\n= Own', encoding="utf-8")
    assert pages(write_report(document, Office(folder=str(tmp_path)), "pdf")) == 1
    (tmp_path / "report.typ").write_text("#no-such-function()", encoding="utf-8")
    with pytest.raises(FaultError, match="no-such-function"):
        write_report(document, Office(folder=str(tmp_path)), "pdf")


@pytest.mark.parametrize("title", ["Привод 7", "冷 😀", "a\x00b", "\ud800", '#x *y* $a$ "q"'])
def test_any_name_can_be_typeset(title: str) -> None:
    document = Document(title, (("Project", title),), (Section("A", (Text(title), Table(("", ""), ((title, "1"),)))),))
    made = pdf_report(document, None, None)
    assert b"/StructTreeRoot" in made
    assert (b"pdfuaid:part" in made) == (title not in ("冷 😀",))


def test_title_block_curves_and_units_are_those_of_the_address(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    at = "excitation.frequency=16 Hz"
    given = {"format": "html", "y": "torque.mean", "units": "torque=N*mm", "x": "shaft.load", "at": at}
    block = {"project": "Feeder 7", "customer": "Acme", "quote": "118", "author": "A. Designer", "number": "R-12",
             "date": "2026-11-23", "revision": "B"}  # fmt: skip
    page = service.http.get(f"{API}/studies/{study_id}/report", params=given | block).text
    assert "Mean clutch torque against load torque" in page
    assert "N·mm" in page[page.index("Load torque") :]
    shown = page[page.index('class="title-block"') : page.index("</dl>")]
    for name, text in block.items():
        assert f"<dt>{name.capitalize()}</dt><dd>{text}</dd>" in shown
    assert "Office" not in shown
    assert "<dt>Sheet</dt><dd>1 of 2</dd>" in shown
    for wrong in ({"y": "torque.men"}, {"appendix": "everything"}, {"text": "x" * 2001}):
        refused = service.http.get(f"{API}/studies/{study_id}/report", params=wrong)
        assert refused.status_code == 422
        assert refused.json()["errors"][0]["parameter"] in wrong


def test_the_working_point_and_the_curve_of_the_address_are_those_of_the_report(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    address = f"{API}/studies/{study_id}/report?format=html"
    usual = service.http.get(address).text
    assert "0.25 N·m" not in usual.partition("</dl>")[2].partition("<section>")[0]
    asked = {"x": "shaft.load", "by": "excitation.frequency", "point": "0.25 N*m", "curve": "16 Hz"}
    page = service.http.get(address, params=asked).text
    assert "0.25 N·m" in page
    assert "Excitation frequency = 16 Hz" in page
    refused = service.http.get(address, params={"point": "much"})
    assert (refused.status_code, refused.json()["errors"][0]["parameter"]) == (422, "point")


def test_versions_and_the_hash_of_the_spec_are_told(service: Service) -> None:
    study_id = service.submit()
    (facts,) = chapter(service, study_id, "versions", "Study and versions").blocks
    assert isinstance(facts, Table)
    told = dict(facts.rows)
    spec = service.get(f"/studies/{study_id}")["spec"]
    canonical = json.dumps(spec, sort_keys=True, separators=(",", ":"))
    assert told["SHA-256 of the spec"] == hashlib.sha256(canonical.encode()).hexdigest()
    assert told["version of Sprag"] == version("sprag-study")


def test_the_machine_with_its_values_and_its_clutch_are_drawn(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    report = report_of(Library(service.store), study_id)
    assert report.clutch is not None
    (line,) = report.clutch.panels[0].lines
    law = [report.study.base[f"clutch.coefficients.{power}"] for power in range(4)]
    by_hand = sum(c * line.x**power for power, c in enumerate(law))
    np.testing.assert_allclose(line.y, by_hand, rtol=1e-12)
    (drawing,) = drawing_images(report)
    assert b"var(" not in drawing.svg
    arm = report.reading.quantity(report.study.base["pendulums.0.arm"], "m")
    assert arm in drawing.svg.decode()


def test_a_caption_says_what_is_held_once(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    report = report_of(Library(service.store), study_id)
    assert report.clutch is not None
    figure = replace(report.clutch, held=("Load = 2 N·m",))
    assert image(report, figure, "Speed").caption == "Speed. Load = 2 N·m"
    assert image(report, figure, "Speed; Load = 2 N·m").caption == "Speed; Load = 2 N·m"


def test_doubtful_cases_are_in_no_range(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    study_id = service.submit()
    rows = service.fill(study_id)
    infos = models.study_results(service.store.studies.study(study_id))
    blocks = list(service.store.rows.blocks(study_id, size=rows.values.shape[0]))
    marked = [replace(block, flags=["unsettled,jumped", *block.flags[1:]]) for block in blocks]
    every, sound = (ranges("vibration-drive", infos, own) for own in (blocks, marked))
    assert [row.known - kept.known for row, kept in zip(every, sound, strict=True)] == [
        int(np.isfinite(rows.values[0, infos.index(row.info)])) for row in every
    ]
    failed = [replace(block, endings=["unstable_motion", *block.endings[1:]]) for block in blocks]
    assert ranges("vibration-drive", infos, failed) == sound
    assert report_of(Library(service.store), study_id).left_out == 0
    monkeypatch.setattr(Report, "left_out", 2)
    section = chapter(service, study_id, "ranges", "Ranges of the results")
    assert [block.text for block in section.blocks if isinstance(block, Text)] == [
        "2 unsettled cases are left out: their results do not show settled motion."
    ]


def test_an_answer_that_is_a_main_result_too_stands_once(service: Service) -> None:
    study_id = service.submit(load_spec(preset_text("press")[1], "toml"))
    service.fill(study_id)
    (table,) = chapter(service, study_id, "answers", "Answers").blocks
    assert isinstance(table, Table)
    answers = table.rows
    starts = [place for place, row in enumerate(answers) if str(row[0]).startswith("Curve ")]
    assert len(starts) == 4
    for start, end in zip(starts, [*starts[1:], len(answers)], strict=True):
        titles = [row[0] for row in answers[start:end]]
        assert "Irregularity" in titles
        assert len(set(titles)) == len(titles)


def test_a_report_is_of_today_unless_it_has_another_date_or_none(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit({**spec, "axes": []})
    service.fill(study_id)
    address = f"{API}/studies/{study_id}/report?format=html"
    for query, today in (("", "%Y-%m-%d"), ("&language=uk", "%d.%m.%Y")):
        assert datetime.now(UTC).strftime(f"<dd>{today}</dd>") in service.http.get(address + query).text
    assert "<dt>Date</dt><dd></dd>" in service.http.get(f"{address}&date=").text


def test_every_machine_result_is_in_one_picture_at_most_and_checks_in_none(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    report = report_of(Library(service.store), study_id)
    pictures, note = report.further
    assert note == ""
    drawn = [info for curves in pictures for info in curves.selection.results]
    assert len(set(drawn)) == len(drawn)
    assert {info.kind for info in drawn} == {"real"}
    assert not [info.name for info in drawn if info.name.startswith(("balance.", "run."))]
    assert report.answers is not None
    assert report.answers.drawn is not None
    main = {info.name for info in report.answers.drawn.selection.results}
    assert {"shaft.speed.mean", "torque.mean", "efficiency"} <= main
    assert "torque.max" in {info.name for info in drawn}
    assert main.isdisjoint(info.name for info in drawn)
    sizes = [len(curves.selection.results) for curves in pictures]
    assert set(sizes[:-1]) <= {12}  # each fills a page
    for info in drawn:
        assert np.ptp([y for curve in pictures[0].curves for y in curve.y[info.name] if np.isfinite(y)]) > 0.0


def test_a_study_of_one_case_has_a_report_without_curves(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = []
    study_id = service.submit(spec)
    service.fill(study_id)
    document = document_of(Library(service.store), study_id)
    (results,) = [section for section in document.sections if section.title == "Results"]
    assert isinstance(results.blocks[0], Table)
    pdf = service.http.get(f"{API}/studies/{study_id}/report?format=pdf").content
    assert pages(pdf) == 2


def test_there_is_no_report_of_another_kind(service: Service) -> None:
    study_id = service.submit()
    refused = service.http.get(f"{API}/studies/{study_id}/report?format=docx")
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["allowed"] == "html, pdf"


def test_the_report_shows_what_results_depend_on_where_two_axes_vary(service: Service, spec: dict[str, Any]) -> None:
    axes = [{"path": "shaft.load", "linspace": [0, 1, 3]}, {"path": "shaft.inertia", "linspace": [0.1, 0.2, 3]}]
    study_id = service.submit({**spec, "axes": axes})
    service.fill(study_id)
    section = chapter(service, study_id, "sensitivity", "Sensitivity", Choice("rpm"))
    captions = [block.caption for block in section.blocks if isinstance(block, Image)]
    assert captions[0].startswith("What mean shaft speed depends on. 1 case without this result is left out")
    pictures = [block.svg.decode() for block in section.blocks if isinstance(block, Image)]
    assert any(">mean of mean shaft speed (rpm)</text>" in svg for svg in pictures)
    single = service.submit({**spec, "name": "One axis", "axes": axes[:1]})
    service.fill(single)
    asked = ReportQuestion(appendix=["all"])
    titles = [section.title for section in document_of(Library(service.store), single, question=asked).sections]
    assert "Sensitivity" not in titles
