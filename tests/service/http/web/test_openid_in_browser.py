"""The login at an OpenID provider in Chromium: the provider is another process, of another site."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import pytest
from playwright.sync_api import expect
from pydantic import SecretStr

from sprag_study.service.http.app import create_app
from sprag_study.service.storage.people.audit import AuditFilter
from tests.acceptance.processes import SECONDS
from tests.conftest import ROOT
from tests.service.http.openid import CLIENT
from tests.serving import served

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

PEOPLE = {"eve": ["cad"], "sam": ["sales"]}


@pytest.fixture
def issuer() -> Iterator[str]:
    """The issuer of a provider in a process of its own."""
    command = [sys.executable, "-m", "tests.service.http.openid", json.dumps(PEOPLE)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.stdin.close()


@pytest.fixture
def page(service: Service, settings: Settings, issuer: str, browser: Browser) -> Iterator[Page]:
    """A tab at a service whose people log in at the provider."""
    at: dict[str, Any] = {
        "oidc_issuer": issuer, "oidc_client_id": CLIENT, "oidc_client_secret": SecretStr("s+e:cret"),
        "oidc_roles": ("cad=designer",), "oidc_create": True,
    }  # fmt: skip
    app = create_app(
        settings.model_copy(update=at), store=service.store, computer=service.computer, checker=service.checker,
        writer=service.writer,
    )  # fmt: skip
    with served(app) as address, ExitStack() as ends:
        context = browser.new_context(base_url=address)
        ends.callback(context.close)
        context.set_default_timeout(1000 * SECONDS)
        yield context.new_page()


def test_somebody_logs_in_works_and_logs_out(page: Page, service: Service) -> None:
    page.goto("/compare?study=a")
    page.get_by_role("link", name="Log in at localhost").click()
    expect(page.get_by_role("heading", name="Who are you?")).to_be_visible()
    page.get_by_role("link", name="eve").click()
    page.wait_for_url("**/compare?study=a")
    names = {cookie["name"]: cookie for cookie in page.context.cookies()}
    assert all(cookie["httpOnly"] for cookie in names.values())
    assert not [name for name in names if name.startswith("sprag_login_")], "that of the login that has begun is gone"
    page.goto("/parts")
    page.goto("/me")
    expect(page.locator("main")).to_contain_text("eve")
    page.get_by_role("button", name="Log out").click()
    page.wait_for_url("**/login*")
    page.goto("/nights")
    expect(page.get_by_role("link", name="Log in at localhost")).to_be_visible()
    assert [row.action for row in service.store.audit.rows(AuditFilter(target="eve"))] == ["user.add"]


@pytest.mark.parametrize(("name", "why"), [("sam", "None of your groups may use"), ("nobody", "did not let you in")])
def test_somebody_without_a_role_is_told_why(page: Page, service: Service, name: str, why: str) -> None:
    page.goto("/")
    page.get_by_role("link", name="Log in at localhost").click()
    page.get_by_role("link", name=name).click()
    expect(page.get_by_role("alert")).to_contain_text(why)
    page.goto("/")
    expect(page.get_by_role("link", name="Log in at localhost")).to_be_visible()
    assert service.store.people.users() == ()
