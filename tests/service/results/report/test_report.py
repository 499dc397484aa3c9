"""Reports: what they say is what the rows say."""

from __future__ import annotations

import re
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag.service.results.report.content import ranges, report_of
from sprag.service.results.report.pdf import pdf_report
from sprag.worker import models

if TYPE_CHECKING:
    from tests.service.conftest import Service

API = "/api/v1"


def pages(pdf: bytes) -> int:
    """Pages of a PDF that matplotlib wrote."""
    return len(re.findall(rb"/Type /Page\b(?!s)", pdf))


def texts(pdf: bytes) -> str:
    """What the streams of a PDF draw, unpacked."""
    found = re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, re.DOTALL)
    parts = []
    for stream in found:
        try:
            parts.append(zlib.decompress(stream).decode("latin-1"))
        except zlib.error:
            continue
    return "".join(parts)


def test_ranges_are_those_of_the_rows(service: Service) -> None:
    study_id = service.submit()
    rows = service.fill(study_id)
    infos = models.study_results(service.store.study(study_id))
    found = ranges(infos, service.store.iter_rows(study_id, block=2))
    for index, row in enumerate(found):
        column = rows.values[:, index]
        assert row.known == int(np.isfinite(column).sum())
        assert (row.least, row.largest) == (np.nanmin(column), np.nanmax(column))
        assert (row.least_case, row.largest_case) == (np.nanargmin(column), np.nanargmax(column))
        assert row.mean == pytest.approx(np.nanmean(column), rel=1e-12)


def test_the_page_holds_everything_and_needs_nothing_else(service: Service, spec: dict[str, Any]) -> None:
    spec["name"] = "<script>alert(1)</script>"
    study_id = service.submit(spec)
    service.fill(study_id)
    response = service.http.get(f"{API}/studies/{study_id}/report")
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    assert "default-src 'none'" in response.headers["content-security-policy"]
    page = response.text
    assert "<script" not in page
    assert "&lt;script&gt;" in page
    assert re.findall(r'(?:src|href)="(?!data:)', page) == []
    for wanted in (study_id, "shaft.load", "excitation.frequency", "pendulums.0.mass", "chatter", "60 periods"):
        assert wanted in page
    largest = report_of(service.store, study_id).ranges[0].largest
    assert f"{largest:.6g}" in page


def test_the_document_has_a_page_for_each_picture(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    response = service.http.get(f"{API}/studies/{study_id}/report?format=pdf")
    assert response.headers["content-type"] == "application/pdf"
    report = report_of(service.store, study_id)
    assert len(report.pictures) > 5
    assert pages(response.content) >= len(report.pictures) + 1
    assert pdf_report(report) == response.content  # nothing in it but the study


def test_every_machine_result_is_in_one_picture_at_most_and_checks_in_none(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    report = report_of(service.store, study_id)
    drawn = [info for curves in report.pictures for info in curves.selection.results]
    assert len(set(drawn)) == len(drawn)
    assert {info.kind for info in drawn} == {"real"}
    assert not [info.name for info in drawn if info.name.startswith(("balance.", "run."))]
    assert {"shaft.speed.mean", "torque.max", "efficiency"} <= {info.name for info in drawn}
    for curves in report.pictures:
        assert len({info.unit for info in curves.selection.results}) == 1


def test_a_study_of_one_case_has_a_report_without_curves(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = []
    study_id = service.submit(spec)
    service.fill(study_id)
    assert "Nothing varies" in service.http.get(f"{API}/studies/{study_id}/report").text
    pdf = service.http.get(f"{API}/studies/{study_id}/report?format=pdf").content
    assert pages(pdf) in (1, 2)
    assert texts(pdf)


def test_there_is_no_report_of_another_kind(service: Service) -> None:
    study_id = service.submit()
    refused = service.http.get(f"{API}/studies/{study_id}/report?format=docx")
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["allowed"] == "html, pdf"
