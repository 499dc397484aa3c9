"""A real service and a real browser, as a designer has them."""

from __future__ import annotations

import copy
import json
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final
from urllib.parse import urlsplit

import httpx
import pytest
from playwright.sync_api import Browser, ConsoleMessage, Page, Request, expect, sync_playwright

from tests.acceptance.processes import SECONDS, service
from tests.service.conftest import Service
from tests.service.timed_spec import SPEC
from tests.serving import served

# Pages wait for processes that start, on a machine that is busy with other tests.
expect.set_options(timeout=1000 * SECONDS)

#: The first one draws the same without the windows, tabs and menus of a whole browser, at half the cost.
_NAMES = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_OPTIONS = ["--no-sandbox", "--disable-gpu", "--disable-software-rasterizer"]


@dataclass
class Office:
    """A running service, and a client of its interface to check what pages say."""

    address: str
    http: httpx.Client = field(repr=False)

    def submit(self, spec: dict[str, Any] | None = None, wait: bool = True, **changes: Any) -> str:
        """Submit the example with changes; its id, when it has ended."""
        answer = self.http.post("/api/v1/studies", json={**copy.deepcopy(SPEC if spec is None else spec), **changes})
        assert answer.status_code == 202, answer.text
        study_id = str(answer.json()["id"])
        if wait:
            self.wait(study_id)
        return study_id

    def wait(self, study_id: str, states: tuple[str, ...] = ("finished", "failed", "cancelled")) -> dict[str, Any]:
        """The study, once it is in one of ``states``: told by the service's own events."""
        limit = time.monotonic() + SECONDS
        with self.http.stream("GET", f"/api/v1/studies/{study_id}/events", timeout=SECONDS) as events:
            for line in events.iter_lines():
                assert time.monotonic() < limit
                if line.startswith("data:") and json.loads(line[5:])["state"] in states:
                    break
        return self.get(f"/studies/{study_id}")

    @cached_property
    def example(self) -> str:
        """The id of the example, which has ended."""
        return self.submit()

    def get(self, path: str, **params: Any) -> Any:
        """JSON of an address of the interface."""
        answer = self.http.get("/api/v1" + path, params=params)
        assert answer.status_code == 200, answer.text
        return answer.json()


@dataclass
class Visitor:
    """A tab of the browser, and what it asked of whom."""

    page: Page
    hosts: set[str] = field(default_factory=set)
    errors: list[str] = field(default_factory=list)

    def note_request(self, request: Request) -> None:
        """Remember the host of a request."""
        if not request.url.startswith(("data:", "blob:", "about:")):
            self.hosts.add(urlsplit(request.url).netloc)

    def note_message(self, message: ConsoleMessage) -> None:
        """Remember errors of scripts and of the policy; refused requests are told by the pages themselves."""
        if message.type == "error" and "Failed to load resource" not in message.text:
            self.errors.append(message.text)


@pytest.fixture(scope="session")
def chromium() -> str:
    """Path of the system's Chromium; the gate has one, a user's machine need not."""
    found = next((path for name in _NAMES if (path := shutil.which(name))), None)
    if found is None:
        if os.environ.get("CI", "").lower() == "true":
            pytest.fail(f"no Chromium on this machine (looked for {', '.join(_NAMES)}); .ci/run installs it")
        pytest.skip(f"needs Chromium: none of {', '.join(_NAMES)} is installed")
    return found


#: Drawings that move take a whole core while a test waits for something else.
STILL: Final[dict[str, Any]] = {"reduced_motion": "reduce"}
_BROWSER = pytest.StashKey[tuple[ExitStack, Browser]]()
_OFFICE = pytest.StashKey[tuple[ExitStack, Office]]()


@pytest.fixture(scope="module")
def browser(chromium: str, request: pytest.FixtureRequest) -> Browser:
    """A browser, which the files share that need one and follow each other."""
    stash = request.config.stash
    if _BROWSER not in stash:
        stack = ExitStack()
        request.config.add_cleanup(stack.close)
        playwright = stack.enter_context(sync_playwright())
        opened = playwright.chromium.launch(executable_path=chromium, args=_OPTIONS)
        stack.callback(opened.close)
        stash[_BROWSER] = stack, opened
    return stash[_BROWSER][1]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    """Close the browser and the service before a file that needs none.

    Beside the browser's event loop no other could run, and a service looks for work and files as long as it runs.
    """
    try:
        return (yield)
    finally:
        goes_on = nextitem is not None and (nextitem.path == item.path or "browser" in nextitem.fixturenames)
        for key in () if goes_on else (_BROWSER, _OFFICE):
            if key in item.config.stash:
                item.config.stash[key][0].close()
                del item.config.stash[key]


@pytest.fixture(scope="module")
def office(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Office:
    """A service with a database of its own, which the files share that need a browser and follow each other."""
    stash = request.config.stash
    if _OFFICE not in stash:
        stack = ExitStack()
        request.config.add_cleanup(stack.close)
        folder = tmp_path_factory.mktemp("office")
        started = stack.enter_context(service(folder, SPRAG_PROCESSES="1", SPRAG_CHECK_PROCESSES="1"))
        client = stack.enter_context(httpx.Client(base_url=started.address, timeout=SECONDS))
        stash[_OFFICE] = stack, Office(started.address, client)
    return stash[_OFFICE][1]


@pytest.fixture(scope="module")
def example(office: Office) -> str:
    """The example study, finished: two axes, nine cases."""
    return office.example


@contextmanager
def visit(page: Page, address: str) -> Iterator[Visitor]:
    """A visit of the service at an address, whose pages may not ask another host nor break a script."""
    found = Visitor(page)
    page.on("request", found.note_request)
    page.on("console", found.note_message)
    page.on("pageerror", lambda error: found.errors.append(str(error)))
    yield found
    page.context.close()
    assert found.hosts <= {urlsplit(address).netloc}
    assert found.errors == []


@pytest.fixture
def visitor(browser: Browser, office: Office, request: pytest.FixtureRequest) -> Iterator[Visitor]:
    """A visit at desktop width, or with the options that the test names."""
    options = {
        "viewport": {"width": 1280, "height": 900}, "accept_downloads": True, **STILL, **getattr(request, "param", {}),
    }  # fmt: skip
    context = browser.new_context(base_url=office.address, **options)
    context.set_default_timeout(1000 * SECONDS)
    with visit(context.new_page(), office.address) as found:
        yield found


@contextmanager
def online(service: Service, port: int = 0) -> Iterator[str]:
    """The address of a server of a service, which is asked by that alone meanwhile.

    An application with two event loops at once would not wake what waits in one of them.
    """
    before = service.http
    with served(service.app, port) as address, httpx.Client(base_url=address, timeout=SECONDS, trust_env=False) as http:
        service.http = http
        try:
            yield address
        finally:
            service.http = before


@pytest.fixture
def open_tab(service: Service, browser: Browser) -> Iterator[Callable[..., Page]]:
    """Opens a tab at the service of this test, in a context with the options of the call."""
    with online(service) as address, ExitStack() as contexts:

        def opened(**options: Any) -> Page:
            context = contexts.enter_context(browser.new_context(base_url=address, **STILL, **options))
            context.set_default_timeout(1000 * SECONDS)
            return context.new_page()

        yield opened
