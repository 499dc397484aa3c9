"""Processor time of a preview beside many kindred studies, and what their keys cost when they are submitted.

python -m benchmarks.kindred [--studies 20000] [--cases 1000] [--db URL]

The studies are samples over the same ranges of two parameters that look as if they had been run; none shares a case
with the study that is previewed. "by comparing" is the same search where no study has keys, as before revision 0035,
beside a twentieth of the studies; the others are copies of one with keys of a sample. Times are the least of several,
and are also given relative to a preview in an empty database. ``--db``: an empty PostgreSQL database, whose server's
processor time is not counted.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from time import process_time

import numpy as np
import sqlalchemy as sa

from sprag_study.service.storage.rows.case_keys import add_keys
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.study_row import study_row
from sprag_study.service.storage.tables import STUDIES
from sprag_study.worker import fingerprint
from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.study import Axis, Study
from tests.worker import fakes

#: The part of the studies beside which a search by comparing is measured.
_SHARE = 20
#: Studies that are written in one transaction.
_AT_ONCE = 200


def sample(cases: int, random: np.random.Generator) -> Study:
    """A sample of two parameters."""
    axes = (
        Axis(("shaft.load",), random.uniform(0.1, 0.5, cases)),
        Axis(("excitation.frequency",), random.uniform(20.0, 30.0, cases)),
    )
    return Study("vibration-drive", "sample", dict(fakes.BASE), dict(fakes.RUN), axes, "zip")


def previewed(store: Store, cases: int, repeats: int = 15) -> float:
    """Least processor time (s) of the search for reusable cases of a new sample."""
    random, times = np.random.default_rng(2), []
    for _ in range(repeats):
        study = sample(cases, random)
        began = process_time()
        assert store.reuse.count(study) == 0
        times.append(process_time() - began)
    return min(times)


def main() -> int:
    """Fill a database with samples, measure previews on the way."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--studies", type=int, default=20_000)
    parser.add_argument("--cases", type=int, default=1_000)
    parser.add_argument("--db")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        url = options.db or f"sqlite:///{folder}/kindred.sqlite3"
        with Store.open(url, chunking=Chunking(cases=200)) as store:
            return measure(store, options.studies, options.cases)


def measure(store: Store, studies: int, cases: int) -> int:
    """Print the figures; 1 where a preview takes more than 0.3 s."""
    random = np.random.default_rng(1)
    unit = previewed(store, cases)
    print(f"preview in an empty database       {1e3 * unit:8.2f} ms")
    submitted(store, cases, random)
    began = process_time()
    keys = case_keys(sample(cases, random), "kin")
    print(f"computing the keys of a study      {1e3 * (process_time() - began):8.2f} ms  for {keys.size:,} cases")
    slow = 0
    for count in (studies // _SHARE, studies):
        fill(store, count, cases, random)
        with_keys = previewed(store, cases)
        slow += with_keys > 0.3
        print(f"preview beside {count:6,} studies       {1e3 * with_keys:8.2f} ms  {with_keys / unit:6.1f} x")
        if count < studies:
            with store.session.write() as connection:
                connection.execute(sa.update(STUDIES).values(keyed=0))
            old = previewed(store, cases, repeats=3)
            print(f"  by comparing                     {1e3 * old:8.2f} ms  {old / unit:6.1f} x")
            with store.session.write() as connection:
                connection.execute(sa.update(STUDIES).values(keyed=1))
    return int(slow > 0)


def submitted(store: Store, cases: int, random: np.random.Generator) -> None:
    """Print the processor time here of the transaction that submits a sample, with its keys and without."""
    least = dict.fromkeys(("without keys", "with keys"), np.inf)
    for _ in range(20):
        row = study_row({}, sample(cases, random), store.dispatchers.chunking)
        bare = {name: value for name, value in row.items() if name != "keys"}
        for what, written in (("without keys", bare), ("with keys", row)):
            began = process_time()
            store.studies.insert(written)
            least[what] = min(least[what], process_time() - began)
    more = 1e6 * (least["with keys"] - least["without keys"]) / cases
    for what, seconds in least.items():
        print(f"submission {what:<23} {1e3 * seconds:8.2f} ms")
    print(f"  more for each case               {more:8.2f} us")


def fill(store: Store, count: int, cases: int, random: np.random.Generator) -> None:
    """Write samples until there are so many studies, all of them as if they had been run."""
    real = count <= 1_000
    with store.session.write() as connection:
        connection.execute(sa.update(STUDIES).values(keyed=1))
        row = dict(connection.execute(sa.select(STUDIES).order_by(STUDIES.c.number).limit(1)).mappings().one())
        there = connection.execute(sa.select(sa.func.max(STUDIES.c.number))).scalar_one()
    row |= {"done": cases, "state": "finished", "fingerprint": fingerprint.digest(), "digest": None}
    for first in range(there + 1, count + 1, _AT_ONCE):
        with store.session.write() as connection:
            for number in range(first, min(first + _AT_ONCE, count + 1)):
                study = sample(cases, random)
                own = {"number": number, "id": f"st_{number}", **({"study": study.to_text()} if real else {})}
                connection.execute(sa.insert(STUDIES).values({**row, **own}))
                add_keys(connection, number, case_keys(study, row["kin_hash"]))
    with store.session.write() as connection:
        seen = {"done": cases, "state": "finished", "fingerprint": fingerprint.digest()}
        connection.execute(sa.update(STUDIES).where(STUDIES.c.number <= there).values(seen))


if __name__ == "__main__":
    sys.exit(main())
