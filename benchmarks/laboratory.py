"""Processor time of one move in the laboratory of vibration drives, against one settled case in the same run.

python -m benchmarks.laboratory [--moves 60] [--seed 1]

A move reads the setting, runs the settled case from the state before it, and makes figure, frames and answer. It is
measured in this process; the service adds two hops between processes.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from sprag.service.http.web.figures.drive import drive_case
from sprag.service.http.web.laboratory.drive_setting import setting
from sprag.service.json_text import to_bytes
from sprag.worker import models

#: Values of the sliders at random, by path: lower and upper end, SI.
_ENDS = {
    "excitation.frequency": (15.0, 45.0),
    "excitation.amplitude_x": (0.5e-3, 4e-3),
    "excitation.amplitude_y": (0.5e-3, 4e-3),
    "shaft.load": (0.0, 1.0),
    "pendulums.0.backlash": (0.0, 0.02),
}


def _timed(function: Callable[..., Any], *args: Any) -> tuple[float, Any]:
    """Processor time (ms) of a call, and its value."""
    begun = time.process_time()
    value = function(*args)
    return 1e3 * (time.process_time() - begun), value


def _bytes_of(study: Any) -> tuple[bytes, dict[str, Any]]:
    found = drive_case(study, None)
    return to_bytes(found), found


def main() -> None:
    """Measure random moves of one slider at a time, each from the motion before it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--moves", type=int, default=60)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    random = np.random.default_rng(asked.seed)
    given: dict[str, str] = {}
    first = setting(given).study
    models.warm_up(first)
    drive_case(first, None)
    rows: list[tuple[float, float, float, float]] = []
    kinds: dict[str, int] = {}
    for _ in range(asked.moves):
        path = str(random.choice(list(_ENDS)))
        given[path] = repr(float(random.uniform(*_ENDS[path])))
        read, chosen = _timed(setting, given)
        case, (_, found) = _timed(_bytes_of, chosen.study)
        alone, _ = _timed(models.run_chunk, chosen.study, 0, 1)
        rows.append((read, case, read + case, alone))
        kinds[found["regime"]] = kinds.get(found["regime"], 0) + 1
        given |= {name: repr(value) for name, value in (found["state"] or {}).items()}
    times = np.array(rows)
    print(f"{asked.moves} moves: " + ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items())))
    print("processor time, ms              median   90 %    most")
    for name, column in zip(
        ("reading the setting", "case, figure, frames", "move", "settled case"), times.T, strict=True
    ):
        print(f"{name:30}" + "".join(f"{value:8.1f}" for value in np.quantile(column, [0.5, 0.9, 1.0])))
    print(f"a move takes {np.median(times[:, 2] / times[:, 3]):.1f} times its settled case (median)")


if __name__ == "__main__":
    main()
