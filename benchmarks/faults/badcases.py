"""Cases that crash their process, and cases that never return, among many sound ones; then they are run again.

The engine's own hook (`sprag_study.engine.faults`) makes them bad; it is off in this process, where a retry makes them
sound.
"""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

from benchmarks.faults import harness
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor

#: Periods of all cases together that this process computes in half a minute or so.
_WHOLE_PERIODS = 5_000_000
#: Loads of a study that runs first, so that no process compiles within the limit of a bad case. None is a load of the
#: drill, whose bad cases would be bad here too.
_FIRST = {"axes": [{"path": "shaft.load", "linspace": [0.0123, 0.4567, 16]}]}
_SECONDS = "SELECT (finished_at - started_at) / 1e6 FROM studies WHERE id = ?"


def badcases(
    folder: Path,
    *,
    cases: int,
    crashing: int,
    hanging: int,
    seed: int,
    periods: float = 60.0,
    chunk: int = 0,
    timeout: float = 600.0,
    timed: bool = True,
    processes: int = 2,
) -> dict[str, Any]:
    """Run a study with bad cases, and without them when it is ``timed``; gives the figures."""
    draw = random.Random(seed)
    made = harness.spec(cases, periods)
    options = ["--processes", processes]
    drawn = draw.sample(range(cases), crashing + hanging)
    odd = {case: "crashed" if place < crashing else "timed_out" for place, case in enumerate(drawn)}
    limit = {"SPRAG_CHUNK_TIMEOUT": f"{timeout:g}", **({"SPRAG_CHUNK_CASES": str(chunk)} if chunk else {})}
    plain = 0.0
    if timed:
        place = folder / "plain"  # where the other one finds no rows to reuse
        place.mkdir()
        with harness.running(place, *options, **limit) as service:
            service.finish(service.submit(harness.spec(16, 4.0) | _FIRST))
            plain = _run(service, made)[1]
    with harness.running(folder, *options, **limit, **_faults(made, odd)) as service:
        service.finish(service.submit(harness.spec(16, 4.0) | _FIRST))
        study, bad = _run(service, made)
    # Where a case takes long, the values around the bad ones are compared, and some others.
    around = [(max(0, min(case - 8, cases - 16)), min(16, cases)) for case in [*odd, *draw.sample(range(cases), 5)]]
    ranges = around if cases * periods > _WHOLE_PERIODS else ()
    harness.compare(service.database, study, made, odd, ranges)
    with Store.open(f"sqlite:///{service.database}") as store:
        assert store.studies.retry(study).done == cases - len(odd)
        Dispatcher(store.work, InlineExecutor(), SystemClock()).run(lambda: store.studies.get(study).over)
        assert store.studies.progress(study).endings == {"ok": cases}
    harness.compare(service.database, study, made, ranges=ranges)
    figures: dict[str, Any] = {"cases": cases, "crashed": crashing, "timed out": hanging, "ok after a retry": cases}
    if timed:
        figures |= {
            "seconds without bad cases": round(plain, 1),
            "seconds with them": round(bad, 1),
            "extra time, %": round(100.0 * (bad / plain - 1.0), 1),
        }
    return figures


def _run(service: harness.Service, made: dict[str, Any]) -> tuple[str, float]:
    study = service.submit(made)
    service.finish(study)
    return study, float(harness.asked(service.database, _SECONDS, study))


def _faults(made: dict[str, Any], odd: dict[int, str]) -> dict[str, str]:
    """The environment that makes these cases bad."""
    clauses = []
    for fault, ending in (("crash", "crashed"), ("hang", "timed_out")):
        loads = [repr(harness.load_of(made, case)) for case, found in odd.items() if found == ending]
        if loads:
            clauses.append(f"{fault} shaft.load={','.join(loads)}")
    return {"SPRAG_FAULTS_ALLOWED": "yes", "SPRAG_FAULTS": "; ".join(clauses)}
