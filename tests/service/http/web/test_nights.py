"""Logging in with a token, and schedules, as people in an office do both in the browser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import Browser, Page, expect

from sprag_study.service.http.app import chunking, create_app
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.settings import Settings
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store
from sprag_study.worker.models import ChunkResult
from tests.acceptance.processes import SECONDS
from tests.service.conftest import InThread, made_up
from tests.service.timed_spec import SPEC
from tests.serving import served

if TYPE_CHECKING:
    from playwright.sync_api import BrowserContext

expect.set_options(timeout=1000 * SECONDS)
PLAIN = {"java_script_enabled": False}


class NewYear:
    """A clock that stands at noon of the first of January 2026, until it is set."""

    def __init__(self) -> None:
        self.moment = datetime(2026, 1, 1, 12, tzinfo=UTC)

    def now(self) -> datetime:
        """The moment it was set to."""
        return self.moment

    def monotonic(self) -> float:
        """Seconds; they stand still."""
        return 0.0


@dataclass
class House:
    """A service of this process with its store and its clock."""

    address: str
    store: Store
    clock: NewYear
    study: str


@pytest.fixture
def house(sqlite_url: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[House]:
    """A service with one finished study of made-up rows, and no worker."""
    for name in Settings.model_fields:
        monkeypatch.delenv(f"SPRAG_{name.upper()}", raising=False)
    settings = Settings(database=sqlite_url, processes=1)
    clock = NewYear()
    with Store.open(settings.database_url, chunking=chunking(settings), clock=clock) as store:
        app = create_app(settings, store=store, computer=InThread(), checker=InThread())
        with served(app) as address:
            yield House(address, store, clock, finished_study(store))


def finished_study(store: Store) -> str:
    """The example, submitted and ended with made-up rows; its id."""
    from sprag_study.service.jobs.submission import accept
    from sprag_study.service.spec.document import parse_spec

    record = accept(store, parse_spec(SPEC))
    rows, epoch = made_up(store.studies.study(record.id)), store.work.take_over("test")
    for chunk in store.work.claim(epoch, store.work.open_chunks(record.number)):
        part = slice(chunk.first, chunk.first + chunk.count)
        result = ChunkResult(chunk.first, rows.endings[part], rows.flags[part], rows.values[part])
        assert store.work.commit(epoch, chunk, result)
    store.work.settle(epoch, record.number)
    return record.id


@pytest.fixture(params=[{}, PLAIN], ids=["with scripts", "without"])
def tab(house: House, browser: Browser, request: pytest.FixtureRequest) -> Iterator[Page]:
    """A tab at the service, with JavaScript and without."""
    context = browser.new_context(base_url=house.address, viewport={"width": 1280, "height": 900}, **request.param)
    # The first page reads all presets, which takes a machine that is busy with other tests many seconds.
    context.set_default_timeout(1000 * SECONDS)
    yield context.new_page()
    context.close()


def log_in(page: Page, secret: str) -> None:
    """Fill in the form of the login."""
    page.get_by_label("Token").fill(secret)
    page.get_by_role("button", name="Log in").click()


def session_of(context: BrowserContext) -> list[dict[str, object]]:
    """The cookies of the service."""
    return [dict(cookie) for cookie in context.cookies() if cookie.get("name") == "sprag_session"]


def test_a_browser_logs_in_looks_and_acts_and_logs_out(house: House, tab: Page) -> None:
    secret, record = house.store.people.create_token("design office", TokenScope.WRITE)
    tab.goto(f"/studies/{house.study}")
    expect(tab).to_have_url(f"{house.address}/login?next=/studies/{house.study}")
    log_in(tab, "sprag_wrong-wrong-wrong-wrong")
    expect(tab.locator("#wrong-token")).to_have_text("This token is not valid.")
    assert session_of(tab.context) == []
    log_in(tab, secret)
    expect(tab).to_have_url(f"{house.address}/studies/{house.study}")
    (cookie,) = session_of(tab.context)
    assert (cookie["httpOnly"], cookie["sameSite"], secret in str(cookie["value"])) == (True, "Lax", False)
    expect(tab.get_by_role("heading", level=1)).to_contain_text("Feeder motor")
    tab.goto("/nights/new")
    tab.get_by_label("Study", exact=True).select_option(f"study {house.study}")
    tab.get_by_label("Time zone").fill("Europe/Berlin")  # without a script nothing fills it in
    tab.get_by_role("button", name="Create the schedule").click()
    expect(tab.locator("tbody tr")).to_have_count(1)
    tab.get_by_role("link", name="Me", exact=True).click()
    expect(tab.get_by_text("You are logged in with the token design office")).to_be_visible()
    tab.get_by_role("button", name="Log out").click()
    assert session_of(tab.context) == []
    tab.context.add_cookies([{"name": "sprag_session", "value": str(cookie["value"]), "url": house.address}])
    tab.goto("/nights")
    expect(tab).to_have_url(f"{house.address}/login?next=/nights")  # a copy of the cookie is worth nothing
    assert record.scope is TokenScope.WRITE


@pytest.mark.parametrize("tab", [{}], indirect=True)
def test_what_was_typed_outlives_the_session(house: House, tab: Page) -> None:
    secret, _ = house.store.people.create_token("design office", TokenScope.WRITE)
    tab.goto("/new")
    log_in(tab, secret)
    load = tab.get_by_role("textbox", name="Load").first
    load.fill("1")
    tab.context.clear_cookies()
    load.fill("1.25")
    tab.get_by_text("Your session has ended").wait_for()
    tab.get_by_role("button", name="Log in").click()
    log_in(tab, secret)
    tab.get_by_role("button", name="Continue").click()
    tab.wait_for_url("**/new")
    expect(tab.get_by_role("textbox", name="Load").first).to_have_value("1.25")


def test_a_token_to_look_sees_every_page_and_may_change_nothing(house: House, tab: Page) -> None:
    secret, _ = house.store.people.create_token("wall display", TokenScope.READ)
    tab.goto("/login")
    log_in(tab, secret)
    expect(tab).to_have_url(f"{house.address}/")
    for page in (
        "/",
        f"/studies/{house.study}",
        f"/studies/{house.study}/cases/0",
        "/nights",
        "/new",
        "/help/interface",
    ):
        answer = tab.goto(page)
        assert answer is not None
        assert answer.status == 200, page
    tab.goto("/nights/new")
    expect(tab.get_by_role("button", name="Create the schedule")).to_be_disabled()
    assert house.store.schedules.all() == ()


def test_a_schedule_is_kept_changed_paused_and_deleted(house: House, tab: Page) -> None:
    tab.goto(f"/nights/new?study={house.study}")
    tab.get_by_label("Name of its studies").fill("Every working night")
    tab.get_by_text("More: other days and hours").click()
    tab.get_by_label("as a cron expression").check()
    tab.get_by_role("textbox", name="Cron expression").fill("0 25 * * *")
    tab.get_by_label("Time zone").fill("Europe/Berln")
    tab.get_by_role("button", name="Create the schedule").click()
    expect(tab.locator("#wrong-cron")).to_contain_text("five fields, such as")
    expect(tab.locator("#wrong-zone")).to_contain_text("Europe/Berlin")
    expect(tab.get_by_role("textbox", name="Cron expression")).to_have_value("0 25 * * *")
    tab.get_by_role("textbox", name="Cron expression").fill("0 22 * * 1-5")
    tab.get_by_label("Time zone").fill("Europe/Berlin")
    tab.get_by_text("More: hours, deadline").click()
    tab.get_by_label("From", exact=True).fill("22:00")
    tab.get_by_role("button", name="Create the schedule").click()
    expect(tab.locator("#wrong-window_begin")).not_to_be_empty()
    tab.get_by_label("Until").fill("06:00")
    tab.get_by_role("button", name="Create the schedule").click()
    row = tab.locator("tbody tr")
    # In winter; the first of January 2026 is a Thursday.
    expect(row).to_contain_text("on working days at 22:00 Europe/Berlin")
    expect(row).to_contain_text("2026-01-01 21:00")
    expect(row).to_contain_text("22:00–06:00")
    row.get_by_role("link", name="Every working night").click()
    tab.get_by_text("More: other days and hours").click()
    tab.get_by_label("as a cron expression").check()
    tab.get_by_role("textbox", name="Cron expression").fill("30 8 * 7 *")
    for label in ("From", "Until"):
        tab.get_by_label(label, exact=True).fill("")
    tab.get_by_role("button", name="Save").click()
    expect(row).to_contain_text("2026-07-01 06:30")
    expect(row).to_contain_text("any time")
    row.get_by_role("button", name="Pause").click()
    expect(row).to_contain_text("paused")
    expect(row).not_to_contain_text("2026-07-01")
    row.get_by_role("button", name="Resume").click()
    expect(row).to_contain_text("2026-07-01 06:30")
    row.locator("summary", has_text="Delete").click()
    row.get_by_role("button", name="its studies stay").click()
    expect(tab.get_by_text("There is no schedule yet.")).to_be_visible()
    assert house.store.schedules.all() == ()


def test_a_first_visit_has_the_zone_of_its_browser(house: House, browser: Browser) -> None:
    context = browser.new_context(
        base_url=house.address, timezone_id="Europe/Kyiv", viewport={"width": 390, "height": 900}
    )
    page = context.new_page()
    page.goto("/nights/new")
    expect(page.get_by_label("Time zone")).to_have_value(re.compile("Europe/K(yi|ie)v"))
    days, mark = (page.locator(name).first.bounding_box() for name in ('[name="days"]', '[name="when"]'))
    assert days is not None
    assert mark is not None
    assert days["width"] > 120
    assert mark["width"] < 30
    context.close()


def test_a_study_is_run_once_at_a_time_of_a_zone(house: House, tab: Page) -> None:
    tab.goto("/nights/new")
    tab.get_by_label("Study", exact=True).select_option("preset one_pendulum")
    tab.get_by_label("once").check()
    tab.get_by_label("Time", exact=True).fill("2025-12-31T22:00")
    tab.get_by_text("More: other days and hours").click()
    tab.get_by_label("Time zone").fill("Asia/Tokyo")
    tab.get_by_role("button", name="Create the schedule").click()
    expect(tab.locator("#wrong-at")).to_contain_text("is in the past")
    tab.get_by_label("Time", exact=True).fill("2026-01-02T07:30")
    tab.get_by_role("button", name="Create the schedule").click()
    row = tab.locator("tbody tr")
    expect(row).to_contain_text("2026-01-01 22:30")
    house.clock.moment = datetime(2026, 1, 1, 22, 30, 1, tzinfo=UTC)
    Scheduler(house.store).look()
    tab.goto("/nights")
    expect(row).to_contain_text("Its study waits for workers: 0 of")
    tab.goto("/nights?hours=12")
    expect(tab.get_by_role("heading", level=3)).to_contain_text("2026-01-01 22:30")
    expect(tab.get_by_text("The only run went as planned")).to_be_visible()
    tab.goto("/nights")
    row.get_by_role("link", name="its study").click()
    expect(tab.get_by_role("heading", level=1)).to_be_visible()
    assert len(house.store.studies.page().studies) == 2
