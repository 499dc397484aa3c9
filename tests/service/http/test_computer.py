"""Computations in a process of their own."""

from __future__ import annotations

import asyncio
import gc
import math
import os
import signal
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import aclosing
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import psutil
import pytest

from sprag_study.service.http.computer import MAX_WAITING, Limits, ProcessComputer
from sprag_study.service.http.problems import ApiError
from sprag_study.worker import models
from sprag_study.worker.limits import COMPUTATION_BYTES
from sprag_study.worker.pool.child_process import ProcessStartError
from tests.worker import fakes

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal

    from sprag_study.service.faults import Kind

#: What a process does first, of a module that it has anyway: others take it half a second to be imported.
NOTHING: Final = gc.enable


@pytest.fixture
def computer() -> Iterator[ProcessComputer]:
    """A computer with short timeouts."""
    made = ProcessComputer(Limits(0.5, COMPUTATION_BYTES), prepare=NOTHING)
    yield made
    made.close()


def test_it_computes_elsewhere_and_survives_crashes(computer: ProcessComputer, portal: BlockingPortal) -> None:
    assert portal.call(computer.run, os.getpid) != os.getpid()
    with pytest.raises(ApiError) as died:
        portal.call(computer.run, os._exit, 3)
    assert died.value.code == "not-computed"
    with pytest.raises(ApiError) as late:
        portal.call(computer.run, time.sleep, 60)
    assert late.value.code == "timed-out"
    portal.call(computer.run, time.sleep, 0.7)  # longer than its limit of processor time, as on a crowded machine
    with pytest.raises(ValueError, match=r"math domain|nonnegative"):
        portal.call(computer.run, math.sqrt, -1.0)
    assert portal.call(computer.run, math.sqrt, 4.0) == 2.0


def test_what_is_killed_is_run_once_more(tmp_path: Path, portal: BlockingPortal) -> None:
    """A process may be killed for no fault of what it computes."""
    computer = ProcessComputer(Limits(60.0, COMPUTATION_BYTES, died="unavailable"), prepare=NOTHING)
    try:
        for number in (signal.SIGKILL, signal.SIGSEGV):
            trace = tmp_path / number.name
            assert portal.call(computer.run, fakes.die_at_first, str(trace), number) == "alive"
            assert trace.exists()
    finally:
        computer.close()


@pytest.mark.parametrize(
    ("died", "number", "kind"),
    [
        ("unavailable", signal.SIGKILL, "unavailable"),
        ("unavailable", signal.SIGSEGV, "unavailable"),
        ("not-computed", signal.SIGKILL, "unavailable"),
        ("not-computed", signal.SIGSEGV, "not-computed"),
    ],
)
def test_what_dies_twice_is_told(portal: BlockingPortal, died: Kind, number: int, kind: str) -> None:
    computer = ProcessComputer(Limits(60.0, COMPUTATION_BYTES, died=died), prepare=NOTHING)
    try:
        with pytest.raises(ApiError) as refused:
            portal.call(computer.run, signal.raise_signal, number)
        assert refused.value.code == kind
        assert ("Retry-After" in refused.value.headers) == (kind == "unavailable")
        assert portal.call(computer.run, math.sqrt, 4.0) == 2.0
    finally:
        computer.close()


SHAPE = models.KernelShape("vibration-drive", (1, 2, 1e-9))


def test_a_kernel_takes_longer_than_a_computation_may_and_outlives_its_request(
    tmp_path: Path, portal: BlockingPortal
) -> None:
    begun, told = tmp_path / "begun", tmp_path / "told"
    os.mkfifo(begun)
    os.mkfifo(told)
    load = partial(fakes.load_between, begun=str(begun), told=str(told))
    computer = ProcessComputer(Limits(0.01, COMPUTATION_BYTES), prepare=NOTHING, load=load)
    try:
        left = portal.start_task_soon(computer.load, SHAPE)
        begun.read_text()  # waits until it compiles
        left.cancel()
        again = portal.start_task_soon(computer.load, SHAPE)
        told.write_text("now")
        assert again.result(timeout=600) is None
        portal.call(computer.load, SHAPE)  # compiling again would wait for ever
    finally:
        computer.close()


def test_the_end_of_a_kernel_that_nobody_waits_for_is_not_logged(tmp_path: Path) -> None:
    begun, told = tmp_path / "begun", tmp_path / "told"
    os.mkfifo(begun)
    os.mkfifo(told)
    load = partial(fakes.load_between, begun=str(begun), told=str(told))
    computers = [ProcessComputer(Limits(60.0, COMPUTATION_BYTES), prepare=NOTHING, load=load)]
    logged: list[dict[str, object]] = []

    async def leave_and_close() -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: logged.append(context))
        request = asyncio.create_task(computers[0].load(SHAPE))
        await asyncio.to_thread(begun.read_text)  # waits until it compiles
        request.cancel()
        await asyncio.wait([request])
        await asyncio.to_thread(computers[0].close)
        await asyncio.gather(asyncio.wrap_future(computers[0]._loads[SHAPE].future), return_exceptions=True)

    asyncio.run(leave_and_close())
    computers.clear()  # and with it the kernel's future, the last to know the request's
    gc.collect()
    assert logged == []


def test_it_is_ready_when_its_processes_are(tmp_path: Path, portal: BlockingPortal) -> None:
    begun, told = tmp_path / "begun", tmp_path / "told"
    os.mkfifo(begun)
    os.mkfifo(told)
    prepare = partial(fakes.load_between, SHAPE, begun=str(begun), told=str(told))
    computer = ProcessComputer(Limits(0.01, COMPUTATION_BYTES), prepare=prepare)
    try:
        ready = portal.start_task_soon(computer.ready, os.getpid)
        begun.read_text()  # waits until the process is being made ready
        assert not ready.done()
        told.write_text("now")
        assert ready.result(timeout=600) is None
    finally:
        computer.close()


def test_each_process_is_made_ready(tmp_path: Path, portal: BlockingPortal) -> None:
    computer = ProcessComputer(Limits(60.0, COMPUTATION_BYTES), processes=3, prepare=NOTHING)
    try:
        portal.call(computer.ready, fakes.leave_a_trace, str(tmp_path))
        assert len(list(tmp_path.iterdir())) == 3
    finally:
        computer.close()


def test_a_process_that_cannot_be_made_ready_is_told(portal: BlockingPortal) -> None:
    computer = ProcessComputer(Limits(60.0, COMPUTATION_BYTES), prepare=partial(os._exit, 3))
    try:
        with pytest.raises(ProcessStartError):
            portal.call(computer.ready, os.getpid)
    finally:
        computer.close()


def test_a_kernel_that_fails_is_told_and_tried_again(portal: BlockingPortal) -> None:
    computer = ProcessComputer(Limits(60.0, COMPUTATION_BYTES), prepare=NOTHING, load=fakes.load_dies)
    try:
        for _ in range(2):
            with pytest.raises(ApiError) as died:
                portal.call(computer.load, SHAPE)
            assert died.value.code == "unavailable"  # killed, both times
    finally:
        computer.close()


def test_it_takes_only_so_many_at_once(computer: ProcessComputer, portal: BlockingPortal) -> None:
    waiting = [portal.start_task_soon(computer.run, time.sleep, 60) for _ in range(MAX_WAITING)]
    with pytest.raises(ApiError) as refused:
        portal.call(computer.run, math.sqrt, 4.0)
    assert refused.value.code == "unavailable"
    for task in waiting:
        task.cancel()


async def taken(pieces: AsyncIterator[bytes], into: list[bytes]) -> None:
    async for piece in pieces:
        into.append(piece)


def test_pieces_come_in_order_and_an_error_after_them(portal: BlockingPortal) -> None:
    made = ProcessComputer(Limits(60.0, 2**30), prepare=NOTHING)

    async def take() -> None:
        pieces: list[bytes] = []
        # More than the pipe holds, so that the process waits for who takes them.
        await taken(made.stream(fakes.numbered, 20, 2**17), pieces)
        assert [int(piece.split()[0]) for piece in pieces] == list(range(20))
        assert {len(piece.split()[1]) for piece in pieces} == {2**17}
        received: list[bytes] = []
        with pytest.raises(ValueError, match="broken"):
            await taken(made.stream(fakes.numbered, 3, 1, True), received)
        assert len(received) == 3

    try:
        portal.call(take)
    finally:
        made.close()


def test_who_leaves_ends_the_pieces_and_frees_the_process(portal: BlockingPortal) -> None:
    made = ProcessComputer(Limits(600.0, 2**30), prepare=NOTHING)

    async def leave() -> None:
        process = await made.run(os.getpid)
        async with aclosing(made.stream(fakes.numbered, 0, 2**17)) as pieces:
            assert await anext(pieces)
            assert await anext(pieces)
        assert await made.run(os.getpid) != process, "it would have gone on for ever"

    try:
        portal.call(leave)
    finally:
        made.close()


def test_a_killed_process_of_pieces_is_told_to_have_run_once(portal: BlockingPortal) -> None:
    made = ProcessComputer(Limits(600.0, 2**30), prepare=NOTHING)

    async def kill() -> None:
        process = await made.run(os.getpid)
        pieces = made.stream(fakes.numbered, 0, 2**17)
        assert await anext(pieces)
        os.kill(process, signal.SIGKILL)
        with pytest.raises(ApiError) as killed:
            await taken(pieces, [])
        assert (killed.value.code, str(killed.value.detail)) == (
            "unavailable",
            "The process that ran the computation was killed.",
        )

    try:
        portal.call(kill)
    finally:
        made.close()


def test_pieces_end_with_the_service(portal: BlockingPortal) -> None:
    made = ProcessComputer(Limits(600.0, 2**30), prepare=NOTHING)

    async def end() -> None:
        pieces = made.stream(fakes.numbered, 0, 2**17)
        assert await anext(pieces)
        closing = asyncio.ensure_future(asyncio.to_thread(made.close))
        with pytest.raises(ApiError) as ended:
            await taken(pieces, [])
        assert ended.value.type.status == 503
        await closing

    portal.call(end)


def test_the_wait_for_a_process_ends(portal: BlockingPortal) -> None:
    made = ProcessComputer(Limits(600.0, 2**30, turn_seconds=600.0), prepare=NOTHING)

    async def wait() -> None:
        pieces = made.stream(fakes.numbered, 0, 2**17)
        assert await anext(pieces)
        made._limits = replace(made._limits, turn_seconds=0.01)
        with pytest.raises(ApiError) as refused:
            await made.run(math.sqrt, 4.0)
        assert (refused.value.type.status, refused.value.headers) == (503, {"Retry-After": "60"})
        await pieces.aclose()

    try:
        portal.call(wait)
    finally:
        made.close()


def test_who_leaves_waits_until_its_process_has_ended(tmp_path: Path, portal: BlockingPortal) -> None:
    told = tmp_path / "told"
    os.mkfifo(told)
    made = ProcessComputer(Limits(600.0, 2**30, leave_seconds=0.0), prepare=NOTHING)

    async def leave() -> None:
        running = asyncio.ensure_future(made.run(fakes.tell_and_wait, str(told)))
        process = int(await asyncio.to_thread(told.read_text))
        running.cancel()
        await asyncio.wait([running])
        assert not psutil.pid_exists(process)

    try:
        portal.call(leave)
    finally:
        made.close()
