"""Saved views and figures of reports: over HTTP, with the client and commands, on pages, in reports and mails."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.cli import saved_views as commands
from sprag_study.service.client import Client
from sprag_study.service.jobs.reports.curve import small_curve
from sprag_study.service.report.blocks import Image, Text
from sprag_study.service.report.document import document_of, report_of
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.saved_views import read_view, read_view_change
from sprag_study.service.views.library import Library
from sprag_study.service.views.study_questions import ReportQuestion
from tests.service.conftest import PortalTransport, Service

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

API = "/api/v1"
TORQUE = "x=shaft.load&y=torque.mean&at=excitation.frequency%3D16+Hz&units=torque%3DN%2Amm"
MAP = "x=shaft.load&y=excitation.frequency&z=shaft.speed.mean&kind=contour&units=si"


@pytest.fixture
def study(service: Service) -> str:
    """The example, with rows."""
    made = service.submit()
    service.fill(made)
    return made


def save(service: Service, **body: Any) -> dict[str, Any]:
    """Save a view over HTTP."""
    answer = service.http.post(f"{API}/views", json=body)
    assert answer.status_code == 200, answer.text
    saved: dict[str, Any] = answer.json()
    return saved


def report(service: Service, study: str, **given: str) -> str:
    """The report as a page."""
    answer = service.http.get(f"{API}/studies/{study}/report", params={"format": "html", **given})
    assert answer.status_code == 200, answer.text
    return answer.text


@pytest.mark.parametrize(
    ("changes", "where", "code"),
    [
        ({"page": "motion"}, "/page", "invalid-choice"),
        ({"study": None}, "/study", "required"),
        ({"page": "compare"}, "/study", "not-used"),
        ({"study": "st/.."}, "/study", "invalid-text"),
        ({"name": " "}, "/name", "invalid-text"),
        ({"name": 7}, "/name", "wrong-type"),
        ({"query": "x=%00"}, "/query", "invalid-text"),
        ({"query": "x=" + "9" * 4000}, "/query", "invalid-text"),
        ({"in_report": "yes"}, "/in_report", "wrong-type"),
        ({"page": "explore", "in_report": True}, "/in_report", "not-used"),
        ({"colour": "red"}, "/colour", "unknown-field"),
    ],
)
def test_faults_name_the_field(changes: dict[str, Any], where: str, code: str) -> None:
    with pytest.raises(SpecError) as caught:
        read_view({"page": "curves", "study": "st_1", "name": "a", "query": "x=1", **changes})
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [(where, code)]


@pytest.mark.parametrize(
    ("change", "page", "where", "code"),
    [
        ({"place": 0}, "curves", "/place", "out-of-range"),
        ({"place": 1.5}, "curves", "/place", "wrong-type"),
        ({"place": 1}, "explore", "/place", "not-used"),
        ({"place": 1, "in_report": False}, "map", "/place", "not-used"),
        ({"in_report": True}, "cases", "/in_report", "not-used"),
    ],
)
def test_faults_of_a_change_name_the_field(change: dict[str, Any], page: str, where: str, code: str) -> None:
    with pytest.raises(SpecError) as caught:
        read_view_change(change, page)
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [(where, code)]


def test_a_view_is_the_address_of_its_page(service: Service, study: str) -> None:
    kept = save(service, page="studies", name="Failed", query="?state=failed&after=abc&sort=")
    assert (kept["query"], kept["address"]) == ("state=failed", "/?state=failed")
    curves = save(service, page="curves", study=study, name="Torque", query=TORQUE)
    shown = service.http.get(curves["address"], follow_redirects=True)
    assert shown.status_code == 200
    assert "Mean clutch torque against" in shown.text
    listed = service.get("/views", study=study)["views"]
    assert listed == [curves]
    assert {one["id"] for one in service.get("/views")["views"]} == {kept["id"], curves["id"]}


def test_only_what_the_study_has_comes_into_its_report(service: Service, study: str) -> None:
    body = {"page": "curves", "study": study, "name": "a", "query": "y=torque.men", "in_report": True}
    refused = service.http.post(f"{API}/views", json=body)
    assert (refused.status_code, refused.json()["type"]) == (422, "/problems/invalid-selection")
    saved = save(service, **{**body, "in_report": False})
    refused = service.http.patch(f"{API}/views/{saved['id']}", json={"in_report": True})
    assert refused.json()["type"] == "/problems/invalid-selection"
    changed = service.http.patch(f"{API}/views/{saved['id']}", json={"in_report": True, "query": TORQUE}).json()
    assert changed["place"] == 1
    missing = service.http.delete(f"{API}/views/vw_0000000000000000")
    assert missing.json()["type"] == "/problems/view-not-found"


def test_the_report_has_the_chosen_figures_in_order(service: Service, study: str) -> None:
    before = report(service, study)
    assert "Torque of the clutch" not in before
    save(service, page="map", study=study, name="Speeds", query=MAP, in_report=True)
    torque = save(service, page="curves", study=study, name="Torque of the clutch", query=TORQUE, in_report=True)
    assert service.http.patch(f"{API}/views/{torque['id']}", json={"place": 1}).status_code == 200
    found = report_of(Library(service.store), study)
    assert [(figure.name, figure.contours) for figure in found.figures] == [
        ("Torque of the clutch", False), ("Speeds", True),
    ]  # fmt: skip
    asked = ReportQuestion(text=["", "", "", "Before the speeds."])
    document = document_of(Library(service.store), study, question=asked)
    first = [block.caption for section in document.sheets[0] for block in section.blocks if isinstance(block, Image)]
    assert first[-1].startswith("Torque of the clutch. ")  # it stands in the place of the curves
    (section,) = document.appendix
    assert section.title == "Figures"
    text, image = section.blocks
    assert isinstance(text, Text)
    assert isinstance(image, Image)
    assert (text.text, image.caption.partition(".")[0]) == ("Before the speeds.", "Speeds")
    torque_figure = found.figures[0].shown
    assert torque_figure is not None
    assert torque_figure.panels[0].y.unit == "N*mm"  # type: ignore[union-attr] - curves, in the units of the view
    page = report(service, study)
    assert page.index("Torque of the clutch. ") < page.index("Speeds. ")
    assert "Speeds. " in report(service, study, x="shaft.load", at="excitation.frequency=16 Hz")  # as its page asks
    assert report(service, study, y="efficiency").count("Torque of the clutch") == 0  # curves of an address win
    pdf = service.http.get(f"{API}/studies/{study}/report?format=pdf")
    assert pdf.content.startswith(b"%PDF")
    assert small_curve(service.store, study, "workshop") == found.figures[0].draw("png", "Torque of the clutch")


def test_a_figure_that_cannot_be_drawn_says_so(service: Service, study: str) -> None:
    saved = save(service, page="curves", study=study, name="Broken", query=TORQUE, in_report=True)
    service.store.views.save(read_view({"page": "curves", "study": study, "name": "Broken", "query": "y=none"}))
    (figure,) = report_of(Library(service.store), study).figures
    assert (figure.shown, "Broken" in figure.caption) == (None, True)
    (first, _second) = document_of(Library(service.store), study).sheets
    assert [block for section in first for block in section.blocks if isinstance(block, Text) and block.warning]
    assert saved["name"] in service.http.get(f"/studies/{study}").text


def test_pages_save_list_order_and_remove_views(service: Service, study: str) -> None:
    page = service.http.get(f"/studies/{study}?{TORQUE}").text
    fields = dict(re.findall(r'<input (?:type="hidden" )?name="(page|study|query|name)" value="([^"]*)"', page))
    fields = {name: value.replace("&amp;", "&") for name, value in fields.items()}
    assert fields["page"] == "curves"
    answer = service.http.post("/views", data={**fields, "in_report": "true"}, follow_redirects=False)
    assert answer.status_code == 303
    back = answer.headers["location"]
    assert back.startswith(f"/studies/{study}/curves?x=shaft.load&y=torque.mean")
    assert "(figure 1 of the report)" in service.http.get(back, follow_redirects=True).text
    save(service, page="map", study=study, name="Speeds", query=MAP, in_report=True)
    first, second = service.store.views.all(study)
    shown = service.http.get(f"/studies/{study}").text
    assert f'<a href="/studies/{study}/map?' in shown
    both = ["Speeds", first.view.name]
    for done, places in (("later", both), ("take-out", ["Speeds"]), ("report", both), ("later", both)):
        assert service.http.post(f"/views/{first.id}", data={"do": done}, follow_redirects=False).status_code == 303
        assert [one.view.name for one in service.store.views.all(study) if one.place] == places
    service.http.post(f"/views/{second.id}", data={"do": "rename", "name": "Map of speeds"})
    assert service.store.views.get(second.id).view.name == "Map of speeds"
    service.http.post(f"/views/{second.id}", data={"do": "delete"})
    assert [one.id for one in service.store.views.all(study)] == [first.id]


def test_the_same_name_is_not_proposed_for_other_choices(service: Service, study: str) -> None:
    address = f"/studies/{study}?{TORQUE}".replace("16+Hz", "35+Hz")
    named = r'name="name" value="([^"]*)" size="40" maxlength="200" required'
    (name,) = re.findall(named, service.http.get(address).text)
    save(service, page="curves", study=study, name=name, query=TORQUE)
    (other,) = re.findall(named, service.http.get(address).text)
    assert other == f"{name} (2)"


def test_lists_and_comparisons_are_saved_too(service: Service, study: str) -> None:
    service.http.post("/views", data={"page": "studies", "name": "Finished ones", "query": "state=finished"})
    other = service.submit()
    service.http.post(
        "/views", data={"page": "compare", "name": "Both", "query": f"study={study}&study={other}&x=shaft.load"}
    )
    page = service.http.get("/").text
    assert '<a href="/?state=finished">Finished ones</a>' in page
    filtered = service.http.get("/?state=finished").text
    assert (filtered.count('id="views"'), filtered.count('id="saved-views"')) == (1, 1)
    assert f'href="/compare?study={study}&amp;study={other}' in page
    assert "Both" in service.http.get(f"/compare?study={study}&study={other}").text
    assert 'name="query" value="state=finished"' in service.http.get("/?state=finished").text


def test_the_client_and_the_commands(
    service: Service, study: str, portal: Any, connected: Callable[[ModuleType], None], sprag: Callable[..., Any]
) -> None:
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        made = client.save_view("curves", "Torque", TORQUE, study=study, in_report=True)
        assert client.change_view(made["id"], name="Torques")["place"] == 1
        assert [one["name"] for one in client.views(study)] == ["Torques"]
        client.delete_view(made["id"])
        assert client.views() == []
    connected(commands)
    address = f"https://host/prefix/studies/{study}/map?{MAP}"
    saved = sprag("view", "save", address, "--name", "Speeds", "--report", "--json").data
    assert (saved["page"], saved["study"], saved["place"]) == ("map", study, 1)
    assert sprag("view", "change", saved["id"], "--no-report", "--name", "x", "--json").data["place"] is None
    assert [one["name"] for one in sprag("view", "list", "--study", study, "--json").data["views"]] == ["x"]
    assert sprag("view", "delete", saved["id"]).code == 0
    assert sprag("view", "save", "/compare?study=a", "--name", "y", "--json").data["page"] == "compare"
    assert sprag("view", "save", "https://host/?state=failed", "--name", "z", "--json").data["page"] == "studies"
    assert sprag("view", "save", f"/studies/{study}", "--name", "x").code == 2
