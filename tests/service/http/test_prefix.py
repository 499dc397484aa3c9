"""A service at a path of its own behind a proxy: every address that leaves it has the prefix."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from html import unescape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urljoin, urlsplit

import httpx
import pytest
from pydantic import SecretStr, ValidationError

from sprag_study.service.client import Client
from sprag_study.service.http.app import create_app
from sprag_study.service.http.current import knowing
from sprag_study.service.http.prefix import here
from sprag_study.service.http.web.templates import _TRANSLATED, Addresses, _templates
from sprag_study.service.presets import preset_text
from sprag_study.service.settings import Settings, UnsafeSettingsError
from sprag_study.service.spec.document import load_spec
from tests.service.conftest import PortalTransport, Service

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal

OWN = "/sprag"
#: What pages differ by: one axis and several, several motions, drawn drives, parts of a machine, a search.
PRESETS = ("one_pendulum", "two_pendulums", "two_motions", "tolerances", "question_masses", "least_flywheel")
#: Attributes, and a header, with addresses that are asked for.
FOLLOWED = {"href", "src", "location", "data-figure"}
#: Attributes with text of users and names of fields, which may begin with "/".
TEXTS = {
    "value",
    "name",
    "for",
    "id",
    "list",
    "data-for",
    "data-into",
    "aria-describedby",
    "aria-labelledby",
    "content",
}


#: A tag with attributes, and an attribute, as the templates write them. `html.parser` takes eight times as long.
_TAG = re.compile(r"<([a-z][\w-]*)((?:\s+[^\s=>\"'/]+(?:=(?:\"[^\"]*\"|'[^']*'|[^\s>\"']+))?)+)\s*/?>", re.IGNORECASE)
_ATTRIBUTE = re.compile(r"([^\s=>\"'/]+)=(?:\"([^\"]*)\"|'([^']*)'|([^\s>\"']+))")


def attributes(text: str) -> Iterator[tuple[str, str, str]]:
    """Every attribute of a page that is not empty: tag, name, value."""
    for tag in _TAG.finditer(text):
        for attribute in _ATTRIBUTE.finditer(tag[2]):
            if value := "".join(filter(None, attribute.groups()[1:])):
                yield tag[1].lower(), attribute[1].lower(), unescape(value)


class OnlyBelow:
    """An application behind a proxy that passes on what is below the prefix, and nothing else."""

    def __init__(self, app: Any) -> None:
        self._app = app
        self.refused: list[str] = []

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        if not f"{scope['path']}/".startswith(f"{OWN}/"):
            self.refused.append(scope["path"])
        await self._app(scope, receive, send)


@pytest.fixture
def below(settings: Settings, connect: Callable[..., httpx.Client]) -> Iterator[tuple[Service, OnlyBelow]]:
    """A service at /sprag."""
    from sprag_study.service.http.app import chunking
    from sprag_study.service.storage.store import Store
    from tests.service.conftest import InThread

    changed = settings.model_copy(update={"url_prefix": OWN})
    with Store.open(changed.database_url, chunking=chunking(changed)) as store:
        computer = InThread()
        app = create_app(changed, store=store, computer=computer, checker=InThread())
        proxy = OnlyBelow(app)
        yield Service(app, connect(proxy, base_url=f"http://localhost{OWN}"), store, computer), proxy


def kind_of(address: str) -> str:
    """What addresses of the same page or file have in common."""
    parts = urlsplit(address)
    path = re.sub(r"(st|sc)_[0-9a-f]+", "x", re.sub(r"(?<=/cases/)\d+", "0", parts.path))
    return f"{path}?{'&'.join(sorted({pair.partition('=')[0] for pair in parts.query.split('&')}))}"


def test_every_address_of_every_page_has_the_prefix(below: tuple[Service, OnlyBelow]) -> None:
    """From page to page along every link, picture, script and figure that there is; all are answered."""
    service, proxy = below
    for name in PRESETS:
        file, text = preset_text(name)
        spec = load_spec(text, "toml" if file.endswith("toml") else "json")
        study = service.submit(spec)
        if service.store.studies.get(study).cases <= 400:
            service.fill(study)
    schedule = {"spec": json.loads(preset_text("one_pendulum")[1]), "cron": "0 22 * * *"}
    assert service.http.post("/api/v1/schedules", json=schedule).status_code == 201
    waiting, seen, pages = [f"{OWN}/"], {kind_of(f"{OWN}/")}, set()
    while waiting:
        address = waiting.pop()
        answer = service.http.get(f"http://localhost{address}", headers={"Accept": "text/html,*/*"})
        assert answer.status_code in (200, 303, 308, 422), (address, answer.status_code, answer.text[:300])
        found = [("", "location", answer.headers["location"])] if "location" in answer.headers else []
        if answer.headers.get("content-type", "").startswith("text/html"):
            pages.add(kind_of(address).partition("?")[0])
            found += attributes(answer.text)
        for tag, name, value in found:
            root = value.startswith("/") and not value.startswith("//")
            if root and name not in TEXTS:
                assert f"{value}/".startswith((f"{OWN}/", f"{OWN}?")), (address, tag, name, value)
            if name in FOLLOWED and not value.startswith("#"):
                target = urljoin(f"http://localhost{address}", value)
                parts = urlsplit(target)
                if parts.netloc != "localhost" or "format=" in target or kind_of(target) in seen:
                    continue
                seen.add(kind_of(target))
                waiting.append(parts.path + (f"?{parts.query}" if parts.query else ""))
    assert proxy.refused == []
    assert {f"{OWN}/{name}" for name in ("new", "help", "nights", "parts", "me", "me/workers")} <= pages
    assert {f"{OWN}/studies/x{part}" for part in ("", "/rows", "/cases/0")} <= pages
    assert len(pages) > 20


def test_no_template_has_an_address_without_the_prefix() -> None:
    """Whatever a page shows in other states than those of the walk: literal paths begin with the prefix."""
    environment = _templates()
    names = list(environment.list_templates(extensions=["html"]))
    assert len(names) > 40
    extension = Addresses(environment)
    for name in names:
        assert environment.loader is not None
        source = extension.preprocess(environment.loader.get_source(environment, name)[0], name)
        source = _TRANSLATED.sub("", source)  # completed with the text itself: every page is walked above
        assert not re.findall(r"""\s(?:href|src|action|formaction|data-(?!into)[a-z]+)=["']/(?!/).*""", source), name
        assert not re.findall(r"""\s(?:href|src|action|formaction)=(?:'|"\{%|[^"'\s>]).*""", source), name


def test_no_script_makes_an_address_without_the_prefix() -> None:
    folder = Path(create_app.__code__.co_filename).parent / "web" / "static"
    scripts = list(folder.glob("*.js"))
    assert len(scripts) > 8
    for script in scripts:
        text = script.read_text(encoding="utf-8")
        pages = "studies|api|laboratory|livez|login|new|compare|schedules"
        assert not re.findall(rf"""[("'`]/(?:{pages})\b[^\n]*""", text), script


def test_headers_and_json_have_the_prefix(below: tuple[Service, OnlyBelow]) -> None:
    service, _ = below
    first = service.http.post("/api/v1/studies", json=json.loads(preset_text("one_pendulum")[1]))
    study = first.json()["id"]
    assert first.headers["location"] == f"{OWN}/api/v1/studies/{study}"
    links = first.json()["links"]
    assert links["page"] == f"{OWN}/studies/{study}"
    assert all(link.startswith(f"{OWN}/") for link in links.values())
    service.submit()
    listed = service.http.get("/api/v1/studies", params={"page_size": 1})
    assert listed.links["next"]["url"].startswith(f"{OWN}/api/v1/studies?")
    second = service.http.get(f"http://localhost{listed.links['next']['url']}")
    assert [found["id"] for found in second.json()["studies"]] == [study]
    case = service.http.get(f"/api/v1/studies/{study}/cases/0").json()
    assert all(link.startswith(f"{OWN}/api/v1/") for link in case["links"].values())
    assert service.http.get("/openapi.json").json()["servers"][0]["url"] == OWN
    assert service.http.get("http://localhost/livez").status_code == 200  # of health checks that do not pass the proxy
    assert service.http.get("").status_code == 200


def test_a_login_leads_back_and_its_cookie_is_for_the_prefix(
    settings: Settings, connect: Callable[..., httpx.Client]
) -> None:
    token = "a-token-of-the-tests"
    app = create_app(settings.model_copy(update={"url_prefix": OWN, "token": SecretStr(token)}))
    browser = connect(app, headers={"Accept": "text/html", "Origin": "http://localhost"})
    refused = browser.get(f"{OWN}/studies/st_0?x=1")
    assert refused.headers["location"] == f"{OWN}/login?next=/studies/st_0%3Fx%3D1"
    page = browser.get(refused.headers["location"])
    actions = [v for tag, name, v in attributes(page.text) if (tag, name) == ("form", "action")]
    assert all(action.startswith(f"{OWN}/") for action in actions)
    (action,) = [action for action in actions if action.endswith("/login")]
    entered = browser.post(action, data={"token": token, "next": "/nights"})
    assert (entered.status_code, entered.headers["location"]) == (303, f"{OWN}/nights")
    assert re.search(rf"; path={OWN}(;|$)", entered.headers["set-cookie"], re.IGNORECASE)
    assert browser.get(f"{OWN}/nights").status_code == 200
    kept = browser.get(f"{OWN}/me")
    assert kept.status_code == 200


def test_the_client_works_below_a_prefix(below: tuple[Service, OnlyBelow], portal: BlockingPortal) -> None:
    _, proxy = below
    transport = PortalTransport(proxy, portal)
    with Client(f"http://localhost{OWN}", transport=transport) as client:
        assert client.models()
    assert proxy.refused == []


def test_addresses_get_the_prefix_once() -> None:
    assert here("/studies") == "/studies"
    with knowing(prefix="/a/b"):
        assert [here(text) for text in ("/", "/x?y=/z", "/a/bc")] == ["/a/b/", "/a/b/x?y=/z", "/a/b/a/bc"]
        for as_it_is in ("/a/b", "/a/b?x", "/a/b/c", "x", "//h/x", "#x"):
            assert here(as_it_is) == as_it_is
        assert here("http://elsewhere/x") == "http://elsewhere/x"


@pytest.mark.parametrize("wrong", ["sprag", "/sprag/", "/", "//x", "/a b", "/ä", "/" + 200 * "x"])
def test_a_prefix_that_is_none_is_refused(wrong: str) -> None:
    with pytest.raises(ValidationError):
        Settings(url_prefix=wrong)


@pytest.mark.parametrize("wrong", ["/studies", "/api/v1", "/static/x"])
def test_a_prefix_that_is_an_address_of_the_service_is_refused(settings: Settings, wrong: str) -> None:
    with pytest.raises(UnsafeSettingsError, match="begins like an address of the service"):
        create_app(settings.model_copy(update={"url_prefix": wrong}))
