"""What rounds cost beyond their cases: a refined study through SQLite and the dispatcher, in this process.

    python -m benchmarks.rounds [REPETITIONS [CURVES [PRESET]]]

All times are processor times. What a round costs is the time between the last row of one round and the first chunk of
the next: reading its rows, planning, the transaction. Storing rows and claiming chunks cost any study of as many cases
the same.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.work.work import Work
from sprag_study.worker import models
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.limits import MAX_PLANNED_CASES
from sprag_study.worker.rounds import Rounds

P = ParamSpec("P")
T = TypeVar("T")

_RESULTS = ("shaft.speed.mean", "efficiency", "torque.max", "shaft.irregularity")


def spec(curves: int, preset: str) -> dict[str, Any]:
    """Curves over the load, four results right to 1 %."""
    file, text = preset_text(preset)
    made: dict[str, Any] = dict(load_spec(text, file.rpartition(".")[2]))
    made["axes"] = [
        {"path": "excitation.frequency", "linspace": ["18 Hz", "32 Hz", curves]},
        {"path": "shaft.load", "adaptive": [0.05, 1.2]},
    ]
    # Every point of the finest spacing may be needed.
    finest = "1/256" if curves <= MAX_PLANNED_CASES // 257 else "1/128"
    made["refine"] = {"results": list(_RESULTS), "error": "1 %", "finest": finest}
    return made


class Clock:
    """Processor time (s) of each call of the functions that it wraps."""

    def __init__(self) -> None:
        self.taken: list[float] = []

    def of(self, function: Callable[P, T]) -> Callable[P, T]:
        """The function, timed."""

        def timed(*given: P.args, **named: P.kwargs) -> T:
            begin = time.process_time()
            try:
                return function(*given, **named)
            finally:
                self.taken.append(time.process_time() - begin)

        return timed

    @property
    def total(self) -> float:
        """Of all calls."""
        return sum(self.taken)


def _over(store: Store, study: str) -> bool:
    return store.studies.get(study).over


def main() -> None:
    """Print the processor times and what a round costs."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    curves = int(sys.argv[2]) if len(sys.argv) > 2 else 8
    preset = sys.argv[3] if len(sys.argv) > 3 else "one_pendulum"
    study = parse_spec(load_spec(json.dumps(spec(curves, preset)), "json")).study
    models.warm_up(study)
    engine, rounds, storage, whole = Clock(), Clock(), Clock(), Clock()
    Rounds.advance = rounds.of(Rounds.advance)  # type: ignore[method-assign]
    Work.exchange = storage.of(Work.exchange)  # type: ignore[method-assign]
    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder) / 'rounds.sqlite3'}"
        with Store.open(url) as store:
            for _ in range(repetitions):
                record = store.studies.create({}, study, fresh=True)
                executor = InlineExecutor(engine.of(models.run_task))
                dispatcher = Dispatcher(store.work, executor, SystemClock(), owner="benchmark")
                whole.of(dispatcher.run)(partial(_over, store, record.id))
                record = store.studies.get(record.id)
                assert record.ok == record.cases
    times = ", ".join(
        f"{name} {clock.total / repetitions:.2f} s ({clock.total / engine.total:.1%})"
        for name, clock in (("rounds", rounds), ("storing rows and claiming chunks", storage), ("everything", whole))
    )
    number = len(rounds.taken) // repetitions
    print(
        f"{record.cases:,} cases in {number} rounds: engine {engine.total / repetitions:.2f} s, relative to it {times}"
    )
    milliseconds = 1e3 * np.array(rounds.taken)
    print(f"a round: {np.median(milliseconds):.0f} ms (median), {milliseconds.max():.0f} ms (most)")


if __name__ == "__main__":
    main()
