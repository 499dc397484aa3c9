"""Logins at an OpenID provider: users, roles, sessions, accounts; with a provider of another process too."""

from __future__ import annotations

import re
import socket
import subprocess
import sys
import time
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterator
from hashlib import sha256
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from pydantic import SecretStr

from sprag_study.service.actor import Door, Role, act_as, of_machine
from sprag_study.service.http import access
from sprag_study.service.http.guard import SECURITY_HEADERS
from sprag_study.service.http.oidc import LOGIN_COOKIE
from sprag_study.service.settings import Settings
from sprag_study.service.storage.people.accounts import Account
from sprag_study.service.storage.people.audit import AuditFilter
from tests.service.http.openid import (
    CLIENT,
    RETURN,
    Openid,
    back,
    begun,
    logged_in,
    login_cookie,
    logins_of,
    why,
)
from tests.service.http.people import OWN, Office
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from tests.service.conftest import Service


def test_a_first_login_makes_a_user_with_the_role_of_the_groups(
    opened: Callable[..., Office], provider: Openid
) -> None:
    office = opened()
    browser = office.behind_proxy(**OWN, Accept="text/html")
    assert "Log in at 127.0.0.1" in browser.get("/login?next=/compare").text
    asked = begun(browser, "/compare?study=a")
    assert (asked["response_type"], asked["client_id"], asked["code_challenge_method"]) == ("code", CLIENT, "S256")
    assert asked["redirect_uri"] == f"http://localhost{RETURN}"
    provider.claims = {"nonce": asked["nonce"], "preferred_username": "eve@example.com", "groups": ["cad", "x"]}
    answer = back(browser, asked)
    assert (answer.status_code, answer.headers["location"]) == (303, "/compare?study=a")
    cookies = answer.headers.get_list("set-cookie")
    assert any(re.match(rf"{access.COOKIE}=[^;]+; HttpOnly; Max-Age=\d+; Path=/; SameSite=lax$", it) for it in cookies)
    assert any(cookie.startswith(f'{login_cookie(asked)}="";') for cookie in cookies)
    (sent,) = provider.asked
    challenge = urlsafe_b64encode(sha256(sent["code_verifier"].encode()).digest()).decode().rstrip("=")
    assert (challenge, sent["code"]) == (asked["code_challenge"], "c1")
    assert sent["authorization"] == httpx.BasicAuth(CLIENT, "s%2Be%3Acret")._auth_header
    assert "client_secret" not in sent
    me = browser.get("/api/v1/me").json()
    assert (me["user"], me["role"], me["token"]) == ("eve@example.com", "designer", None)
    assert browser.post("/api/v1/studies", json=SPEC).json()["owner"] == "eve@example.com"
    (row,) = office.store.audit.page(AuditFilter(action="user.add", actor="eve@example.com")).records
    assert (row.target, row.door, row.detail) == ("eve@example.com", "page", {"role": "designer", "login": True})
    # Tokens go on as they are, and pages of other sites change nothing by the session.
    assert office.program("dora").get("/api/v1/me").json()["user"] == "dora"
    assert browser.post("/me", data={}, headers={"Sec-Fetch-Site": "cross-site"}).status_code == 403
    assert SECURITY_HEADERS["Content-Security-Policy"] == answer.headers["content-security-policy"]


def test_logging_out_ends_the_session_and_every_copy_of_its_cookie(
    opened: Callable[..., Office], provider: Openid
) -> None:
    browser = opened().behind_proxy(**OWN, Accept="text/html")
    logged_in(browser, provider, preferred_username="eve", groups=["cad"])
    kept = browser.cookies[access.COOKIE]
    assert browser.get("/").status_code == 200
    assert browser.post("/logout").headers["location"] == "/login"
    assert browser.get("/").status_code == 303
    browser.cookies.set(access.COOKIE, kept)
    assert browser.get("/").status_code == 303


def test_groups_decide_at_each_login_and_without_one_nobody_comes_in(
    opened: Callable[..., Office], provider: Openid
) -> None:
    office = opened()
    browser = office.behind_proxy(**OWN, Accept="text/html")

    def role(groups: object) -> str:
        answer = logged_in(browser, provider, preferred_username="dora", groups=groups)
        assert answer.status_code == 303, why(answer)
        return str(browser.get("/api/v1/me").json()["role"])

    assert role("it") == "administrator"
    assert role(["cad", 7]) == "designer"
    changes = [row.detail for row in office.store.audit.page(AuditFilter(action="user.change")).records]
    assert changes == [
        {"changes": {"role": ["administrator", "designer"]}},
        {"login": True, "changes": {"role": ["designer", "administrator"]}},
    ]
    refused = logged_in(browser, provider, preferred_username="dora", groups=["sales"])
    assert (refused.status_code, why(refused)) == (403, "None of your groups may use this service.")
    everybody = Settings(oidc_roles="*=viewer,it=administrator").role_of
    assert (everybody(("sales",)), everybody(("it", "cad"))) == ("viewer", "administrator")


def test_a_listed_user_keeps_the_role_where_groups_decide_nothing(
    opened: Callable[..., Office], provider: Openid
) -> None:
    office = opened(oidc_roles=(), oidc_create=False)
    browser = office.behind_proxy(**OWN, Accept="text/html")
    assert logged_in(browser, provider, preferred_username="vera", groups=["it"]).status_code == 303
    assert browser.get("/api/v1/me").json()["role"] == "viewer"
    other = office.behind_proxy(**OWN, Accept="text/html")
    refused = logged_in(other, provider, sub="s2", preferred_username="nobody")
    assert refused.status_code == 403
    assert "nobody is not a user of this service" in why(refused)
    assert {user.name for user in office.store.people.users()} == {"ada", "dora", "vera"}


def test_a_user_is_one_account_and_a_removed_one_stays_out(
    opened: Callable[..., Office], provider: Openid, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)
    office = opened(oidc_create=False, oidc_roles=())
    people = office.store.people
    browser, other = (office.behind_proxy(**OWN, Accept="text/html") for _ in range(2))
    logged_in(browser, provider, preferred_username="dora")
    # Who takes her name at the provider is not her; she is, under whatever name.
    refused = logged_in(other, provider, sub="s2", preferred_username="dora")
    assert (refused.status_code, "Another account" in why(refused)) == (403, True)
    assert logged_in(browser, provider, preferred_username="ada").status_code == 303
    assert browser.get("/api/v1/me").json()["user"] == "dora"
    with act_as(of_machine(Door.COMMAND)):
        people.change_user("dora", removed=True)
    assert browser.get("/").status_code == 303
    assert browser.get("/api/v1/studies").status_code == 401
    refused = logged_in(browser, provider, preferred_username="dora")
    assert (refused.status_code, why(refused)) == (403, "The user dora was removed.")
    with act_as(of_machine(Door.COMMAND)):
        people.change_user("dora", removed=False)
    assert logged_in(other, provider, sub="s2", preferred_username="dora").status_code == 303


@pytest.mark.usefixtures("believing")
@pytest.mark.parametrize("again", [False, True])
def test_removing_a_user_ends_the_sessions_for_good(
    opened: Callable[..., Office], provider: Openid, again: bool
) -> None:
    office = opened()
    browser, other = (office.behind_proxy(**OWN, Accept="text/html") for _ in range(2))
    logged_in(browser, provider, preferred_username="dora", groups=["cad"])
    with act_as(of_machine(Door.COMMAND)):
        office.store.people.change_user("dora", removed=True)
        office.store.people.change_user("dora", removed=False)
    assert browser.get("/").status_code == 303
    # Nor does it go on when another account is the user now, or the same one.
    sub = "s1" if again else "s2"
    assert logged_in(other, provider, sub=sub, preferred_username="dora", groups=["cad"]).status_code == 303
    assert other.get("/").status_code == 200
    assert browser.get("/").status_code == 303


@pytest.mark.usefixtures("believing", "waits")
def test_who_has_no_group_any_more_loses_role_and_sessions(opened: Callable[..., Office], provider: Openid) -> None:
    office = opened()
    first, second, stranger = (office.behind_proxy(**OWN, Accept="text/html") for _ in range(3))
    logged_in(first, provider, preferred_username="dora", groups=["it"])
    assert first.get("/me/users").status_code == 200
    assert logged_in(second, provider, preferred_username="dora", groups=[]).status_code == 403
    assert first.get("/me/users").status_code == 303
    assert roles(office)["dora"] is Role.VIEWER
    (row, *_) = office.store.audit.page(AuditFilter(action="user.change", actor="dora")).records
    assert row.detail == {"sessions_ended": True, "changes": {"role": ["administrator", "viewer"]}}
    # Who only has the name of a user is not that user.
    logged_in(first, provider, sub="s3", preferred_username="ada", groups=["it"])
    assert logged_in(stranger, provider, sub="s4", preferred_username="ada", groups=[]).status_code == 403
    assert first.get("/me/users").status_code == 200


def roles(office: Office) -> dict[str, Role]:
    """Roles by user."""
    return {user.name: user.role for user in office.store.people.users()}


@pytest.mark.usefixtures("believing", "waits")
def test_the_last_administrator_keeps_the_role(
    opened: Callable[..., Office], provider: Openid, caplog: pytest.LogCaptureFixture
) -> None:
    office = opened()
    browser = office.behind_proxy(**OWN, Accept="text/html")
    assert logged_in(browser, provider, preferred_username="ada", groups=["cad"]).status_code == 303
    assert (browser.get("/me/users").status_code, roles(office)["ada"]) == (200, Role.ADMINISTRATOR)
    (row,) = office.store.audit.page(AuditFilter(action="user.change")).records
    assert (row.actor, row.detail) == (
        "ada",
        {"login": True, "role_kept": "administrator", "role_of_groups": "designer"},
    )
    assert "is the last administrator" in caplog.text
    assert logged_in(browser, provider, preferred_username="ada", groups=[]).status_code == 403
    assert (browser.get("/me/users").status_code, roles(office)["ada"]) == (303, Role.ADMINISTRATOR)
    with act_as(of_machine(Door.COMMAND)):
        office.store.people.change_user("dora", Role.ADMINISTRATOR)
    assert logged_in(browser, provider, preferred_username="ada", groups=["cad"]).status_code == 303
    assert roles(office)["ada"] is Role.DESIGNER


@pytest.mark.usefixtures("believing", "waits")
def test_an_account_of_another_issuer_takes_the_user_as_at_a_first_login(
    opened: Callable[..., Office], provider: Openid
) -> None:
    office = opened()
    browser, other = (office.behind_proxy(**OWN, Accept="text/html") for _ in range(2))
    before = Account("https://before.example", "0" * 64, "dora")
    office.store.people.sign_in(before, Role.DESIGNER, create=False)
    assert logged_in(browser, provider, preferred_username="dora", groups=["cad"]).status_code == 303
    assert browser.get("/").status_code == 200
    (row, *_) = office.store.audit.page(AuditFilter(action="user.change")).records
    assert (row.actor, row.detail) == ("dora", {"login": True, "changes": {"issuer": [before.issuer, provider.issuer]}})
    # The accounts of one issuer stay apart.
    assert logged_in(other, provider, sub="s2", preferred_username="dora", groups=["cad"]).status_code == 403


@pytest.mark.usefixtures("believing")
def test_the_user_acts_at_a_login_whatever_the_name_at_the_provider(
    opened: Callable[..., Office], provider: Openid
) -> None:
    office = opened()
    browser = office.behind_proxy(**OWN, Accept="text/html")
    logged_in(browser, provider, preferred_username="dora", groups=["cad"])
    logged_in(browser, provider, preferred_username="ada", groups=["it"])
    assert {row.actor for row in office.store.audit.page(AuditFilter(action="user.change", target="dora")).records} == {
        "dora"
    }


def test_two_tabs_log_in_and_a_browser_keeps_few_logins(opened: Callable[..., Office], provider: Openid) -> None:
    office = opened()
    browser = office.behind_proxy(**OWN, Accept="text/html")
    first, second = begun(browser, "/compare"), begun(browser)
    for asked, wanted in ((first, "/compare"), (second, "/")):
        provider.claims = {"nonce": asked["nonce"], "preferred_username": "eve", "groups": ["cad"]}
        assert back(browser, asked).headers["location"] == wanted
    assert logins_of(browser) == []
    for _ in range(8):
        latest = begun(browser)
    assert len(logins_of(browser)) == 5
    assert login_cookie(latest) in browser.cookies
    forged = f"{LOGIN_COOKIE}ü=1; {LOGIN_COOKIE}abcdefghijkl=1; {LOGIN_COOKIE}a@=1".encode()
    led = office.behind_proxy(**OWN, Cookie=forged).get("/login/oidc")
    gone = [cookie for cookie in led.headers.get_list("set-cookie") if '=""' in cookie]
    assert [cookie.partition("=")[0] for cookie in gone] == [f"{LOGIN_COOKIE}abcdefghijkl"]


def test_a_browser_at_another_address_is_led_to_the_public_one(opened: Callable[..., Office], provider: Openid) -> None:
    browser = opened(public_url="http://127.0.0.1").behind_proxy(**OWN, Accept="text/html")
    led = browser.get("/login/oidc", params={"next": "/compare"})
    assert led.headers["location"] == "http://127.0.0.1/login/oidc?next=%2Fcompare&moved=true"
    there = browser.get("/login/oidc", headers={"Host": "127.0.0.1:80"})
    assert there.headers["location"].startswith(provider.issuer)


def test_a_form_that_was_refused_is_sent_after_the_login_in_another_tab(
    opened: Callable[..., Office], provider: Openid
) -> None:
    browser = opened().behind_proxy(**OWN, Accept="text/html")
    refused = browser.post("/studies", data={"do": "archive", "name": "<x>"})
    assert refused.status_code == 401
    assert re.search(r'<a class="button" href="/login/oidc\?next=%2Fme" target="_blank" rel="noopener">', refused.text)
    form = re.search(r'<form method="post" action="/studies">(.*?)</form>', refused.text, re.DOTALL)
    assert form is not None
    assert 'name="name" value="&lt;x&gt;"' in form[1]


def test_without_the_settings_nothing_changes(office_without: Office) -> None:
    browser = office_without.behind_proxy(**OWN, Accept="text/html")
    assert "/login/oidc" not in browser.get("/login").text
    for path in ("/login/oidc", RETURN):
        assert browser.get(path).headers["location"] == "/login"
    # A session of a provider that is no longer set is none.
    assert office_without.app.state.provider is None


@pytest.fixture
def office_without(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Office:
    return Office(settings, service, connect)


def test_a_session_ends_with_the_settings_of_its_provider(
    opened: Callable[..., Office], provider: Openid, settings: Settings, service: Service,
    connect: Callable[..., httpx.Client],
) -> None:  # fmt: skip
    office = opened()
    browser = office.behind_proxy(**OWN, Accept="text/html")
    logged_in(browser, provider, preferred_username="eve", groups=["cad"])
    session = browser.cookies[access.COOKIE]
    for more in ({}, {"oidc_issuer": provider.issuer, "oidc_client_id": "other"}):
        from sprag_study.service.http.app import create_app

        app = create_app(settings.model_copy(update=more), store=service.store, computer=service.computer,
                         checker=service.checker)  # fmt: skip
        other = connect(app, headers={"Accept": "text/html", "Cookie": f"{access.COOKIE}={session}"})
        assert other.get("/").status_code == 303


def test_https_makes_the_cookies_secure_and_the_public_address_leads_back(
    opened: Callable[..., Office], provider: Openid
) -> None:
    office = opened(public_url="https://sprag.example", url_prefix="/sprag")
    browser = office.behind_proxy(**OWN, Accept="text/html", **{"X-Forwarded-Proto": "https"})
    # The cookie must be that of the public address; behind a proxy that replaces Host the login goes on.
    led = browser.get("/sprag/login/oidc", params={"next": "/compare"})
    assert led.headers["location"] == "https://sprag.example/sprag/login/oidc?next=%2Fcompare&moved=true"
    assert "set-cookie" not in led.headers
    led = browser.get("/sprag/login/oidc", params={"moved": "true"})
    assert parse_qs(urlsplit(led.headers["location"]).query)["redirect_uri"] == [f"https://sprag.example/sprag{RETURN}"]
    assert "; Secure" in led.headers["set-cookie"]
    assert "Path=/sprag/login/oidc;" in led.headers["set-cookie"]


@pytest.fixture
def mock() -> Iterator[str]:
    """The address of a provider of its own process, with three accounts."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    accounts = {
        "u1": {"preferred_username": "eve", "groups": ["cad"]},
        "u2": {"preferred_username": "ada", "groups": ["it"]},
        "u3": {"preferred_username": "sam", "groups": ["sales"]},
    }
    process = subprocess.Popen([sys.executable, "-m", "oidc_provider_mock", "--port", str(port)])
    address = f"http://localhost:{port}"
    try:
        with httpx.Client(base_url=address) as client:
            for _ in range(300):
                try:
                    client.get("/.well-known/openid-configuration")
                    break
                except httpx.ConnectError:
                    time.sleep(0.1)
            for sub, claims in accounts.items():
                assert client.put(f"/users/{sub}", json=claims).status_code == 204
        yield address
    finally:
        process.terminate()
        process.wait(600)


def test_people_log_in_at_a_real_provider(
    mock: str, settings: Settings, service: Service, connect: Callable[..., httpx.Client]
) -> None:
    office = Office(
        settings, service, connect, oidc_issuer=mock, oidc_client_id=CLIENT, oidc_client_secret=SecretStr("x" * 20),
        oidc_roles=("cad=designer", "it=administrator"), oidc_create=True,
    )  # fmt: skip

    def visit(subject: str, **form: str) -> tuple[httpx.Client, httpx.Response, str]:
        browser = office.behind_proxy(**OWN, Accept="text/html")
        led = browser.get("/login/oidc", params={"next": "/nights"}).headers["location"]
        given = httpx.post(led, data={"sub": subject, **form}, follow_redirects=False).headers["location"]
        assert given.startswith(f"http://localhost{RETURN}?")
        return browser, browser.get(given), given

    browser, answer, given = visit("u1")
    assert (answer.status_code, answer.headers["location"]) == (303, "/nights")
    assert browser.get("/nights").status_code == 200
    assert browser.get("/api/v1/me").json()["role"] == "designer"
    assert office.program("ada").get("/api/v1/me").json()["role"] == "administrator"
    # The code is worth nothing a second time, even with a copy of the cookie.
    other = office.behind_proxy(**OWN, Accept="text/html")
    led = other.get("/login/oidc").headers["location"]
    state = parse_qs(urlsplit(led).query)["state"][0]
    code = parse_qs(urlsplit(given).query)["code"][0]
    assert other.get(RETURN, params={"code": code, "state": state}).status_code == 401
    assert visit("u2")[0].get("/me/users").status_code == 200
    assert visit("u3")[1].status_code == 403
    assert visit("u1", action="deny")[1].status_code == 401
    assert {user.name: user.role for user in office.store.people.users()} == {
        "ada": Role.ADMINISTRATOR, "dora": Role.DESIGNER, "eve": Role.DESIGNER, "vera": Role.VIEWER,
    }  # fmt: skip
