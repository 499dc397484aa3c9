"""Processor time of one move in the laboratory of vibration drives, against one settled case in the same run.

python -m benchmarks.laboratory [--moves 200] [--seed 1] [--worst 5]

For each built-in drive one slider at a time goes to a random place of its range, each move from the motion before it. A
move reads the setting, runs the settled case, and makes figure, frames and answer. It is measured in this process; the
service adds two hops between processes.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sprag.service.http.web.figures.drive import drive_case
from sprag.service.http.web.laboratory.setting import machines, setting
from sprag.service.json_text import to_bytes
from sprag.service.reading.reader import Reading
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.http.web.laboratory.sliders import Slider

#: Milliseconds that a move may take.
BOUND = 100.0
#: Times that each computation is measured: other processes make some of them slower.
REPEATS = 3


class Move(NamedTuple):
    """One move: processor times (ms), the motion that it comes to, and what was set last."""

    reading: float
    drawing: float
    alone: float
    regime: str
    settled_after: float
    path: str
    given: dict[str, str]

    @property
    def whole(self) -> float:
        """Time of the move."""
        return self.reading + self.drawing


def _timed(function: Callable[..., Any], *args: Any) -> tuple[float, Any]:
    """Processor time (ms) of a call, the least of some, and its value."""
    times = []
    for _ in range(REPEATS):
        begun = time.process_time()
        value = function(*args)
        times.append(1e3 * (time.process_time() - begun))
    return min(times), value


def _bytes_of(study: Any) -> tuple[bytes, dict[str, Any]]:
    found = drive_case(study, Reading(study.model))
    return to_bytes(found), found


def _place(slider: Slider, share: float) -> str:
    """The text of a slider at a share of its range."""
    low, high = slider.low, slider.high
    value = low * (high / low) ** share if slider.logarithmic else low + (high - low) * share
    return repr(value)


def moves_of(name: str, count: int, random: np.random.Generator) -> list[Move]:
    """Random moves of one drive."""
    given = {"machine": name}
    chosen = setting(models.VIBRATION_DRIVE, given)
    models.warm_up(chosen.study)
    drive_case(chosen.study, Reading(chosen.study.model))
    sliders = [slider for slider in chosen.sliders if slider.high > slider.low]
    found = []
    for _ in range(count):
        slider = sliders[int(random.integers(len(sliders)))]
        given[slider.path] = _place(slider, float(random.random()))
        reading, chosen = _timed(setting, given)
        drawing, (_, case) = _timed(_bytes_of, chosen.study)
        alone, _ = _timed(models.run_chunk, chosen.study, 0, 1)
        after = case["results"].get("regime.settled_after") or float("nan")
        regime = case["regime"] or case["ending"]
        found.append(Move(reading, drawing, alone, regime, after, slider.path, dict(given)))
        given |= {path: repr(value) for path, value in (case["state"] or {}).items()}
    return found


def _told(name: str, found: list[Move], worst: int) -> None:
    kinds = {regime: sum(move.regime == regime for move in found) for regime in sorted({m.regime for m in found})}
    print(f"{name}, {len(found)} moves: " + ", ".join(f"{count} {kind}" for kind, count in kinds.items()))
    print("processor time, ms              median   90 %    most")
    rows = np.array([[move.reading, move.drawing, move.whole, move.alone] for move in found])
    titles = ("reading the setting", "case, figure, frames", "move", "settled case")
    for title, column in zip(titles, rows.T, strict=True):
        print(f"{title:30}" + "".join(f"{value:8.1f}" for value in np.quantile(column, [0.5, 0.9, 1.0])))
    above = sum(move.whole > BOUND for move in found)
    print(f"{above} of {len(found)} moves take more than {BOUND:g} ms; a move takes ", end="")
    print(f"{np.median(rows[:, 2] / rows[:, 3]):.1f} times its settled case (median)")
    for move in sorted(found, key=lambda move: -move.whole)[:worst]:
        after = f", settled after {move.settled_after:.0f} periods" if move.settled_after > 0.0 else ""
        print(f"  {move.whole:6.0f} ms, case {move.alone:.0f} ms: {move.regime}{after}; {move.path} moved")
        print("    " + "&".join(f"{path}={text}" for path, text in move.given.items() if ".initial_" not in path))


def main() -> None:
    """Measure random moves of one slider at a time, each from the motion before it."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--moves", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--worst", type=int, default=5)
    asked = parser.parse_args()
    random = np.random.default_rng(asked.seed)
    for name in machines(models.VIBRATION_DRIVE):
        _told(name, moves_of(name, asked.moves, random), asked.worst)


if __name__ == "__main__":
    main()
