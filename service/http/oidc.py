"""The login at an OpenID provider: authorization code with PKCE, state and nonce (OpenID Connect Core 1.0).

A login that has begun is a cookie of the browser: a state with the destination and an end, signed with the key of the
sessions. PKCE's verifier and the nonce are derived from the state with that key, so they leave the service only where
the protocol sends them, and any service of the database can end a login that another one began.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import logging
import re
import secrets
import time
from base64 import urlsafe_b64decode, urlsafe_b64encode
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote_plus, urlencode

from sprag_study.sentences import Sentence
from sprag_study.service.extras import naming_extra
from sprag_study.service.faults import FaultError
from sprag_study.service.http.problems import ApiError
from sprag_study.service.oidc import is_safe_address
from sprag_study.service.storage.people.accounts import Account
from sprag_study.service.storage.people.scopes import user_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    import httpx
    from joserfc.jwk import Key

    from sprag_study.service.actor import Role
    from sprag_study.service.settings import Settings

_LOG = logging.getLogger("sprag.access")

#: Each login that has begun has its cookie, so that several tabs can log in: this, and the beginning of the state.
LOGIN_COOKIE: Final = "sprag_login_"
_STATE_IN_NAME: Final = 12
_NAME: Final = re.compile(f"{LOGIN_COOKIE}[A-Za-z0-9_-]{{{_STATE_IN_NAME}}}")
#: Most logins that a browser keeps; the oldest ones go.
_MOST_LOGINS: Final = 5
#: Seconds in which somebody can log in at the provider.
LOGIN_SECONDS: Final = 600
#: Seconds for which the browser keeps the cookie: a login that took too long still knows where it was to lead.
COOKIE_SECONDS: Final = 3600
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
#: Errors by which the provider says that it cannot answer now (RFC 6749, section 4.1.2.1).
_OUTAGES: Final = ("server_error", "temporarily_unavailable")


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

    @property
    def cookie(self) -> str:
        """Name of its cookie."""
        return f"{LOGIN_COOKIE}{self.state[:_STATE_IN_NAME]}"

    @property
    def has_ended(self) -> bool:
        """Whether it took too long."""
        return time.time() >= self.end


class RefusedAccountError(ApiError):
    """What the provider says of an ``account`` lets nobody in."""

    def __init__(self, why: Sentence, account: Account) -> None:
        super().__init__("unauthorized", why)
        self.account = account


def begin(wanted: str) -> Login:
    """A new login that leads to ``wanted``."""
    state = secrets.token_urlsafe(32)
    return Login(state, wanted if len(wanted) <= _LONGEST else "/", int(time.time()) + LOGIN_SECONDS)


def cookie_of(login: Login, sealed: Callable[[str], str]) -> str:
    """The value of the cookie of a login; ``sealed`` signs a text."""
    return f"{login.text}.{sealed(f'login {login.text}')}"


def login_of(cookies: Mapping[str, str], state: str, sealed: Callable[[str], str]) -> Login | None:
    """The login of this ``state`` in the cookies, which may have ended; None where there is none."""
    return next((login for login in _logins(cookies, sealed) if login.state == state), None)


def surplus(cookies: Mapping[str, str], sealed: Callable[[str], str]) -> list[str]:
    """Names of the cookies that go when another login begins: forged ones, and the oldest ones."""
    latest = sorted(_logins(cookies, sealed), key=lambda login: login.end, reverse=True)
    kept = {login.cookie for login in latest[: _MOST_LOGINS - 1]}
    return [name for name in cookies if _NAME.fullmatch(name) and name not in kept]


def _logins(cookies: Mapping[str, str], sealed: Callable[[str], str]) -> Iterator[Login]:
    """Every login in the cookies."""
    for name, value in cookies.items():
        text, dot, seal = value.rpartition(".")
        if not _NAME.fullmatch(name) or not dot:
            continue
        if hmac.compare_digest(seal.encode("utf-8", "replace"), sealed(f"login {text}").encode()):
            state, end, wanted = text.split(".")
            padded = wanted + "=" * (-len(wanted) % 4)
            yield Login(state, urlsafe_b64decode(padded).decode(), int(end))


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

    async def account(self, login: Login, given: Mapping[str, str], back: str) -> tuple[Account, Role | None]:
        """Who logged in, from what the provider gave the browser, and the role, None where the groups give none.

        Raises ApiError: `unauthorized` where what the browser sent is refused, `unavailable` where the provider cannot
        be used.
        """
        about = await self._about()
        issuer = given.get("iss")
        required = about.get("authorization_response_iss_parameter_supported") is True
        if issuer != self._settings.oidc_issuer and (issuer is not None or required):
            raise _refused(Sentence("The answer is that of another provider."))
        if "error" in given or not given.get("code"):
            _LOG.warning("The OpenID provider refused a login: %.200r", given.get("error"))
            if given.get("error") in _OUTAGES:
                raise _unusable()
            raise _refused(Sentence("The provider did not let you in."))
        async with _client() as client:
            tokens = await self._tokens(client, about, login, given["code"], back)
            claims = await self._id_token(client, about, login, tokens)
            return self._account({**await self._further(client, about, claims, tokens), **claims})

    def _account(self, claims: Mapping[str, Any]) -> tuple[Account, Role | None]:
        settings = self._settings
        named = settings.oidc_name_claim
        subject = hashlib.sha256(f"{settings.oidc_issuer}\n{claims['sub']}".encode()).hexdigest()
        name = _claim(claims, named)
        account = Account(settings.oidc_issuer, subject, name if isinstance(name, str) else "")
        if not account.name:
            why = Sentence("The provider did not say who you are: there is no claim {claim}.", claim=named)
            raise RefusedAccountError(why, account)
        if named == "email" and claims.get("email_verified") is not True:
            why = Sentence("The provider has not verified the address in the claim {claim}.", claim=named)
            raise RefusedAccountError(why, account)
        try:
            user_name(account.name)
        except FaultError:
            why = Sentence("The claim {claim} is not the name of a user.", claim=named)
            raise RefusedAccountError(why, account) from None
        groups = _claim(claims, settings.oidc_groups_claim)
        listed = [groups] if isinstance(groups, str) else groups if isinstance(groups, list) else []
        return account, settings.role_of(tuple(group for group in listed if isinstance(group, str)))

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

        keys = _usable_keys(await _json(client, "GET", about["jwks_uri"]))
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
            token = jwt.decode(str(tokens.get("id_token", "")), KeySet(keys), registry=registry)
            claims = CodeIDToken(token.claims, token.header, options, params)
            claims.validate(leeway=_LEEWAY)
            if not (isinstance(claims["sub"], str) and claims["sub"]):
                raise ValueError("the subject is no text, or empty")
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
        further = await _json(client, "GET", about["userinfo_endpoint"], headers=bearer)
        if further.get("sub") != claims["sub"]:
            _LOG.warning("The userinfo of the OpenID provider is that of another account.")
            raise _refused(Sentence("What the provider says of you does not hold: try again."))
        return further


def _usable_keys(published: Mapping[str, Any]) -> list[Key]:
    """The keys that the provider signs with; those that cannot be used are left out (RFC 7517, section 5).

    Raises ApiError where there is none.
    """
    from joserfc.errors import JoseError
    from joserfc.jwk import JWKRegistry

    listed, keys = published.get("keys"), []
    for key in listed if isinstance(listed, list) else []:
        if not isinstance(key, dict) or key.get("kty") not in _KEY_TYPES or key.get("use") == "enc":
            continue
        try:
            keys.append(JWKRegistry.import_key(key))
        except (JoseError, ValueError, TypeError, KeyError) as error:
            _LOG.warning("A key of the OpenID provider cannot be used: %s: %s", type(error).__name__, error)
    if not keys:
        _LOG.error("The OpenID provider publishes no key that can be used.")
        raise _unusable()
    return keys


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
        async with asyncio.timeout(_TIMEOUT):  # httpx limits each read of an answer, not all of them together
            answer = await client.request(method, url, **sent)
        found = answer.json()
    except (httpx.HTTPError, httpx.InvalidURL, TimeoutError, ValueError) as error:
        _LOG.error("The OpenID provider cannot be used at %s: %s: %s", url, type(error).__name__, error)
        raise _unusable() from error
    reason = found.get("error") if isinstance(found, dict) else None
    if answer.status_code == 400 and reason == "invalid_grant":  # of a code: expired, used, or of somebody else
        _LOG.warning("The OpenID provider refused at %s: %.200r", url, reason)
        raise _refused(Sentence("The provider did not let you in."))
    if answer.status_code != 200 or not isinstance(found, dict):
        _LOG.error("The OpenID provider answered %s at %s: %.200r", answer.status_code, url, reason)
        raise _unusable()
    return found


def _refused(why: Sentence) -> ApiError:
    return ApiError("unauthorized", why)


def _unusable() -> ApiError:
    return ApiError("unavailable", Sentence("The provider cannot be used now; the log of the service says why."))
