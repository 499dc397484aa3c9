"""A study that chooses its own cases under kill -9: in its cases, in the planner, in the transaction between rounds.

The process that runs the study kills itself before a drawn event: a statement or the end of a transaction, a call of
the planner. The next process goes on, and is killed again. In the end the study has the same cases, rounds and rows as
an undisturbed one, bit for bit.
"""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from benchmarks.faults.fate import Fate, before_commits, before_writes
from benchmarks.faults.harness import ROOT, environment
from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.tables import STUDIES, results_table
from sprag_study.worker import planning
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.planning.rounds import Planner
from sprag_study.worker.states import StudyState

#: Events of the whole study, roughly: what is drawn lies within, or the process ends with the study.
_EVENTS = 60
#: An event in whose middle a process is killed.
_PLANNER = "planner"


def rounds(folder: Path, *, count: int = 50, seed: int = 1, url: str = "") -> dict[str, Any]:
    """Run a refined study under ``count`` kills and compare it with an undisturbed one; gives the figures."""
    draw = random.Random(seed)
    url = url or f"sqlite:///{folder / 'rounds.sqlite3'}"
    killed: Counter[str] = Counter()
    studies = 0
    with Store.open(url, chunking=Chunking(cases=8)) as store:
        undisturbed = create(store)
        _run_here(store, undisturbed)
        while killed.total() < count:
            disturbed = create(store)
            studies += 1
            while killed.total() < count and store.studies.get(disturbed).state is not StudyState.FINISHED:
                _run(url, disturbed, draw.randint(1, _EVENTS), killed)
            # Once there were kills enough, the last study is left alone.
            _run_here(store, disturbed)
            assert store.studies.get(disturbed).state is StudyState.FINISHED
            assert whole(store, disturbed) == whole(store, undisturbed)
        record = store.studies.get(undisturbed)
    return {
        "studies": studies,
        "kills": dict(killed),
        "cases of each": record.cases,
        "rounds of each": len(_whole_rounds(url, undisturbed)),
        "other, missing or doubled cases, rounds and rows": 0,
    }


def create(store: Store) -> str:
    """Submit the study; its id."""
    parsed = parse_spec(load_spec(json.dumps(spec()), "json"))
    return store.studies.create(parsed.spec, parsed.study, fresh=True).id


def spec() -> dict[str, Any]:
    """Two refined curves."""
    made: dict[str, Any] = json.loads(preset_text("one_pendulum")[1])
    made["axes"] = [
        {"path": "excitation.frequency", "values": ["24 Hz", "26 Hz"]},
        {"path": "shaft.load", "adaptive": [0.05, 0.6]},
    ]
    made["refine"] = {"results": ["shaft.speed.mean", "efficiency"], "error": "2 %", "start": 5, "finest": "1/32"}
    return made


def _run_here(store: Store, study: str) -> None:
    """Run the study to its end, if it has not come there."""
    dispatcher = Dispatcher(store.work, InlineExecutor(), SystemClock(), owner="drill")
    dispatcher.run(lambda: store.studies.get(study).over)


def _run(url: str, study: str, fatal: int, killed: Counter[str]) -> None:
    """Run the study in a process of its own that ends before event number ``fatal``, or with the study."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.faults.rounds", url, study, str(fatal)],
        cwd=ROOT, env=environment(), stdout=subprocess.PIPE, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == (-signal.SIGKILL if done.stdout else 0), done
    if done.stdout:
        killed[done.stdout.strip()] += 1


def whole(store: Store, study: str) -> tuple[Any, ...]:
    """Everything of a study that may not depend on how it was run."""
    with store.session.read() as connection:
        columns = (STUDIES.c.number, STUDIES.c.study, STUDIES.c.model, STUDIES.c.variant)
        number, text, model, variant = connection.execute(sa.select(*columns).where(STUDIES.c.id == study)).one()
        c = results_table(model, variant).c
        rows = connection.execute(
            sa.select(*(column for column in c if column.name != "study"))
            .where(c.study == number)
            .order_by(c.case_number)
        ).all()
    rounds = [(found.round, found.cases, found.summary) for found in store.studies.rounds(study)]
    return text, [tuple(map(repr, row)) for row in rows], rounds


def _whole_rounds(url: str, study: str) -> list[Any]:
    with Store.open(url) as store:
        return [found for found in store.studies.rounds(study) if found.cases]


def _watched(make: Callable[..., Planner], fate: Fate) -> Callable[..., Planner]:
    """A planner whose every call is an event."""

    def made(plan: Any) -> Planner:
        planner = make(plan)
        tell, ask = planner.tell, planner.ask
        planner.tell = lambda rows: (fate.meet(_PLANNER), tell(rows), fate.meet(_PLANNER))  # type: ignore
        planner.ask = lambda: (fate.meet(_PLANNER), ask())[1]  # type: ignore[method-assign]
        return planner

    return made


def main(url: str, study: str, fatal: int) -> None:
    """Run every study of the database here, until the event that ends the process."""
    fate = Fate(fatal)
    with Store.open(url, chunking=Chunking(cases=8)) as store:
        for kind, make in list(planning.PLANNERS.items()):
            planning.PLANNERS[kind] = _watched(make, fate)
        before_commits(fate.meet)
        before_writes(fate.meet)
        _run_here(store, study)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
