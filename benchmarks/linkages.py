"""Random chains of dyads against positions by the law of cosines with complex steps, and what dyads cost.

How many chains agree, and how far; the processor time of a toggle as dyads over that of the toggle.
"""

from __future__ import annotations

import sys
from time import process_time
from typing import Any

import numpy as np

from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import MachineSpec, MechanismChoice, OperationChoice
from tests.engine.machine_shaft.linkages import Numbers, as_dyads
from tests.engine.machine_shaft.test_planar import chain_error, mechanism

_CASES, _REPEATS = 256, 3


def seconds(choice: MechanismChoice, numbers: Numbers) -> float:
    """Least processor time of a case, with a force over the stroke and another crank in each case."""
    spec = MachineSpec(mechanism=choice, operation=OperationChoice("force", over="stroke"))
    values: dict[str, Any] = {f"mechanism.{choice.kind}.{name}": value for name, value in numbers.items()}
    values[f"mechanism.{choice.kind}.crank"] = numbers["crank"] * np.linspace(0.95, 1.0, _CASES)
    values |= {"mean_speed": 20.0, "drive.inertia": 8.0, "operation.value": 900.0}
    times = []
    for _ in range(_REPEATS):
        start = process_time()
        simulate(spec, values, cases=_CASES)
        times.append(process_time() - start)
    return min(times) / _CASES


def main(count: int = 300) -> None:
    """Print the share of chains that agree to 1e-9 of their size, the largest difference, and the ratio of times."""
    errors = np.array([chain_error(seed) for seed in range(1_000, 1_000 + count)])
    agree = int((errors < 1e-9).sum())
    print(f"{agree} of {count} chains agree to 1e-9; median {np.median(errors):.1e}, largest {errors.max():.1e}")
    choice, numbers = mechanism("toggle")
    linkage, dyads = as_dyads("toggle", numbers)
    known, own = seconds(choice, numbers), seconds(MechanismChoice("linkage", linkage=linkage), dyads)
    print(f"a toggle as dyads takes {own / known:.1f} times its processor time ({own * 1e3:.2f} ms a case)")
    sys.exit(agree < count)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
