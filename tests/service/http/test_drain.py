"""The end of the service: what was committed is told, what was not is told to be sent again, and nothing fails."""

from __future__ import annotations

import json
import threading
from typing import TYPE_CHECKING, Any

import anyio
import pytest

from sprag_study.service.http.drain import Drain
from sprag_study.service.json_text import to_bytes
from sprag_study.service.storage.errors import EndingError
from tests.service.conftest import API, Service

if TYPE_CHECKING:
    from collections.abc import MutableMapping

    from anyio.from_thread import BlockingPortal


def _scope(method: str) -> dict[str, Any]:
    return {"type": "http", "method": method, "path": "/", "headers": []}


class _Sent:
    """The messages of an answer."""

    def __init__(self) -> None:
        self.messages: list[MutableMapping[str, Any]] = []

    async def __call__(self, message: MutableMapping[str, Any]) -> None:
        self.messages.append(message)

    @property
    def status(self) -> int:
        return int(self.messages[0]["status"])


async def _receive() -> dict[str, Any]:
    return {"type": "http.disconnect"}


def test_a_change_that_is_cut_off_comes_to_its_own_answer(portal: BlockingPortal) -> None:
    committing, go_on = threading.Event(), threading.Event()

    def commit() -> None:
        committing.set()
        assert go_on.wait(600)

    async def app(_scope: Any, _receive: Any, send: Any) -> None:
        await anyio.to_thread.run_sync(commit)
        await send({"type": "http.response.start", "status": 202, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    sent, drain = _Sent(), Drain(app)
    request = portal.start_task_soon(drain, _scope("POST"), _receive, sent)
    assert committing.wait(600)
    request.cancel()  # as the server does when its patience is at an end
    idle = portal.start_task_soon(drain.idle)
    go_on.set()
    idle.result(600)
    assert sent.status == 202


def test_reading_that_is_cut_off_is_told_to_come_back(portal: BlockingPortal) -> None:
    async def app(_scope: Any, _receive: Any, _send: Any) -> None:
        begun.set()
        await anyio.sleep_forever()

    async def cut() -> None:
        async with anyio.create_task_group() as group:
            group.start_soon(Drain(app), _scope("GET"), _receive, sent)
            await begun.wait()
            group.cancel_scope.cancel()

    sent, begun = _Sent(), anyio.Event()
    portal.call(cut)
    assert sent.status == 503
    assert (b"retry-after", b"5") in sent.messages[0]["headers"]
    assert json.loads(sent.messages[1]["body"])["type"] == "/problems/unavailable"


def test_no_write_begins_after_the_cut_and_the_one_under_way_is_kept(service: Service, spec: Any) -> None:
    inside, go_on = threading.Event(), threading.Event()
    refused: list[BaseException] = []

    def hold() -> None:
        with service.store.session.write():
            inside.set()
            assert go_on.wait(600)

    def wait() -> None:
        try:
            with service.store.session.write():
                pass
        except EndingError as error:
            refused.append(error)

    holder, waiter = threading.Thread(target=hold), threading.Thread(target=wait)
    holder.start()
    assert inside.wait(600)
    waiter.start()
    service.store.session.refuse_writes()
    waiter.join(600)
    assert refused
    go_on.set()
    holder.join(600)
    answer = service.http.post(f"{API}/studies", content=to_bytes(spec), headers={"Content-Type": "application/json"})
    assert answer.status_code == 503
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["retry-after"] == "5"
    assert service.get("/studies")["studies"] == []


@pytest.mark.parametrize("address", ["/studies", "/studies:preview"])
def test_a_check_that_is_cut_off_is_told_to_come_back(service: Service, spec: Any, address: str) -> None:
    from sprag_study.service.http.computer import Limits, ProcessComputer

    computer = ProcessComputer(Limits(60.0, 2**30))
    service.checker.run = computer.run  # type: ignore[method-assign]
    computer.close()
    answer = service.http.post(f"{API}{address}", json=spec)
    assert answer.status_code == 503
    assert answer.headers["retry-after"] == "5"
    assert answer.headers["content-type"] == "application/problem+json"
