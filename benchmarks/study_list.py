"""Times of pages of a long list of studies, in every order and with searches.

python -m benchmarks.study_list [--studies 20000]

Names, notes and tags are made up. Times are medians of 15, also given relative to the first page of the newest studies.
"""

from __future__ import annotations

import argparse
import random
import tempfile
from statistics import median
from time import perf_counter

import sqlalchemy as sa

from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.listing import StudyFilter, StudyOrder, search_text
from sprag_study.service.storage.tables import STUDIES
from sprag_study.worker.chunking import Chunking
from tests.worker import fakes

_WORDS = ("feeder", "Förderer", "press", "Zahnrad", "Kurbel", "slider", "drive", "clutch", "Antrieb", "night")


def fill(store: Store, studies: int) -> None:
    """Make so many rows of studies with names, notes and tags, as copies of one."""
    drawn = random.Random(3)
    store.studies.create({"sprag": 1, "name": "one"}, fakes.study(3, "one"))
    with store.session.write() as connection:
        one = dict(connection.execute(sa.select(STUDIES)).mappings().one())
        rows = []
        for number in range(2, studies + 1):
            name, tag = f"{drawn.choice(_WORDS)} {drawn.choice(_WORDS)} {number}", drawn.choice(_WORDS)
            notes = " ".join(drawn.choices(_WORDS, k=60))
            own = {
                "number": number,
                "id": f"st_{number:016x}",
                "name": name,
                "notes": notes,
                "tags": f"\n{tag}\n",
                "digest": None,
            }
            search = search_text(name, (tag,), notes)
            rows.append({**one, **own, "search": search, "cases": drawn.randint(1, 10**6)})
        connection.execute(sa.insert(STUDIES), rows)


def main() -> None:
    """Fill a database, read pages, print the times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--studies", type=int, default=20_000)
    studies: int = parser.parse_args().studies
    with (
        tempfile.TemporaryDirectory() as folder,
        Store.open(f"sqlite:///{folder}/list.sqlite3", chunking=Chunking(cases=10)) as store,
    ):
        fill(store, studies)

        def timed(wanted: StudyFilter, order: StudyOrder, page: str | None = None) -> float:
            times = []
            for _ in range(15):
                began = perf_counter()
                store.studies.page(50, page, wanted, order)
                times.append(perf_counter() - began)
            return median(times)

        unit = timed(StudyFilter(), StudyOrder.NEWEST)
        everything = StudyFilter()
        questions = {f"by {order}, first page": (everything, order, None) for order in StudyOrder}
        middle = store.studies.page(1000, None, everything, StudyOrder.NAME).next_token
        questions["by name, page after the first 1,000"] = (everything, StudyOrder.NAME, middle)
        questions["two words that many have"] = (StudyFilter(search="forderer night"), StudyOrder.NEWEST, None)
        questions["a word that none has"] = (StudyFilter(search="nothing"), StudyOrder.NEWEST, None)
        questions["a tag, by name"] = (StudyFilter(tag="press"), StudyOrder.NAME, None)
        for what, (wanted, order, page) in questions.items():
            seconds = timed(wanted, order, page)
            print(f"{what:<40} {1e3 * seconds:8.2f} ms  {seconds / unit:6.1f} x")


if __name__ == "__main__":
    main()
