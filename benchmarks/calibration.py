"""Do the intervals of calibrations hold the true values? Synthetic measurements of drives, with noise.

    python -m benchmarks.calibration [--sets COUNT] [--first SET] [--refits COUNT] [--settled] [--unknown-sigma]
        [--few] [--priors]

Each set is a drive of W1 with random damping, inertia of the pendulum, rate of its spring and backlash, whose mean
speed and irregularity are measured with 2 % noise at five loads and three frequencies. By default its rows are those of
runs over 60 periods. With ``--few`` only one frequency is measured, and the rate of the spring is drawn from a normal
distribution, which the calibration knows with ``--priors``.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.workloads import W1
from sprag_study.engine import Run, Span
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.engine.vibration_drive.results import result_infos
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.worker.planning.calibrate import CalibratePlan, CalibratePlanner, Measured, Unknown
from sprag_study.worker.planning.calibrate.answer import answer
from sprag_study.worker.planning.rounds import Rows

Floats = NDArray[np.float64]

UNKNOWN = (
    Unknown(("pendulums.0.damping",), 0.002, 0.05),
    Unknown(("pendulums.0.inertia",), 0.0006, 0.0016),
    Unknown(("pendulums.0.spring_rate",), 5_000.0, 14_000.0),
    Unknown(("pendulums.0.backlash",), 0.0, 0.015),
)
#: Ranges of the true values.
TRUE = ((0.006, 0.02), (0.0009, 0.0011), (8_000.0, 10_000.0), (0.002, 0.008))
RESULTS = ("shaft.speed.mean", "shaft.irregularity")
PATHS = ("shaft.load", "excitation.frequency")
AT = tuple((float(load), hertz) for load in np.linspace(0.05, 0.25, 5) for hertz in (20.0, 24.0, 28.0))
NOISE = 0.02
#: Which of the unknowns is drawn from a prior, and that prior.
RATE, PRIOR = 2, (9_000.0, 300.0)
_TIMED = Run(Span(60.0), (Span(40.0), Span(60.0)))


class Drive:
    """Runs drives; ``seconds`` of processor time were spent in the engine."""

    def __init__(self, *, settled: bool) -> None:
        self.seconds, self.cases, self._settled = 0.0, 0, settled
        infos = settled_infos(1) if settled else result_infos(1)
        self._places = [[info.name for info in infos].index(name) for name in RESULTS]

    def rows(self, points: Floats) -> Rows:
        """The rows of sets of parameters at conditions."""
        begin = time.process_time()
        columns = W1.columns(np.zeros(1, dtype=np.int64))
        columns |= {"excitation.amplitude_x": 0.002, "excitation.amplitude_y": 0.002}
        columns |= dict(zip((*(one.paths[0] for one in UNKNOWN), *PATHS), points.T, strict=True))
        if self._settled:
            batch = settle(columns, SettledRun(), cases=len(points))
            endings, values = batch.endings, batch.values
        else:
            timed = simulate(columns, _TIMED, cases=len(points))
            endings, values = timed.endings, timed.values
        self.seconds += time.process_time() - begin
        self.cases += len(points)
        named = {name: values[:, place] for name, place in zip(RESULTS, self._places, strict=True)}
        return Rows(points, np.asarray(endings) == ENDINGS.index(Ending.OK), named)


def one_set(
    number: int, drive: Drive, refits: int, *, known: bool, few: bool, prior: bool
) -> tuple[Floats, CalibratePlanner]:
    """The true values of a set, and its calibration at the end."""
    random = np.random.default_rng(number)
    true = np.array([random.uniform(*ends) for ends in TRUE])
    at, unknown = AT, UNKNOWN
    if few:
        true[RATE] = random.normal(*PRIOR)
        at = tuple(one for one in AT if one[1] == AT[1][1])
    if prior:
        unknown = tuple(replace(one, prior=PRIOR if place == RATE else None) for place, one in enumerate(UNKNOWN))
    exact = drive.rows(np.hstack([np.tile(true, (len(at), 1)), np.array(at)]))
    measured = []
    for name in RESULTS:
        sigma = NOISE * np.abs(exact.values[name])
        values = exact.values[name] + sigma * random.normal(size=len(at))
        deviations = tuple(sigma.tolist()) if known else ()
        measured.append(Measured(name, tuple(range(len(at))), tuple(values.tolist()), deviations))
    planner = CalibratePlanner(CalibratePlan(unknown, PATHS, at, tuple(measured), refits=refits, seed=number))
    while len(points := planner.ask().points):
        planner.tell(drive.rows(points))
    return true, planner


def main() -> None:
    """Count the intervals that hold the true values."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sets", type=int, default=20)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--refits", type=int, default=200)
    parser.add_argument("--settled", action="store_true")
    parser.add_argument("--unknown-sigma", action="store_true")
    parser.add_argument("--few", action="store_true")
    parser.add_argument("--priors", action="store_true")
    chosen = parser.parse_args()
    drive = Drive(settled=chosen.settled)
    held, named, planning = np.zeros(len(UNKNOWN), dtype=np.int64), 0, 0.0
    for number in range(chosen.first, chosen.first + chosen.sets):
        begin, engine = time.process_time(), drive.seconds
        true, planner = one_set(
            number, drive, chosen.refits, known=not chosen.unknown_sigma, few=chosen.few, prior=chosen.priors
        )
        planning += time.process_time() - begin - (drive.seconds - engine)
        found = answer(planner.plan, planner.space, planner.state)
        if found is None or found.intervals is None:
            print(f"set {number}: no intervals")
            continue
        inside = (found.intervals[:, 0] <= true) & (true <= found.intervals[:, 1])
        held += inside
        named += bool(found.directions)
        print(
            f"set {number}: {''.join('+' if one else '-' for one in inside)}  chi-square {found.chi_square:.1f} for "
            f"{found.freedom}, values over true {np.array2string(found.values / true, precision=4)}",
            flush=True,
        )
    shares = 100.0 * held / chosen.sets
    print(", ".join(f"{one.paths[0]} {share:.1f} %" for one, share in zip(UNKNOWN, shares, strict=True)))
    print(f"all {shares.mean():.1f} %; directions that cannot be told apart in {named} sets")
    print(f"{drive.cases:,} cases, {drive.seconds:.0f} s in the engine, {planning:.0f} s of planning")


if __name__ == "__main__":
    main()
