"""What rounds cost beyond their cases: a refined study through SQLite and the dispatcher, and the engine alone.

    python -m benchmarks.rounds [REPETITIONS [CURVES]]

Both run in this process, one after the other, on the same plan and in the same chunks; times are processor times, the
least of the repetitions. The engine alone computes the same rounds, asked for by a planner without a store. What a
round costs is the time between the last row of one round and the first chunk of the next: reading its rows, planning,
the transaction.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from sprag.service.presets import preset_text
from sprag.service.spec.document import load_spec, parse_spec
from sprag.service.storage import maintenance
from sprag.service.storage.part import SystemClock
from sprag.service.storage.session import Session
from sprag.service.storage.store import Store
from sprag.worker import models
from sprag.worker.chunking import Chunking, spans
from sprag.worker.dispatcher import Dispatcher
from sprag.worker.executors.inline import InlineExecutor
from sprag.worker.planning import planner_of
from sprag.worker.planning.rounds import Rows
from sprag.worker.rounds import Appended, Rounds
from sprag.worker.study import Study

_RESULTS = ("shaft.speed.mean", "efficiency", "torque.max", "shaft.irregularity")


def spec(curves: int) -> dict[str, Any]:
    """Curves over the load, four results right to 1 %."""
    made: dict[str, Any] = json.loads(preset_text("one_pendulum")[1])
    made["axes"] = [
        {"path": "excitation.frequency", "linspace": ["18 Hz", "32 Hz", curves]},
        {"path": "shaft.load", "adaptive": [0.05, 1.2]},
    ]
    made["refine"] = {"results": list(_RESULTS), "error": "1 %"}
    return made


def alone(study: Study) -> tuple[float, int]:
    """Processor time (s) of the engine for all rounds, and their number."""
    assert study.plan is not None
    planner, seconds, rounds = planner_of(study.plan), 0.0, 0
    infos = models.study_results(study)
    places = {info.name: place for place, info in enumerate(infos)}
    while len(points := planner.ask().points):
        study = study if not rounds else study.with_points(points)
        first = study.cases - len(points)
        begin = time.process_time()
        sizes = spans(len(points), Chunking().cases_of(study, len(points)))
        results = [models.run_chunk(study, first + start, size) for start, size in sizes]
        seconds += time.process_time() - begin
        ok = np.array([ending == models.OK for result in results for ending in result.endings])
        values = np.concatenate([result.values for result in results])
        planner.tell(Rows(points, ok, {name: values[:, places[name]] for name in planner.results}))
        rounds += 1
    return seconds, rounds


def through(store: Store, study: Study) -> float:
    """Processor time (s) of the whole study through the store and the dispatcher."""
    record = store.create_study({}, study, fresh=True)
    begin = time.process_time()
    Dispatcher(store, InlineExecutor(), SystemClock(), owner="benchmark").run(lambda: store.get_study(record.id).over)
    seconds = time.process_time() - begin
    assert store.get_study(record.id).ok == store.get_study(record.id).cases
    return seconds


def measured() -> list[float]:
    """A list to which every `Rounds.advance` from now on appends its processor time (s)."""
    advance, taken = Rounds.advance, []

    def timed(rounds: Rounds, epoch: int, number: int, study: Study) -> Appended | None:
        begin = time.process_time()
        try:
            return advance(rounds, epoch, number, study)
        finally:
            taken.append(time.process_time() - begin)

    Rounds.advance = timed  # type: ignore[method-assign]
    return taken


def main() -> None:
    """Print the processor times and what a round costs."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    curves = int(sys.argv[2]) if len(sys.argv) > 2 else 8
    parsed = parse_spec(load_spec(json.dumps(spec(curves)), "json"))
    models.warm_up(parsed.study)
    alone(parsed.study)
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder) / 'rounds.sqlite3'}"
        session = Session(url)
        maintenance.upgrade(session)
        session.close()
        with Store.open(url) as store:
            taken = measured()
            pairs = [(alone(parsed.study), through(store, parsed.study)) for _ in range(repetitions)]
            cases = store.list_studies().studies[0].cases
    rounds = pairs[0][0][1]
    engine, whole = min(pair[0][0] for pair in pairs), min(pair[1] for pair in pairs)
    print(
        f"{cases} cases in {rounds} rounds: engine alone {engine:.2f} s, through the store {whole:.2f} s "
        f"({whole / engine:.3f} times)"
    )
    milliseconds = 1e3 * np.array(taken)
    print(f"a round: {np.median(milliseconds):.0f} ms (median), {milliseconds.max():.0f} ms (most)")


if __name__ == "__main__":
    main()
