"""Error of the mean speed against cases per second, for tolerances 1e-4 to 1e-13: this engine, heyoka and scipy.

    pip install -e '.[benchmark]'
    python -m benchmarks.work_precision [--reference PATH] [--repeats 3] [--core K]

Writes docs/figures/work_precision.svg and, beside it, the same numbers as work_precision.csv. Rates are of all cases of
W1 (scipy: of a few), by processor time on one pinned core, the least of the repeats; errors are over its reference
cases.
"""

from __future__ import annotations

import argparse
import csv
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.heyoka_drive import HeyokaDrive
from benchmarks.peers.scipy_drive import ScipyDrive
from benchmarks.peers.sprag_drive import SpragDrive
from benchmarks.workloads import (
    CASES,
    REFERENCE,
    W1,
    Errors,
    cores,
    errors,
    load_reference,
    pin,
    take_turns,
)

ROOT = Path(__file__).resolve().parents[1]
FIGURES = ROOT / "docs" / "figures"
EXPONENTS = range(4, 14)
TOOLS = {"this engine": SpragDrive, "heyoka, batches of 8": HeyokaDrive, "scipy DOP853": ScipyDrive}
_FIELDS = ("tool", "tolerance", "cases_per_second", "median_error", "p95_error", "max_error", "steps_per_case")


def _row(name: str, tolerance: float, rate: float, found: Errors, steps: float) -> dict[str, Any]:
    values = found.relative["shaft.speed.mean"]
    numbers = rate, np.median(values), np.percentile(values, 95.0), np.max(values), steps
    return dict(zip(_FIELDS, (name, f"{tolerance:.0e}", *(f"{number:.4g}" for number in numbers)), strict=True))


def measure(options: argparse.Namespace) -> list[dict[str, Any]]:
    """All tools at all tolerances."""
    reference = load_reference(options.reference, W1)
    spread = np.linspace(0, len(reference) - 1, options.scipy_cases).astype(int)
    few = np.array(sorted({reference[k]["case"] for k in spread}))
    rows = []
    for exponent in EXPONENTS:
        tolerance = 10.0**-exponent
        jobs = {}
        for name, tool in TOOLS.items():
            drive = tool(W1, tolerance)
            jobs[name] = partial(drive.run, few if tool is ScipyDrive else np.arange(CASES))
            if tool is not ScipyDrive:
                drive.run(np.arange(16))  # loads and compiles
        slow = jobs.pop("scipy DOP853")
        found = take_turns(jobs, options.repeats) | take_turns({"scipy DOP853": slow}, 1)
        for name, (timing, outcome) in found.items():
            cases = len(outcome.cases)
            rows.append(_row(name, tolerance, cases / timing.cpu, errors(outcome, reference), outcome.steps / cases))
            print("  ".join(f"{value:>12}" for value in rows[-1].values()))
    return rows


def draw(rows: list[dict[str, Any]], path: Path) -> None:
    """The plot: medians as lines, 95th percentiles dashed."""
    import matplotlib as mpl

    mpl.use("svg")
    import matplotlib.pyplot as plt

    plt.rcParams |= {"svg.hashsalt": "sprag", "font.size": 10}
    figure, axes = plt.subplots(figsize=(7.5, 5.0), layout="constrained")
    for tool, marker in zip(TOOLS, "osd", strict=True):
        own = [row for row in rows if row["tool"] == tool]
        rates = [float(row["cases_per_second"]) for row in own]
        (line,) = axes.loglog(rates, [float(row["median_error"]) for row in own], marker=marker, label=tool)
        high = [float(row["p95_error"]) for row in own]
        axes.loglog(rates, high, marker=marker, markersize=3, linestyle="--", linewidth=0.8, color=line.get_color())
    axes.set(xlabel="cases per second on one core", ylabel="relative error of the mean shaft speed")
    axes.set_title("W1: 60 periods a case, tolerances 1e-4 to 1e-13 (dashed: 95th percentile)", fontsize=10)
    axes.grid(which="major", alpha=0.3)
    axes.legend()
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Measure, write the table, draw it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--reference", type=Path, default=REFERENCE, help="folder or file of reference values")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--scipy-cases", type=int, default=8, help="how many cases scipy runs")
    parser.add_argument("--core", type=int, default=cores()[-1], help="the core to stay on")
    parser.add_argument("--out", type=Path, default=FIGURES, help="folder for the plot and its numbers")
    options = parser.parse_args()
    pin(options.core)
    rows = measure(options)
    options.out.mkdir(parents=True, exist_ok=True)
    with (options.out / "work_precision.csv").open("w", newline="", encoding="utf-8") as handle:
        writer = csv.DictWriter(handle, _FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    draw(rows, options.out / "work_precision.svg")


if __name__ == "__main__":
    main()
