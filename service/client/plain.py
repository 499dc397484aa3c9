"""The service over HTTP with plain JSON data in and out, for the command line and `sprag.service.client.study`."""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import httpx

from sprag.service.client.errors import UnreachableError
from sprag.service.client.queries import longer_query
from sprag.service.client.wire import (
    API,
    EVENTS_TIMEOUT,
    FILE_TIMEOUT,
    Drawn,
    Query,
    answers_path,
    calibration_path,
    case_path,
    connection_options,
    document,
    explore_path,
    front_path,
    is_event,
    reason,
    refusal,
    require_finite,
    schedule_path,
    study_path,
    within,
)


class ServiceClient:
    """A connection to a running service. Use it as a context manager.

    Parameters
    ----------
    server : str
        Address such as "http://127.0.0.1:8000".
    token : str, optional
        Sent as a bearer token.
    transport : httpx.BaseTransport, optional
        Replaces the network, for instance in tests.

    Raises
    ------
    ValueError
        When ``server`` is not an HTTP address.
    """

    def __init__(self, server: str, token: str | None = None, *, transport: httpx.BaseTransport | None = None) -> None:
        self.server = server.rstrip("/")
        self._http = httpx.Client(transport=transport, **connection_options(self.server, token))

    def __enter__(self) -> ServiceClient:
        return self

    def __exit__(self, *_: object) -> None:
        self._http.close()

    def create_study(
        self,
        spec: object,
        key: str | None = None,
        priority: int = 0,
        fresh: bool = False,
        finish_by: str | None = None,
    ) -> dict[str, Any]:
        """Submit a study; the same ``key`` submits it once, however often it is sent.

        A ``fresh`` study runs every case, even those that other studies already have. With ``finish_by``, a time with
        its offset or a duration such as "8 h", it is run coarse to fine and held then.
        """
        query = [("priority", str(priority))] if priority else []
        query += [("fresh", "true")] if fresh else []
        query += [("finish_by", finish_by)] if finish_by is not None else []
        return self._json("POST", "/studies", json=spec, headers=_once(key), params=query)

    def extend(self, study_id: str, addition: object, key: str | None = None) -> dict[str, Any]:
        """Submit a study with more values on the axes of an old one (``axes``), or more cases (``cases``).

        The same ``key`` submits it once, however often it is sent.
        """
        return self._json("POST", f"{study_path(study_id)}:extend", json=addition, headers=_once(key))

    def run_longer(
        self, study_id: str, regime: str | None = None, at_most: int | None = None, key: str | None = None
    ) -> dict[str, Any]:
        """Submit a study of the unsettled cases of another, with more time for each.

        The same ``key`` submits it once, however often it is sent.
        """
        query = longer_query(regime, at_most)
        return self._json("POST", f"{study_path(study_id)}:longer", params=query, headers=_once(key))

    def narrow(self, study_id: str, query: Query = (), key: str | None = None) -> dict[str, Any]:
        """Submit the sweep of a study once more, with smaller steps where its motion jumps.

        The same ``key`` submits it once, however often it is sent.
        """
        return self._json("POST", f"{study_path(study_id)}:narrow", params=query, headers=_once(key))

    def preview(self, spec: object) -> dict[str, Any]:
        """Number of cases, estimated time and size of a study that is not submitted."""
        return self._json("POST", "/studies:preview", json=spec)

    def study(self, study_id: str, timeout: float | None = None) -> dict[str, Any]:
        """One study with its state, progress and time left, requested with ``timeout`` s."""
        return self._json("GET", study_path(study_id), timeout=within(timeout))

    def studies(self, query: Query = ()) -> Iterator[dict[str, Any]]:
        """All studies, newest first; ``page_size`` in the query sets how many are requested at a time."""
        return self._items("/studies", "studies", query)

    def act(self, study_id: str, verb: str, query: Query = ()) -> dict[str, Any]:
        """Request a change of a study: "cancel", "pause", "resume", "retry" or "prioritize"."""
        return self._json("POST", f"{study_path(study_id)}:{verb}", params=list(query))

    def drawn(self, study_id: str, part: Drawn, query: Query) -> dict[str, Any]:
        """Curves of results against one axis, a map over two, what results depend on, a ribbon or a yield."""
        return self._json("GET", f"{study_path(study_id)}/{part}", params=list(query))

    def calibration(self, study_id: str) -> dict[str, Any]:
        """What a calibration has found."""
        return self._json("GET", calibration_path(study_id))

    def calibration_file(self, study_id: str, form: str) -> Iterator[bytes]:
        """The same as "csv", a row for each measured value, or as a picture: "svg", "png" or "pdf"."""
        return self.download(calibration_path(study_id), [("format", form)])

    def answers(self, study_id: str, query: Query = ()) -> dict[str, Any]:
        """What people ask of a study first."""
        return self._json("GET", answers_path(study_id), params=list(query))

    def answers_file(self, study_id: str, query: Query) -> Iterator[bytes]:
        """The same as a file, by the query's ``format``."""
        return self.download(answers_path(study_id), query)

    def explore(self, study_id: str, query: Query = ()) -> dict[str, Any]:
        """A selection of cases by ranges and kinds, with histograms."""
        return self._json("GET", explore_path(study_id), params=list(query))

    def explore_file(self, study_id: str, query: Query) -> Iterator[bytes]:
        """The same as a file, by the query's ``format``."""
        return self.download(explore_path(study_id), query)

    def front(self, study_id: str, query: Query = ()) -> dict[str, Any]:
        """The designs of a study with a goal."""
        return self._json("GET", front_path(study_id), params=list(query))

    def front_file(self, study_id: str, query: Query) -> Iterator[bytes]:
        """The same as a file, by the query's ``format``."""
        return self.download(front_path(study_id), query)

    def picture(self, study_id: str, part: Drawn, query: Query, form: str) -> Iterator[bytes]:
        """The same as a picture, "svg", "png" or "pdf"."""
        return self.download(f"{study_path(study_id)}/{part}", [*query, ("format", form)])

    def cases(self, study_id: str, query: Query = ()) -> Iterator[dict[str, Any]]:
        """All case rows, in order of their numbers; ``page_size`` as for `studies`."""
        return self._items(f"{study_path(study_id)}/cases", "cases", query)

    def _items(self, path: str, name: str, query: Query) -> Iterator[dict[str, Any]]:
        """The items of a list, page by page."""
        token: list[tuple[str, str]] = []
        while True:
            page = self._json("GET", path, params=[*query, *token])
            yield from page[name]
            if page["next_page_token"] is None:
                return
            token = [("page_token", page["next_page_token"])]

    def of_case(self, study_id: str, case: int, part: str, query: Query) -> dict[str, Any]:
        """One case, or a part of it, such as "/branch"."""
        return self._json("GET", case_path(study_id, case, part), params=list(query))

    def download(self, path: str, query: Query = ()) -> Iterator[bytes]:
        """The bytes of a document under the API, such as ``/studies/ID/results`` with ``format=csv``, as they come."""
        try:
            with self._http.stream("GET", API + path, params=list(query), timeout=FILE_TIMEOUT) as response:
                if response.is_error:
                    response.read()
                    raise refusal(response)
                yield from response.iter_bytes()
        except httpx.HTTPError as error:
            raise UnreachableError(self.server, reason(error)) from error

    def events(self, study_id: str) -> Iterator[None]:
        """One item for each event or keep-alive comment of a study's stream until it ends; none without a stream.

        The reason of its end does not matter, because the next poll of the study shows it.
        """
        address = f"{API}{study_path(study_id)}/events"
        with suppress(httpx.HTTPError), self._http.stream("GET", address, timeout=EVENTS_TIMEOUT) as response:
            if response.is_success:
                yield from (None for line in response.iter_lines() if is_event(line))

    def results(self, study_id: str, form: str) -> Iterator[bytes]:
        """All rows of a study in the named format."""
        return self.download(f"{study_path(study_id)}/results", [("format", form)])

    def report(self, study_id: str, form: str) -> Iterator[bytes]:
        """The study as a document, "html" or "pdf"."""
        return self.download(f"{study_path(study_id)}/report", [("format", form)])

    def schedules(self) -> dict[str, Any]:
        """Every schedule with its last and its next run."""
        return self._json("GET", "/schedules")

    def schedule(self, schedule_id: str) -> dict[str, Any]:
        """One schedule with its spec and its latest runs."""
        return self._json("GET", schedule_path(schedule_id))

    def create_schedule(self, fields: Mapping[str, Any], key: str | None = None) -> dict[str, Any]:
        """Create a schedule; the same ``key`` creates it once."""
        return self._json("POST", "/schedules", json=dict(fields), headers=_once(key))

    def change_schedule(self, schedule_id: str, fields: Mapping[str, Any]) -> dict[str, Any]:
        """Change some fields of a schedule."""
        return self._json("PATCH", schedule_path(schedule_id), json=dict(fields))

    def delete_schedule(self, schedule_id: str) -> None:
        """Delete a schedule; its studies are kept."""
        response = self._request("DELETE", schedule_path(schedule_id))
        if response.is_error:
            raise refusal(response)

    def _request(self, method: str, path: str, **arguments: Any) -> httpx.Response:
        require_finite(arguments.get("json"))
        try:
            return self._http.request(method, API + path, **arguments)
        except httpx.HTTPError as error:
            raise UnreachableError(self.server, reason(error)) from error

    def _json(self, method: str, path: str, **arguments: Any) -> dict[str, Any]:
        return document(self.server, self._request(method, path, **arguments))


def _once(key: str | None) -> dict[str, str]:
    return {"Idempotency-Key": key or uuid.uuid4().hex}
