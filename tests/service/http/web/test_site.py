"""The documentation as a site: built without a warning, complete, all of it from here, shown by the service."""

from __future__ import annotations

import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import httpx
import pytest
from playwright.sync_api import ConsoleMessage, expect

from docs import site as building
from sprag_study.service.http.web import pages
from tests.serving import served

if TYPE_CHECKING:
    from playwright.sync_api import Browser

    from tests.service.conftest import Service


class Loaded(HTMLParser):
    """What a page loads by itself, its inline scripts and styles, and where its links lead."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.links: list[str] = []
        self.inline: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        if tag == "link" and values["rel"] not in ("prev", "next"):
            self.addresses.append(values["href"])
        self.addresses += [values[name] for name in ("src", "srcset", "data") if name in values]
        data = values.get("type") == "application/json"
        if tag == "style" or (tag == "script" and "src" not in values and not data):
            self.inline.append(tag)
        self.inline += [name for name in values if name == "style" or name.startswith("on")]
        if tag == "a" and "href" in values:
            self.links.append(values["href"])


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, which a link that leads nowhere would have stopped."""
    target = tmp_path_factory.mktemp("built") / "site"
    building.build(target)
    return target


@pytest.fixture
def shown(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The site lies where the service looks for it."""
    monkeypatch.setattr(pages, "_SITE", built)
    monkeypatch.setattr(pages, "_SITE_FILES", pages._SiteFiles(directory=built))


def documents() -> set[str]:
    """Every document, as a path of the site."""
    folder = building.ROOT / "docs"
    return {*building.BESIDE, *(file.relative_to(folder).as_posix() for file in folder.rglob("*.md"))}


def test_the_site_has_a_page_for_every_document(built: Path) -> None:
    wanted = {re.sub(r"README\.md$", "index.md", name).removesuffix(".md") + ".html" for name in documents()}
    found = {file.relative_to(built).as_posix() for file in built.rglob("*.html")}
    assert found - {"404.html"} == wanted
    arranged = {page for part in building.parts().values() for page in part}
    assert arranged == {name for name in documents() if not re.match(r"README|adr/\d", name)}
    assert list(building.parts())[:4] == ["Learn", "Do", "Look up", "Understand"]
    first = Loaded((built / "index.html").read_text("utf-8"))
    assert {f"./{name}" for name in wanted if name.startswith("adr/")} <= set(first.links)


def test_nothing_of_the_site_comes_from_another_host_or_is_inline(built: Path) -> None:
    for file in built.rglob("*.html"):
        page = Loaded(file.read_text("utf-8"))
        assert page.inline == [], file
        for address in page.addresses:
            parts = urlsplit(address)
            assert (parts.scheme, parts.netloc) == ("", ""), (file, address)
            # The page of what is missing has addresses from the root.
            assert file.name == "404.html" or (file.parent / parts.path).is_file(), (file, address)
    for file in built.rglob("*.css"):
        assert not re.search(r"@import|url\(['\"]?(?:https?:)?//", file.read_text("utf-8")), file


def test_links_of_the_site_lead_to_its_files(built: Path) -> None:
    for file in built.rglob("*.html"):
        for link in Loaded(file.read_text("utf-8")).links:
            parts = urlsplit(link)
            if not parts.scheme and file.name != "404.html":
                assert (file.parent / parts.path).exists(), (file, link)


def test_a_link_that_leads_nowhere_stops_the_building(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("docs", "examples"):
        shutil.copytree(building.ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in building.BESIDE:
        shutil.copy(building.ROOT / name, tmp_path)
    monkeypatch.setattr(building, "ROOT", tmp_path)
    with (tmp_path / "docs" / "starts.md").open("a", encoding="utf-8") as page:
        page.write("\n[lost](theory.md#no-such-heading)\n")
    with pytest.raises(SystemExit, match="anchor does not exist"):
        building.build(tmp_path / "site")
    assert not (tmp_path / "site").exists()


def test_the_service_says_how_to_build_it(service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "_SITE", tmp_path / "none")
    answer = service.http.get("/docs/site/", headers={"Accept": "text/html"})
    assert answer.status_code == 404
    assert "make docs" in answer.text
    assert "/docs/site/" not in service.http.get("/help").text


@pytest.mark.usefixtures("shown")
def test_the_service_shows_it(service: Service) -> None:
    answer = service.http.get("/docs/site", follow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (303, "/docs/site/")
    answer = service.http.get("/docs/site/")
    assert answer.status_code == 200
    assert "<h1" in answer.text
    policy = answer.headers["content-security-policy"]
    assert re.match(r"default-src 'self'; style-src 'self' 'sha256-[\w+/=]{44}'; img-src", policy)
    assert "unsafe" not in policy
    assert service.http.get("/docs/site/adr/0012-one-package.html").status_code == 200
    for name in ("nowhere.html", "../pages.py", "%2e%2e/pages.py", "adr"):
        assert service.http.get(f"/docs/site/{name}", follow_redirects=True).status_code == 404, name
    for page in ("/help",):
        assert 'href="/docs/site/"' in service.http.get(page).text


@pytest.mark.usefixtures("shown")
def test_its_search_finds_a_word(service: Service, browser: Browser) -> None:
    with served(service.app) as address:
        page = browser.new_page()
        hosts: set[str] = set()
        errors: list[str] = []

        def note(message: ConsoleMessage) -> None:
            errors.extend([message.text] if message.type == "error" else [])

        page.on("console", note)
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("request", lambda request: hosts.add(urlsplit(request.url).netloc))
        page.goto(f"{address}/docs/site/")
        page.keyboard.press("/")
        page.get_by_placeholder("Search").fill("grazing")
        page.get_by_role("option").filter(has_text="grazing").filter(has_text="Branches").first.click()
        expect(page.locator("h1", has_text="Branches")).to_be_visible()
        page.close()
    assert hosts == {httpx.URL(address).netloc.decode()}
    assert errors == []
