"""Studies of vibration drives with forces and duty among their results (docs/theory.md, "Forces", "Duty of the
clutches").

The run of such a study has ``"loads": true``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.engine.vibration_drive.cases import of_cases
from sprag_study.worker.models.common import has_loads
from sprag_study.worker.models.starts import count_of
from sprag_study.worker.models.vibration_drive.settled import settings_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from sprag_study.engine.outcome import Batch
    from sprag_study.engine.run import Run
    from sprag_study.engine.vibration_drive.settle import SettledBatch
    from sprag_study.engine.vibration_drive.starts import StartedBatch
    from sprag_study.worker.models.common import ChunkTask

    Floats = NDArray[np.float64]

#: Seconds that they take for each pendulum: in a case, and besides for each period that they examine of a timed run
#: (benchmarks/loads.py).
_SECONDS_EACH, _SECONDS_OF_PERIOD = 0.016, 0.003


def loads_seconds(run: Mapping[str, Any], pendulums: int, periods: float) -> float:
    """Rough time that they take in a case, in s; of a case with starts for two regimes.

    ``periods`` are the excitation periods that they examine of a run of a given time; 0 for settled motion.
    """
    if not has_loads(run):
        return 0.0
    return (_SECONDS_EACH + _SECONDS_OF_PERIOD * periods) * pendulums * min(2, count_of(run))


def with_settled_loads(task: ChunkTask, settled: SettledBatch) -> Floats:
    """The results of a batch of settled motions, with forces and duty where the study has them."""
    if not has_loads(task.run):
        return settled.values
    from sprag_study.engine.vibration_drive.loads import settled_loads

    return np.hstack([settled.values, settled_loads(task.columns, settings_of(task.run), settled)])


def with_loads(task: ChunkTask, batch: Batch, run: Run) -> Floats:
    """The results of runs of a given time, with forces and duty where the study has them."""
    if not has_loads(task.run):
        return batch.values
    from sprag_study.engine.vibration_drive.loads import loads

    return np.hstack([batch.values, loads(task.columns, run, batch.endings)])


def with_loads_of_starts(task: ChunkTask, started: StartedBatch) -> tuple[Floats, Floats]:
    """The results of the most frequent regimes of cases with starts, and of the further ones."""
    if not has_loads(task.run):
        return started.values, started.further_values
    from sprag_study.engine.vibration_drive.loads import settled_loads

    settings = settings_of(task.run)
    first = settled_loads(task.columns, settings, started.motions(further=False))
    further = settled_loads(of_cases(task.columns, started.further), settings, started.motions(further=True))
    return np.hstack([started.values, first]), np.hstack([started.further_values, further])
