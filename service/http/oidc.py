"""The login at an OpenID provider: authorization code with PKCE, state and nonce (OpenID Connect Core 1.0).

A login that has begun is a cookie of the browser: a state with the destination and an end, signed with the key of the
sessions. PKCE's verifier and the nonce are derived from the state with that key, so they leave the service only where
the protocol sends them, and any service of the database can end a login that another one began.
"""

from __future__ import annotations

import hashlib
import hmac
import logging
import secrets
import time
from base64 import urlsafe_b64decode, urlsafe_b64encode
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote_plus, urlencode

from sprag_study.sentences import Sentence
from sprag_study.service.actor import Role
from sprag_study.service.extras import naming_extra
from sprag_study.service.faults import FaultError
from sprag_study.service.http.problems import ApiError
from sprag_study.service.oidc import is_safe_address
from sprag_study.service.storage.people.scopes import user_name

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import httpx

    from sprag_study.service.settings import Settings

_LOG = logging.getLogger("sprag.access")

LOGIN_COOKIE: Final = "sprag_login"
#: Seconds in which somebody can log in at the provider.
LOGIN_SECONDS: Final = 600
#: Seconds for which the addresses of the provider are kept, and for each of its answers.
_KEPT_SECONDS: Final = 3600.0
_TIMEOUT: Final = 10.0
#: Seconds by which the clocks of the provider and of this machine may differ.
_LEEWAY: Final = 60
#: Longest destination that a cookie keeps, which has 4096 bytes altogether.
_LONGEST: Final = 1500
#: Signatures by a key that only the provider has.
_ALGORITHMS: Final = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512")
_KEY_TYPES: Final = ("RSA", "EC")


@dataclass(frozen=True, slots=True)
class Login:
    """A login that has begun: its state, its destination, and its end (s since 1970)."""

    state: str
    wanted: str
    end: int

    @property
    def text(self) -> str:
        """What its cookie has, apart from the signature."""
        return f"{self.state}.{self.end}.{urlsafe_b64encode(self.wanted.encode()).decode().rstrip('=')}"


@dataclass(frozen=True, slots=True)
class Account:
    """Who logged in: digest of issuer and subject, name of the user, and the role, None where groups give none."""

    subject: str
    name: str
    role: Role | None


def begin(wanted: str) -> Login:
    """A new login that leads to ``wanted``."""
    state = secrets.token_urlsafe(32)
    return Login(state, wanted if len(wanted) <= _LONGEST else "/", int(time.time()) + LOGIN_SECONDS)


def cookie_of(login: Login, sealed: Callable[[str], str]) -> str:
    """The value of the cookie of a login; ``sealed`` signs a text."""
    return f"{login.text}.{sealed(f'login {login.text}')}"


def login_of(cookies: Mapping[str, str], sealed: Callable[[str], str]) -> Login | None:
    """The login in the cookies; None where there is none, or it has ended."""
    text, dot, seal = cookies.get(LOGIN_COOKIE, "").rpartition(".")
    if not dot or not hmac.compare_digest(seal.encode("utf-8", "replace"), sealed(f"login {text}").encode()):
        return None
    state, end, wanted = text.split(".")
    padded = wanted + "=" * (-len(wanted) % 4)
    login = Login(state, urlsafe_b64decode(padded).decode(), int(end))
    return login if time.time() < login.end else None


class Provider:
    """The OpenID provider of a service. For one event loop.

    Parameters
    ----------
    settings : Settings
        `oidc_issuer` and the settings beside it.
    sealed : function
        Signs a text with the key of the sessions.

    Raises MissingExtraError where authlib is not installed.
    """

    def __init__(self, settings: Settings, sealed: Callable[[str], str]) -> None:
        with naming_extra("SPRAG_OIDC_ISSUER", "oidc"):
            import authlib.oidc.core  # noqa: F401 - is there, or the service does not start
        self._settings = settings
        self._sealed = sealed
        self._known: dict[str, Any] = {}
        self._known_until = 0.0

    async def address(self, login: Login, back: str) -> str:
        """The address at the provider where the login goes on, and which leads ``back``; raises ApiError."""
        from authlib.oauth2.rfc7636 import create_s256_code_challenge

        about = await self._about()
        asked = {
            "response_type": "code",
            "client_id": self._settings.oidc_client_id,
            "redirect_uri": back,
            "scope": self._settings.oidc_scopes,
            "state": login.state,
            "nonce": self._derived("nonce", login),
            "code_challenge": create_s256_code_challenge(self._derived("verifier", login)),
            "code_challenge_method": "S256",
        }
        address = str(about["authorization_endpoint"])
        return f"{address}{'&' if '?' in address else '?'}{urlencode(asked)}"

    async def account(self, login: Login, given: Mapping[str, str], back: str) -> Account:
        """Who logged in, from what the provider gave the browser; raises ApiError."""
        if not hmac.compare_digest(given.get("state", "").encode(), login.state.encode()):
            raise _refused(
                Sentence("This login was not begun in this browser, or another one was begun since: try again.")
            )
        about = await self._about()
        issuer = given.get("iss")
        required = about.get("authorization_response_iss_parameter_supported") is True
        if issuer != self._settings.oidc_issuer and (issuer is not None or required):
            raise _refused(Sentence("The answer is that of another provider."))
        if "error" in given or not given.get("code"):
            _LOG.warning("The OpenID provider refused a login: %.200r", given.get("error"))
            raise _refused(Sentence("The provider did not let you in."))
        async with _client() as client:
            tokens = await self._tokens(client, about, login, given["code"], back)
            claims = await self._id_token(client, about, login, tokens)
            return self._account({**await self._further(client, about, claims, tokens), **claims})

    def _account(self, claims: Mapping[str, Any]) -> Account:
        settings = self._settings
        named = settings.oidc_name_claim
        name = _claim(claims, named)
        if not isinstance(name, str) or not name:
            raise _refused(Sentence("The provider did not say who you are: there is no claim {claim}.", claim=named))
        if named == "email" and claims.get("email_verified") is not True:
            raise _refused(Sentence("The provider has not verified the address in the claim {claim}.", claim=named))
        try:
            user_name(name)
        except FaultError:
            raise _refused(Sentence("The claim {claim} is not the name of a user.", claim=named)) from None
        groups = _claim(claims, settings.oidc_groups_claim)
        listed = [groups] if isinstance(groups, str) else groups if isinstance(groups, list) else []
        role = settings.role_of(tuple(group for group in listed if isinstance(group, str)))
        if settings.oidc_roles and role is None:
            raise ApiError("not-allowed", Sentence("None of your groups may use this service."))
        subject = hashlib.sha256(f"{settings.oidc_issuer}\n{claims['sub']}".encode()).hexdigest()
        return Account(subject, name, None if role is None else Role(role))

    def _derived(self, purpose: str, login: Login) -> str:
        return self._sealed(f"login {purpose} {login.state}")

    async def _about(self) -> dict[str, Any]:
        """The metadata of the provider, whose addresses are safe."""
        if time.monotonic() < self._known_until:
            return self._known
        issuer = self._settings.oidc_issuer
        async with _client() as client:
            about = await _json(client, "GET", f"{issuer.rstrip('/')}/.well-known/openid-configuration")
        needed = ("authorization_endpoint", "token_endpoint", "jwks_uri")
        further = [name for name in ("userinfo_endpoint",) if name in about]
        wrong = [name for name in (*needed, *further) if not is_safe_address(str(about.get(name, "")))]
        if about.get("issuer") != issuer or wrong:
            _LOG.error(
                "The OpenID provider %s describes itself as %.200r; unsafe: %s", issuer, about.get("issuer"), wrong
            )
            raise _unusable()
        self._known, self._known_until = about, time.monotonic() + _KEPT_SECONDS
        return about

    async def _tokens(
        self, client: httpx.AsyncClient, about: Mapping[str, Any], login: Login, code: str, back: str
    ) -> dict[str, Any]:
        """What the provider gives for the code."""
        settings, headers = self._settings, {"Accept": "application/json"}
        form = {
            "grant_type": "authorization_code",
            "code": code,
            "redirect_uri": back,
            "code_verifier": self._derived("verifier", login),
            "client_id": settings.oidc_client_id,
        }
        if settings.oidc_client_secret is not None:
            secret = settings.oidc_client_secret.get_secret_value()
            if "client_secret_basic" in about.get("token_endpoint_auth_methods_supported", ["client_secret_basic"]):
                auth = quote_plus(settings.oidc_client_id), quote_plus(secret)
                return await _json(client, "POST", about["token_endpoint"], data=form, headers=headers, auth=auth)
            form["client_secret"] = secret
        return await _json(client, "POST", about["token_endpoint"], data=form, headers=headers)

    async def _id_token(
        self, client: httpx.AsyncClient, about: Mapping[str, Any], login: Login, tokens: Mapping[str, Any]
    ) -> dict[str, Any]:
        """The claims of the ID token, whose signature and claims hold."""
        from authlib.oidc.core import CodeIDToken
        from joserfc import jwt
        from joserfc.errors import JoseError
        from joserfc.jwk import KeySet
        from joserfc.jws import JWSRegistry

        published = await _json(client, "GET", about["jwks_uri"])
        keys = [key for key in published.get("keys", []) if key.get("kty") in _KEY_TYPES and key.get("use") != "enc"]
        params = {
            "nonce": self._derived("nonce", login),
            "client_id": self._settings.oidc_client_id,
            "access_token": tokens.get("access_token"),
        }
        options = {
            "iss": {"essential": True, "value": self._settings.oidc_issuer},
            "aud": {"essential": True, "value": self._settings.oidc_client_id},
        }
        try:
            registry = JWSRegistry(algorithms=list(_ALGORITHMS), strict_check_header=False)
            token = jwt.decode(
                str(tokens.get("id_token", "")), KeySet.import_key_set({"keys": keys}), registry=registry
            )
            claims = CodeIDToken(token.claims, token.header, options, params)
            claims.validate(leeway=_LEEWAY)
        except (JoseError, ValueError, TypeError, KeyError) as error:
            _LOG.warning("An ID token of the OpenID provider does not hold: %s: %s", type(error).__name__, error)
            raise _refused(Sentence("What the provider says of you does not hold: try again.")) from error
        return dict(claims)

    async def _further(
        self,
        client: httpx.AsyncClient,
        about: Mapping[str, Any],
        claims: Mapping[str, Any],
        tokens: Mapping[str, Any],
    ) -> dict[str, Any]:
        """Claims that only the provider's userinfo has; none where the ID token has what is needed."""
        settings = self._settings
        wanted = (settings.oidc_name_claim, *([settings.oidc_groups_claim] if settings.oidc_roles else []))
        if "userinfo_endpoint" not in about or all(_claim(claims, name) is not None for name in wanted):
            return {}
        bearer = {"Authorization": f"Bearer {tokens.get('access_token')}"}
        found = await _json(client, "GET", about["userinfo_endpoint"], headers=bearer)
        if found.get("sub") != claims["sub"]:
            raise _refused(Sentence("What the provider says of you does not hold: try again."))
        return found


def _client() -> httpx.AsyncClient:
    import httpx  # a service without a provider does not need it

    return httpx.AsyncClient(timeout=_TIMEOUT, follow_redirects=False)


def _claim(claims: Mapping[str, Any], name: str) -> Any:
    """The value of a claim, whose name may lead into objects; None where there is none."""
    if name in claims:
        return claims[name]
    value: Any = claims
    for part in name.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return value


async def _json(client: httpx.AsyncClient, method: str, url: str, **sent: Any) -> dict[str, Any]:
    """The object with which the provider answers; raises ApiError."""
    import httpx

    try:
        answer = await client.request(method, url, **sent)
        found = answer.json()
    except (httpx.HTTPError, httpx.InvalidURL, ValueError) as error:
        _LOG.error("The OpenID provider cannot be used at %s: %s: %s", url, type(error).__name__, error)
        raise _unusable() from error
    if answer.status_code == 400 and isinstance(found, dict):  # of a code: expired, used, or of somebody else
        _LOG.warning("The OpenID provider refused at %s: %.200r", url, found.get("error"))
        raise _refused(Sentence("The provider did not let you in."))
    if answer.status_code != 200 or not isinstance(found, dict):
        _LOG.error("The OpenID provider answered %s at %s", answer.status_code, url)
        raise _unusable()
    return found


def _refused(why: Sentence) -> ApiError:
    return ApiError("unauthorized", why)


def _unusable() -> ApiError:
    return ApiError("unavailable", Sentence("The provider cannot be used now; the log of the service says why."))
