"""A dispatcher is stopped by SIGSTOP, a second one takes over, and the first is continued."""

from __future__ import annotations

import random
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import psutil

from benchmarks.faults import harness
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking

_LATEST = "SELECT max(epoch) FROM dispatchers"


def _worker(database: Path, log: Path, *options: str) -> subprocess.Popen[bytes]:
    with log.open("wb") as errors:
        return subprocess.Popen(
            [*harness.COMMAND, "admin", "worker", "--db", str(database), *options],
            stderr=errors, env=harness.environment(SPRAG_PROCESSES="1"),
        )  # fmt: skip


def stopped(folder: Path, *, cases: int, rounds: int, seed: int, periods: float = 60.0) -> dict[str, Any]:
    """Let dispatcher after dispatcher be stopped, replaced and woken while a study runs; gives the figures."""
    draw = random.Random(seed)
    database, made = folder / "sprag.sqlite3", harness.spec(cases, periods)
    with Store.open(f"sqlite:///{database}", chunking=Chunking(cases=4)) as store:
        study = store.studies.create(made, harness.study_of(made)).id
    _watch_commits(database)
    logs = [folder / f"worker-{number}.log" for number in range(rounds + 1)]
    workers = [_worker(database, logs[0])]
    try:
        for number in range(rounds):
            share = (number + draw.random()) / (rounds + 1)
            harness.until(lambda share=share: harness.done(database, study) > share * cases, "the study goes on")
            current = psutil.Process(workers[-1].pid)
            harness.until(
                lambda current=current: harness.suspended(current, database), "the dispatcher is in no transaction"
            )
            before = harness.asked(database, _LATEST)
            workers.append(_worker(database, logs[number + 1], "--take-over"))
            harness.until(lambda before=before: harness.asked(database, _LATEST) > before, "the second takes over")
            time.sleep(draw.uniform(0.0, 0.2))
            workers[-2].send_signal(signal.SIGCONT)
            assert workers[-2].wait(harness.PATIENCE) == 3, logs[number].read_text()
            assert "another dispatcher has taken over" in logs[number].read_text()
        harness.until(
            lambda: harness.asked(database, "SELECT finished_at FROM studies WHERE id = ?", study), "the study ends"
        )
        workers[-1].terminate()
        assert workers[-1].wait(harness.PATIENCE) == 0, logs[-1].read_text()
    finally:
        for worker in workers:
            worker.kill()
            worker.wait()
    stale = harness.asked(database, "SELECT count(*) FROM drill_commits WHERE epoch <> latest")
    assert stale == 0, f"{stale} chunks were committed by a dispatcher that had lost its epoch"
    harness.compare(database, study, made)
    return {"cases": cases, "dispatchers stopped and replaced": rounds, "stale commits": 0, "gave up by itself": rounds}


def _watch_commits(database: Path) -> None:
    """Let the database note, with every chunk that is done, by whose claim it was and who was the latest."""
    session = Session(f"sqlite:///{database}")
    with session.write() as connection:
        connection.exec_driver_sql("CREATE TABLE drill_commits (epoch INTEGER, latest INTEGER)")
        connection.exec_driver_sql(
            "CREATE TRIGGER drill_commit AFTER UPDATE OF state ON chunks WHEN new.state = 'done' "
            f"BEGIN INSERT INTO drill_commits SELECT new.epoch, ({_LATEST}); END"
        )
    session.close()
