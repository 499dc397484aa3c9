"""Elementary functions of arrays against numpy's: time an element, and its ratio.

They take turns in one run; the least times count.

    python -m benchmarks.elementary [--size 2000] [--repeats 200]
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary

Floats = NDArray[np.float64]

_ONE = ("sin", "cos", "tan", "arcsin", "arccos", "arctan", "exp", "log", "sinh", "cosh", "tanh")
_TWO = ("arctan2", "power")


def seconds(function: Callable[..., object], *arguments: Floats) -> float:
    """Elapsed time of one call."""
    begin = time.perf_counter()
    function(*arguments)
    return time.perf_counter() - begin


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=2000, help="elements of an array")
    parser.add_argument("--repeats", type=int, default=200)
    options = parser.parse_args()
    fractions = np.random.default_rng(1).uniform(0.01, 0.99, (2, options.size))
    for name in (*_ONE, *_TWO):
        arguments = tuple(fractions[: 1 if name in _ONE else 2])
        own, theirs = [], []
        for _ in range(options.repeats):
            own.append(seconds(getattr(elementary, name), *arguments))
            theirs.append(seconds(getattr(np, name), *arguments))
        each, other = (1e9 * min(times) / options.size for times in (own, theirs))
        print(f"{name:<8} {each:6.2f} ns an element, numpy {other:6.2f}: {each / other:5.2f} times as long")


if __name__ == "__main__":
    main()
