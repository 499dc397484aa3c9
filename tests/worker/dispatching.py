"""What the tests of the dispatcher share: studies, runs of chunks, and how they ended."""

from __future__ import annotations

from collections.abc import Callable

from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.records import StudyRecord
from sprag_study.worker.dispatcher import (
    Dispatcher,
)
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models import ChunkResult, ChunkTask
from sprag_study.worker.ports import Executor, Outcome
from sprag_study.worker.states import StudyState
from tests.worker import fakes


def submit(store: Store, cases: int = 20, name: str = "a study") -> StudyRecord:
    return store.studies.create({"name": name}, fakes.study(cases, name), fresh=True)


def work(store: Store, executor: Executor, only: int | None = None) -> None:
    """Dispatch until nothing is left to do but what is paused."""

    def idle() -> bool:
        return all(
            study.state is StudyState.PAUSED or only not in {None, study.number}
            for study in store.work.active_studies()
        )

    Dispatcher(store.work, executor, SystemClock(), only=only).run(idle)


def endings(store: Store, record: StudyRecord) -> dict[int, str]:
    return {
        int(case): ending
        for block in store.rows.blocks(record.id)
        for case, ending in zip(block.cases, block.endings, strict=True)
    }


def after(store: Store, case: int, act: Callable[[], object]) -> Callable[[ChunkTask], ChunkResult]:
    """A run of chunks that does something when it comes to ``case``."""

    def run(task: ChunkTask) -> ChunkResult:
        if task.first == case:
            act()
        return fakes.run(task)

    return run


class Prompt(InlineExecutor):
    """An executor that never waits: the clock is the test's."""

    def wait(self, timeout: float) -> list[Outcome]:
        """See the class."""
        return super().wait(0.0)
