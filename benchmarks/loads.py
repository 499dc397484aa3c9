"""What forces and duty of every case cost: processor time of settled cases with them, relative to those without.

``python -m benchmarks.loads [--cases 64]``: cases of the workloads W1 and W2, evenly spread, whose motions are settled
together; prints the milliseconds of each part, the ratio, how much longer the rows are, and how many milliseconds each
further period in the window of a run of a given time takes.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.workloads import CASES, W1, W2, Workload
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive.loads import loads as timed_loads
from sprag_study.engine.vibration_drive.loads import settled_loads
from sprag_study.engine.vibration_drive.settle import settle

#: Periods in the windows that are compared.
_WINDOWS = (10, 50)


def measure(name: str, workload: Workload, cases: int) -> None:
    """Print the figures of one workload."""
    columns = workload.columns(np.linspace(0, CASES - 1, cases, dtype=np.int64))
    settings = SettledRun()
    settled_loads(columns, settings, settle(columns, settings, cases=cases))  # compiles
    begin = time.process_time()
    settled = settle(columns, settings, cases=cases)
    middle = time.process_time()
    loads = settled_loads(columns, settings, settled)
    end = time.process_time()
    each = [1e3 * (later - earlier) / cases for earlier, later in ((begin, middle), (middle, end))]
    longer = 1.0 + loads.shape[1] / settled.values.shape[1]
    print(
        f"{name}: {each[0]:.2f} ms a case without, {each[1]:.2f} ms more with forces and duty, ratio "
        f"{sum(each) / each[0]:.1f}; rows of {settled.values.shape[1] + loads.shape[1]} numbers, {longer:.2f} times"
    )
    few = columns | {path: np.asarray(value)[:4] for path, value in columns.items() if np.ndim(value)}
    took = [_in_window(few, periods) for periods in _WINDOWS]
    more = 1e3 * (took[1] - took[0]) / (_WINDOWS[1] - _WINDOWS[0]) / 4
    print(f"{name}: {more:.2f} ms a case for each further period of a window")


def _in_window(columns: Mapping[str, ArrayLike], periods: int) -> float:
    """Seconds of forces and duty of four runs of 60 periods, in a window of so many at the end."""
    run = Run(duration=Span(60.0), window=(Span(60.0 - periods), Span(60.0)))
    begin = time.process_time()
    timed_loads(columns, run, np.zeros(4, dtype=np.int8))
    return time.process_time() - begin


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=64)
    chosen = parser.parse_args().cases
    for title, work in (("W1", W1), ("W2", W2)):
        measure(title, work, chosen)
