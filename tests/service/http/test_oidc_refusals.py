"""What lets nobody in by an OpenID provider: forged, used, changed and foreign answers, unsafe settings."""

from __future__ import annotations

import json
import time
from base64 import urlsafe_b64encode
from collections.abc import Callable
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import pytest
from joserfc.jwk import OctKey, RSAKey
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter
from pydantic import ValidationError

from sprag_study.service.http import access
from sprag_study.service.http import oidc as logins
from sprag_study.service.http.attempts import Attempts
from sprag_study.service.http.oidc import LOGIN_SECONDS
from sprag_study.service.settings import Settings, UnsafeSettingsError
from sprag_study.worker import traces
from tests.service.http.openid import (
    CLIENT,
    RETURN,
    Openid,
    back,
    begun,
    logged_in,
    login_cookie,
    no_login,
    why,
)
from tests.service.http.people import OWN, Office

if TYPE_CHECKING:
    pass


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


def test_an_answer_that_comes_byte_by_byte_is_not_waited_for(
    opened: Callable[..., Office], provider: Openid, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(logins, "_TIMEOUT", 0.5)
    provider.pause = 0.02
    answer = opened().behind_proxy(**OWN, Accept="text/html").get("/login/oidc")
    assert (answer.status_code, "cannot be used now" in why(answer)) == (503, True)
    assert "openid-configuration: TimeoutError" in caplog.text


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


@pytest.mark.parametrize("broken", [{"kty": "RSA", "n": "x"}, {"kty": "EC", "crv": "P-1", "x": "", "y": ""}, 7, None])
def test_a_key_that_cannot_be_used_is_ignored(opened: Callable[..., Office], provider: Openid, broken: object) -> None:
    browser = opened().behind_proxy(**OWN, Accept="text/html")
    provider.keys = [broken, provider.known.as_dict(private=False)]
    assert logged_in(browser, provider, preferred_username="eve", groups=["cad"]).status_code == 303
    for keys in (None, [broken], "x"):
        provider.keys = keys
        assert logged_in(browser, provider, preferred_username="eve", groups=["cad"]).status_code == 503


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
