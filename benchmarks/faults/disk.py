"""The disk is full, or files may not grow: studies are held with the reason and go on when there is room."""

from __future__ import annotations

import os
import resource
import subprocess
import time
from pathlib import Path
from typing import Any

from benchmarks.faults import harness
from sprag_study.service.jobs.preview import estimated_bytes
from sprag_study.service.storage.work.room import RESERVE_BYTES

_STATE = "SELECT state FROM studies WHERE id = ?"


def file_limit(folder: Path, *, cases: int, studies: int, periods: float = 20.0) -> dict[str, Any]:
    """Run three or more studies under a limit of file sizes too small for all, and raise it when they are held."""
    specs = [harness.spec(cases, periods + 0.5 * number) for number in range(studies)]  # none has rows for another
    empty = harness.with_tables(folder / "empty.sqlite3")
    # Half of them: enough for each alone, and so little that they are held long before the last one ends.
    room = int(0.5 * studies * estimated_bytes(harness.study_of(specs[0]))) + RESERVE_BYTES + empty.stat().st_size
    service = harness.Service(folder, "--processes", 1, SPRAG_CHUNK_CASES="250")
    service.before_exec = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (room, resource.RLIM_INFINITY))
    service.start()
    try:
        # No rows before all of them are accepted, or the last ones find no room.
        harness.until(service.dispatcher, "there is a dispatcher")
        dispatcher = service.dispatcher()
        assert dispatcher is not None
        harness.until(lambda: harness.suspended(dispatcher, service.database), "the dispatcher is suspended")
        submitted = [service.submit(made) for made in specs]
        dispatcher.resume()
        held: dict[str, Any] = {}

        def is_held() -> bool:
            if _state(service, submitted[-1]) not in ("paused", "finished"):
                return False
            # A held study is tried again now and then, without a reason for that while.
            held.update(service.look(submitted[-1]))
            assert held["state"] != "finished", "there was room for all studies"
            return held["state"] == "paused" and held["reason"] is not None

        harness.until(is_held, "the studies are held")
        assert "ulimit -f" in held["reason"], held["reason"]
        refused = service.http.post("/studies", json=harness.spec(cases, 30.0))
        assert (refused.status_code, refused.json()["type"]) == (507, "/problems/storage-full"), refused.text
        dispatcher = service.dispatcher()
        assert dispatcher is not None
        for process in (service.process.pid, dispatcher.pid):
            resource.prlimit(process, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        for study in submitted:
            service.finish(study)
    except BaseException:
        service.kill()
        raise
    service.stop()
    for study, made in zip(submitted, specs, strict=True):
        harness.compare(service.database, study, made)
    return {"cases": studies * cases, "held": "by the limit of file sizes", "reason": held["reason"], "rows lost": 0}


def disk(folder: Path, *, cases: int, megabytes: int) -> dict[str, Any]:
    """Run a study on a file system of that size that others fill up, suddenly and to the last byte, three times.

    The file system is one in memory, which takes the rights of root.
    """
    place = folder / "small"
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "sprag-drill", place], check=True)
    try:
        return _on_small_disk(place, cases)
    finally:
        subprocess.run(["umount", "--lazy", place], check=True)


def _on_small_disk(place: Path, cases: int) -> dict[str, Any]:
    made = harness.spec(cases, 30.0)
    ballast = place / "ballast"
    waits: list[float] = []
    reasons: list[str] = []
    with harness.running(place, "--processes", 2, SPRAG_CHUNK_CASES="100") as service:
        study = service.submit(made)
        for share in (0.1, 0.3, 0.5):
            harness.until(lambda share=share: harness.done(service.database, study) > share * cases, "it goes on")
            _fill(ballast)
            harness.until(lambda: _state(service, study) == "paused", "the study is held")
            reasons.append(service.look(study)["reason"])
            before = harness.done(service.database, study)
            assert service.http.get(f"/studies/{study}/cases", params={"page_size": 5}).status_code == 200
            assert before == harness.done(service.database, study)
            ballast.unlink()
            begin = time.monotonic()
            harness.until(lambda: _state(service, study) in ("running", "finished"), "it goes on by itself")
            waits.append(round(time.monotonic() - begin, 1))
        service.finish(study)
    harness.compare(service.database, study, made)
    return {
        "cases": cases,
        "times the disk was full": len(waits),
        "reasons": sorted(set(reasons)),
        "seconds until it went on by itself": waits,
        "rows lost": 0,
    }


def _state(service: harness.Service, study: str) -> str:
    return str(harness.asked(service.database, _STATE, study))


def _fill(ballast: Path) -> None:
    """Take every last byte, again and again until nobody else has found one."""
    with ballast.open("wb", buffering=0) as file:
        for _ in range(3):
            try:
                while True:
                    file.write(bytes(65536))
            except OSError:
                try:
                    while True:
                        file.write(bytes(4096))
                except OSError:
                    os.fsync(file.fileno())
