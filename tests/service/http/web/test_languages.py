"""The language of pages: chosen by the reader, otherwise what the browser accepts; the API is English."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from tests.service.conftest import Service

UKRAINIAN = {"Accept-Language": "uk-UA,uk;q=0.9,en;q=0.8"}


def language_of(page: str) -> str:
    return page.partition('<html lang="')[2].partition('"')[0]


@pytest.mark.parametrize(
    ("accepted", "expected"),
    [
        ("", "en"),
        ("uk", "uk"),
        ("uk-UA,uk;q=0.9,en;q=0.8", "uk"),
        ("de,en;q=0.5,uk;q=0.4", "en"),
        ("de", "en"),
        (";;=", "en"),
    ],
)
def test_a_page_is_in_the_language_that_is_accepted(service: Service, accepted: str, expected: str) -> None:
    answer = service.http.get("/me", headers={"Accept-Language": accepted})
    assert language_of(answer.text) == expected
    assert {"Accept-Language", "Cookie"} <= {name.strip() for name in answer.headers["vary"].split(",")}


def test_the_choice_is_kept_and_leads_back(service: Service) -> None:
    page = service.http.get("/me/workers?language=en", headers=UKRAINIAN).text
    assert language_of(page) == "en"
    assert 'name="back" value="/me/workers"' in page
    assert '<button class="plain" name="language" value="uk" lang="uk">Українська</button>' in page
    answer = service.http.post("/me", data={"language": "uk", "back": "/me/workers"}, follow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (303, "/me/workers")
    chosen = service.http.get("/me/workers", headers={"Accept-Language": "en"})
    assert language_of(chosen.text) == "uk"
    assert ">Дослідження</a>" in chosen.text
    assert 'value="en" lang="en">English</button>' in chosen.text
    refused = service.http.post("/me", data={"language": "tlh"})
    assert (refused.status_code, refused.json()["errors"][0]["allowed"]) == (422, "en, uk")
    assert "set-cookie" not in refused.headers
    outside = service.http.post("/me", data={"language": "en", "back": "//evil.example"}, follow_redirects=False)
    assert outside.headers["location"] == "/"


def test_errors_are_pages_in_the_language_too(service: Service) -> None:
    for address in ("/nowhere", "/studies/st_1", "/curves?units=furlong"):
        answer = service.http.get(address, headers={**UKRAINIAN, "Accept": "text/html"})
        assert answer.status_code in (404, 422)
        assert language_of(answer.text) == "uk"
        if address == "/studies/st_1":
            assert '<p class="lead">Немає дослідження &#39;st_1&#39;.</p>' in answer.text


def test_programs_read_english(service: Service, spec: dict[str, Any]) -> None:
    study = service.submit(spec)
    service.fill(study)
    for address in (f"/api/v1/studies/{study}", "/api/v1/models", f"/api/v1/studies/{study}/curves", "/openapi.json"):
        english, other = (service.http.get(address, headers=headers) for headers in ({}, UKRAINIAN))
        assert english.content == other.content
        assert english.headers.get("etag") == other.headers.get("etag")
