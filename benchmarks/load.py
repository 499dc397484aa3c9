"""Requests a second and the slowest percent, for a cached curve and a page, while slow clients and streams are open.

``python -m benchmarks.load``: a service of its own on this machine with a finished study; 200 connections that send
their request a byte a second, and 50 streams of events. The ratio is against ``/livez`` without them, in the same run.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import tempfile
import time
from collections.abc import AsyncIterator
from pathlib import Path
from urllib.parse import urlsplit

import httpx

from benchmarks.faults.harness import PATIENCE
from sprag_study.service.http.api.examples import SPEC
from tests.acceptance.processes import service

SLOW, STREAMS, CLIENTS = 200, 50, 16
CURVE = "curves?x=shaft.load&y=shaft.speed.mean&by=excitation.frequency"


async def slow_client(host: str, port: int, begun: asyncio.Event) -> None:
    """Send the head of a request a byte a second, for ever: whenever the service hangs up, begin anew."""
    while True:
        with contextlib.suppress(OSError):
            _, writer = await asyncio.open_connection(host, port)
            with contextlib.closing(writer):
                for byte in b"GET /livez HTTP/1.1\r\nHost: localhost\r\nX: " + b"y" * 10_000:
                    writer.write(bytes([byte]))
                    await writer.drain()
                    begun.set()
                    await asyncio.sleep(1.0)


async def stream(address: str, path: str, opened: asyncio.Event) -> None:
    """Hold a stream of events open; returns when the service ends it."""
    async with httpx.AsyncClient(timeout=None) as client, client.stream("GET", address + path) as answer:
        assert answer.status_code == 200, answer.status_code
        async for _ in answer.aiter_bytes():
            opened.set()


async def measured(host: str, port: int, path: str, seconds: float, tag: str = "") -> list[float]:
    """Seconds of each request of `CLIENTS` clients that ask again at once, on connections that stay open."""
    until, times = time.perf_counter() + seconds, []
    held = f"If-None-Match: {tag}\r\n" if tag else ""
    request = f"GET {path} HTTP/1.1\r\nHost: localhost\r\n{held}\r\n".encode()

    async def client() -> None:
        reader, writer = await asyncio.open_connection(host, port)
        while time.perf_counter() < until:
            began = time.perf_counter()
            writer.write(request)
            head = await reader.readuntil(b"\r\n\r\n")
            assert head.startswith((b"HTTP/1.1 200", b"HTTP/1.1 304")), head
            length = [line for line in head.lower().split(b"\r\n") if line.startswith(b"content-length:")]
            if length:
                await reader.readexactly(int(length[0].split(b":")[1]))
            times.append(time.perf_counter() - began)
        writer.close()

    await asyncio.gather(*(client() for _ in range(CLIENTS)))
    return times


@contextlib.asynccontextmanager
async def crowd(address: str, study: str) -> AsyncIterator[None]:
    """The slow clients and the streams, all of them there; none has left when the block ends."""
    host, port = str(urlsplit(address).hostname), int(urlsplit(address).port or 0)
    begun, opened = [[asyncio.Event() for _ in range(count)] for count in (SLOW, STREAMS)]
    tasks = [asyncio.create_task(slow_client(host, port, event)) for event in begun]
    tasks += [asyncio.create_task(stream(address, f"/api/v1/studies/{study}/events", event)) for event in opened]
    await asyncio.gather(*(asyncio.wait_for(event.wait(), PATIENCE) for event in [*begun, *opened]))
    try:
        yield
        assert not any(task.done() for task in tasks), "a slow client or a stream of events has ended"
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


async def run(address: str, done: str, held: str, seconds: float) -> None:
    """Measure and print."""
    host, port = str(urlsplit(address).hostname), int(urlsplit(address).port or 0)
    curve = f"/api/v1/studies/{done}/{CURVE}"
    tag = httpx.get(address + curve, timeout=PATIENCE).headers["etag"]
    trivial = await measured(host, port, "/livez", seconds)
    base = len(trivial) / seconds
    print(f"{CLIENTS} clients; {SLOW} slow connections and {STREAMS} streams of events from the second line on")
    print(f"{'':34} requests/s   ratio   p50 ms   p99 ms")

    def tell(name: str, times: list[float]) -> None:
        times.sort()
        rate, middle, slow = len(times) / seconds, times[len(times) // 2], times[int(len(times) * 0.99)]
        print(f"{name:34} {rate:10.0f}   {rate / base:5.2f}   {1e3 * middle:6.1f}   {1e3 * slow:6.1f}")

    tell("/livez, nobody else", trivial)
    async with crowd(address, held):
        tell("/livez", await measured(host, port, "/livez", seconds))
        tell("curve that the client has (304)", await measured(host, port, curve, seconds, tag))
        tell("curve", await measured(host, port, curve, seconds))
        tell("page of a case", await measured(host, port, f"/studies/{done}/cases/0", seconds))


def main() -> None:
    """Start the service, fill it, measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=10.0, help="for each line")
    seconds = parser.parse_args().seconds
    with tempfile.TemporaryDirectory() as folder, service(Path(folder), "--processes", "1") as running:
        with httpx.Client(base_url=running.address + "/api/v1", timeout=PATIENCE) as client:
            done = client.post("/studies", json=SPEC).json()["id"]
            with client.stream("GET", f"/studies/{done}/events") as events:
                states = [json.loads(line[5:])["state"] for line in events.iter_lines() if line.startswith("data:")]
            assert states[-1] == "finished", states
            # So many cases that it cannot end before it is held: streams of an ended study end too.
            many = {"name": "held", "axes": [{"path": "shaft.load", "linspace": [0.0, 0.5, 100_000]}]}
            held = client.post("/studies?fresh=true", json=SPEC | many).json()["id"]
            paused = client.post(f"/studies/{held}:pause").json()
            assert paused["state"] == "paused", paused
        asyncio.run(run(running.address, done, held, seconds))


if __name__ == "__main__":
    main()
