"""Machines of several parts against a computation that shares nothing with the engine, and their cost.

Random machines of two to five parts (slider-cranks, quick returns, four-bars under steps, forces and gas) are solved by
the engine and by complex steps through positions with a quadrature and a root search of their own. Prints the largest
relative difference of each result with the seed of its machine, and the cases a second of 1 to 8 equal parts relative
to the first.

    python -m benchmarks.machine_parts [--machines 300] [--seed 0] [--cases 500]
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict

import numpy as np

from sprag_study.engine.machine_shaft.estimate import estimate_seconds
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import MachineSpec
from tests.engine.machine_shaft import independent, random_machines
from tests.engine.machine_shaft.machines import PRESS_NUMBERS
from tests.engine.machine_shaft.test_parts import PRESS_PART, engine_machine, in_part, of_shaft

NAMES = tuple(info.name for info in result_infos())


def main() -> None:
    """Compare and measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cases", type=int, default=500)
    arguments = parser.parse_args()
    begun = time.process_time()
    largest: dict[str, tuple[float, int]] = defaultdict(lambda: (0.0, arguments.seed))
    for seed in range(arguments.seed, arguments.seed + arguments.machines):
        machine = random_machines.random_machine(np.random.default_rng(seed))
        batch = simulate(*engine_machine(machine), cases=1)
        found = dict(zip(NAMES, batch.values[0], strict=True))
        solved = independent.solve(machine)
        for name, value in solved.items():
            # The work of a machine without an operation is a rounding error of what its masses exchange.
            least = solved["energy.fluctuation"] if name in {"drive_torque.mean", "work.resistance"} else 0.0
            scale = machine.speed if name.startswith("omega") else max(abs(value), least)
            largest[name] = max(largest[name], (abs(found[name] - value) / scale, seed))
    print(f"{'result':24}{'difference':>12}{'seed':>8}")
    for name, (error, seed) in largest.items():
        print(f"{name:24}{error:12.2e}{seed:8}")
    print(f"{arguments.machines} machines, {time.process_time() - begun:.0f} s of processor time")
    first = 0.0
    print(f"\n{'parts':8}{'cases/s':>10}{'ratio':>8}{'estimate':>10}")
    for count in (1, 2, 4, 8):
        spec = MachineSpec(parts=(PRESS_PART,) * count)
        numbers = of_shaft(PRESS_NUMBERS) | {"drive.inertia": np.linspace(15.0, 50.0, arguments.cases) * count}
        for k in range(count):
            numbers |= in_part(k, PRESS_NUMBERS, crank_angle=6.28 * k / count)
        simulate(spec, numbers, cases=arguments.cases)
        start = time.process_time()
        simulate(spec, numbers, cases=arguments.cases)
        rate = arguments.cases / (time.process_time() - start)
        first = first or rate
        print(f"{count:<8}{rate:10.0f}{rate / first:8.2f}{1.0 / estimate_seconds(spec):10.0f}")


if __name__ == "__main__":
    main()
