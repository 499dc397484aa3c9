"""Swept studies of vibration drives: runs of whole lines, and the state from which a case of a line starts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.worker.models.common import ChunkResult, ChunkTask, chunk_result
from sprag_study.worker.models.vibration_drive.loads import with_settled_loads
from sprag_study.worker.models.vibration_drive.settled import ARBITRARY_START, JUMPED, RESTARTED, settings_of
from sprag_study.worker.sweeps import line_to

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from sprag_study.worker.study import Study


def swept(task: ChunkTask, flags_of: Callable[[NDArray[np.float64]], list[str]]) -> ChunkResult:
    """Run the lines of a task; ``flags_of`` gives the flags that follow from the results of each case."""
    from sprag_study.engine.vibration_drive.sweep import Begun, sweep

    assert task.lines is not None
    found = sweep(task.columns, settings_of(task.run), task.lines, task.along)
    raised = {
        JUMPED: found.jumped,
        ARBITRARY_START: found.begun == Begun.ARBITRARY,
        RESTARTED: found.begun == Begun.AGAIN,
    }
    flags = [
        ",".join(filter(None, [own, *(name for name, cases in raised.items() if cases[case])]))
        for case, own in enumerate(flags_of(found.batch.values))
    ]
    return chunk_result(task.first, found.batch.endings, flags, with_settled_loads(task, found.batch))


def start_of(study: Study, case: int) -> NDArray[np.float64] | None:
    """The state from which one case of a swept study starts, shape (1, columns); None: its own initial values.

    The line is run up to this case again: it gives the same bits as the run of the study.
    """
    from sprag_study.engine.vibration_drive.sweep import sweep

    if study.sweep is None:
        return None
    line = line_to(study, case)
    columns: dict[str, Any] = {**study.base, **study.columns(line)}
    machine = {path: column for path, column in columns.items() if path not in study.beside}
    return sweep(machine, settings_of(study.run), np.arange(line.size)[None, :]).starts[-1:]
