"""An OpenID provider that says whatever a test wants, with real keys, on a port of this machine."""

from __future__ import annotations

import html
import json
import re
import sys
import threading
import time
from base64 import urlsafe_b64encode
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlencode, urlsplit

import httpx
from joserfc import jwt
from joserfc.jwk import OctKey, RSAKey

from sprag_study.service.http.oidc import LOGIN_COOKIE

CLIENT = "sprag"
RETURN = "/login/oidc/return"


@cache
def _known_key() -> RSAKey:
    """A key of a size that is accepted, which takes a quarter of a second to be found."""
    return RSAKey.generate_key(2048, {"kid": "k1"})


class Openid:
    """What the provider says; a test changes it.

    Attributes
    ----------
    about, claims : further metadata, and further claims of the ID token; a claim that is None is left out
    userinfo : claims of the userinfo
    header, key : of the signature; without a key there is none
    status, error : of the answer of the token endpoint
    keys : that it publishes
    asked : forms that were sent to the token endpoint
    pause : seconds between two bytes of an answer
    people : groups of those who can be chosen on its page, by name; a login has the claims of whoever was chosen
    """

    def __init__(self, port: int, host: str = "127.0.0.1") -> None:
        self.issuer = f"http://{host}:{port}"
        self.people: dict[str, list[str]] = {}
        self._nonce = ""
        self.known = _known_key()
        self.key: RSAKey | OctKey | None = self.known
        self.header: dict[str, str] = {"alg": "RS256", "kid": "k1"}
        self.about: dict[str, Any] = {}
        self.claims: dict[str, Any] = {}
        self.userinfo: dict[str, Any] = {}
        self.status, self.error = 200, "invalid_grant"
        self.keys: object = [self.known.as_dict(private=False)]
        self.asked: list[dict[str, str]] = []
        self.pause = 0.0

    def metadata(self) -> dict[str, Any]:
        """The metadata."""
        names = {"authorization_endpoint": "authorize", "token_endpoint": "token", "jwks_uri": "keys"}
        found = {name: f"{self.issuer}/{path}" for name, path in (names | {"userinfo_endpoint": "userinfo"}).items()}
        return {"issuer": self.issuer, **found, **self.about}

    def tokens(self) -> dict[str, Any]:
        """The tokens for a code."""
        now = int(time.time())
        claims = {"iss": self.issuer, "aud": CLIENT, "sub": "s1", "iat": now, "exp": now + 60, **self.claims}
        kept = {name: value for name, value in claims.items() if value is not None}
        given = {"access_token": "a1", "token_type": "Bearer"}
        if self.key is None:
            parts = (json.dumps(part).encode() for part in ({"alg": "none"}, kept))
            return {
                **given,
                "id_token": ".".join([*(urlsafe_b64encode(part).decode().rstrip("=") for part in parts), ""]),
            }
        return {**given, "id_token": jwt.encode(self.header, kept, self.key, algorithms=["RS256", "HS256"])}

    def page(self, asked: dict[str, str]) -> str:
        """The page on which somebody says who it is, or does not."""
        self._nonce = asked["nonce"]
        back = f"{asked['redirect_uri']}?{urlencode({'state': asked['state']})}"
        ways = {**{name: {"code": name} for name in self.people}, "nobody": {"error": "access_denied"}}
        links = (f'<p><a href="{html.escape(f"{back}&{urlencode(more)}")}">{name}</a>' for name, more in ways.items())
        return f"<!doctype html><title>Provider</title><h1>Who are you?</h1>{''.join(links)}"

    def chosen(self, code: str) -> None:
        """Answer with the claims of whoever the code is of, where people can be chosen."""
        if code in self.people:
            self.claims = {"nonce": self._nonce, "sub": code, "preferred_username": code, "groups": self.people[code]}

    def answer(self, path: str) -> tuple[int, Any]:
        """Status and content for a path; a page is a text."""
        match path.partition("?")[0]:
            case "/authorize":
                return 200, self.page({name: values[0] for name, values in parse_qs(urlsplit(path).query).items()})
            case "/.well-known/openid-configuration":
                return 200, self.metadata()
            case "/keys":
                return 200, {"keys": self.keys}
            case "/token":
                return self.status, self.tokens() if self.status == 200 else {"error": self.error}
            case "/userinfo":
                return 200, {"sub": "s1", **self.userinfo}
        return 404, {}


@contextmanager
def openid(host: str = "127.0.0.1") -> Iterator[Openid]:
    """A provider that answers until the end of the block; ``host`` is the name of this machine in its addresses."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self._say()

        def do_POST(self) -> None:
            sent = self.rfile.read(int(self.headers["Content-Length"])).decode()
            form = {name: values[0] for name, values in parse_qs(sent).items()}
            provider.chosen(form.get("code", ""))
            provider.asked.append({**form, "authorization": self.headers.get("Authorization", "")})
            self._say()

        def _say(self) -> None:
            status, content = provider.answer(self.path)
            is_page = isinstance(content, str)
            body = (content if is_page else json.dumps(content)).encode()
            self.send_response(status)
            self.send_header("Content-Type", "text/html; charset=utf-8" if is_page else "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            if not provider.pause:
                self.wfile.write(body)
                return
            with suppress(OSError):  # nobody reads it any more
                for byte in body:
                    self.wfile.write(bytes([byte]))
                    time.sleep(provider.pause)

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    provider = Openid(server.server_port, host)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
    thread.start()
    try:
        yield provider
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


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


def why(answer: httpx.Response) -> str:
    """What the login page says is wrong."""
    found = re.search(r'<p class="fault" role="alert">(.*?)</p>', answer.text)
    assert found, answer.text
    return html.unescape(found[1])


def main() -> None:
    """A provider of the people in the first argument, JSON; prints its issuer, and ends with its standard input."""
    with openid("localhost") as provider:
        provider.people = json.loads(sys.argv[1])
        print(provider.issuer, flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main()
