"""The login at an OpenID provider: with a real one, and with one that lies."""

from __future__ import annotations

import html
import json
import re
import socket
import subprocess
import sys
import time
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterator
from hashlib import sha256
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import httpx
import pytest
from joserfc.jwk import OctKey, RSAKey
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from pydantic import SecretStr, ValidationError

from sprag_study.service.actor import Door, Role, act_as, of_machine
from sprag_study.service.http import access
from sprag_study.service.http import oidc as logins
from sprag_study.service.http.attempts import Attempts
from sprag_study.service.http.guard import SECURITY_HEADERS
from sprag_study.service.http.oidc import LOGIN_COOKIE, LOGIN_SECONDS
from sprag_study.service.settings import Settings, UnsafeSettingsError
from sprag_study.service.storage.people.accounts import Account
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.worker import traces
from tests.service.http.openid import CLIENT, Openid, openid
from tests.service.http.people import OWN, Office
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from tests.service.conftest import Service

RETURN = "/login/oidc/return"


@pytest.fixture
def provider() -> Iterator[Openid]:
    with openid() as started:
        yield started


@pytest.fixture
def opened(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], provider: Openid
) -> Callable[..., Office]:
    """An office whose people log in at the provider."""
    usual = {
        "oidc_issuer": provider.issuer, "oidc_client_id": CLIENT, "oidc_client_secret": SecretStr("s+e:cret"),
        "oidc_roles": ("cad=designer", "it=administrator"), "oidc_create": True,
    }  # fmt: skip
    return lambda **more: Office(settings, service, connect, **{**usual, **more})


def begun(browser: httpx.Client, wanted: str = "/") -> dict[str, str]:
    """What the service asks the provider for."""
    led = browser.get("/login/oidc", params={"next": wanted})
    assert led.status_code == 303, led.text
    return {name: values[0] for name, values in parse_qs(urlsplit(led.headers["location"]).query).items()}


def back(browser: httpx.Client, asked: dict[str, str], **more: str) -> httpx.Response:
    """Come back from the provider."""
    return browser.get(RETURN, params={"code": "c1", "state": asked["state"], **more})


def logged_in(browser: httpx.Client, provider: Openid, wanted: str = "/", **claims: Any) -> httpx.Response:
    """A whole login as the user of the claims."""
    asked = begun(browser, wanted)
    provider.claims = {"nonce": asked["nonce"], **claims}
    return back(browser, asked)


def login_cookie(asked: dict[str, str]) -> str:
    """Name of the cookie of a login."""
    return f"{LOGIN_COOKIE}{asked['state'][:12]}"


def logins_of(browser: httpx.Client) -> list[str]:
    """Names of the cookies of logins that a browser has."""
    return [name for name in browser.cookies if name.startswith(LOGIN_COOKIE)]


def no_login(answer: httpx.Response) -> str:
    """What the login page says to a browser that comes back without a login."""
    assert answer.status_code == 401
    return why(answer)


def test_codes_are_in_no_trace(opened: Callable[..., Office], provider: Openid) -> None:
    spans = InMemorySpanExporter()
    traces.start_with(SimpleSpanProcessor(spans))
    try:
        browser = opened().behind_proxy(**OWN, Accept="text/html")
        assert logged_in(browser, provider, preferred_username="eve", groups=["cad"]).status_code == 303
        assert back(browser, {"state": "another"}).status_code != 500
        browser.get("/api/v1/studies", params={"state": "running"})
    finally:
        traces.stop()
    queries = [str((span.attributes or {}).get("url.query", "")) for span in spans.get_finished_spans()]
    assert "state=running" in queries
    assert not any("code=" in query for query in queries), queries


def why(answer: httpx.Response) -> str:
    """What the login page says is wrong."""
    found = re.search(r'<p class="fault" role="alert">(.*?)</p>', answer.text)
    assert found, answer.text
    return html.unescape(found[1])


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


@pytest.mark.parametrize(
    "claims",
    [
        {"nonce": "another"}, {"nonce": None}, {"iss": "https://elsewhere.example"}, {"iss": None}, {"aud": "other"},
        {"aud": ["other", CLIENT]}, {"aud": [CLIENT], "azp": "other"}, {"exp": int(time.time()) - 3600}, {"exp": None},
        {"iat": int(time.time()) + 3600}, {"iat": None}, {"sub": None}, {"sub": ""}, {"at_hash": "wrong"},
        {"nbf": int(time.time()) + 3600},
    ],
)  # fmt: skip
def test_an_id_token_with_a_wrong_claim_lets_nobody_in(
    opened: Callable[..., Office], provider: Openid, claims: dict[str, Any]
) -> None:
    browser = opened().behind_proxy(**OWN, Accept="text/html")
    refused = logged_in(browser, provider, preferred_username="ada", groups=["it"], **claims)
    assert (refused.status_code, why(refused)) == (401, "What the provider says of you does not hold: try again.")
    assert access.COOKIE not in browser.cookies
    assert browser.get("/").status_code == 303


@pytest.mark.parametrize("forged", ["another key", "its key as a secret", "no signature"])
def test_a_forged_id_token_lets_nobody_in(opened: Callable[..., Office], provider: Openid, forged: str) -> None:
    browser = opened().behind_proxy(**OWN, Accept="text/html")
    if forged == "another key":
        provider.key = RSAKey.generate_key(2048, {"kid": "k1"})
    elif forged == "its key as a secret":
        provider.key = OctKey.import_key(json.dumps(provider.known.as_dict(private=False)).encode(), {"kid": "k1"})
        provider.header = {"alg": "HS256", "kid": "k1"}
    else:
        provider.key = None
    refused = logged_in(browser, provider, preferred_username="ada", groups=["it"])
    assert refused.status_code == 401
    assert access.COOKIE not in browser.cookies


def test_a_way_back_that_this_browser_did_not_begin_lets_nobody_in(
    opened: Callable[..., Office], provider: Openid
) -> None:
    office = opened()
    mallory, victim, fresh = (office.behind_proxy(**OWN, Accept="text/html") for _ in range(3))
    asked = begun(mallory)
    provider.claims = {"nonce": asked["nonce"], "preferred_username": "mallory", "groups": ["cad"]}
    # Into a browser that began none, and into one that began another: nothing is asked of the provider.
    assert "not begun in this browser" in no_login(back(fresh, asked))
    begun(victim)
    refused = back(victim, asked)
    assert (refused.status_code, "not begun in this browser" in why(refused)) == (401, True)
    for given in ({"state": ""}, {"state": "ü"}, {"code": ""}, {"iss": "https://elsewhere.example"}, {"error": "<b>"}):
        mine = begun(victim)
        assert back(victim, mine, **given).status_code == 401, given
        assert "state" in given or login_cookie(mine) not in victim.cookies
    assert provider.asked == []
    assert access.COOKIE not in victim.cookies
    # One that answers as it should comes back once: the cookie of the login is gone.
    assert back(mallory, asked, iss=provider.issuer).status_code == 303
    assert "not begun in this browser" in no_login(back(mallory, asked))


def test_a_code_that_was_used_is_refused(opened: Callable[..., Office], provider: Openid) -> None:
    office = opened()
    browser = office.behind_proxy(**OWN, Accept="text/html")
    asked = begun(browser)
    kept = browser.cookies[login_cookie(asked)]
    provider.claims = {"nonce": asked["nonce"], "preferred_username": "eve", "groups": ["cad"]}
    assert back(browser, asked).status_code == 303
    provider.status = 400
    browser.cookies.set(login_cookie(asked), kept)
    refused = back(browser, asked)
    assert (refused.status_code, why(refused)) == (401, "The provider did not let you in.")


def test_a_cookie_that_was_changed_or_is_old_begins_nothing(
    opened: Callable[..., Office], provider: Openid, monkeypatch: pytest.MonkeyPatch
) -> None:
    office = opened()
    browser = office.behind_proxy(**OWN, Accept="text/html")
    asked = begun(browser)
    named = login_cookie(asked)
    state, end, wanted, seal = browser.cookies[named].split(".")
    elsewhere = urlsafe_b64encode(b"https://evil.example").decode().rstrip("=")
    for changed in (
        f"{state}.{end}.{elsewhere}.{seal}", f"{state}.{int(end) + 1}.{wanted}.{seal}", f"{state}.{end}.{wanted}.", "x",
        f"ü.{end}.{wanted}.{seal}",
    ):  # fmt: skip
        answer = office.behind_proxy(**OWN, Cookie=f"{named}={changed}".encode()).get(
            RETURN, params={"code": "c1", "state": asked["state"]}
        )
        assert "not begun in this browser" in no_login(answer), changed
    # Nor is the one cookie the other, and a session that was changed is none.
    logged_in(browser, provider, preferred_username="eve", groups=["cad"])
    who, end, seal = browser.cookies[access.COOKIE].split(".")
    ada = "user-" + urlsafe_b64encode(b"ada").decode().rstrip("=")
    for session in (f"{ada}.{end}.{seal}", f"{who}.{int(end) + 9}.{seal}", f"{who}.{end}.{seal[:-1]}"):
        other = office.behind_proxy(**OWN, Accept="text/html", Cookie=f"{access.COOKIE}={session}")
        assert other.get("/").status_code == 303
    late = time.time() + LOGIN_SECONDS + 1
    asked = begun(browser, "/compare?study=a")
    with monkeypatch.context() as patch:
        patch.setattr(logins.time, "time", lambda: late)
        answer = back(browser, asked)
    assert "took longer than 10 minutes" in no_login(answer)
    assert "/login/oidc?next=%2Fcompare%3Fstudy%3Da" in answer.text  # where it was to lead
    end_of_session = time.time() + access.SESSION_SECONDS + 1
    with monkeypatch.context() as patch:
        patch.setattr(access.time, "time", lambda: end_of_session)
        assert browser.get("/").status_code == 303


@pytest.mark.parametrize(
    "wanted", ["https://evil.example", "//evil.example", "/\\evil.example", "javascript:alert(1)", "/" + "a" * 3000]
)
def test_a_login_leads_to_no_other_site(opened: Callable[..., Office], provider: Openid, wanted: str) -> None:
    browser = opened().behind_proxy(**OWN, Accept="text/html")
    answer = logged_in(browser, provider, wanted, preferred_username="eve", groups=["cad"])
    assert (answer.status_code, answer.headers["location"]) == (303, "/")


@pytest.mark.parametrize(
    "about",
    [
        {"issuer": "https://elsewhere.example"}, {"token_endpoint": "http://elsewhere.example/token"},
        {"jwks_uri": "file:///etc/passwd"}, {"authorization_endpoint": "javascript:alert(1)"},
        {"userinfo_endpoint": "http://10.0.0.1/"}, {"token_endpoint": None},
    ],
)  # fmt: skip
def test_a_provider_that_is_another_or_unsafe_is_not_used(
    opened: Callable[..., Office], provider: Openid, about: dict[str, Any]
) -> None:
    provider.about = about
    answer = opened().behind_proxy(**OWN, Accept="text/html").get("/login/oidc")
    assert (answer.status_code, "cannot be used now" in why(answer)) == (503, True)


def test_userinfo_has_what_the_id_token_leaves_out(opened: Callable[..., Office], provider: Openid) -> None:
    office = opened(oidc_groups_claim="realm.roles")
    browser = office.behind_proxy(**OWN, Accept="text/html")
    provider.userinfo = {"preferred_username": "eve", "realm": {"roles": ["cad"]}}
    assert logged_in(browser, provider).status_code == 303
    assert browser.get("/api/v1/me").json()["role"] == "designer"
    provider.userinfo = {"sub": "s2", "preferred_username": "ada", "realm": {"roles": ["it"]}}
    assert logged_in(browser, provider).status_code == 401


@pytest.mark.parametrize(
    "claims",
    [
        {}, {"email": "ada"}, {"email": "ada", "email_verified": "true"}, {"email": "a\nb", "email_verified": True},
        {"email": 7, "email_verified": True},
    ],
)  # fmt: skip
def test_a_name_that_is_none_or_not_verified_is_refused(
    opened: Callable[..., Office], provider: Openid, claims: dict[str, Any]
) -> None:
    browser = opened(oidc_name_claim="email").behind_proxy(**OWN, Accept="text/html")
    assert logged_in(browser, provider, groups=["it"], **claims).status_code == 401


@pytest.fixture
def believing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Users and tokens are read anew for each request."""
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Seconds for which failed attempts wait; none of them does."""
    waited: list[float] = []

    async def wait(self: Attempts, scope: object, place: str) -> None:
        waited.append(0.0)

    monkeypatch.setattr(Attempts, "failed", wait)
    return waited


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


def test_the_log_says_why_a_login_failed_and_counts_what_browsers_sent(
    opened: Callable[..., Office], provider: Openid, waits: list[float], caplog: pytest.LogCaptureFixture
) -> None:
    browser = opened(oidc_create=False).behind_proxy(**OWN, Accept="text/html")
    account = sha256(f"{provider.issuer}\ns1".encode()).hexdigest()[:12]
    refused = logged_in(browser, provider, preferred_username="nobody", groups=["cad"])
    assert (refused.status_code, waits) == (403, [])
    assert f"'nobody' (account {account}) from 127.0.0.1: nobody is not a user of this service" in caplog.text
    # An outage is no failed attempt, and the documented filter does not find it.
    asked = begun(browser)
    assert back(browser, asked, error="temporarily_unavailable").status_code == 503
    provider.status = 500
    assert (back(browser, begun(browser)).status_code, waits) == (503, [])
    provider.status = 400
    assert (back(browser, begun(browser)).status_code, len(waits)) == (401, 1)
    provider.status, provider.error = 400, "invalid_client"
    assert (back(browser, begun(browser)).status_code, len(waits)) == (503, 1)
    provider.status = 200
    assert logged_in(browser, provider, groups=["cad"]).status_code == 401
    assert f"(account {account}) from 127.0.0.1: The provider did not say who you are" in caplog.text
    assert "Failed login from" not in caplog.text  # which `Attempts.failed` says, that does nothing here


def test_failed_logins_are_slowed(
    opened: Callable[..., Office], provider: Openid, caplog: pytest.LogCaptureFixture
) -> None:
    office = opened()
    waited: list[float] = []

    async def sleep(seconds: float) -> None:
        waited.append(seconds)

    office.app.state.access.attempts = Attempts(sleep=sleep)
    browser = office.behind_proxy(**OWN, Accept="text/html")
    provider.status = 400
    for _ in range(2):
        assert back(browser, begun(browser)).status_code == 401
    assert waited == [0.25, 0.5]
    assert "Failed login from 127.0.0.1: page /login/oidc" in caplog.text


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


def test_pages_of_other_sites_begin_no_login(opened: Callable[..., Office], provider: Openid) -> None:
    office = opened()
    for site, mode, dest, status in (
        ("cross-site", "no-cors", "image", 403),
        ("same-site", "cors", "empty", 403),
        ("cross-site", "navigate", "iframe", 403),
        ("cross-site", "navigate", "document", 303),
        ("same-origin", "cors", "empty", 303),
    ):
        sent = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": mode, "Sec-Fetch-Dest": dest}
        answer = office.behind_proxy(Accept="text/html", **sent).get("/login/oidc")
        assert (answer.status_code, "set-cookie" in answer.headers) == (status, status == 303), sent


def test_a_browser_at_another_address_is_led_to_the_public_one(opened: Callable[..., Office], provider: Openid) -> None:
    browser = opened(public_url="http://127.0.0.1").behind_proxy(**OWN, Accept="text/html")
    led = browser.get("/login/oidc", params={"next": "/compare"})
    assert led.headers["location"] == "http://127.0.0.1/login/oidc?next=%2Fcompare&moved=true"
    there = browser.get("/login/oidc", headers={"Host": "127.0.0.1:80"})
    assert there.headers["location"].startswith(provider.issuer)


@pytest.mark.parametrize("broken", [{"kty": "RSA", "n": "x"}, {"kty": "EC", "crv": "P-1", "x": "", "y": ""}, 7, None])
def test_a_key_that_cannot_be_used_is_ignored(opened: Callable[..., Office], provider: Openid, broken: object) -> None:
    browser = opened().behind_proxy(**OWN, Accept="text/html")
    provider.keys = [broken, provider.known.as_dict(private=False)]
    assert logged_in(browser, provider, preferred_username="eve", groups=["cad"]).status_code == 303
    for keys in (None, [broken], "x"):
        provider.keys = keys
        assert logged_in(browser, provider, preferred_username="eve", groups=["cad"]).status_code == 503


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


@pytest.mark.parametrize(
    "wrong",
    [
        {"oidc_issuer": "http://login.example"}, {"oidc_issuer": "https://a@b.example"}, {"oidc_issuer": "ftp://x"},
        {"oidc_issuer": "https://login.example", "oidc_client_id": ""}, {"oidc_roles": "cad=boss"},
        {"oidc_roles": "=viewer"}, {"oidc_create": True}, {"oidc_scopes": "profile"},
    ],
)  # fmt: skip
def test_settings_that_would_not_do_are_refused(settings: Settings, wrong: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        Settings(**wrong)


def test_a_provider_makes_an_address_safe_that_others_can_reach(settings: Settings) -> None:
    with pytest.raises(UnsafeSettingsError):
        settings.model_copy(update={"host": "0.0.0.0"}).require_safe()
    Settings(host="0.0.0.0", oidc_issuer="https://login.example", oidc_client_id=CLIENT).require_safe()
    assert Settings(oidc_roles="a = designer, b=c=viewer").role_of(("b=c",)) == "viewer"


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
