"""How often a result lies within the band of a refined curve where the motion is irregular.

    python -m benchmarks.refine_irregular [--curves 24] [--places 40] [--seed 1]

Drives are drawn at random: one pendulum and two, over frequency and over load. Each curve is refined to 1 %, and cases
are run at random places of its irregular stretches. Printed is the share of them whose result is within the half width
of the line, for each result, and what share of the axes the stretches and the jumps take.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from benchmarks.refine import FINEST, START, refined
from benchmarks.refine_problems import Problem, over_load, over_speed
from sprag_study.worker.planning.refine import Curve

Floats = NDArray[np.float64]


def drawn(generator: np.random.Generator, curves: int) -> Iterator[Problem]:
    """Curves of drives drawn at random."""
    for number in range(curves):
        preset, amplitude = ("one_pendulum", "two_pendulums")[number % 2], round(float(generator.uniform(0.8, 3.2)), 2)
        if number % 4 < 2:
            yield over_speed(preset, amplitude, round(float(generator.uniform(0.02, 0.5)), 3))
        else:
            yield over_load(preset, round(float(generator.uniform(105.0, 215.0)), 1), amplitude)


def places_within(curve: Curve, name: str, places: int, generator: np.random.Generator) -> Floats:
    """Random places in the stretches of a result, evenly distributed over their length."""
    parts = np.flatnonzero(curve.scattered[name])
    widths = np.diff(curve.x)[parts]
    chosen = generator.choice(parts, size=places, p=widths / widths.sum())
    return np.asarray(curve.x[chosen] + generator.uniform(size=places) * np.diff(curve.x)[chosen])


def share_of(curve: Curve, parts: NDArray[np.bool_]) -> float:
    """Share of the axis."""
    return float(np.diff(curve.x)[parts].sum() / np.ptp(curve.x))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--curves", type=int, default=24)
    parser.add_argument("--places", type=int, default=40, help="of each result of a curve, at most")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    generator = np.random.default_rng(chosen.seed)
    within: dict[str, list[bool]] = {}
    widths: dict[str, list[float]] = {}
    shares: dict[str, list[tuple[float, float]]] = {}
    for problem in drawn(generator, chosen.curves):
        curve, _, _ = refined(problem, problem.plan(0.01, START, FINEST))
        for name, values in curve.values.items():
            scattered = curve.scattered[name]
            shares.setdefault(name, []).append((share_of(curve, scattered), share_of(curve, ~curve.joined[name])))
            if not scattered.any():
                continue
            x = places_within(curve, name, min(chosen.places, int(scattered.sum()) + 4), generator)
            rows = problem.rows(x[:, None])
            band = np.interp(x, curve.x, np.nan_to_num(curve.half_widths[name]))
            distance = np.abs(rows.values[name] - np.interp(x, curve.x, values))
            within.setdefault(name, []).extend((distance <= band)[rows.ok].tolist())
            widths.setdefault(name, []).extend((band / curve.ranges[name])[rows.ok].tolist())
        print(f"  {problem.name}: {len(curve.x)} points, {len(curve.stretches)} stretches", flush=True)
    for name, inside in within.items():
        stretch, blank = np.mean(shares[name], axis=0)
        print(
            f"{name}: {np.mean(inside):.1%} of {len(inside)} places within the band; its half width is "
            f"{np.median(widths[name]):.2%} of the range (median), {np.quantile(widths[name], 0.9):.2%} at 9 of 10 "
            f"places at most; stretches are {stretch:.1%} of the axes, blanks {blank:.1%}"
        )


if __name__ == "__main__":
    main()
