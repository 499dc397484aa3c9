"""A study of as many cases as one may have, run and read back: time, and memory of each process.

    python -m benchmarks.ten_million [--cases 10000000] [--postgres | --db URL] [--formats csv,parquet,arrow]

The cases are not computed: an executor answers at once, so what is measured is submission, the dispatcher, the database
and the exports. Every number is compared when all rows are read; of the exports only the lines of CSV are counted. Each
step runs in a process of its own, whose peak memory is that of the step. ``--postgres`` starts a PostgreSQL server with
`fsync` on, ``--db`` is a database of its own on a server that runs; without them, SQLite in a temporary folder.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.at_once import AtOnce
from sprag_study.service import exports
from sprag_study.service.exports.source import stored
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Axis, Study
from tests import postgres

RESULTS = len(models.result_infos("vibration-drive", "1"))
#: Cases of a chunk, and values of the inner axes.
CHUNK, INNER = 4_000, 1_000
FORMATS = ("csv", "parquet", "arrow")


def values_of(cases: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Results of full precision, different for every case: shape (cases, results)."""
    found: np.ndarray[Any, Any] = np.sqrt(cases[:, None] + 1.0) * (1.0 + np.arange(RESULTS) / 7.0)
    for column, info in enumerate(models.result_infos("vibration-drive", "1")):
        if info.kind != "real":
            found[:, column] = cases % 1000
    return found


def study_of(cases: int) -> Study:
    """A grid of that many cases, a multiple of the square of `INNER`; of that square for fewer."""
    base = {"excitation.amplitude_y": 2e-3, "pendulums.0.inertia": 1e-3, "shaft.inertia": 2e-3}
    base |= {"clutch.coefficients.0": 0.0, "clutch.coefficients.1": 200.0}
    run = {"duration": [3.0, "periods"], "window": None, "tolerance": 1e-9, "reset": "contact"}
    loads, speeds = np.arange(INNER) * 1e-3, 10.0 + np.arange(INNER) * 0.05
    outer = max(1, cases // INNER**2)
    axes = (
        Axis(("pendulums.0.mass",), tuple((0.1 + np.arange(outer) * 0.01).tolist())),
        Axis(("excitation.frequency",), tuple(speeds.tolist())),
        Axis(("shaft.load",), tuple(loads.tolist())),
    )
    return Study("vibration-drive", "as many as one may have", base, run, axes)


def submit(store: Store, cases: int) -> dict[str, Any]:
    """Submit the study."""
    return {"cases": store.studies.create({}, study_of(cases), fresh=True).cases}


def run(store: Store, cases: int) -> dict[str, Any]:
    """Let a dispatcher run it."""
    (record,) = store.studies.page().studies
    executor = AtOnce(lambda first, count: values_of(np.arange(first, first + count)))
    Dispatcher(store.work, executor, SystemClock()).run(lambda: store.studies.get(record.id).state.terminal)
    record = store.studies.get(record.id)
    assert (record.state, record.ok) == (StudyState.FINISHED, cases), record
    return {"state": record.state.value}


def rows(store: Store, cases: int) -> dict[str, Any]:
    """Read every row and compare it."""
    (record,) = store.studies.page().studies
    seen = 0
    for block in store.rows.blocks(record.id):
        assert np.array_equal(block.cases, np.arange(seen, seen + len(block)))
        assert np.array_equal(block.values, values_of(block.cases))
        seen += len(block)
    assert seen == cases
    return {"rows": seen}


def exported(form: Any) -> Callable[[Store, int], dict[str, Any]]:
    """Write the file piece by piece to nowhere."""

    def write(store: Store, cases: int) -> dict[str, Any]:
        (record,) = store.studies.page().studies
        source = stored(store, record, store.studies.study(record.id))
        size = lines = 0
        for piece in exports.export(source, form):
            size += len(piece)
            lines += piece.count(b"\n") if form == "csv" else 0
        assert form != "csv" or lines == cases + 1
        return {"GB": round(size / 1e9, 2)}

    return write


STEPS: dict[str, Callable[[Store, int], dict[str, Any]]] = {
    "submit": submit,
    "run": run,
    "rows": rows,
    **{form: exported(form) for form in FORMATS},
}


def step(name: str, url: str, cases: int) -> None:
    """One step in this process; prints its figures."""
    with Store.open(url, chunking=Chunking(cases=CHUNK)) as store:
        before, begin = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.perf_counter()
        figures = STEPS[name](store, cases)
        seconds = time.perf_counter() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    memory = {"seconds": round(seconds, 1), "cases/s": round(cases / seconds), "peak MB": peak // 1024}
    print(json.dumps({"step": name, **figures, **memory, "before MB": before // 1024}), flush=True)


def commands(url: str, cases: int, formats: Sequence[str]) -> Iterator[list[str]]:
    """The command of each step."""
    for name in ("submit", "run", "rows", *formats):
        yield [sys.executable, "-m", "benchmarks.ten_million", "--step", name, "--db", url, "--cases", str(cases)]


@contextmanager
def database(url: str, *, start: bool) -> Iterator[tuple[str, Callable[[], int]]]:
    """The database of that URL, of a server that is started, or in a temporary file; and what gives its bytes."""
    if url or start:
        with ExitStack() as stack:
            if start:
                server = stack.enter_context(postgres.running(fsync="on", max_wal_size="4GB"))
                url = server.url(server.new_database())
            yield url, lambda: bytes_on_server(url)
        return
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "a.sqlite3"
        yield f"sqlite:///{file}", lambda: sum(path.stat().st_size for path in Path(folder).iterdir())


def bytes_on_server(url: str) -> int:
    """Size of the database of a server."""
    with Store.open(url) as store, store.session.plain() as connection:
        return int(connection.exec_driver_sql("SELECT pg_database_size(current_database())").scalar_one())


def main() -> None:
    """Run all steps, each in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--cases", type=int, default=10_000_000, help=f"a multiple of {INNER**2:,}; default: %(default)s"
    )
    parser.add_argument("--postgres", action="store_true")
    parser.add_argument("--db", default="")
    parser.add_argument("--formats", default=",".join(FORMATS), help="separated by commas; each is an export")
    parser.add_argument("--step", choices=STEPS, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.cases < INNER**2 or options.cases % INNER**2:
        parser.error(f"--cases: must be a multiple of {INNER**2:,}, at least one of it")
    if options.step:
        step(options.step, options.db, options.cases)
        return
    with database(options.db, start=options.postgres) as (url, size):
        for command in commands(url, options.cases, [form for form in options.formats.split(",") if form]):
            subprocess.run(command, check=True)
        print(json.dumps({"database GB": round(size() / 1e9, 2)}))


if __name__ == "__main__":
    main()
