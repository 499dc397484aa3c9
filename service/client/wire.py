"""Common parts of all clients: addresses, timeouts, and the reading of answers."""

from __future__ import annotations

import re
import ssl
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from operator import index
from pathlib import Path
from typing import Any, BinaryIO, Final
from urllib.parse import quote

import httpx

from sprag_study.hosts import is_loopback
from sprag_study.service.client.errors import (
    ArgumentError,
    RefusedError,
    ServiceError,
    UnreachableError,
    UntrustedError,
)
from sprag_study.service.languages import N_
from sprag_study.service.plain_data import plain

#: Seconds without a byte after which an event stream is abandoned; the service sends one every 15 s.
SILENCE: Final = 30.0
API: Final = "/api/v1"
#: Addresses of the service that do not lie under its API.
_OUTSIDE: Final = frozenset({"/livez", "/readyz", "/metrics"})
#: Seconds to wait for an answer that is only read, and for one that the service computes: by its default settings it
#: ends a computation within ten minutes and says so.
TIMEOUT: Final = httpx.Timeout(60.0, connect=10.0)
COMPUTED: Final = httpx.Timeout(900.0, connect=10.0)
#: Writing a whole study can take minutes before its first byte arrives.
FILE_TIMEOUT: Final = httpx.Timeout(None, connect=10.0)
#: Formats of rows that are text, and how many of their lines are no rows: heads and ends.
LINES_WITHOUT_ROWS: Final[Mapping[str, int]] = {"csv": 1, "jsonl": 0, "json": 2}
#: Longest silence of an event stream.
EVENTS_TIMEOUT: Final = httpx.Timeout(SILENCE, connect=10.0)
#: A token after "Bearer" (RFC 6750, section 2.1).
_TOKEN: Final = re.compile(r"[A-Za-z0-9._~+/-]+=*")

Query = Sequence[tuple[str, str]]


def connection_options(server: str, token: str | None) -> dict[str, Any]:
    """Options of an httpx client of the service at ``server``.

    ValueError when that is not an HTTP address, or ``token``, without the white space around it, cannot be one.
    """
    try:
        url = httpx.URL(server)
    except httpx.InvalidURL as error:
        # The reason has a part of the password where a sign of it ends the host.
        why = "/, ? and # of a password are written %2F, %3F and %23" if "@" in server else error
        raise ValueError(f"{_without_user(server)!r} is not an address: {why}") from None
    if url.scheme not in ("http", "https") or not url.host:
        raise ValueError(f"{_without_user(server)!r} is not the address of a service, such as http://127.0.0.1:8000")
    secret = (token or "").strip()
    if secret and not _TOKEN.fullmatch(secret):  # the secret itself is in no message
        raise ValueError(N_("the token is not valid: it has only letters, digits and -._~+/ and may end with ="))
    headers = {"Authorization": f"Bearer {secret}"} if secret else {}
    options = {"base_url": public(server), "headers": headers, "timeout": TIMEOUT}
    # A proxy from the environment is never used for this machine itself.
    options |= {"trust_env": not is_loopback(url.host)}
    if url.userinfo:  # not in the address, which logs and errors show
        options["auth"] = (url.username, url.password)
    return options | ({"verify": _trusted()} if url.scheme == "https" else {})


def public(server: str) -> str:
    """The valid address of a service without user and password, for messages and pickles."""
    return re.sub(r"(?<=://)[^/?#]*@", "", server).rstrip("/")


def _without_user(server: str) -> str:
    """What is no address, up to its last @: a password may have any sign, and the scheme may be missing."""
    return re.sub(r"^(.*?://)?.*@", r"\1...@", server)


def _trusted() -> ssl.SSLContext:
    """Trust in what httpx trusts, in the authorities of this machine, and in that of ``SSL_CERT_FILE``.

    ValueError where that file, or the folder ``SSL_CERT_DIR``, cannot be read.
    """
    try:
        context = httpx.create_ssl_context()
        context.load_default_certs()
    except OSError as error:  # ssl.SSLError is one
        named = "the certificates that SSL_CERT_FILE or SSL_CERT_DIR names cannot be read"
        raise ValueError(f"{named}: {error}") from error
    return context


def within(seconds: float | None) -> httpx.Timeout:
    """`TIMEOUT`, limited to ``seconds`` where given, but at least one second."""
    return TIMEOUT if seconds is None else limited(min(seconds, TIMEOUT.read or seconds))


def limited(seconds: float) -> httpx.Timeout:
    """A limit for each part of a request, at least one second; for connecting no longer than usual."""
    seconds = max(seconds, 1.0)
    return httpx.Timeout(seconds, connect=min(seconds, TIMEOUT.connect or seconds))


def patience(method: str, path: str) -> httpx.Timeout:
    """How long to wait for an answer: specs are checked, and views of a study and its cases are computed."""
    return COMPUTED if method == "POST" or path.count("/") > 2 else TIMEOUT


def document(server: str, response: httpx.Response) -> dict[str, Any]:
    """The JSON object of an answer; RefusedError for a problem, UnreachableError for anything else."""
    if response.is_error:
        raise refusal(response)
    try:
        data = response.json()
    except ValueError:
        data = None
    if not isinstance(data, dict):
        raise UnreachableError(server, "the answer is not from Sprag")
    return data


def plain_body(data: object) -> Any:
    """The body of a request as plain JSON data; RefusedError, as the service would, where values have no form in it."""
    made, faults = plain(data)
    if not faults:
        return made
    errors = [
        {"pointer": fault.where, "code": fault.code, "message": fault.message, "value": fault.value}
        | ({} if fault.allowed is None else {"allowed": fault.allowed})
        for fault in faults
    ]
    problem = {
        "type": "/problems/invalid-spec",
        "title": "The study spec is not valid",
        "status": 422,
        "detail": "\n".join(map(str, faults)),
        "errors": errors,
    }
    raise RefusedError(422, problem)


def named(argument: str, value: object) -> str:
    """The id or name in an argument of a method; ArgumentError where it is none."""
    if not isinstance(value, str) or not value.strip():
        raise ArgumentError(argument, value, "an id or name")
    return value


def _quoted(argument: str, value: object) -> str:
    return quote(named(argument, value), safe="")


def study_path(study_id: str) -> str:
    """Address of a study under the API."""
    return f"/studies/{_quoted('study_id', study_id)}"


def address(path: str) -> str:
    """The address for a path under the API, or of the service's health and metrics."""
    return path if path in _OUTSIDE else API + path


def model_path(name: str) -> str:
    """Address of a model under the API."""
    return f"/models/{_quoted('name', name)}"


def preset_path(name: str) -> str:
    """Address of a study that comes with the service."""
    return f"/presets/{_quoted('name', name)}"


def case_path(study_id: str, case: int, part: str) -> str:
    """Address of a case under the API, or of a part of it, such as "/branch"; ArgumentError for no whole number."""
    try:
        number = -1 if isinstance(case, bool) else index(case)  # numbers of numpy are numbers too
    except TypeError:
        number = -1
    if number < 0:
        raise ArgumentError("case", case, "whole numbers from 0")
    return f"{study_path(study_id)}/cases/{number}{part}"


def component_path(component_id: str) -> str:
    """Address of a component."""
    return f"/components/{_quoted('component_id', component_id)}"


def view_path(view_id: str) -> str:
    """Address of a saved view under the API."""
    return f"/views/{_quoted('view_id', view_id)}"


def user_path(name: str) -> str:
    """Address of a user under the API."""
    return f"/users/{_quoted('name', name)}"


def token_path(token_id: str, action: str) -> str:
    """Address of what is done with a token under the API."""
    return f"/tokens/{_quoted('token_id', token_id)}{action}"


def schedule_path(schedule_id: str) -> str:
    """Address of a schedule under the API."""
    return f"/schedules/{_quoted('schedule_id', schedule_id)}"


def refusal(response: httpx.Response) -> ServiceError:
    """The error for an answer of status 400 or more."""
    try:
        problem = response.json()
    except ValueError:
        problem = None
    if not isinstance(problem, dict):
        problem = {"title": f"HTTP status {response.status_code} {response.reason_phrase}"}
    return RefusedError(response.status_code, problem)


def unanswered(server: str, error: httpx.HTTPError) -> UnreachableError:
    """The error for a request without an answer."""
    refused = _tls_error(error)
    if isinstance(refused, ssl.SSLCertVerificationError):
        return UntrustedError(server, refused.verify_message)
    if refused is not None:
        return UnreachableError(
            server, f"no TLS connection: {(refused.reason or 'it ended').lower().replace('_', ' ')}"
        )
    return UnreachableError(server, _reason(error))


def _tls_error(error: BaseException) -> ssl.SSLError | None:
    """The failure of TLS that caused an error."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, ssl.SSLError):
        cause = cause.__cause__ or cause.__context__
    return cause


def _reason(error: httpx.HTTPError) -> str:
    """Why there was no answer, in a few words."""
    if isinstance(error, httpx.ConnectError):
        return "cannot connect"
    if isinstance(error, httpx.TimeoutException):
        return "no answer in time"
    if isinstance(error, httpx.LocalProtocolError):  # its text has the headers, and with them the token
        return "the request has a header that HTTP does not allow"
    return str(error) or type(error).__name__


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A file that takes its name when it is complete; devices and pipes are written to as they are."""
    if path.exists() and not path.is_file():
        with path.open("wb") as file:
            yield file
        return
    part = path.with_name(f".{path.name[:100]}.{uuid.uuid4().hex}.part")
    try:
        with part.open("wb") as file:
            yield file
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
