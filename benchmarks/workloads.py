"""The workloads W1 and W2, the reference values, and the two clocks every measurement is taken with."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

REFERENCE = Path(__file__).resolve().parents[1] / "tests" / "data" / "reference"
PERIODS, WINDOW_START = 60.0, 40.0
GRAVITY = 9.80665
SHAFT_INERTIA = 0.002
COEFFICIENTS = (0.0, 200.0, 0.0, 20000.0)
PENDULUM = {
    "inertia": 0.001,
    "mass": 0.5,
    "arm": 0.03,
    "spring_arm": 0.05,
    "spring_rate": 9000.0,
    "damping": 0.01,
    "backlash": 0.005,
}

#: What the tables give errors of.
COMPARED = ("shaft.speed.mean", "shaft.speed.max", "torque.max")
EVENTS = "run.events"


@dataclass(frozen=True)
class Workload:
    """A grid of 512 cases from rest: 16 frequencies x 4 amplitudes x 8 loads, the load varying fastest."""

    name: str
    spring_rates: tuple[float, ...]

    @property
    def pendulums(self) -> int:
        return len(self.spring_rates)

    @property
    def grid(self) -> tuple[Floats, Floats, Floats]:
        """Angular frequency in rad/s, amplitude in m and load in N*m of every case."""
        axes = np.linspace(100.0, 220.0, 16), np.linspace(0.001, 0.003, 4), np.linspace(0.02, 0.3, 8)
        nu, amplitude, load = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
        return nu, amplitude, load

    def columns(self, cases: Ints) -> dict[str, Floats | float]:
        """Columns for ``sprag_study.engine.vibration_drive.simulate``."""
        nu, amplitude, load = (axis[cases] for axis in self.grid)
        columns: dict[str, Floats | float] = {
            "gravity": GRAVITY,
            "excitation.frequency": nu / (2.0 * math.pi),
            "excitation.amplitude_x": amplitude,
            "excitation.amplitude_y": amplitude,
            "shaft.inertia": SHAFT_INERTIA,
            "shaft.load": load,
        }
        columns |= {f"clutch.coefficients.{k}": value for k, value in enumerate(COEFFICIENTS)}
        for i, rate in enumerate(self.spring_rates):
            columns |= {f"pendulums.{i}.{name}": value for name, value in PENDULUM.items()}
            columns[f"pendulums.{i}.spring_rate"] = rate
        return columns


CASES = 512
W1 = Workload("W1", (9000.0,))
W2 = Workload("W2", (9000.0, 12000.0))
_GROUPS = {"W1": "one_pendulum", "W2": "two_pendulums"}


def many_pendulums(n: int) -> Workload:
    """The same grid with ``n`` pendulums, spring rates spread evenly from the first of W2 to the second."""
    return Workload(f"n = {n}", tuple(float(rate) for rate in np.linspace(9000.0, 12000.0, n)))


@dataclass(frozen=True)
class Outcome:
    """What one tool found: a value for each of its cases, by result name, and the steps it took in all."""

    cases: Ints
    values: Mapping[str, Floats]
    steps: float


@dataclass(frozen=True)
class Errors:
    """Relative errors against the reference by result name, and how many event counts agree."""

    relative: dict[str, Floats]
    equal_events: int
    compared: int


def load_reference(path: Path, workload: Workload) -> list[dict[str, Any]]:
    """The reference's cases of a workload; ``path`` is its folder or the file itself."""
    file = path / "vibration_drive.json" if path.is_dir() else path
    cases: list[dict[str, Any]] = json.loads(file.read_text(encoding="utf-8"))[_GROUPS[workload.name]]
    nu, amplitude, load = workload.grid
    for case in cases:
        k = case["case"]
        told = case["excitation_angular_frequency"], case["amplitude"], case["load"]
        assert np.allclose(told, (nu[k], amplitude[k], load[k]), rtol=1e-12), f"case {k} is numbered otherwise"
    return cases


def errors(outcome: Outcome, reference: list[dict[str, Any]]) -> Errors:
    """Compare what was computed with the reference, over the cases both have."""
    row_of = {int(case): row for row, case in enumerate(outcome.cases)}
    common = [(row_of[case["case"]], case["results"]) for case in reference if case["case"] in row_of]
    relative = {
        name: np.array([abs(outcome.values[name][row] / expected[name] - 1.0) for row, expected in common])
        for name in COMPARED
    }
    equal = sum(outcome.values[EVENTS][row] == expected["events"] for row, expected in common)
    return Errors(relative, int(equal), len(common))


@dataclass(frozen=True)
class Timing:
    """Seconds by the clock on the wall and of the processor's time, each the least over the repeats."""

    wall: float
    cpu: float


def take_turns(jobs: Mapping[str, Callable[[], Any]], repeats: int) -> dict[str, tuple[Timing, Any]]:
    """Run every job ``repeats`` times, in turn, so that a slow minute of the machine falls on all of them."""
    best: dict[str, tuple[Timing, Any]] = {}
    for _ in range(repeats):
        for name, job in jobs.items():
            wall, cpu = time.perf_counter(), time.process_time()
            result = job()
            timing = Timing(time.perf_counter() - wall, time.process_time() - cpu)
            if name in best:
                before = best[name][0]
                timing = Timing(min(timing.wall, before.wall), min(timing.cpu, before.cpu))
            best[name] = timing, result
    return best


def cores() -> list[int]:
    """The cores this process may use."""
    return sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]


def pin(core: int) -> None:
    """Keep this process on one core (where the system allows it)."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})
