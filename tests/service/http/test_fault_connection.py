"""A fault of the service on real sockets: its answer announces the end of the connection, and clients go on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

import httpx
import pytest

from sprag_study.service.http.timeouts import TimeoutProtocol
from sprag_study.service.views import sensitivity as sensitivities
from tests.service.conftest import API, Service
from tests.service.http.test_timeouts import serving

if TYPE_CHECKING:
    from collections.abc import Sequence


def _fail(*_: object) -> NoReturn:
    raise RuntimeError("a fault of the program")


def test_the_next_request_of_the_same_client_is_answered(
    service: Service, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sensitivities, "sensitivity", _fail)
    path = f"{API}/studies/{service.submit(spec)}/sensitivity?y=torque.max"
    with (
        serving(service.app, http=TimeoutProtocol) as address,
        httpx.Client(base_url=f"http://localhost:{address[1]}", timeout=600) as client,
    ):
        answers: Sequence[httpx.Response] = [client.get(place) for _ in range(5) for place in (path, "/livez")]
    assert [answer.status_code for answer in answers] == [500, 200] * 5
    assert {answer.headers["content-type"] for answer in answers[::2]} == {"application/problem+json"}
    assert {answer.headers.get("connection") for answer in answers[::2]} == {"close"}
    assert {answer.headers.get("connection") for answer in answers[1::2]} == {None}
