"""A running service that drills do things to, and the comparison of its rows with an undisturbed run."""

from __future__ import annotations

import copy
import json
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import psutil

from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.storage.database.sqlite_files import sqlite_driver
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.study import Study

ROOT = Path(__file__).resolve().parents[2]
COMMAND = (sys.executable, "-m", "sprag_study.service.cli")
#: Generous: the machine may be busy.
PATIENCE = 600.0
_LOOK = 0.1
_ORPHANED = "EOFError: Ran out of input"


def environment(**more: str) -> dict[str, str]:
    """The environment without the user's settings of the program, except where compiled kernels lie.

    One process checks specs: each loads the engine when a service starts, and drills start many services. A service may
    take long to stop, because the machine may be busy.
    """
    kept = {k: v for k, v in os.environ.items() if not k.startswith("SPRAG_") or k == "SPRAG_KERNEL_CACHE"}
    set_here = {"SPRAG_CHECK_PROCESSES": "1", "SPRAG_STOP_SECONDS": f"{PATIENCE:g}"}
    return {**kept, "PYTHONPATH": str(ROOT), **set_here, **more}


@cache
def _empty_database() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sprag.sqlite3"
        Store.open(f"sqlite:///{file}").close()
        return file.read_bytes()


def with_tables(database: Path) -> Path:
    """The path of a database, which is made with the tables where there is none.

    A new process needs more than a second of processor time to make them, and this one makes them once.
    """
    if not database.exists():
        database.touch(mode=0o600)
        database.write_bytes(_empty_database())
    return database


def free_port() -> int:
    """A port that nobody listens on, below those that the system gives to connections in the meantime."""
    for port in random.SystemRandom().sample(range(20_000, 32_000), 1_000):
        with suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return port
    raise AssertionError("no port is free")


def until(condition: Callable[[], object], what: str, patience: float = PATIENCE, look: float = _LOOK) -> None:
    """Wait until ``condition()`` holds, with ``look`` seconds between two looks."""
    deadline = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < deadline, f"waited {patience:g} s in vain until {what}"
        time.sleep(look)


def kill_family(process: subprocess.Popen[bytes]) -> None:
    """kill -9 of a process and of what it has started."""
    family = []
    with suppress(psutil.Error):
        family = psutil.Process(process.pid).children(recursive=True)
    process.kill()
    process.wait()
    for child in family:
        with suppress(psutil.Error):
            child.kill()
    psutil.wait_procs(family, timeout=PATIENCE)


def spec(cases: int, periods: float = 60.0) -> dict[str, Any]:
    """The one-pendulum example with one axis of that many loads, so that a load names a case."""
    made: dict[str, Any] = json.loads(preset_text("one_pendulum")[1])
    made["axes"] = [{"path": "shaft.load", "linspace": [0.01, 0.5, cases]}]
    made["run"] = {"duration": f"{periods:g} periods"}
    return made


def study_of(made: Mapping[str, Any]) -> Study:
    """The study of a spec."""
    return parse_spec(load_spec(json.dumps(made), "json")).study


def load_of(made: Mapping[str, Any], case: int) -> float:
    """Value of the load of a case, as the fault hook of the engine takes it."""
    return float(study_of(made).case_parameters(case)["shaft.load"])


class Service:
    """``sprag serve`` on a database in ``folder``, which can be killed and started again."""

    def __init__(self, folder: Path, *options: object, **environment: str) -> None:
        self.database = folder / "sprag.sqlite3"
        self.log = folder / "service.log"
        self._options = [str(option) for option in options]
        self._environment = environment
        self.before_exec: Callable[[], None] | None = None

    def start(self) -> None:
        """Start it; returns when it listens."""
        with_tables(self.database)
        command = [*COMMAND, "serve", "--json", "--port", "0", "--db", str(self.database), *self._options]
        with self.log.open("ab") as errors:
            self.process = subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=errors, env=environment(**self._environment),
                preexec_fn=self.before_exec,  # noqa: PLW1509 - no thread of this process is running then
            )  # fmt: skip
        assert self.process.stdout is not None
        with self.process.stdout as output:
            line = output.readline()
        assert line, self.log.read_text()
        self.http = httpx.Client(base_url=f"{json.loads(line)['address']}/api/v1", timeout=PATIENCE, trust_env=False)

    def dispatcher(self) -> psutil.Process | None:
        """The process of its dispatcher, if it has taken the lock."""
        with suppress(OSError, ValueError, psutil.Error):
            noted = self.database.with_name("sprag.sqlite3.lock").read_text(encoding="utf-8")
            holder = psutil.Process(int(noted.split(" ")[0]))
            if holder.ppid() == self.process.pid and holder.status() != psutil.STATUS_ZOMBIE:
                return holder
        return None

    def pool(self) -> list[psutil.Process]:
        """The processes of the pool."""
        found = []
        with suppress(psutil.Error):
            for child in dispatcher.children() if (dispatcher := self.dispatcher()) else []:
                with suppress(psutil.Error):  # one that was killed before may still be listed
                    if "spawn_main" in " ".join(child.cmdline()):
                        found.append(child)
        return found

    def kill(self) -> None:
        """kill -9, and wait until nothing of it is left."""
        _READER.close()
        family = psutil.Process(self.process.pid).children(recursive=True)
        self.http.close()
        self.process.kill()
        self.process.wait()
        for child in family:
            with suppress(psutil.Error):
                child.resume()  # a drill may have suspended it, and then it does not notice
        assert psutil.wait_procs(family, timeout=PATIENCE)[1] == [], "a process outlived the service"

    def stop(self) -> float:
        """SIGTERM; seconds until everything had ended in order."""
        _READER.close()
        self.http.close()
        family = psutil.Process(self.process.pid).children(recursive=True)
        begin = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(PATIENCE)
        seconds = time.monotonic() - begin
        assert code == 0, self.log.read_text()
        assert psutil.wait_procs(family, timeout=PATIENCE)[1] == [], "a process outlived the service"
        # A process whose parent is killed while it starts finds its pipe closed, and Python says so.
        log = self.log.read_text()
        assert log.count("Traceback") == log.count(_ORPHANED), log[-20_000:]
        return seconds

    def submit(self, made: Mapping[str, Any], **headers: str) -> str:
        """Submit a study; its id."""
        answer = self.http.post("/studies", json=made, headers=headers)
        assert answer.status_code == 202, answer.text
        return str(answer.json()["id"])

    def look(self, study: str) -> dict[str, Any]:
        """A study as the service shows it."""
        answer = self.http.get(f"/studies/{study}")
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found

    def finish(self, study: str) -> dict[str, Any]:
        """Wait until a study has finished; the study."""
        until(lambda: asked(self.database, "SELECT finished_at FROM studies WHERE id = ?", study), f"{study} ended")
        found = self.look(study)
        assert found["state"] == "finished", found
        return found


@contextmanager
def running(folder: Path, *options: object, **environment: str) -> Iterator[Service]:
    """A service that has ended, in order, when the block is left."""
    service = Service(folder, *options, **environment)
    service.start()
    try:
        yield service
    except BaseException:
        service.kill()
        raise
    service.stop()


class _Reader:
    """A connection that reads a database, kept for the next question.

    To open one takes 20 ms of processor time, as SQLite reads the definitions of all tables: a drill that asks ten
    times a second would spend a fifth of a core.
    """

    def __init__(self) -> None:
        self._file: tuple[Path, int] | None = None
        self._connection: Any = None

    def of(self, database: Path) -> Any:
        """A connection to the file that is there now."""
        file = (database, database.stat().st_ino)
        if file != self._file:
            self.close()
            self._connection = sqlite_driver().connect(f"file:{database}?mode=ro", uri=True, timeout=PATIENCE)
            self._file = file
        return self._connection

    def close(self) -> None:
        """Close it, so that the last process that leaves the database tidies its log up."""
        if self._connection is not None:
            self._connection.close()
        self._file = self._connection = None


_READER = _Reader()


def asked(database: Path, query: str, *values: object) -> Any:
    """The first column of the first row that the database gives; only one thread asks."""
    row = _READER.of(database).execute(query, values).fetchone()
    return None if row is None else row[0]


def locked(database: Path) -> bool:
    """Whether another process is writing to the database at this moment."""
    connection = sqlite_driver().connect(database, timeout=0)
    try:
        connection.execute("BEGIN IMMEDIATE")
        connection.execute("ROLLBACK")
    except sqlite_driver().OperationalError:
        return True
    finally:
        connection.close()
    return False


def suspended(process: psutil.Process, database: Path) -> bool:
    """Suspend a process, unless it is in a transaction: the lock that it holds would keep everybody else waiting."""
    process.suspend()
    if not locked(database):
        return True
    process.resume()
    return False


def done(database: Path, study: str) -> int:
    """Cases of a study that have an ending."""
    return int(asked(database, "SELECT done FROM studies WHERE id = ?", study) or 0)


def compare(
    database: Path,
    study_id: str,
    made: Mapping[str, Any],
    odd: Mapping[int, str] | None = None,
    ranges: Sequence[tuple[int, int]] = (),
) -> None:
    """Hold every row to an undisturbed run of the same spec in this process, bit for bit.

    ``odd`` tells the cases that end in another way, without results. With ``ranges`` (first case, number of cases) only
    the values of those cases are computed and compared; every ending has to be right. The database has to be sound.
    """
    study = study_of(copy.deepcopy(dict(made)))
    endings = ["ok"] * study.cases
    computed = [models.run_chunk(study, *part) for part in ranges or [(0, study.cases)]]
    for case, ending in (odd or {}).items():
        endings[case] = ending
    with Store.open(f"sqlite:///{database}") as store:
        blocks = list(store.rows.blocks(study_id))
        cases = np.concatenate([block.cases for block in blocks])
        missing = set(range(study.cases)) - set(cases.tolist())
        assert not missing, f"{len(missing)} missing rows: {sorted(missing)[:10]}"
        assert len(cases) == study.cases, f"{len(cases) - study.cases} duplicate rows"
        assert [ending for block in blocks for ending in block.endings] == endings
        values = np.concatenate([block.values for block in blocks])
        for part in computed:
            assert set(part.endings) == {"ok"}
            for case in set(odd or ()) & set(range(part.first, part.first + part.count)):
                part.values[case - part.first] = np.nan
            np.testing.assert_array_equal(values[part.first : part.first + part.count], part.values)
        counted = store.studies.progress(study_id)
        assert counted.endings == {ending: endings.count(ending) for ending in set(endings)}
        assert (counted.done, counted.ok) == (study.cases, endings.count("ok"))
        problems = [problem for problem in store.check().problems if "can corrupt" not in problem]
        assert not problems, problems
