"""A model that its file alone knows, as a person uses it: form, laboratory, study, curves and case."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from sprag_study.service.storage.part import SystemClock
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from tests.service.http.web.fields import fill, named
from tests.service.registered import create_table, registered
from tests.service.test_toy_model import NAME, DampedOscillator

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Page

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service


@pytest.fixture(autouse=True)
def toy() -> Iterator[None]:
    """The model, for the time of a test."""
    with registered(DampedOscillator()):
        yield


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Settings of a service whose database has the model's table."""
    create_table(settings, NAME)
    return settings


def test_a_study_of_the_model_from_its_numbers_to_its_case(service: Service, open_tab: Callable[..., Page]) -> None:
    page = open_tab()
    page.goto(f"/new?model={NAME}&body.spring_rate=1.5")
    expect(page.locator(".live-figure svg")).to_be_visible()
    page.locator('[name="vary:damping"]').check()
    expect(named(page, "/axes/0/values")).to_have_value(re.compile(" in 9$"))
    fill(page, {"/axes/0/values": "0 to 0.8 in 3"})
    page.locator("#go").click()
    page.wait_for_url("**/studies/st_*")
    study_id = page.url.rpartition("/")[2]
    store = service.store
    Dispatcher(store.work, InlineExecutor(), SystemClock()).run(lambda: store.studies.get(study_id).state.terminal)
    page.goto(f"/studies/{study_id}")
    expect(page.locator("#chart svg.wide .panel").first.locator("a[data-case]")).to_have_count(3)
    page.goto(f"/studies/{study_id}/cases/1")
    expect(page.locator("figure svg.figure:visible")).to_have_count(1)
    page.get_by_role("link", name="Change this machine").click()
    expect(named(page, "/base/damping")).to_have_value("0.4")
