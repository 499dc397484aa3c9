"""kill -9 of pool processes, dispatcher and service while a study runs, at moments drawn from a seed.

Most kills come when the study has got to a case that was drawn; one in five follows the one before within two seconds,
while the program is still about to recover. In between small studies are submitted with an Idempotency-Key, and sent
again until the service has accepted them.
"""

from __future__ import annotations

import random
import time
from collections import Counter
from pathlib import Path
from typing import Any

import httpx
import psutil

from benchmarks.faults import harness
from sprag_study.service.storage.database.sqlite_files import sqlite_driver

#: What is killed, and how often in relation.
TARGETS = {"pool process": 12, "dispatcher": 5, "service": 3}
_SOON_SHARE, _SOON_SECONDS, _JITTER_SECONDS = 0.2, 2.0, 0.05
_ACCEPTED = 5
#: What differs between drives.
_TOLERANCES = [
    {"path": "pendulums.*.backlash", "plus_minus": "60 %"},
    {"path": "pendulums.*.spring_rate", "plus_minus": "10 %", "distribution": "uniform"},
]


def kills(
    folder: Path,
    *,
    cases: int,
    count: int,
    seed: int,
    periods: float = 60.0,
    drives: int = 0,
    chunk: int = 4,
    processes: int = 2,
) -> dict[str, Any]:
    """Run a study of ``cases`` cases under ``count`` kills; gives the figures.

    With ``drives`` the cases are the nominal drive and that many drawn ones, at as many loads as they suffice for.
    """
    draw = random.Random(seed)
    made = harness.spec(cases // (drives + 1), periods)
    if drives:
        made |= {"tolerances": _TOLERANCES, "drives": drives, "seed": seed}
    cases = harness.study_of(made).cases
    service = harness.Service(folder, "--processes", processes, SPRAG_CHUNK_CASES=str(chunk))
    service.start()
    study = service.submit(made)
    _count_claims(service.database)
    small = harness.spec(3, 4.0)
    accepted: dict[str, str] = {}
    plan = sorted(draw.random() for _ in range(count))
    killed: Counter[str] = Counter()
    begin = time.monotonic()
    for number, share in enumerate(plan):
        if draw.random() < _SOON_SHARE:
            time.sleep(draw.uniform(0.0, _SOON_SECONDS))
        else:
            harness.until(
                lambda share=share: harness.done(service.database, study) >= share * cases, "the study goes on"
            )
            time.sleep(draw.uniform(0.0, _JITTER_SECONDS))
        killed[kill(service, draw)] += 1
        if number % max(1, count // _ACCEPTED) == 0:
            key = f"small-{number}"
            accepted[key] = _submit(service, small, key)
    service.finish(study)
    seconds = time.monotonic() - begin
    for key, small_study in accepted.items():
        service.finish(small_study)
        assert _submit(service, small, key) == small_study
    claimed = harness.asked(service.database, "SELECT sum(cases) FROM drill_claims WHERE study = 1")
    service.stop()
    harness.compare(service.database, study, made)
    for small_study in accepted.values():
        harness.compare(service.database, small_study, small)
    assert harness.asked(service.database, "SELECT count(*) FROM studies") == 1 + len(accepted)
    return {
        "cases": cases,
        "kills": dict(killed),
        "missing, duplicate and wrong rows": 0,
        "cases handed out again, %": round(100.0 * (claimed - cases) / cases, 2),
        "small studies accepted and finished once": len(accepted),
        "seconds": round(seconds, 1),
    }


def _count_claims(database: Path) -> None:
    """Let the database itself count the cases of every claim."""
    connection = sqlite_driver().connect(database, timeout=harness.PATIENCE)
    connection.executescript(
        "CREATE TABLE drill_claims (study INTEGER, cases INTEGER);"
        "INSERT INTO drill_claims SELECT study, count FROM chunks WHERE state <> 'waiting';"
        "CREATE TRIGGER drill_claim AFTER UPDATE OF state ON chunks WHEN new.state = 'claimed' "
        "BEGIN INSERT INTO drill_claims VALUES (new.study, new.count); END;"
    )
    connection.close()


def kill(service: harness.Service, draw: random.Random) -> str:
    """Kill the drawn target; wait until it exists."""
    target = draw.choices(list(TARGETS), list(TARGETS.values()))[0]
    if target == "service":
        service.kill()
        service.start()
    elif target == "dispatcher":
        harness.until(service.dispatcher, "there is a dispatcher")
        if (dispatcher := service.dispatcher()) is not None:
            pool = dispatcher.children(recursive=True)
            dispatcher.kill()
            dispatcher.wait(harness.PATIENCE)
            assert psutil.wait_procs(pool, timeout=harness.PATIENCE)[1] == [], "a process outlived the dispatcher"
    else:
        harness.until(service.pool, "there is a pool")
        if pool := service.pool():
            draw.choice(pool).kill()
    return target


def _submit(service: harness.Service, made: dict[str, Any], key: str) -> str:
    """Submit until it is accepted, as a client would that got no answer."""
    deadline = time.monotonic() + harness.PATIENCE
    while time.monotonic() < deadline:
        try:
            return service.submit(made, **{"Idempotency-Key": key})
        except httpx.TransportError:
            time.sleep(0.1)
    raise AssertionError(f"the service took no study in {harness.PATIENCE:g} s")
