"""The service over HTTP, as a Python program uses it: plain JSON data in and out, two kinds of failure.

``UnreachableError`` means nobody answered at the address; ``RefusedError`` carries the service's problem document.
"""

from __future__ import annotations

import ipaddress
import uuid
from collections.abc import Iterator, Mapping, Sequence
from typing import Any
from urllib.parse import quote

import httpx

_API = "/api/v1"
#: Seconds to wait for an answer; curves of a large study are read from disk first.
_TIMEOUT = httpx.Timeout(60.0, connect=10.0)
#: A whole study may take minutes to be written before its first byte comes.
_FILE_TIMEOUT = httpx.Timeout(None, connect=10.0)

Query = Sequence[tuple[str, str]]


class ServiceError(Exception):
    """The service did not do what it was asked to."""


class UnreachableError(ServiceError):
    """Nobody answered, or what answered is not the service. ``address`` is what was asked."""

    def __init__(self, address: str, reason: str) -> None:
        super().__init__(f"{address}: {reason}")
        self.address = address
        self.reason = reason


class RefusedError(ServiceError):
    """The service answered with an error.

    Attributes
    ----------
    status : int
        HTTP status.
    problem : dict
        The problem document (RFC 9457): title, detail, and for wrong input ``errors``.
    """

    def __init__(self, status: int, problem: Mapping[str, Any]) -> None:
        self.status = status
        self.problem = dict(problem)
        super().__init__(str(self.problem.get("detail") or self.problem.get("title") or f"HTTP status {status}"))

    @property
    def errors(self) -> list[dict[str, Any]]:
        """The problems of the input, each with pointer, message, value and allowed range where known."""
        found = self.problem.get("errors")
        return [dict(error) for error in found if isinstance(error, Mapping)] if isinstance(found, list) else []


class ServiceClient:
    """A connection to a running service. Use it as a context manager.

    Parameters
    ----------
    server : str
        Address such as "http://127.0.0.1:8000".
    token : str, optional
        Sent as a bearer token.

    Raises
    ------
    ValueError
        When ``server`` is no http address.
    """

    def __init__(self, server: str, token: str | None = None) -> None:
        self.server = server.rstrip("/")
        try:
            url = httpx.URL(self.server)
        except httpx.InvalidURL as error:
            raise ValueError(f"{server!r} is no address: {error}") from error
        if url.scheme not in ("http", "https") or not url.host:
            raise ValueError(f"{server!r} is no address of a service, such as http://127.0.0.1:8000")
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        # A proxy of the environment never leads to this machine itself.
        self._http = httpx.Client(
            base_url=self.server, headers=headers, timeout=_TIMEOUT, trust_env=not _is_loopback(url.host)
        )

    def __enter__(self) -> ServiceClient:
        return self

    def __exit__(self, *_: object) -> None:
        self._http.close()

    def create_study(
        self, spec: object, key: str | None = None, priority: int = 0, fresh: bool = False
    ) -> dict[str, Any]:
        """Submit a study; the same ``key`` submits it once, however often it is sent.

        Of a ``fresh`` study every case is run, also those that other studies have already.
        """
        headers = {"Idempotency-Key": key or uuid.uuid4().hex}
        query = [("priority", str(priority))] if priority else []
        query += [("fresh", "true")] if fresh else []
        return self._json("POST", "/studies", json=spec, headers=headers, params=query)

    def extend(self, study_id: str, addition: object) -> dict[str, Any]:
        """Submit a study with more values on the axes of an old one (``axes``), or more cases (``cases``)."""
        return self._json("POST", f"{_study(study_id)}:extend", json=addition)

    def preview(self, spec: object) -> dict[str, Any]:
        """Number of cases, estimated time and size of a study that is not submitted."""
        return self._json("POST", "/studies:preview", json=spec)

    def study(self, study_id: str) -> dict[str, Any]:
        """One study with its state, progress and time left."""
        return self._json("GET", _study(study_id))

    def studies(self, query: Query = ()) -> dict[str, Any]:
        """A page of studies, newest first."""
        return self._json("GET", "/studies", params=list(query))

    def act(self, study_id: str, verb: str, query: Query = ()) -> dict[str, Any]:
        """Ask for a change of a study: "cancel", "pause", "resume", "retry" or "prioritize"."""
        return self._json("POST", f"{_study(study_id)}:{verb}", params=list(query))

    def curves(self, study_id: str, query: Query) -> dict[str, Any]:
        """Curves of results against one axis."""
        return self._json("GET", f"{_study(study_id)}/curves", params=list(query))

    def cases(self, study_id: str, query: Query = ()) -> dict[str, Any]:
        """A page of case rows."""
        return self._json("GET", f"{_study(study_id)}/cases", params=list(query))

    def download(self, path: str, query: Query = ()) -> Iterator[bytes]:
        """The bytes of a document under the API, such as ``/studies/ID/results`` with ``format=csv``, as they come."""
        try:
            with self._http.stream("GET", _API + path, params=list(query), timeout=_FILE_TIMEOUT) as response:
                if response.is_error:
                    response.read()
                    raise _refusal(response)
                yield from response.iter_bytes()
        except httpx.HTTPError as error:
            raise UnreachableError(self.server, _reason(error)) from error

    def results(self, study_id: str, form: str) -> Iterator[bytes]:
        """All rows of a study in the named format."""
        return self.download(f"{_study(study_id)}/results", [("format", form)])

    def picture(self, study_id: str, query: Query, form: str) -> Iterator[bytes]:
        """The picture of curves as "svg", "png" or "pdf"."""
        return self.download(f"{_study(study_id)}/curves", [*query, ("format", form)])

    def map(self, study_id: str, query: Query) -> dict[str, Any]:
        """One result over two axes."""
        return self._json("GET", f"{_study(study_id)}/map", params=list(query))

    def map_picture(self, study_id: str, query: Query, form: str) -> Iterator[bytes]:
        """The picture of a map as "svg", "png" or "pdf"."""
        return self.download(f"{_study(study_id)}/map", [*query, ("format", form)])

    def sensitivity(self, study_id: str, query: Query) -> dict[str, Any]:
        """Main effects and shares of the variance of results."""
        return self._json("GET", f"{_study(study_id)}/sensitivity", params=list(query))

    def sensitivity_picture(self, study_id: str, query: Query, form: str) -> Iterator[bytes]:
        """The picture of it as "svg", "png" or "pdf"."""
        return self.download(f"{_study(study_id)}/sensitivity", [*query, ("format", form)])

    def report(self, study_id: str, form: str) -> Iterator[bytes]:
        """The study as a document, "html" or "pdf"."""
        return self.download(f"{_study(study_id)}/report", [("format", form)])

    def schedules(self) -> dict[str, Any]:
        """Every schedule with its last and its next run."""
        return self._json("GET", "/schedules")

    def schedule(self, schedule_id: str) -> dict[str, Any]:
        """One schedule with its spec and its latest runs."""
        return self._json("GET", _schedule(schedule_id))

    def create_schedule(self, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Keep a new schedule: a study that is submitted by itself."""
        return self._json("POST", "/schedules", json=dict(fields))

    def change_schedule(self, schedule_id: str, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Change some fields of a schedule."""
        return self._json("PATCH", _schedule(schedule_id), json=dict(fields))

    def delete_schedule(self, schedule_id: str) -> None:
        """Delete a schedule; its studies stay."""
        self._request("DELETE", _schedule(schedule_id))

    def _request(self, method: str, path: str, **arguments: Any) -> httpx.Response:
        try:
            response = self._http.request(method, _API + path, **arguments)
        except httpx.HTTPError as error:
            raise UnreachableError(self.server, _reason(error)) from error
        if response.is_error:
            raise _refusal(response)
        return response

    def _json(self, method: str, path: str, **arguments: Any) -> dict[str, Any]:
        response = self._request(method, path, **arguments)
        try:
            data = response.json()
        except ValueError:
            data = None
        if not isinstance(data, dict):
            raise UnreachableError(self.server, "what answers there is not Sprag")
        return data


def _study(study_id: str) -> str:
    return f"/studies/{quote(study_id, safe='')}"


def _schedule(schedule_id: str) -> str:
    return f"/schedules/{quote(schedule_id, safe='')}"


def _refusal(response: httpx.Response) -> ServiceError:
    try:
        problem = response.json()
    except ValueError:
        problem = None
    if not isinstance(problem, dict):
        problem = {"title": f"HTTP status {response.status_code} {response.reason_phrase}"}
    return RefusedError(response.status_code, problem)


def _reason(error: httpx.HTTPError) -> str:
    if isinstance(error, httpx.ConnectError):
        return "nobody answers there"
    if isinstance(error, httpx.TimeoutException):
        return "no answer in time"
    return str(error) or type(error).__name__


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
