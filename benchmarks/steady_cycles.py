"""All steady cycles of random machines against marching by scipy, which shares nothing with the engine.

Scotch yokes under loads that fall with the speed somewhere, driven by linear and asynchronous motors, by motors with a
saddle in their characteristic, or by the constant torque that balances them. Prints what marching says against them:
cycles that are none, wrong multipliers and basins, cycles that are missing; and rows that give another ending than
their cycle has.

    python -m benchmarks.steady_cycles [--machines 200] [--seed 0]
"""

from __future__ import annotations

import argparse
import time
from collections import Counter

import numpy as np

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.steady_cycles import steady_cycles
from tests.engine.machine_shaft.marching import judged, random_machine

NAMES = tuple(info.name for info in result_infos())


def main() -> None:
    """Compare and count."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    kinds: Counter[str] = Counter()
    wrong = 0
    spent = 0.0
    for seed in range(arguments.seed, arguments.seed + arguments.machines):
        machine = random_machine(np.random.default_rng(seed))
        begun = time.process_time()
        found = steady_cycles(machine.spec, machine.numbers)
        spent += time.process_time() - begun
        batch = simulate(machine.spec, machine.numbers, cases=1)
        row = dict(zip(NAMES, batch.values[0].tolist(), strict=True))
        ending = ENDINGS[int(batch.endings[0])]
        if found is None:
            raise AssertionError(f"machine {seed} has no torque that follows the speed")
        kinds[f"{ending}, stable cycles: {len(found.stable)}"] += 1
        if found.cycles or machine.spec.balance == "motor":
            given = row["drive_torque.mean"]
            faults = judged(machine, found, given if np.isfinite(given) else 0.0)
        else:
            faults = []
        if not found.whole:
            faults.append("not every motion was followed")
        case = None if found.case is None else found.cycles[found.case]
        if ending in {Ending.OK, Ending.UNSTABLE} and (case is None or case.stable != (ending is Ending.OK)):
            faults.append(f"the row ends as {ending}")
        if ending is Ending.MOTOR_STALLED and found.stable:
            faults.append("the row ends as motor_stalled, and the shaft can turn steadily")
        for fault in faults:
            print(f"machine {seed}: {fault}", flush=True)
        wrong += bool(faults)
    print(f"{arguments.machines} machines, {wrong} of them with faults; {spent / arguments.machines:.1f} s each")
    for kind, count in sorted(kinds.items()):
        print(f"  {count:4d}  {kind}")


if __name__ == "__main__":
    main()
