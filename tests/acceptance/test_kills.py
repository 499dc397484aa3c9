"""Processes that are killed, stopped and ended while a study runs, for which nothing is lost, doubled or wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import httpx

from benchmarks.faults import harness
from benchmarks.faults.dispatchers import dispatchers
from benchmarks.faults.kills import kills
from benchmarks.faults.rounds import rounds
from benchmarks.faults.stopped import stopped
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from tests.conftest import Finished

#: Chunks of a study that a dispatcher has taken.
CLAIMED = "SELECT count(*) FROM chunks WHERE state = 'claimed' AND study = (SELECT number FROM studies WHERE id = ?)"


def test_killed_processes_lose_nothing(tmp_path: Path) -> None:
    """With drives, whose cases are stored, claimed and handed out again as all others are."""
    figures = kills(tmp_path, cases=60, count=3, seed=9, periods=2000.0, drives=19, processes=1)
    assert figures["cases"] == 60
    assert figures["kills"] == {"pool process": 1, "dispatcher": 1, "service": 1}


def test_a_study_that_chooses_its_cases_ends_as_an_undisturbed_one(tmp_path: Path) -> None:
    assert sum(rounds(tmp_path, count=2, seed=4)["kills"].values()) == 2


def test_killed_dispatchers_of_one_database_lose_nothing(tmp_path: Path, postgres_url: str) -> None:
    figures = dispatchers(tmp_path, count=2, seed=2, studies=2, cases=40, url=postgres_url)
    assert sum(figures["ends"].values()) >= 2


def test_a_dispatcher_that_was_stopped_commits_nothing_and_gives_up(tmp_path: Path) -> None:
    stopped(tmp_path, cases=200, rounds=1, seed=1)


def test_a_copy_goes_on_where_it_was_made_and_a_service_with_open_streams_ends_soon(
    tmp_path: Path, sprag: Callable[..., Finished]
) -> None:
    """One service shows both: it is copied while a study runs, and has to hand back chunks of another one."""
    made = harness.spec(120, 2_000.0)
    with ExitStack() as client:
        with harness.running(tmp_path, "--processes", 1, SPRAG_CHUNK_CASES="10") as service:
            study = service.submit(made)
            harness.until(lambda: harness.done(service.database, study) > 20, "the study goes on")
            (tmp_path / "restored").mkdir()
            copy = tmp_path / "restored" / "sprag.sqlite3"
            saved = sprag("admin", "db", "backup", copy, "--db", service.database)
            assert saved.code == 0, saved.err
            assert service.look(study)["state"] == "running"
            service.http.post(f"/studies/{study}:cancel")
            endless = service.submit(harness.spec(4_000, 100_000.0))
            harness.until(lambda: harness.asked(service.database, CLAIMED, endless), "chunks are claimed")
            lines = followed(client, service, endless)
        assert "event: end" not in list(lines)
    assert harness.asked(service.database, CLAIMED, endless) == 0, service.log.read_text()
    assert harness.asked(service.database, "SELECT count(*) FROM chunks WHERE failures > 0") == 0
    assert harness.asked(service.database, "SELECT state FROM studies WHERE id = ?", endless) == "running"
    done = harness.done(copy, study)
    assert 20 < done < 120
    assert sprag("admin", "db", "check", "--db", copy).code == 0
    with Store.open(f"sqlite:///{copy}") as store:
        assert store.studies.look(study)[1].done == done
        executor = InlineExecutor()
        Dispatcher(store.work, executor, SystemClock()).run(lambda: store.studies.get(study).over)
    assert sum(executor.report().cases.values()) == 120 - done
    harness.compare(copy, study, made, ranges=[(16, 16), (104, 16)])


def followed(client: ExitStack, service: harness.Service, study: str) -> Iterator[str]:
    """The further lines of the stream of a study that shows its progress, open as long as the client."""
    http = client.enter_context(httpx.Client(base_url=service.http.base_url, timeout=harness.PATIENCE, trust_env=False))
    lines = client.enter_context(http.stream("GET", f"/studies/{study}/events")).iter_lines()
    assert any(line == "event: progress" for line in lines)
    return lines
