"""Sweeps against runs from rest: periods a case, hysteresis, and whether jumps lie where a finer sweep has them.

    python -m benchmarks.sweeps [drives steps]

Lines are random drives of the range of W1 (amplitude, load), swept over the excitation frequency from 16 to 35 Hz, up
and down. A jump agrees if a sweep with 16 times smaller steps has one in the same step or the next one to either side.
Then the sweep of each drive is narrowed at its jumps: of its steps with a jump, those are counted in which the finer
sweep jumps, too, and those beside such a step.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.workloads import W1
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.sweep import Begun, Sweep, sweep
from sprag_study.service.spec.narrow import narrowed_values

FINER = 16
LOW, HIGH = 16.0, 35.0
SWEPT = "excitation.frequency"
#: Differences of the mean speeds up and down, relative to the larger one, that count as hysteresis.
HYSTERESIS = 0.05
SPEED = [info.name for info in settled_infos(1)].index("shaft.speed.mean")

Floats = NDArray[np.float64]


def columns_of(drives: Floats, frequencies: Floats) -> dict[str, Any]:
    """Columns of every drive (amplitude in m, load in N*m) at every frequency, up and then down."""
    amplitude, load = (np.repeat(column, 2 * frequencies.size) for column in drives.T)
    return {
        **W1.columns(np.array([0])),
        "excitation.frequency": np.tile(frequencies, 2 * len(drives)),
        "excitation.amplitude_x": amplitude,
        "excitation.amplitude_y": amplitude,
        "shaft.load": load,
    }


def lines_of(drives: int, steps: int) -> NDArray[np.int64]:
    """Cases of the lines of `columns_of`: those with even numbers go up, the others down."""
    lines = np.arange(2 * drives * steps).reshape(2 * drives, steps)
    lines[1::2] = lines[1::2, ::-1]
    return lines


def jumps(found: Sweep, lines: NDArray[np.int64], frequencies: Floats) -> list[Floats]:
    """The steps of each line in which the motion jumps: their lower and upper ends, shape (jumps, 2)."""
    steps = frequencies.size
    every = []
    for line in lines:
        at = np.flatnonzero(found.jumped[line])
        every.append(np.sort(frequencies[line[np.column_stack([at - 1, at])] % steps], axis=1))
    return every


def narrowed(drives: Floats, frequencies: Floats, coarse: list[Floats], fine: list[Floats]) -> None:
    """Print whether the jumps of narrowed sweeps are those of the finer one."""
    count = within = beside = cases = whole = 0
    for number in range(len(drives)):
        own = np.unique(np.concatenate(coarse[2 * number : 2 * number + 2]), axis=0)
        values = narrowed_values(frequencies, own, FINER)
        lines = lines_of(1, values.size)
        found = sweep(columns_of(drives[number : number + 1], values), SettledRun(), lines, SWEPT)
        cases += 2 * values.size
        for steps, finer in zip(jumps(found, lines, values), fine[2 * number : 2 * number + 2], strict=True):
            count += len(steps)
            whole += int((np.diff(steps) > 1.5 * np.diff(frequencies)[0] / FINER).sum())
            middles = finer.mean(axis=1)
            inside = [bool(((middles > low) & (middles < high)).any()) for low, high in steps]
            near = [bool(((middles > 2 * low - high) & (middles < 2 * high - low)).any()) for low, high in steps]
            within += sum(inside)
            beside += sum(near) - sum(inside)
    print(
        f"narrowed: {count} jumps, {within} in steps in which the finer sweep jumps, {beside} in the step beside one, "
        f"{whole} in steps not narrowed yet; "
        f"{cases} cases, the finer sweep {2 * len(drives) * (FINER * (frequencies.size - 1) + 1)}"
    )


def main() -> None:
    """Print the comparison."""
    count, steps = (int(text) for text in (sys.argv[1:] or ["20", "41"]))
    random = np.random.default_rng(18)
    drives = np.column_stack([random.uniform(1e-3, 3e-3, count), random.uniform(0.02, 0.4, count)])
    frequencies = np.linspace(LOW, HIGH, steps)
    columns, lines = columns_of(drives, frequencies), lines_of(count, steps)
    coarse = sweep(columns, SettledRun(), lines, SWEPT)
    rest = settle(columns, SettledRun(), cases=lines.size)
    continued = coarse.begun != Begun.FIRST
    ratio = coarse.batch.spent[continued].mean() / rest.spent[continued].mean()
    print(f"{count} drives, {steps} frequencies from {LOW:g} to {HIGH:g} Hz, up and down")
    print(
        f"periods a case: {coarse.batch.spent[continued].mean():.0f} continued, "
        f"{rest.spent[continued].mean():.0f} from rest, ratio {ratio:.2f}"
    )
    speed = coarse.batch.values[:, SPEED].reshape(count, 2, steps)
    with np.errstate(invalid="ignore"):
        apart = np.abs(speed[:, 0] - speed[:, 1]) / np.maximum(speed.max(axis=1), 1e-12)
    wide = int((apart > HYSTERESIS).any(axis=1).sum())
    print(f"drives with hysteresis above {100 * HYSTERESIS:g} %: {wide} of {count}")
    fine_frequencies = np.linspace(LOW, HIGH, FINER * (steps - 1) + 1)
    fine_lines = lines_of(count, fine_frequencies.size)
    fine = sweep(columns_of(drives, fine_frequencies), SettledRun(), fine_lines, SWEPT)
    step = (HIGH - LOW) / (steps - 1)
    agree = total = 0
    jumped, finer_jumps = jumps(coarse, lines, frequencies), jumps(fine, fine_lines, fine_frequencies)
    for own, finer in zip(jumped, finer_jumps, strict=True):
        total += len(own)
        middles = finer.mean(axis=1)
        agree += int(sum(bool(len(finer)) and np.abs(middles - at).min() <= 1.5 * step for at in own.mean(axis=1)))
    print(f"jumps within a step of a {FINER} times finer sweep: {agree} of {total}")
    narrowed(drives, frequencies, jumped, finer_jumps)


if __name__ == "__main__":
    main()
