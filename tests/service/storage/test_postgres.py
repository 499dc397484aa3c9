"""A PostgreSQL server in the place of the file: the lock, hand-over, news, and what is said when something is wrong."""

from __future__ import annotations

import base64
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psycopg
import pytest
import sqlalchemy as sa

from sprag_study.service.http.app import chunking, create_app
from sprag_study.service.jobs import dispatching
from sprag_study.service.jobs.dispatching import WorkerSettings, run_dispatcher
from sprag_study.service.settings import Settings
from sprag_study.service.spec.labels import StudyChange
from sprag_study.service.storage.database import postgres as storage
from sprag_study.service.storage.database import session as session_module
from sprag_study.service.storage.database.server_lock import ServerLock
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.errors import DatabaseBusyError, DatabaseError, SchemaError, StudyNotFoundError
from sprag_study.service.storage.part import lock_row
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import HEAD_REVISION, STUDIES, all_tables
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.stages import Spent, Stage
from sprag_study.worker.states import StudyState
from tests import postgres
from tests.conftest import ROOT, Finished
from tests.faults import refused
from tests.service.conftest import API, InThread, Service
from tests.worker import fakes

#: Generous: the machine may be busy with other tests.
DEADLINE = 600.0


def eventually(true: Callable[[], Any]) -> None:
    """Wait until ``true()``; fails when it never is."""
    begin = time.monotonic()
    while not true():
        assert time.monotonic() - begin < DEADLINE
        threading.Event().wait(0.02)


# What is refused, before a server is asked


@pytest.mark.parametrize(
    ("url", "code"),
    [
        ("postgresql+psycopg2://host/db", "invalid-database-url"),
        ("postgresql://host/db?sslmode=require&options=-c", "invalid-database-url"),
        ("postgresql://me:secret@host/", "invalid-database-url"),
        ("mysql://host/db", "invalid-database-url"),
    ],
)
def test_urls_that_are_not_understood_are_refused_in_one_sentence(url: str, code: str) -> None:
    with refused(DatabaseError, code) as caught:
        Session(url)
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize(
    ("url", "mode"),
    [
        ("postgresql://me@db.example/sprag", "require"),
        ("postgresql://me@db.example/sprag?sslmode=verify-full", "verify-full"),
        ("postgresql://localhost/sprag", None),
        ("postgresql://[::1]:5433/sprag", None),
        ("postgresql:///sprag?host=/run/postgresql", None),
        ("postgresql:///sprag?host=db.example", "require"),
    ],
)
def test_other_machines_are_spoken_to_in_secret(url: str, mode: str | None) -> None:
    assert storage.checked(sa.make_url(url)).query.get("sslmode") == mode


def test_without_the_driver_the_command_that_brings_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "sprag_study.service.storage.database.postgres")
    monkeypatch.delattr("sprag_study.service.storage.database.postgres")
    monkeypatch.setitem(sys.modules, "psycopg", None)
    with refused(DatabaseError, "missing-extra"):
        Session("postgresql://localhost/sprag")


def test_a_server_that_is_not_there_is_told_in_one_line_without_the_password(tmp_path: Path) -> None:
    url = f"postgresql://me:secret@/sprag?host={tmp_path}"
    with refused(DatabaseError, "database-unreachable") as caught:
        Store.open(url)
    assert "secret" not in str(caught.value)
    assert "\n" not in str(caught.value)
    lock = ServerLock(storage.checked(sa.make_url(url)), "a", 1.0)
    with refused(DatabaseError, "database-unreachable"):
        lock.take()


class _Error(psycopg.Error):
    def __init__(self, state: str, text: str) -> None:
        self._state = state
        super().__init__(text)

    @property
    def sqlstate(self) -> str:  # type: ignore[override]
        return self._state


@pytest.mark.parametrize(
    ("state", "kind", "code"),
    [
        ("55P03", "DatabaseBusyError", "database-busy"),
        ("53100", "DatabaseFullError", "storage-full"),
        ("53300", "DatabaseBusyError", "database-busy"),
        ("42501", "DatabaseError", "database-forbidden"),
        ("25006", "DatabaseError", "database-read-only"),
        ("57P01", "DatabaseError", "database-unreachable"),
    ],
)
def test_errors_of_the_server_are_told_by_what_they_mean(state: str, kind: str, code: str) -> None:
    found = storage.explained(_Error(state, "first line\nsecond line"), "here")
    assert type(found).__name__ == kind
    assert found is not None
    assert (found.code, "second line" in str(found)) == (code, False)


def test_what_the_program_did_wrong_is_not_explained_away() -> None:
    assert storage.explained(_Error("42601", "syntax error"), "here") is None


# The server


def test_an_empty_database_gets_the_tables_of_the_code(postgres_server: postgres.Server) -> None:
    url = postgres_server.url(postgres_server.new_database())
    with Store.open(url) as store:
        assert store.studies.page().studies == ()
        with store.session.read() as connection:
            assert {*all_tables().tables} <= {*sa.inspect(connection).get_table_names()}
        report = store.check()
    assert (report.backend, report.revision, report.problems) == ("PostgreSQL", HEAD_REVISION, ())
    assert report.location == f"postgresql://sprag@/{url.partition('@/')[2].partition('?')[0]}"


def test_a_database_of_another_program_is_left_alone(postgres_server: postgres.Server) -> None:
    url = postgres_server.url(postgres_server.new_database())
    session = Session(url)
    with session.write() as connection:
        connection.exec_driver_sql("CREATE TABLE birds (name text)")
    session.close()
    with refused(SchemaError, "not-a-database"):
        Store.open(url)


def test_one_writer_at_a_time_and_readers_of_one_moment(postgres_url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_module, "BUSY_SECONDS", 0.05)
    with Store.open(postgres_url) as store, Store.open(postgres_url) as other:
        with store.session.write():
            assert other.studies.page().studies == ()
            with refused(DatabaseBusyError, "database-busy"), other.session.write():
                pass
        with store.session.read() as connection:
            count = sa.select(sa.func.count()).select_from(STUDIES)
            assert connection.execute(count).scalar_one() == 0
            other.studies.create({}, fakes.study(3))
            assert connection.execute(count).scalar_one() == 0


def test_what_people_write_and_heartbeats_do_not_wait_for_rows(
    postgres_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_module, "BUSY_SECONDS", 0.5)
    size = 20_000
    with Store.open(postgres_url, chunking=Chunking(cases=size)) as store, Store.open(postgres_url) as other:
        study = fakes.study(size)
        record, waiting = store.studies.create({}, study), store.studies.create({}, fakes.study(3))
        store.dispatchers.presence = other.dispatchers.presence = fakes.Present()
        epoch, second = store.work.take_over("test"), other.work.take_over("second")
        (_, token) = store.people.create_token("a", TokenScope.READ)
        (chunk,) = store.work.claim(epoch, store.work.open_chunks(record.number))
        copied, go_on = threading.Event(), threading.Event()
        insert = store.session.insert_blocks

        def slowly(*given: Any) -> None:
            insert(*given)
            copied.set()
            assert go_on.wait(600)

        monkeypatch.setattr(store.session, "insert_blocks", slowly)
        storing = threading.Thread(target=store.work.commit, args=(epoch, chunk, fakes.result(0, size)))
        storing.start()
        assert copied.wait(600)
        for service in (store, other):
            for study_id in (record.id, waiting.id):
                service.studies.change(study_id, StudyChange(name=f"renamed {study_id}"))
            service.work.heartbeat(second, {})
            moment = store.clock.now()
            spent = {Stage.COMPUTING: Spent(1.0, moment, moment)}
            service.work.spent({record.number: spent, waiting.number: spent})
            service.people.note_uses({token.id: 1})
        with refused(DatabaseBusyError, "database-busy"):
            other.studies.pause(waiting.id)
        go_on.set()
        storing.join()
        ended = store.studies.get(record.id)
        assert (ended.name, ended.done) == (f"renamed {record.id}", size)
        assert store.studies.study(record.id) == replace(study, name=ended.name)


def test_a_study_that_is_deleted_meanwhile_is_not_changed(postgres_url: str) -> None:
    with Store.open(postgres_url) as store, Store.open(postgres_url) as other:
        record = store.studies.create({}, fakes.study(3))
        store.studies.cancel(record.id)
        store.work.settle(store.work.take_over("test"), record.number)
        refusals: list[StudyNotFoundError] = []

        def rename() -> None:
            with pytest.raises(StudyNotFoundError) as caught:
                other.studies.change(record.id, StudyChange(name="late"))
            refusals.append(caught.value)

        changing = threading.Thread(target=rename)
        with store.session.write() as connection:
            lock_row(connection, record.id)
            changing.start()
            time.sleep(0.2)
            connection.execute(sa.update(STUDIES).where(STUDIES.c.id == record.id).values(deleted_at=1))
        changing.join()
        assert refusals


def test_a_study_is_removed_after_its_times_were_added(postgres_url: str) -> None:
    with Store.open(postgres_url) as store, Store.open(postgres_url) as other:
        record = store.studies.create({}, fakes.study(3))
        moment = store.clock.now()
        spent = {record.number: {Stage.COMPUTING: Spent(1.0, moment, moment)}}
        store.times.add(spent)
        store.studies.cancel(record.id)
        store.work.settle(store.work.take_over("test"), record.number)
        store.studies.delete(record.id, at_once=True)
        removing = threading.Thread(target=other.purging.purge)

        class Slow(dict[int, dict[Stage, Spent]]):
            """Times that are looked up, with their study locked, while another process removes it."""

            def __getitem__(self, number: int) -> dict[Stage, Spent]:
                removing.start()
                time.sleep(0.5)
                return super().__getitem__(number)

        store.times.add(Slow(spent))
        removing.join()
        with store.session.read() as connection:
            assert connection.execute(sa.select(sa.func.count()).select_from(STUDIES)).scalar_one() == 0


def test_dispatchers_know_of_each_other_by_their_connections(postgres_url: str) -> None:
    with Store.open(postgres_url) as store:
        first, second, mover = (store.session.server_lock(f"host:{number}") for number in (1, 2, 3))
        assert (first.take(), first.take(), second.take()) == (True, True, True)
        first.enter(1)
        second.enter(2)
        assert first.present() == second.present() == {1, 2}
        assert not mover.take_alone()
        assert mover.holder() == "host:1, host:2"
        assert first.take_chores()
        assert not second.take_chores()
        with refused(DatabaseError, "database-busy"):
            second.enter(1)
        second.end([1])
        assert second.present() == {2}
        with refused(DatabaseError, "database-unreachable"):
            first.present()
        with refused(DatabaseError, "database-unreachable"):  # a new connection, by which nobody knows of it
            first.present()
        assert second.take_chores()
        first.release()
        second.release()
        assert mover.take_alone()
        assert not first.take()
        assert first.holder() == "host:3"
        mover.release()
        first.release()


def test_news_come_with_every_wish_and_not_without(postgres_url: str) -> None:
    with Store.open(postgres_url) as store:
        news = store.session.news()
        assert news is not None
        assert news.wait(0.0)  # whatever happened before it began to listen
        assert not news.wait(0.0)
        record = store.studies.create({}, fakes.study(3))
        for wish in (store.studies.pause, store.studies.resume, lambda of: store.studies.prioritize(of, 3)):
            assert news.wait(DEADLINE)
            assert not news.wait(0.0)
            wish(record.id)
        assert news.wait(DEADLINE)
        with store.session.plain() as connection:
            connection.exec_driver_sql(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE query = 'LISTEN sprag' "
                "AND datname = current_database()"
            )
        eventually(lambda: news.wait(0.0))  # lost, which may mean anything
        eventually(lambda: not news.wait(0.0))
        store.studies.cancel(record.id)
        assert news.wait(DEADLINE)
        news.close()


def test_the_service_answers_as_it_does_with_a_file(
    postgres_url: str, connect: Callable[..., httpx.Client], spec: dict[str, Any]
) -> None:
    settings = Settings(database=postgres_url, chunk_cases=2, processes=2)
    computer = InThread()
    with Store.open(settings.database_url, chunking=chunking(settings)) as store:
        app = create_app(settings, store=store, computer=computer, checker=InThread())
        service = Service(app, connect(app), store, computer)
        study = service.submit(spec)
        rows = service.fill(study)
        found = service.get(f"/studies/{study}/cases")["cases"]
        assert [row["ending"] for row in found] == rows.endings
        assert found[0]["results"]["shaft.speed.mean"] == rows.values[0, 0]
        beyond = base64.urlsafe_b64encode(f'["newest",{"9" * 18},{"9" * 18}]'.encode()).decode().rstrip("=")
        for address, status in {
            f"/studies/{study}/results?format=csv": 200,
            f"/studies/{study}/results?format=parquet": 200,
            f"/studies?page_token={beyond}": 200,
            "/studies?page_token=" + "9" * 18: 422,
            f"/studies/{study}/cases?page_token=" + "9" * 18: 200,
            f"/studies/{study}/cases?ending=a%00b": 422,
            f"/studies/{study}/cases/999999999999999999": 404,
            "/studies/a%00b": 404,
            "/nights/a%00b": 404,
        }.items():
            answer = service.http.get(API + address)
            assert answer.status_code == status, (address, answer.text)
        assert service.http.get("/readyz").status_code == 200


def test_commands_about_the_database(
    postgres_server: postgres.Server, sprag: Callable[..., Finished], tmp_path: Path
) -> None:
    url = postgres_server.url(postgres_server.new_database())
    made = sprag("admin", "db", "upgrade", "--db", url)
    assert (made.code, f"from revision none to {HEAD_REVISION}" in made.out) == (0, True)
    checked = sprag("admin", "db", "check", "--db", url)
    assert (checked.code, checked.out.splitlines()[1]) == (0, "  sound")
    assert "PostgreSQL 1" in checked.out
    refused = sprag("admin", "db", "backup", tmp_path / "copy", "--db", url)
    assert refused.code == 3
    assert "pg_dump" in refused.err
    looked = sprag("admin", "doctor", "--db", url, "--json")
    subjects = {finding["subject"]: finding for finding in looked.data["findings"]}
    assert subjects["database"]["ok"]
    assert "SQLite" not in subjects


# Hand-over, with real processes


def worker(url: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "sprag_study.service.cli", "worker", "--db", url]
    environment = {**os.environ, "SPRAG_PROCESSES": "1"}
    return subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)


def test_workers_share_studies_and_take_over_those_of_one_that_is_killed_or_loses_its_connection(
    postgres_url: str,
) -> None:
    with Store.open(postgres_url, chunking=Chunking(cases=4)) as store:
        workers = [worker(postgres_url), worker(postgres_url)]
        try:
            eventually(lambda: len([record for record in store.dispatchers.all() if record.usable]) == 2)
            studies = [store.studies.create({}, fakes.study(200, f"{number}"), fresh=True) for number in range(4)]
            eventually(lambda: {record.studies for record in store.dispatchers.all()} == {2})
            eventually(lambda: all(store.studies.get(record.id).done for record in studies))
            workers[0].send_signal(signal.SIGKILL)
            eventually(
                lambda: [record.owner.rpartition(":")[2] for record in store.dispatchers.all()] == [f"{workers[1].pid}"]
            )
            workers.append(worker(postgres_url))
            eventually(lambda: len(store.dispatchers.all()) == 2)
            (lost, _) = store.dispatchers.all()

            # Its connection is cut and it does not know; it ends when it asks who is there, or is refused.
            with store.session.plain() as connection:
                connection.exec_driver_sql(
                    "SELECT pg_terminate_backend(pid) FROM pg_locks WHERE locktype = 'advisory' "
                    f"AND classid = {storage.EPOCHS} AND objid = {lost.epoch} "
                    "AND database = (SELECT oid FROM pg_database WHERE datname = current_database())"
                )
            assert workers[1].wait(DEADLINE) == 3
            eventually(lambda: all(store.studies.get(record.id).state is StudyState.FINISHED for record in studies))
            expected = models.run_chunk(fakes.study(200), 0, 200).values
            for record in studies:
                np.testing.assert_array_equal(store.rows.block(record.id, limit=200).values, expected)
        finally:
            for process in workers:
                process.terminate()
            codes = [process.wait(DEADLINE) for process in workers]
            for process in workers:
                assert process.stderr is not None
                process.stderr.close()
        assert codes == [-signal.SIGKILL, 3, 0]


#: Takes the dispatcher's lock, begins to write, and stands still.
STOPPED = """
import os, signal, sys
from sprag_study.service.storage.database.session import Session
session = Session(sys.argv[1])
with session.write() as connection:
    print("ready", flush=True)
    os.kill(os.getpid(), signal.SIGSTOP)
"""


def test_a_worker_that_was_stopped_in_its_transaction_keeps_nobody_from_taking_over(
    postgres_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dispatching, "LOCKED_SECONDS", 1.5)  # a transaction that is idle for less is left alone
    said: list[str] = []
    with Store.open(postgres_url) as store:
        command = [sys.executable, "-c", STOPPED, postgres_url]
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
            assert not store.session.can_write(0.01)
            run_dispatcher(
                WorkerSettings(postgres_url, 1, 60.0), lambda: True, say=said.append,
                executor=lambda _: InlineExecutor(fakes.run), take_over=True,
            )  # fmt: skip
            assert said[0] == "a hung transaction that blocked all others was ended"
            assert store.session.can_write(0.01)
        finally:
            process.kill()
            process.wait()
            assert process.stdout is not None
            process.stdout.close()


def test_a_server_that_crashes_ends_the_worker_with_a_sentence_and_loses_nothing(tmp_path: Path) -> None:
    with postgres.running() as server:
        url = server.url(server.new_database())
        with Store.open(url, chunking=Chunking(cases=4)) as store:
            study = fakes.study(200)  # enough that the first worker is not through before the server crashes
            record = store.studies.create({}, study)
            with worker(url) as process:
                eventually(lambda: store.studies.get(record.id).done > 0)
                server.stop()
                assert process.wait(DEADLINE) == 3
                assert process.stderr is not None
                said = process.stderr.read()
            assert "cannot be reached" in said
            assert "Traceback" not in said
            with refused(DatabaseError, "database-unreachable"):
                store.studies.get(record.id)
            server.start()
            with worker(url) as process:
                eventually(lambda: store.studies.get(record.id).state is StudyState.FINISHED)
                process.terminate()
            assert process.returncode == 0
            block = store.rows.block(record.id, limit=200)
            assert block.cases.tolist() == list(range(200))
            np.testing.assert_array_equal(block.values, models.run_chunk(study, 0, 200).values)
