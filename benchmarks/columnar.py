"""Rows of results as rows of PostgreSQL against a Parquet file for each chunk, without the index of the files.

    python -m benchmarks.columnar [--rows 1000000] [--db URL]

Both store the same chunks, durably (``fsync``), five at a time, and answer the same questions: all rows, a thousand
cases at random, the extreme of one result. A file is found by the first case in its name, where a database would keep
rows about the files. The data are smooth functions of the parameters with all their digits, as results are.
Printed are time and room, and what both would be for 10^9 rows. Without ``--db`` a server is started.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from benchmarks.at_once import timed
from benchmarks.ten_million import CHUNK, INNER, study_of, values_of
from sprag_study.service.storage.database.private_files import sync_folder
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.ports import Finished

INFOS = models.result_infos("vibration-drive", "1")
NAMES = [info.column for info in INFOS]
#: The result whose extreme is asked for, chunks of one transaction, and the number that is extrapolated to.
ASKED, GROUP, TARGET = NAMES[0], 5, 1e9


def chosen(rows: int) -> np.ndarray[Any, Any]:
    """A thousand cases at random."""
    return np.sort(np.random.default_rng(1).choice(rows, min(1000, rows), replace=False))


def rows_of_postgres(url: str, rows: int) -> tuple[dict[str, float], float]:
    """Seconds and bytes of the store on a server, and the extreme."""
    with Store.open(url, chunking=Chunking(cases=CHUNK)) as store:
        record = store.studies.create({}, study_of(rows), fresh=True)
        epoch = store.work.take_over("benchmark")
        chunks = [chunk for chunk in store.work.open_chunks(record.number) if chunk.first < rows]
        writing = 0.0
        for first in range(0, len(chunks), GROUP):
            group = store.work.claim(epoch, chunks[first : first + GROUP])
            finished = [
                Finished(chunk, ChunkResult(chunk.first, ["ok"] * chunk.count, [""] * chunk.count,
                    values_of(np.arange(chunk.first, chunk.first + chunk.count))))
                for chunk in group
            ]  # fmt: skip
            writing += timed(lambda finished=finished: store.work.exchange(epoch, finished))[0]
        reading, count = timed(lambda: sum(len(block) for block in store.rows.blocks(record.id)))
        assert count == rows
        cases = chosen(rows)
        picking, found = timed(lambda: store.rows.for_cases(record.id, cases, [INFOS[0].name]))
        assert len(found.endings) == cases.size
        with store.session.plain() as connection:
            asking, extreme = timed(
                lambda: connection.exec_driver_sql(
                    f"SELECT max({ASKED}) FROM vibration_drive_1 WHERE study = {record.number}"
                ).scalar_one()
            )
            size = connection.exec_driver_sql("SELECT pg_total_relation_size('vibration_drive_1')").scalar_one()
    return {"write": writing, "read": reading, "pick": picking, "extreme": asking, "bytes": size}, float(extreme)


def write_part(folder: Path, cases: np.ndarray[Any, Any], values: np.ndarray[Any, Any]) -> None:
    """Store a chunk as a file; the name of the file is its first case."""
    ending = pa.DictionaryArray.from_arrays(np.zeros(cases.size, dtype=np.int8), ["ok"])
    columns = [cases, ending, *(values[:, index] for index in range(values.shape[1]))]
    table = pa.table(columns, names=["case_number", "ending", *NAMES])
    part = folder / f"{cases[0]}.part"
    with part.open("wb") as file:
        pq.write_table(table, file, compression="zstd")
        file.flush()
        os.fsync(file.fileno())
    part.rename(folder / f"{cases[0]}.parquet")


def parts_of_parquet(folder: Path, rows: int) -> tuple[dict[str, float], float]:
    """Seconds and bytes of a file for each chunk, and the extreme."""
    writing = 0.0
    for first in range(0, rows, GROUP * CHUNK):
        begins = range(first, min(first + GROUP * CHUNK, rows), CHUNK)
        chunks = [(cases, values_of(cases)) for cases in (np.arange(begin, begin + CHUNK) for begin in begins)]

        def store(chunks: list[Any] = chunks) -> None:
            for cases, values in chunks:
                write_part(folder, cases, values)
            sync_folder(folder)

        writing += timed(store)[0]
    files = [folder / f"{first}.parquet" for first in range(0, rows, CHUNK)]
    reading, count = timed(lambda: sum(pq.read_table(file).num_rows for file in files))
    assert count == rows
    cases = chosen(rows)

    def pick() -> int:
        found = 0
        for first in np.unique(cases // CHUNK * CHUNK):
            inside = cases[cases // CHUNK * CHUNK == first] - first
            found += pq.read_table(folder / f"{first}.parquet", columns=[NAMES[0]]).take(inside).num_rows
        return found

    picking, picked = timed(pick)
    assert picked == cases.size
    asking, extreme = timed(lambda: max(pc.max(pq.read_table(file, columns=[ASKED])[ASKED]).as_py() for file in files))
    size = sum(file.stat().st_size for file in files)
    return {"write": writing, "read": reading, "pick": picking, "extreme": asking, "bytes": size}, float(extreme)


def main() -> None:
    """Measure both and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    limits = f"a multiple of {CHUNK:,}, above {INNER**2:,} of {INNER**2:,}"
    parser.add_argument("--rows", type=int, default=1_000_000, help=f"{limits}; default: %(default)s")
    parser.add_argument("--db", default="")
    options = parser.parse_args()
    if options.rows < CHUNK or options.rows % (CHUNK if options.rows <= INNER**2 else INNER**2):
        parser.error(f"--rows: must be {limits}")
    with tempfile.TemporaryDirectory() as folder:
        parts, highest = parts_of_parquet(Path(folder), options.rows)
    if options.db:
        server, extreme = rows_of_postgres(options.db, options.rows)
    else:
        from tests import postgres

        with postgres.running(fsync="on") as made:
            server, extreme = rows_of_postgres(made.url(made.new_database()), options.rows)
    assert highest == extreme, (highest, extreme)
    scale = TARGET / options.rows
    print(f"{options.rows:,} rows of {len(NAMES)} results, chunks of {CHUNK:,}; in brackets for 1e9 rows")
    for name, unit in (("write", "s"), ("read", "s"), ("pick", "s"), ("extreme", "s"), ("bytes", "B")):
        a, b = server[name], parts[name]
        grown = f"  [{a * scale:,.0f} and {b * scale:,.0f} {unit}]" if name != "pick" else ""
        print(f"{name:8} PostgreSQL {a:,.2f} {unit}, Parquet {b:,.2f} {unit}, ratio {a / b:.2f}{grown}")


if __name__ == "__main__":
    main()
