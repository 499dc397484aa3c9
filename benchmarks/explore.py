"""Times of questions about all cases of a large study, and of reading their columns, which the service does ahead.

python -m benchmarks.explore [--cases 1000000]

Also the page of rows, as lines and as points, without its template. Rows are random numbers in a database of its own.
Times are also given relative to sorting one column with numpy.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks.reading import build, grid
from sprag_study.service.figures.explore import explore_figure
from sprag_study.service.http.web.rows.view import rows_view
from sprag_study.service.json_text import to_bytes
from sprag_study.service.reading.reader import Choice
from sprag_study.service.results.explore import ExploreQuery, explore, explored_json, plan_of
from sprag_study.service.storage.store import Store
from sprag_study.service.views.columns import ColumnFiles, Columns
from sprag_study.service.views.library import Library


def timed(what: str, work: Callable[[], object], unit: float | None = None) -> float:
    """Print and give the time of some work."""
    began = perf_counter()
    work()
    seconds = perf_counter() - began
    print(f"{what:<50} {seconds:8.3f} s" + ("" if unit is None else f"  {seconds / unit:8.1f} x"))
    return seconds


def main() -> None:
    """Fill a database, ask, and print the times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1_000_000)
    cases: int = parser.parse_args().cases
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "explore.sqlite3"
        study_id, _ = build(path, grid(cases))
        with Store.open(f"sqlite:///{path}") as store:
            study, columns = store.studies.study(study_id), Columns(store, ColumnFiles(Path(folder) / "columns"))
            where = ("shaft.load <= 0.3 N*m", "efficiency >= 0.2", "shaft.speed.mean >= 0")
            queries = {
                "the first question (its columns have been read)": ExploreQuery(where, sort="-efficiency", limit=50),
                "the same again": ExploreQuery(where, sort="-efficiency", limit=50),
                "other ranges, other order": ExploreQuery(where[:1], sort="torque.mean", limit=500),
                "all rows, one more column": ExploreQuery(sort="-shaft.irregularity", limit=50),
                "all rows by a column that is there": ExploreQuery(sort="-torque.mean", limit=50),
            }
            unit = timed("numpy sorts one column", lambda: np.sort(np.random.default_rng(1).normal(size=cases)))

            def ask(query: ExploreQuery) -> None:
                plan = plan_of(study, query)
                found = explore(study, plan, columns.of(study_id, plan.results))
                to_bytes(explored_json(study_id, found))
                explore_figure(found)

            library = Library(store)
            library.columns = columns

            def page(pairs: list[tuple[str, str]]) -> None:
                rows_view(library, study_id, pairs, Choice())

            usual = plan_of(study, ExploreQuery()).results
            timed("reading the columns when the study has ended", lambda: columns.of(study_id, usual), unit)
            for what, query in queries.items():
                timed(what, lambda query=query: ask(query), unit)  # type: ignore[misc]
            usual_pairs = [("where", text) for text in where]
            for what, pairs in {
                "the page of rows, first": usual_pairs,
                "the page of rows": usual_pairs,
                "the page of rows as points": [*usual_pairs, ("plot", "points"), ("outside", "1")],
            }.items():
                timed(what, lambda pairs=pairs: page(pairs), unit)  # type: ignore[misc]


if __name__ == "__main__":
    main()
