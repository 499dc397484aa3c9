"""How somebody reads: units and time zone, chosen once; old addresses; schedules in words."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from html import unescape
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect

from sprag_study.service.http.web.moved import MOVED, OF_CASE, OF_STUDY
from sprag_study.service.languages import language
from sprag_study.service.reading.times import in_full, when
from sprag_study.service.schedules.plain import cron_of, days_of, deadline_said, said

if TYPE_CHECKING:
    from playwright.sync_api import Browser

    from tests.service.conftest import Service
    from tests.service.http.web.conftest import Office, Visitor

NOW = datetime(2026, 11, 27, 21, 30, tzinfo=UTC)  # a Friday; in Kyiv 23:30


@pytest.mark.parametrize(
    ("moment", "english", "ukrainian"),
    [
        ("2026-11-27T09:14", "today 11:14", "сьогодні 11:14"),
        ("2026-11-27T22:15", "tomorrow 00:15", "завтра 00:15"),
        ("2026-11-26T15:02", "yesterday 17:02", "учора 17:02"),
        ("2026-11-23T07:26", "Mon 09:26", "пн 09:26"),
        ("2026-07-01T20:00", "2026-07-01 23:00", "01.07.2026 23:00"),
    ],
)
def test_times_are_those_of_the_clock_on_the_wall(moment: str, english: str, ukrainian: str) -> None:
    own = datetime.fromisoformat(moment).replace(tzinfo=UTC)
    assert when(own, NOW, "Europe/Kyiv") == english
    with language("uk"):
        assert when(own, NOW, "Europe/Kyiv") == ukrainian
    assert when(own, NOW, "Europe/Kyiv", seconds=True) == f"{english}:00"
    assert in_full(own, "Europe/Kyiv").endswith(", Europe/Kyiv")


@pytest.mark.parametrize(
    ("cron", "words"),
    [
        ("0 22 * * 1-5", "on working days at 22:00"), ("30 6 * * *", "every day at 06:30"),
        ("5 0 * * 0", "on Sundays at 00:05"), ("0 22 1 * *", ""), ("@daily", ""), ("*/5 * * * *", ""),
    ],
)  # fmt: skip
def test_a_schedule_is_said_in_words_where_these_say_it_all(cron: str, words: str) -> None:
    assert said(cron) == words
    plain = days_of(cron)
    assert plain is None or cron_of(*plain) == cron


def test_a_deadline_is_said_as_its_reader_says_it() -> None:
    with language("en"):
        assert [deadline_said(text) for text in ("06:00", "8 год", "90 min")] == [
            "finished by 06:00", "finished within 8 h", "finished within 90 min",
        ]  # fmt: skip
    with language("uk"):
        assert deadline_said("8 h") == "завершення за 8 год"


def test_old_addresses_lead_to_where_their_content_went(service: Service) -> None:
    for old, new in MOVED.items():
        answer = service.http.get(f"{old}?hours=12", follow_redirects=False)
        assert (answer.status_code, answer.headers["location"]) == (308, f"{new}?hours=12")
        assert service.http.get(new).status_code == 200, new
    for name in ("guide", "guide.md"):
        assert service.http.get(f"/docs/{name}", follow_redirects=False).headers["location"] == "/help/guide"


def test_old_addresses_of_a_study_lead_to_pages(service: Service, spec: dict[str, Any]) -> None:
    study = f"/studies/{service.http.post('/api/v1/studies', json=spec).json()['id']}"
    for old in (*OF_STUDY, *(f"cases/0/{name}" for name in OF_CASE)):
        answer = service.http.get(f"{study}/{old}", follow_redirects=True)
        assert (answer.status_code, len(answer.history) > 0) == (200, True), old
        assert answer.headers["content-type"].startswith("text/html"), old


@pytest.mark.parametrize(
    ("units", "words"),
    [
        ("workshop", "rpm · mm · N·m · %"), ("workshop,N*mm", "rpm · mm · N·mm · %"),
        ("typed,deg", "own units"), ("typed,rpm,deg", "rpm"), ("si,mm", "mm"),
    ],
)  # fmt: skip
def test_the_head_names_only_units_that_the_page_has_for_sure(service: Service, units: str, words: str) -> None:
    page = service.http.get("/", params={"units": units}).text
    assert f'title="Units of this page; change them">{words}</a>' in page


def test_who_is_not_known_has_no_tokens_that_are_looked_for(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_people: object) -> None:
        raise AssertionError("read for nobody")

    assert service.http.get("/me").status_code == 200  # whether tokens are needed is read once
    for read in ("tokens", "users"):
        monkeypatch.setattr(type(service.store.people), read, refuse)
    assert service.http.get("/me").status_code == 200


def test_a_schedule_is_made_of_days_and_a_time(service: Service) -> None:
    form = {"source": "preset one_pendulum", "when": "days", "days": "1-5", "clock": "21:05", "zone": "Europe/Kyiv"}
    assert service.http.post("/nights/new", data=form).status_code == 303
    (kept,) = service.store.schedules.all()
    assert (kept.fields.timing.cron, kept.fields.timing.zone) == ("5 21 * * 1-5", "Europe/Kyiv")
    assert "on working days at 21:05" in service.http.get("/nights").text
    wrong = service.http.post("/nights/new", data={**form, "clock": "late"})
    assert wrong.status_code == 422
    assert (
        'id="wrong-clock" role="alert">is not a time of day; allowed: hours and minutes, such as 22:00<' in wrong.text
    )


def test_a_zone_that_nobody_said_is_asked_for(service: Service) -> None:
    form = {"source": "preset one_pendulum", "when": "days", "days": "1-5", "clock": "22:00"}
    zone = '<input id="zone" name="zone" type="text" value="{}"'
    assert zone.format("") in service.http.get("/nights/new").text
    assert (
        zone.format("Asia/Tokyo") in service.http.get("/nights/new", headers={"Cookie": "sprag_here=Asia%2FTokyo"}).text
    )
    refused = service.http.post("/nights/new", data={**form, "zone": ""})
    assert (refused.status_code, 'id="wrong-zone" role="alert"' in refused.text) == (422, True)


@pytest.mark.parametrize(
    ("changes", "field", "text"),
    [
        ({"clock": ""}, "clock", "is not a time of day; allowed: hours and minutes, such as 22:00"),
        ({"when": "at"}, "at", "is required; allowed: a future time, such as 2027-01-31 22:00"),
        ({"when": "cron"}, "cron", 'is required; allowed: five fields, such as "0 22 * * 1-5"'),
        ({"window_begin": "22:00"}, "window_begin", "allowed: two different times of day, such as 22:00 and 06:00"),
        ({"report_email": "dora"}, "report_email", "at most 10 different addresses, such as dora@example.com"),
        ({"report_email": "a@b.example"}, "report_email", "none, until the administrator sets a mail server"),
        ({"report_webhook": "https://a.example/x"}, "report_webhook", "none, until the administrator allows origins"),
    ],
)
def test_faults_of_a_schedule_stand_beside_what_was_typed(
    service: Service, changes: dict[str, str], field: str, text: str
) -> None:
    form = {"source": "preset one_pendulum", "when": "days", "days": "1-5", "clock": "22:00", "zone": "Europe/Kyiv"}
    page = unescape(service.http.post("/nights/new", data={**form, **changes}).text)
    fault = page[page.index(f'id="wrong-{field}" role="alert"') :].partition("</span>")[0]
    assert text in fault, fault
    assert page.count('role="alert">') == 1 or field == "report_email"


def test_times_are_in_the_zone_of_the_browser_or_in_the_chosen_one(
    visitor: Visitor, office: Office, browser: Browser, example: str
) -> None:
    assert example
    abroad = browser.new_context(base_url=office.address, timezone_id="Asia/Tokyo")
    page = abroad.new_page()
    page.goto("/")
    time = page.locator("#studies time").first
    # The first page is made for the office; its times follow when the browser has said its own zone.
    expect(time).to_have_attribute("title", re.compile("Asia/Tokyo"))
    expect(page.get_by_text("Times: Asia/Tokyo")).to_be_visible()
    page.goto("/me")
    expect(page.get_by_text("Times: Asia/Tokyo")).to_be_visible()
    page.get_by_label("Times on pages are those of").select_option("Europe/Kyiv")
    page.get_by_role("button", name="Use this zone").click()
    page.goto("/")
    expect(time).to_have_attribute("title", re.compile("Europe/Kyiv"))
    abroad.close()


def test_an_address_shows_a_colleague_the_same_numbers(
    visitor: Visitor, office: Office, browser: Browser, example: str
) -> None:
    page = visitor.page
    page.goto(f"/studies/{example}/cases/0")
    assert "units=" not in page.url
    page.goto("/me")
    page.get_by_label("SI: rad/s, m, rad, N/m").check()
    page.get_by_role("button", name="Use these").click()
    page.goto(f"/studies/{example}/cases/0")
    expect(page).to_have_url(f"{office.address}/studies/{example}/cases/0?units=si")
    expect(page.locator("main")).to_contain_text("rad/s")
    colleague = browser.new_context(base_url=office.address).new_page()
    colleague.goto(page.url)
    expect(colleague.locator("main")).to_contain_text("rad/s")
    expect(colleague.locator("header.site")).to_contain_text("SI")
    colleague.goto(f"/studies/{example}/cases/0")
    expect(colleague.locator("main")).to_contain_text("rpm")
    colleague.context.close()
