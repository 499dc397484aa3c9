"""What the engine's tests share: one ordinary drive, results by name, and how far two results may differ."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.outcome import Trajectory
from sprag_study.engine.run import Run, Span
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.simulate import simulate

Columns = dict[str, Any]

#: Coefficients of every clutch law in these tests, padded with zeros, so that few kernels are compiled.
COEFFICIENTS = 4


def clutch(*coefficients: float) -> Columns:
    """A clutch law for all pendulums."""
    padded = [*coefficients, *[0.0] * (COEFFICIENTS - len(coefficients))]
    return {f"clutch.coefficients.{k}": value for k, value in enumerate(padded)}


def pendulum(index: int = 0, **changes: Any) -> Columns:
    """One pendulum of an ordinary drive (natural frequency 24 Hz), with changes by field name."""
    fields = {
        "inertia": 1e-3, "mass": 0.5, "arm": 0.03, "spring_rate": 9000.0, "spring_arm": 0.05, "damping": 0.01,
        "backlash": 0.005,
    } | changes  # fmt: skip
    return {f"pendulums.{index}.{name}": value for name, value in fields.items()}


def drive(pendulums: int = 1, **changes: Any) -> Columns:
    """An ordinary drive; ``changes`` are paths with ``__`` for the dot, such as ``shaft__load=0.2``."""
    columns: Columns = {
        "excitation.frequency": 20.0, "excitation.amplitude_x": 0.002, "excitation.amplitude_y": 0.002,
        "shaft.inertia": 2e-3, "shaft.load": 0.1, **clutch(0.0, 200.0, 0.0, 2e4),
    }  # fmt: skip
    for index in range(pendulums):
        columns |= pendulum(index, spring_rate=9000.0 + 3000.0 * index)
    return columns | {path.replace("__", "."): value for path, value in changes.items()}


def periods(duration: float, start: float, end: float, **settings: Any) -> Run:
    """A run of so many periods with a window in periods."""
    return Run(duration=Span(duration), window=(Span(start), Span(end)), **settings)


class Results:
    """The results of a batch by name, each of shape (cases,)."""

    def __init__(self, columns: Mapping[str, Any], run: Run, cases: int) -> None:
        batch = simulate(columns, run, cases=cases)
        count = 1 + max(int(path.split(".")[1]) for path in columns if path.startswith("pendulums."))
        self.names = [info.name for info in result_infos(count)]
        self.values = batch.values
        self.endings = [ENDINGS[code] for code in batch.endings]

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        return self.values[:, self.names.index(name)]

    def row(self, case: int) -> dict[str, float]:
        """One case as name to number."""
        return dict(zip(self.names, map(float, self.values[case]), strict=True))


def one(columns: Mapping[str, Any], run: Run) -> dict[str, float]:
    """Results of one case, which must have ended well."""
    results = Results(columns, run, 1)
    assert results.endings == [Ending.OK]
    return results.row(0)


def batch_of(cases: list[Columns]) -> Columns:
    """Columns of a batch from those of its cases (all with the same paths)."""
    return {path: np.array([case[path] for case in cases]) for path in cases[0]}


def column(trajectory: Trajectory, name: str) -> NDArray[np.float64]:
    """One variable of a trajectory."""
    return trajectory.values[:, trajectory.names.index(name)]
