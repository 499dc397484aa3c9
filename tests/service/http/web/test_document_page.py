"""The page of a report: an address that holds what it says, progress while it is made, and what is refused."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

import pytest

from sprag_study.service.http.web import document
from sprag_study.service.report import Office

if TYPE_CHECKING:
    from tests.service.conftest import Service


@pytest.fixture
def address(service: Service) -> str:
    """The report of a finished study."""
    study_id = service.submit()
    service.fill(study_id)
    return f"/studies/{study_id}/document"


def test_the_address_has_what_is_written_and_no_empty_fields(service: Service, address: str) -> None:
    sent = {"customer": "Acme", "quote": "", "date": Office().today(), "text": ["", "Below.", ""], "point": ""}
    answer = service.http.get(address, params={**sent, "appendix": "inputs"}, follow_redirects=False)
    assert answer.status_code == 303
    kept = parse_qs(urlsplit(answer.headers["location"]).query, keep_blank_values=True)
    assert kept == {"customer": ["Acme"], "text": ["", "Below."], "appendix": ["inputs"]}
    page = service.http.get(answer.headers["location"]).text
    assert 'value="Acme"' in page
    assert re.findall(r"<textarea[^>]*>([^<]*)</textarea>", page) == ["", "Below.", ""]
    assert '<input type="checkbox" name="appendix" value="inputs" checked>' in page
    dated = service.http.get(address, params={"date": ""}, follow_redirects=False)
    assert dated.status_code == 200  # an empty date means none
    assert re.search(r'name="date"[^>]* value=""', dated.text)


def test_a_report_that_takes_long_is_announced_first(
    service: Service, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = "The report is being made"
    assert told not in service.http.get(address).text
    monkeypatch.setattr(document, "_SOON", 0.0)
    page = service.http.get(address).text
    assert page.index(told) < page.index('<article class="sheet"')
    assert page.rstrip().endswith("</html>")


def test_what_is_refused_is_said_and_the_document_stays(service: Service, address: str) -> None:
    answer = service.http.get(address, params={"point": "much", "customer": "Acme", "text": "Beside the drawing."})
    assert answer.status_code == 422
    assert 'role="alert"' in answer.text
    assert re.search(r'name="point"[^>]* value="much"', answer.text)
    assert "shaft.load" not in answer.text
    assert 'value="Acme"' in answer.text
    assert "Beside the drawing.</textarea>" in answer.text
    assert service.http.get(address, params={"appendix": "everything"}).status_code == 422


def test_a_report_is_saved_with_its_study(service: Service, address: str) -> None:
    page = service.http.get(f"{address}?customer=Acme&number=R-12").text
    fields = dict(re.findall(r'<input (?:type="hidden" )?name="(page|study|query|name)" value="([^"]*)"', page))
    assert (fields["page"], fields["name"]) == ("document", "R-12")
    answer = service.http.post(
        "/views", data={name: value.replace("&amp;", "&") for name, value in fields.items()}, follow_redirects=False
    )
    assert answer.status_code == 303
    saved = service.http.get(answer.headers["location"]).text
    assert 'value="Acme"' in saved
    assert ">R-12</a>" in service.http.get(address).text


def test_examples_in_fields_are_in_the_language_of_each_reader(service: Service, address: str) -> None:
    for code, example in (("en", "0.3 N·m"), ("uk", "0,3 Н·м"), ("en", "0.3 N·m")):
        page = service.http.get(address, headers={"Accept-Language": code}).text
        assert re.search(r'name="point"[^>]* placeholder="([^"]*)"', page)[1].replace("*", "·") == example  # type: ignore[index]
