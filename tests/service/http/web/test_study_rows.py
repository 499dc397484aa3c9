"""The list of studies: a curve and answers of each, chips, and a bar of actions for those that are ticked."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from playwright.sync_api import expect

from sprag_study.service.reading.reader import Choice
from sprag_study.service.views import listed as module

if TYPE_CHECKING:
    from tests.service.conftest import Service
    from tests.service.http.web.conftest import Office, Visitor


def test_a_row_has_a_curve_and_answers_in_the_units_of_the_reader(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    page = service.http.get("/").text
    row = page[page.index("<tbody>") : page.index("</tbody>")]
    assert 'class="spark"' in row
    assert "Mean shaft speed along load torque".lower() in row.lower()
    assert len(re.findall('<td class="answer">', row)) == 3
    assert "rpm</small>" in row
    assert "rad/s</small>" in service.http.get("/?units=si").text
    assert "<progress" not in row


def test_a_list_looks_at_each_study_once(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    looks: list[str] = []
    first = module.headline_of

    def counted(library: object, study_id: str) -> object:
        looks.append(study_id)
        return first(library, study_id)  # type: ignore[arg-type]

    monkeypatch.setattr(module, "headline_of", counted)
    ids = [service.submit(), service.submit()]
    for study_id in ids:
        service.fill(study_id)
    library = service.app.state.context.library
    records = service.store.studies.page().studies
    assert module.listed(library, records, Choice("workshop"), 0.0) == {}, "without time only what is known"
    assert module.known(library, records, 600.0) == [True, True]
    assert sorted(looks) == sorted(ids)
    service.http.get("/")
    assert len(looks) == 2
    monkeypatch.setattr(type(service.store.studies), "spec", None)
    assert module.known(library, records, 600.0) == [True, True], "a look reads no specs"
    assert module.listed(library, records, Choice("workshop"), 0.0).keys() == set(ids)


def test_a_list_is_shown_without_a_study_that_is_deleted_meanwhile(service: Service) -> None:
    gone, kept = service.submit(), service.submit()
    for study_id in (gone, kept):
        service.fill(study_id)
    library = service.app.state.context.library
    records = service.store.studies.page().studies
    assert module.known(library, records, 600.0) == [True, True]
    service.store.studies.delete(gone)
    assert module.listed(library, records, Choice("typed"), 600.0).keys() == {kept}


def test_what_needs_a_look_has_failed_cases(service: Service) -> None:
    study_id, waiting = service.submit(), service.submit()
    service.fill(study_id)
    progress = service.get(f"/studies/{study_id}")["progress"]
    assert progress["ok"] < progress["done"]
    shown = service.http.get("/?trouble=true").text
    assert re.search(r'href="/\?trouble=true" aria-current="true">Needs a look', shown)
    assert (study_id in shown, waiting in shown) == (True, False)
    assert "without a result" in shown


def test_ticks_open_the_bar_of_actions(visitor: Visitor, office: Office, example: str) -> None:
    page = visitor.page
    page.goto("/")
    bar = page.get_by_role("group", name="With the chosen ones")
    expect(bar).to_be_hidden()
    page.locator(f'input[value="{example}"]').check()
    expect(bar).to_be_visible()
    expect(bar.get_by_role("button", name="Compare")).to_be_visible()
    page.set_viewport_size({"width": 390, "height": 800})
    expect(bar).to_be_in_viewport()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
