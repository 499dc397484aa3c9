"""What users define is worked on in processes: ended with their clients, within limits, and within each one's share."""

from __future__ import annotations

import asyncio
import os
import signal
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

import anyio
import psutil
import pytest
from starlette.requests import ClientDisconnect, Request

from sprag_study.service.actor import Role
from sprag_study.service.http.computer import Limits, ProcessComputer
from sprag_study.service.http.grants import Grant
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.shares import Shares
from sprag_study.service.http.work import Work
from sprag_study.worker import models
from tests.service.conftest import API, InThread, Service
from tests.worker import fakes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from anyio.from_thread import BlockingPortal

_LIMITS = Limits(60.0, 64 * 2**20, 8, "too-costly", "SPRAG_CHECK_TIMEOUT", leave_seconds=0.0)


@pytest.fixture
def checker() -> Iterator[ProcessComputer]:
    """One process that has loaded nothing."""
    made = ProcessComputer(_LIMITS, prepare=fakes.prepare_nothing)
    yield made
    made.close()


def test_memory_is_limited_and_the_process_lives_on(checker: ProcessComputer, portal: BlockingPortal) -> None:
    before = portal.call(checker.run, os.getpid)
    with pytest.raises(ApiError, match="more than the 64 MiB") as refused:
        portal.call(checker.run, bytearray, 10**9)
    assert refused.value.type.status == 422
    assert portal.call(checker.run, os.getpid) == before


def test_time_is_limited_and_the_limit_is_named(portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch) -> None:
    checker = ProcessComputer(
        Limits(0.05, 2**30, 8, "too-costly", "SPRAG_CHECK_TIMEOUT"), prepare=fakes.prepare_nothing
    )
    try:
        with pytest.raises(ApiError, match=r"within 0\.5 s by the clock") as hung:
            portal.call(checker.run, signal.pause)
        monkeypatch.setattr("sprag_study.service.http.computer.WALL_TIMES", 1e4)
        named = r"within 0\.05 s of processor time, the limit of SPRAG_CHECK_TIMEOUT"
        with pytest.raises(ApiError, match=named) as busy:
            portal.call(checker.run, sum, range(10**12))
        assert hung.value.type.status == busy.value.type.status == 422
    finally:
        checker.close()


def test_what_waits_when_the_service_ends_is_told_so(checker: ProcessComputer, portal: BlockingPortal) -> None:
    waiting = [portal.start_task_soon(checker.run, signal.pause) for _ in range(3)]
    portal.call(anyio.wait_all_tasks_blocked)
    checker.close()
    for task in waiting:
        error = task.exception(60)
        assert isinstance(error, ApiError)
        assert (error.type.status, error.headers["Retry-After"]) == (503, "5")


def _request(service: Service, receive: Any, token: str = "one") -> Request:
    scope = {
        "type": "http", "method": "POST", "path": "/", "headers": [], "app": service.app,
        "sprag.grant": Grant(token, token, Role.VIEWER),
    }  # fmt: skip
    return Request(scope, receive)


def test_a_client_that_leaves_ends_the_process(
    service: Service, checker: ProcessComputer, portal: BlockingPortal, tmp_path: Path
) -> None:
    begun = tmp_path / "begun"
    os.mkfifo(begun)
    service.checker.run = checker.run  # type: ignore[method-assign]
    left: list[anyio.Event] = []

    async def receive() -> dict[str, Any]:
        if not left:
            left.append(anyio.Event())
        await left[0].wait()
        return {"type": "http.disconnect"}

    work = Work(_request(service, receive))
    asked = portal.start_task_soon(work.check, fakes.tell_and_wait, str(begun))
    process = psutil.Process(int(begun.read_text()))
    portal.call(lambda: left[0].set())  # noqa: PLW0108
    with pytest.raises(ClientDisconnect):
        asked.result(600)
    psutil.wait_procs([process], timeout=600)
    assert not process.is_running()


def test_what_ends_soon_after_its_client_left_costs_no_process(portal: BlockingPortal, tmp_path: Path) -> None:
    begun, told = tmp_path / "begun", tmp_path / "told"
    os.mkfifo(begun)
    os.mkfifo(told)
    limits = replace(_LIMITS, leave_seconds=60.0)
    checker = ProcessComputer(limits, prepare=fakes.prepare_nothing)

    async def leave() -> None:
        process = await checker.run(os.getpid)
        slow = partial(fakes.load_between, begun=str(begun), told=str(told))
        running = asyncio.ensure_future(checker.run(slow, models.KernelShape("", ())))
        await asyncio.to_thread(begun.read_text)
        queued = asyncio.ensure_future(checker.run(signal.pause))  # would keep the process for ever
        await anyio.wait_all_tasks_blocked()
        for task in (queued, running):
            task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await queued  # before the process is free for it
        await asyncio.to_thread(told.write_text, "now")
        with pytest.raises(asyncio.CancelledError):
            await running
        assert await checker.run(os.getpid) == process

    try:
        portal.call(leave)
    finally:
        checker.close()


def test_each_has_a_share_and_no_more(portal: BlockingPortal) -> None:
    async def take() -> None:
        shares, order = Shares(1, 2, 8), []
        held, go_on = anyio.Event(), anyio.Event()

        async def have(owner: str, name: str) -> None:
            async with shares.take(owner):
                order.append(name)
                held.set()
                await go_on.wait()

        async with anyio.create_task_group() as group:
            group.start_soon(have, "one", "first")
            await held.wait()
            group.start_soon(have, "one", "second")
            await anyio.wait_all_tasks_blocked()
            assert order == ["first"]  # one at work, one waits
            with pytest.raises(ApiError) as refused:
                await have("one", "third")
            assert (refused.value.type.status, refused.value.headers["Retry-After"]) == (429, "5")
            group.start_soon(have, "other", "of another")
            await anyio.wait_all_tasks_blocked()
            assert order == ["first", "of another"]
            go_on.set()
        assert order == ["first", "of another", "second"]
        await have("one", "later")

    portal.call(take)


def _doors(service: Service, spec: Any) -> dict[str, Any]:
    study = service.submit(spec)
    service.fill(study)
    fit = {"data": [[0.1, 0.5], [0.2, 1.0], [0.3, 1.5]], "accuracy": 0.1}
    axes = {"axes": [{"path": spec["axes"][0]["path"], "values": [0.123]}]}
    schedule = {"cron": "0 22 * * 1-5", "spec": spec}
    curve = urlencode({"x": spec["axes"][0]["path"], "y": "shaft.speed.mean", "format": "svg"})
    at = [f"&at={axis['path']}={0}" for axis in spec["axes"][2:]]
    form = {"Content-Type": "application/x-www-form-urlencoded"}
    return {
        "preview": lambda: service.http.post(f"{API}/studies:preview", json=spec),
        "submit": lambda: service.http.post(f"{API}/studies", json=spec),
        "extend": lambda: service.http.post(f"{API}/studies/{study}:extend", json=axes),
        "fit": lambda: service.http.post(f"{API}/clutch-fits", json=fit),
        "schedule": lambda: service.http.post(f"{API}/schedules", json=schedule),
        "picture": lambda: service.http.get(f"{API}/studies/{study}/curves?{curve}{''.join(at)}"),
        "report": lambda: service.http.get(f"{API}/studies/{study}/report?format=html"),
        "form": lambda: service.http.get("/new?preset=one_pendulum"),
        "live form": lambda: service.http.post("/new/check", content="pendulums=1", headers=form),
        "sent form": lambda: service.http.post("/new", content="pendulums=1&do=submit", headers=form),
        "live machine": lambda: service.http.post("/new/live", content="pendulums=1", headers=form),
    }


DOORS = (
    "preview", "submit", "extend", "fit", "schedule", "picture", "report", "form", "live form", "sent form",
    "live machine",
)  # fmt: skip


@pytest.mark.parametrize("door", DOORS)
def test_nothing_that_users_define_is_worked_on_in_the_service(
    service: Service, spec: Any, door: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    ask = _doors(service, spec)[door]

    async def refuse(*_: object) -> None:
        raise ApiError("too-costly", "Refused.")

    assert isinstance(service.checker, InThread)
    monkeypatch.setattr(service.checker, "run", refuse)
    assert ask().status_code == 422


def test_what_has_to_be_compiled_first_is_compiled_by_the_engines_process(
    service: Service, portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch
) -> None:
    press = service.get("/presets/press")["spec"]
    monkeypatch.setattr("sprag_study.service.spec.machine.shaft_check._compiles_here", False)
    monkeypatch.setattr(
        "sprag_study.service.spec.machine.shaft_check.is_compiled", lambda _shape: bool(service.computer.loads)
    )
    assert service.http.post(f"{API}/studies:preview", json=press).status_code == 200
    assert service.computer.loads
