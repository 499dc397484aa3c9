"""Branches of the drive of examples/one_pendulum.json at 25 Hz, 2 mm along the load: where, how exact, how expensive.

    nice -n 10 python -m benchmarks.branches

For the motions of order 1, 2 and 4: the doubling at which all of them meet, the largest relative difference of stable
points from settled cases, processor time; and brute force, started on the orbit, to either side of the doubling.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.workloads import W1
from sprag_study.engine.continuation.follow import Range
from sprag_study.engine.continuation.problem import Kind
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.branches import DriveBranch, branch
from sprag_study.engine.vibration_drive.cases import case_matrix, with_lengths
from sprag_study.engine.vibration_drive.integration import integrate
from sprag_study.engine.vibration_drive.kernel import kernel_of
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.results import orbit_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.strobes import BEGIN, SHAFT_SPEED

SETTINGS = SettledRun()
#: Distance (N*m) from the doubling at which brute force starts on the orbit, and its periods.
AWAY, PERIODS = 1e-3, 20_000


def machines(loads: NDArray[np.float64]) -> dict[str, Any]:
    """The drive at some loads."""
    columns = {path: float(np.asarray(value).reshape(-1)[0]) for path, value in W1.columns(np.array([0])).items()}
    columns |= {"excitation.frequency": 25.0, "excitation.amplitude_x": 2e-3, "excitation.amplitude_y": 2e-3}
    return {**columns, "shaft.load": loads}


def apart(made: DriveBranch) -> tuple[int, float]:
    """Stable points whose cases settle to this motion, and their largest relative difference in the mean speed."""
    rows = [row for row, point in enumerate(made.points) if point.multiplier < 0.95]
    loads = np.array([made.points[row].parameter for row in rows])
    found = settle(machines(loads), SETTINGS, cases=len(rows))
    names = [info.name for info in settled_infos(1)]
    same = found.values[:, names.index("regime.order")] == made.order
    speeds = made.values[rows, [info.name for info in orbit_infos(1)].index("shaft.speed.mean")]
    differences = np.abs(found.values[:, names.index("shaft.speed.mean")] / speeds - 1.0)[same]
    return int(np.sum(same)), float(np.max(differences))


def brute_force(made: DriveBranch, load: float) -> float:
    """Difference (rad/s) of the shaft's speed at the last two of many strobes of a run from the orbit on."""
    loads = np.array([point.parameter for point in made.points])
    start = made.points[int(np.argmin(np.abs(loads - load)))].state[None]
    columns, run = machines(np.array([load])), SETTINGS.run
    matrix = with_lengths(case_matrix(columns, run, 1), start[:, BEGIN], np.array([float(PERIODS)]), windowed=False)
    strobes = integrate(kernel_of(columns, run.tolerance), matrix, run, starts=start, strobes=2).strobes[0]
    return float(abs(strobes[0, SHAFT_SPEED] - strobes[1, SHAFT_SPEED]))


def main() -> None:
    """Print a line for each branch, and one for each side of the doubling."""
    settle(machines(np.array([0.3])), SETTINGS, cases=1)  # loads the kernel
    print("order  from   range        orbits  seconds  special points; settled cases compared, largest difference")
    branches = []
    for load, low, high in ((0.3, 0.1, 0.5), (0.2, 0.095, 0.4), (0.05, 0.03, 0.4)):
        begin = time.process_time()
        made = branch(machines, load, SETTINGS, Range(low, high), (0.0, np.inf))
        seconds = time.process_time() - begin
        specials = ", ".join(f"{special.kind} {special.parameter:.10f}" for special in made.specials)
        cases, difference = apart(made)
        print(f"{made.order}      {load:<5}  {low:<5} .. {high}  {len(made.points):<6}  {seconds:<7.2f}  {specials}; "
              f"{cases}, {difference:.1e}", flush=True)  # fmt: skip
        branches.append(made)
    doubling = next(special.parameter for special in branches[0].specials if special.kind == Kind.DOUBLING)
    for load in (doubling - AWAY, doubling + AWAY):
        left = brute_force(branches[0], load)
        print(f"{load:.7f} N*m: after {PERIODS} periods strobes differ by {left:.1e} rad/s")


if __name__ == "__main__":
    main()
