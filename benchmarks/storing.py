"""How fast rows are stored: the real dispatcher and store with an executor that answers at once.

PostgreSQL is compared with a text COPY of the same rows by psql into the same table, one commit, `fsync` on; SQLite
with an `executemany` of the same rows into the same table, one commit. Both take turns in one run; what counts is the
ratio.

What the digests of the chunks cost is measured in the same runs, as a share of the processor time of the dispatcher,
and of the dispatcher and the server that was started.

    python -m benchmarks.storing [--rows 100000] [--chunks 1000,20] [--in-flight 64] [--repeats 3] [--db URL]

``--db`` is a PostgreSQL database of its own with `fsync` on; without it a server is started in a temporary folder.
"""

from __future__ import annotations

import argparse
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import psutil
import sqlalchemy as sa
from sqlalchemy.engine import make_url

from benchmarks.at_once import AtOnce
from sprag_study.service.storage.database import blocks
from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.service.storage.tables import results_table
from sprag_study.service.storage.work import work
from sprag_study.worker import fingerprint, models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.study import Axis, Study
from tests import postgres
from tests.worker import fakes

#: Settings of the server of the benchmark: those of a server in use.
_SERVER = {"fsync": "on", "shared_buffers": "512MB", "max_wal_size": "4GB", "autovacuum": "on"}


@dataclass(frozen=True, slots=True)
class Spent:
    """Elapsed time, and processor time of this process, in s."""

    elapsed: float
    processor: float


class Meter:
    """Measures what happens in a ``with`` block as ``spent``."""

    def __init__(self) -> None:
        self.spent = Spent(0.0, 0.0)

    def __enter__(self) -> Self:
        self.spent = Spent(time.perf_counter(), time.process_time())
        return self

    def __exit__(self, *_: object) -> None:
        begin = self.spent
        self.spent = Spent(time.perf_counter() - begin.elapsed, time.process_time() - begin.processor)


def study_of(rows: int) -> Study:
    """A one-pendulum study over the load."""
    loads = tuple((np.arange(rows) * 1e-6).tolist())
    return Study("vibration-drive", "storing", dict(fakes.BASE), dict(fakes.RUN), (Axis(("shaft.load",), loads),))


def numbers(rows: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Results with all their digits; counts and categories are small integers."""
    random = np.random.default_rng(1)
    infos = models.result_infos("vibration-drive", "1")
    values = random.normal(size=(rows, len(infos)))
    for index, info in enumerate(infos):
        if info.kind != "real":
            values[:, index] = random.integers(1, 3 if info.kind == "category" else 1000, rows)
    return values


def at_once(values: np.ndarray[Any, np.dtype[np.float64]], in_flight: int) -> AtOnce:
    """An executor that has the results of all cases."""
    return AtOnce(lambda first, count: values[first : first + count], in_flight)


def through_the_dispatcher(store: Store, record: StudyRecord, executor: AtOnce, meter: Meter) -> Spent:
    """Run the study to its end."""
    fingerprint.digest()  # once in a process
    dispatcher = Dispatcher(store.work, executor, SystemClock(), news=store.session.news())
    with meter:
        # The study is read only when nothing is in flight, so that reading is not measured.
        dispatcher.run(lambda: not executor.busy and store.studies.get(record.id).state.terminal)
    assert store.studies.get(record.id).ok == record.cases
    return meter.spent


def by_psql(url: str, record: StudyRecord, other: StudyRecord, folder: Path, meter: Meter) -> Spent:
    """The time of a COPY of the rows of one study into the same table as those of another one, in one commit."""
    found, name = postgres.program("psql"), results_table("vibration-drive", "1").name
    columns = [column.name for column in results_table("vibration-drive", "1").c]
    file = folder / "rows"
    address = make_url(url).set(drivername="postgresql").render_as_string(hide_password=False)

    def psql(*commands: str) -> str:
        assert found is not None
        arguments = [part for command in commands for part in ("-c", command)]
        done = subprocess.run(
            [found, "-X", "-q", "-A", "-t", "-v", "ON_ERROR_STOP=1", *arguments, address],
            check=True, capture_output=True, text=True,
        )  # fmt: skip
        return done.stdout

    chosen = ", ".join([str(other.number), *columns[1:]])
    psql(f"\\copy (SELECT {chosen} FROM {name} WHERE study = {record.number}) TO '{file}'", "CHECKPOINT")
    with meter:
        psql("BEGIN", f"\\copy {name} ({', '.join(columns)}) FROM '{file}'", "COMMIT")
    assert int(psql(f"SELECT count(*) FROM {name} WHERE study = {other.number}")) == record.cases
    return meter.spent


def by_executemany(path: Path, record: StudyRecord, other: StudyRecord, meter: Meter) -> Spent:
    """The time of an `executemany` of the rows of one study into the same table as those of another one."""
    table = results_table("vibration-drive", "1")
    connection = sqlite_driver().connect(path, isolation_level=None)
    connection.execute("PRAGMA synchronous = FULL")
    rows = connection.execute(f"SELECT * FROM {table.name} WHERE study = ?", (record.number,)).fetchall()
    rows = [(other.number, *row[1:]) for row in rows]
    marks = ", ".join("?" * len(table.c))
    with meter:
        connection.execute("BEGIN IMMEDIATE")
        connection.executemany(f"INSERT INTO {table.name} VALUES ({marks})", rows)
        connection.execute("COMMIT")
    (stored,) = connection.execute(f"SELECT count(*) FROM {table.name} WHERE study = ?", (other.number,)).fetchone()
    assert stored == record.cases
    connection.close()
    return meter.spent


def measure(server: Server, folder: Path, rows: int, size: int, in_flight: int, repeats: int) -> None:
    """The two in turn; print the least time of each and their ratio."""
    values, study, meter = numbers(rows), study_of(rows), Meter()
    ours: list[Spent] = []
    theirs: list[Spent] = []
    shares: list[float] = []
    of_all: list[float] = []
    with Store.open(server.url, chunking=Chunking(cases=size)) as store:
        # Statements are compiled once in a process.
        warming = store.studies.create({}, study, fresh=True)
        with DigestCost():
            through_the_dispatcher(store, warming, at_once(values, in_flight), meter)
        store.studies.delete(warming.id)
        store.purging.purge()
        for _ in range(repeats):
            record = store.studies.create({}, study, fresh=True)
            at_server = server.processor()
            with DigestCost() as cost:
                spent = through_the_dispatcher(store, record, at_once(values, in_flight), meter)
            ours.append(Spent(spent.elapsed - cost.doubled, spent.processor - cost.doubled))
            shares.append(cost.total / ours[-1].processor)
            of_all.append(cost.total / (ours[-1].processor + server.processor() - at_server))
            other = store.studies.create({}, study, fresh=True)
            store.studies.cancel(other.id)
            store.work.settle(store.work.take_over("benchmark"), other.number)
            if store.session.on_server:
                theirs.append(by_psql(server.url, record, other, folder, meter))
            else:
                theirs.append(by_executemany(store.session.path, record, other, meter))
            for done in (record, other):
                store.studies.delete(done.id)
            store.purging.purge()
            if store.session.on_server:
                with store.session.plain() as connection:
                    connection.exec_driver_sql("VACUUM vibration_drive_1")
    report(server.rival, rows, size, ours, theirs)
    print(f"    of it for digests {min(shares):.1%} to {max(shares):.1%}", flush=True)
    if server.data is not None:
        print(f"    of it and the server's time {min(of_all):.1%} to {max(of_all):.1%}", flush=True)


def report(rival: str, rows: int, size: int, ours: list[Spent], theirs: list[Spent]) -> None:
    """Print the least time of each and their ratio."""
    own, other = (min(spent.elapsed for spent in all_of) for all_of in (ours, theirs))
    work = min(spent.processor for spent in ours) / rows * 1e6
    print(
        f"chunks of {size:5d}: {rows / own:8,.0f} rows/s, {rival} {rows / other:8,.0f} rows/s: {other / own:4.0%}; "
        f"processor time of the dispatcher {work:5.1f} us a row",
        flush=True,
    )


class Turns:
    """Processor time of a step with digests, less that of what the step was without them.

    The two take turns: every other call does what it was without digests first, then the step, whose time is
    ``doubled`` then. So that neither finds in the processor's cache what the other has read.
    """

    def __init__(self, step: Callable[..., Any], without: Callable[..., Any]) -> None:
        self._step, self._without = step, without
        self._calls = 0
        self.doubled = 0.0
        #: Seconds and amounts of work of the two.
        self._spent = [[0.0, 0], [0.0, 0]]

    @property
    def cost(self) -> float:
        """What digests add, in s."""
        without, with_digests = (spent / max(amount, 1) for spent, amount in self._spent)
        return (with_digests - without) * sum(amount for _, amount in self._spent)

    def run(self, amount: int, *values: Any) -> Any:
        """Run the step on so much work."""
        self._calls += 1
        turn = self._calls % 2
        began = time.thread_time()
        if not turn:
            self._without(*values)
        middle = time.thread_time()
        answer = self._step(*values)
        end = time.thread_time()
        self._spent[turn][0] += (end if turn else middle) - began
        self._spent[turn][1] += amount
        self.doubled += 0.0 if turn else end - middle
        return answer


class DigestCost:
    """Processor time in s of what computes and stores digests, while the context lasts.

    Digests are stored by the statement that marks chunks done, and numbers are brought into the form that the database
    keeps where they were looked through for infinities only: of these steps what digests add counts.
    """

    def __init__(self) -> None:
        self.computing = 0.0

    @property
    def total(self) -> float:
        """With what storing them takes."""
        return self.computing + self._keeping.cost + self._marking.cost

    @property
    def doubled(self) -> float:
        """Time of steps that were run for this measurement only."""
        return self._keeping.doubled + self._marking.doubled

    def __enter__(self) -> Self:
        self._steps = [
            (blocks, "as_kept"),
            (work, "_words"),
            (work, "_digests"),
            (work, "finish_chunks"),
        ]
        keep, words, digests, mark = self._real = [getattr(module, name) for module, name in self._steps]
        self._keeping = Turns(keep, lambda values: np.isinf(values).any())
        self._marking = Turns(mark, work.change_chunks)
        new = [self._keep, self._timed(words), self._timed(digests), self._mark]
        for (module, name), step in zip(self._steps, new, strict=True):
            setattr(module, name, step)
        return self

    def __exit__(self, *_: object) -> None:
        for (module, name), step in zip(self._steps, self._real, strict=True):
            setattr(module, name, step)

    def _timed(self, step: Callable[..., Any]) -> Callable[..., Any]:
        def run(*values: Any, **named: Any) -> Any:
            began = time.thread_time()
            try:
                return step(*values, **named)
            finally:
                self.computing += time.thread_time() - began

        return run

    def _keep(self, values: np.ndarray[Any, Any]) -> Any:
        return self._keeping.run(values.size, values)

    def _mark(self, connection: sa.Connection, digests: Mapping[Any, int], values: Mapping[str, Any]) -> None:
        self._marking.run(len(digests), connection, digests, values)


@dataclass(frozen=True, slots=True)
class Server:
    """A database, and what it is compared with."""

    url: str
    rival: str
    data: Path | None = None

    def processor(self) -> float:
        """Processor time in s of the processes of the server so far; 0 where they are not known."""
        if self.data is None:
            return 0.0
        main = psutil.Process(int((self.data / "postmaster.pid").read_text().split()[0]))
        own = main.cpu_times()
        ended = own.children_user + own.children_system
        spent = ended + own.user + own.system
        for child in main.children(recursive=True):
            with suppress(psutil.NoSuchProcess):  # it has just ended
                times = child.cpu_times()
                spent += times.user + times.system
        return spent


@contextmanager
def on_server(url: str) -> Iterator[Server]:
    """The PostgreSQL database to use."""
    if url:
        yield Server(url, "psql")
        return
    with postgres.running(**_SERVER) as started:
        yield Server(started.url(started.new_database()), "psql", started.data)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=100_000)
    parser.add_argument("--chunks", default="1000,20", help="cases of a chunk, several separated by commas")
    parser.add_argument("--in-flight", type=int, default=64, help="chunks in flight, as with about that many workers")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--db", default="")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, on_server(options.db) as server:
        folder = Path(name)
        for database in (Server(f"sqlite:///{folder / 'storing.sqlite3'}", "executemany"), server):
            for size in map(int, options.chunks.split(",")):
                measure(database, folder, options.rows, size, options.in_flight, options.repeats)


if __name__ == "__main__":
    main()
