"""Random chains of dyads against positions by the law of cosines with complex steps: how many agree, and how far."""

from __future__ import annotations

import sys

import numpy as np

from tests.engine.machine_shaft.test_planar import chain_error


def main(count: int = 300) -> None:
    """Print the share of chains that agree to 1e-9 of their size, and the largest differences."""
    errors = np.array([chain_error(seed) for seed in range(1_000, 1_000 + count)])
    agree = int((errors < 1e-9).sum())
    print(f"{agree} of {count} chains agree to 1e-9; median {np.median(errors):.1e}, largest {errors.max():.1e}")
    sys.exit(agree < count)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
