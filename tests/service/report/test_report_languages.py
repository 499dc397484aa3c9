"""Reports in the language that is asked for; files and answers for programs are the same in every language."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service import languages
from sprag_study.service.reading.reader import Choice, reading_for
from sprag_study.service.results.shown_inputs import run_settings
from sprag_study.service.spec.document import load_spec, parse_spec
from tests.service.conftest import API

if TYPE_CHECKING:
    from tests.service.conftest import Service


def test_a_report_is_in_the_language_of_its_address(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    address = f"{API}/studies/{study_id}/report"
    asked = {"format": "html", "project": "Живильник 7", "number": "Р-12", "language": "uk", "appendix": "all"}
    page = service.http.get(address, params=asked).text
    assert '<html lang="uk">' in page
    for text in (
        "<dt>Проєкт</dt><dd>Живильник 7</dd>", "<dt>Номер</dt><dd>Р-12</dd>", "<h2>Наскільки цьому довіряти</h2>",
        "<h2>Діапазони результатів</h2>", "Найбільша корисна потужність", "Н·м", "Запуск дійшов до кінця.",
        "<span>2 з 2</span>",
    ):  # fmt: skip
        assert text in page, text
    for english in ("<h2>Machine</h2>", "Largest useful power", "N·m", "rad/s"):
        assert english not in page, english
    refused = service.http.get(address, params={"language": "tlh"})
    assert refused.status_code == 422
    (item,) = refused.json()["errors"]
    assert (item["parameter"], item["code"], item["value"], item["allowed"]) == (
        "language", "invalid-choice", "tlh", "en, uk"
    )  # fmt: skip


def test_each_language_is_a_document_of_its_own(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit({**spec, "axes": []})  # without figures, which take most of the time of a report
    service.fill(study_id)
    address, asked = f"{API}/studies/{study_id}/report", {"format": "html", "language": "uk"}
    known = {"If-None-Match": service.http.get(address, params=asked).headers["etag"]}
    assert service.http.get(address, params=asked, headers=known).status_code == 304
    other = service.http.get(address, params=asked | {"language": "en"}, headers=known)
    assert other.status_code == 200
    assert '<html lang="en">' in other.text
    assert "<h2>How far to trust this</h2>" in other.text
    pdf = service.http.get(address, params=asked | {"format": "pdf"}).content
    assert b"/Lang(uk)" in pdf
    assert b"pdfuaid:part" in pdf
    plain, accepting = (
        service.http.get(address, params={"format": "html"}, headers={"Accept-Language": language}).content
        for language in ("en", "uk")
    )
    assert plain == accepting


def test_a_picture_is_in_the_language_of_its_address_and_data_are_not(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    address = f"{API}/studies/{study_id}/curves"
    english, ukrainian = (
        service.http.get(address, params={"format": "svg", **asked}).text for asked in ({}, {"language": "uk"})
    )
    for text, other in (("Load torque", "Момент навантаження"), ("N·m", "Н·м"), (">0.1", ">0,1")):
        assert (text in english, other in english) == (True, False), text
        assert (text in ukrainian, other in ukrainian) == (False, True), other
    for form in ("json", "csv"):
        plain, asked = (
            service.http.get(address, params={"format": form, **more}).content for more in ({}, {"language": "uk"})
        )
        assert plain == asked
    refused = service.http.get(address, params={"format": "csv", "language": "tlh"})
    assert (refused.status_code, refused.json()["errors"][0]["allowed"]) == (422, "en, uk")


@pytest.mark.parametrize("part", ["", "/results?format=csv", "/results?format=json", "/curves?format=svg", "/curves"])
def test_programs_read_the_same_bytes_whatever_language_is_accepted(service: Service, part: str) -> None:
    study_id = service.submit()
    service.fill(study_id)
    plain, accepting = (
        service.http.get(f"{API}/studies/{study_id}{part}", headers={"Accept-Language": language}).content
        for language in ("en", "uk")
    )
    assert plain == accepting


def test_settings_of_the_run_are_told_in_the_language_and_units(spec: dict[str, Any]) -> None:
    run = {"duration": "60 periods", "window": ["40 periods", "60 periods"]}
    given = {**spec, "run": run}
    study = parse_spec(given).study
    starting = load_spec(Path("examples/coexisting_motions.json").read_text("utf-8"), "json")
    many = parse_spec(starting).study

    def told(language: str) -> dict[str, str]:
        with languages.language(language):
            found = run_settings(study, given, reading_for(study, given, Choice()))
            found += run_settings(many, starting, reading_for(many, starting, Choice("rpm")))
            return {item.path: value for _label, value, item in found}

    english, ukrainian = told("en"), told("uk")
    assert english["window"] == "40 to 60 periods"
    assert ukrainian["window"] == "від 40 до 60 періодів"
    assert english["starts"].startswith("32, seed 1: Initial shaft speed 0 to")
    assert "0 to 286.48 rpm" in english["starts"]
    assert "від 0 до 286,48 об/хв" in ukrainian["starts"]
    assert "від -0,3 до 0,3 рад" in ukrainian["starts"].replace("−", "-")
