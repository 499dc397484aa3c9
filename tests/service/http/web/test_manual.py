"""The manual on pages, and the links that lead there from every field."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import pytest

from sprag_study.service.http.current import knowing
from sprag_study.service.http.web.manual import PAGES, manual_page, titles
from sprag_study.worker import models

if TYPE_CHECKING:
    from tests.service.conftest import Service

FORMS = (
    "/new", "/new?preset=two_pendulums", "/new?preset=tolerances", "/new?preset=fastest_drive",
    "/new?preset=refined_characteristic", "/new?model=machine-shaft",
    *(f"/new?preset={name}" for name in ("press", "punching_press", "slotter", "compressor", "cam_machine",
                                         "four_cylinder_engine", "least_flywheel")),
)  # fmt: skip


class Read(HTMLParser):
    """Ids, addresses of links, what a page loads, and the explanation of each field by its name."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.helps: dict[str, str] = {}
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.ids |= {values["id"]} if "id" in values else set()
        self.loaded += [values[name] for name in ("src", "srcset", "data") if name in values]
        if tag == "a" and "href" in values:
            self.links.append(values["href"])
        if "data-more" in values:
            self.helps[values["name"]] = values["data-more"]


def targets() -> dict[str, set[str]]:
    """Ids of the headings of each page."""
    return {name: Read(str(manual_page(name).html)).ids for name in PAGES}


@pytest.mark.parametrize("name", PAGES)
def test_links_of_a_page_lead_to_headings_that_exist(service: Service, name: str) -> None:
    answer = service.http.get(f"/help/{name}", headers={"Accept-Language": "uk"})
    assert answer.status_code == 200
    assert '<html lang="uk"' in answer.text
    assert '<article class="manual" lang="en">' in answer.text
    found, known = Read(str(manual_page(name).html)), targets()
    assert not found.loaded
    for link in found.links:
        address = urlsplit(link)
        assert not address.netloc
        page = address.path.removeprefix("/help/") or name
        assert page in known, link
        assert not address.fragment or address.fragment in known[page], link
    assert "&lt;!--" not in str(manual_page(name).html)


def test_a_page_has_the_text_of_its_file(service: Service) -> None:
    page = service.http.get("/help/theory-machine-shaft").text
    assert '<h2 id="the-mean-speed-and-t_0">The mean speed and T_0</h2>' in page
    assert "omega^2 = S1 + S2 + S3 + S4 " in page
    assert re.search(r"<td><code>midrange</code> \(default\)</td>", page)
    assert titles()["theory"] == "Theory of the vibration drive"
    assert service.http.get("/help/operations").status_code == 404


def test_a_service_at_a_path_of_its_own_has_it_in_the_links() -> None:
    with knowing(prefix="/sprag"):
        assert 'href="/sprag/help/theory#settled-motion"' in str(manual_page("guide").html)


@pytest.mark.parametrize("model", [models.VIBRATION_DRIVE, models.MACHINE_SHAFT])
def test_every_parameter_has_a_section(model: str) -> None:
    known = targets()
    for entry in models.parameter_catalogue(model):
        page, _, heading = models.model_of(model).presentation.explained(entry.path).partition("#")
        assert page in known, entry.path
        assert heading in known[page], entry.path


@pytest.mark.parametrize("address", FORMS)
def test_every_field_links_to_the_section_that_explains_it(service: Service, address: str) -> None:
    found, known = Read(service.http.get(address).text), targets()
    assert len(found.helps) > 10
    for field, link in found.helps.items():
        page, _, heading = link.removeprefix("/help/").partition("#")
        assert page in known, (field, link)
        assert not heading or heading in known[page], (field, link)
