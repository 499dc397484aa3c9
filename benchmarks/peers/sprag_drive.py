"""This engine, behind the same interface as its peers."""

from __future__ import annotations

import numpy as np

from benchmarks.workloads import COMPARED, EVENTS, Ints, Outcome, Workload
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import Run
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.simulate import simulate


class SpragDrive:
    """Runs cases through the public interface: all characteristics are computed, the default window is used."""

    def __init__(self, workload: Workload, tolerance: float) -> None:
        self.workload = workload
        self.settings = Run(tolerance=tolerance)
        self.names = [info.name for info in result_infos(workload.pendulums)]

    def run(self, cases: Ints) -> Outcome:
        """Run the cases as one batch."""
        batch = simulate(self.workload.columns(cases), self.settings, cases=len(cases))
        assert np.all(batch.endings == ENDINGS.index(Ending.OK))
        values = {name: batch.values[:, self.names.index(name)] for name in (*COMPARED, EVENTS)}
        return Outcome(cases, values, float(batch.values[:, self.names.index("run.steps")].sum()))
