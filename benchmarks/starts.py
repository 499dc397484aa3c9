"""Regimes and shares of cases with many starts against runs of 20,000 periods, and against 4,096 starts.

    nice -n 15 python -m benchmarks.starts RESULTS [--points COUNT] [--starts COUNT] [--many COUNT] [--long PERIODS]
        [--speed LOW HIGH] [--angle LOW HIGH]

The points are those of W1 at which 24 starts show several regimes and the same number of other ones in turn, then the
rest; both in a random order. RESULTS is a file with the settings and a line of JSON for each point. Points that are in
it are not computed again, so a run that was stopped goes on; the figures printed at the end are those of all of them.
Each point:

- its regimes from some starts (256), as a study reports them;
- a long run from each of the same starts, distinguished by its strobes alone (`benchmarks.starts_long`), five times as
  long where the regimes are not the same: some chaotic transients outlast 20,000 periods;
- its regimes from many other starts (4,096).
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.starts_long import Motions, long_motions
from benchmarks.workloads import CASES, W1
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.start_results import started_infos
from sprag_study.engine.vibration_drive.starts import StartedBatch, settle_starts, started_columns
from sprag_study.service.spec.kinds.starts import drawn

Ints = NDArray[np.int64]

_SETTINGS = SettledRun()
_NAMES = [info.name for info in started_infos(1)]
#: Starts of the scan that chooses the points, and the seed of their order.
_SCAN, _SEED = 24, 18
#: How many times as long the long runs are where the regimes are not the same.
_LONGER = 5
#: Share of the many starts from which on a regime must not be missed.
_FREQUENT = 0.05


@dataclass(frozen=True)
class Point:
    """What was found at a point.

    ``regimes``: of some starts, the results that distinguish them. ``motions``: those of the long runs. ``table``: how
    many starts each regime (row; the last one: failed) has in common with each motion (column; the last one: failed).
    ``shares``: of every regime that the many starts have, its share of them, and the number of the regime of some
    starts that it is; -1 where it is none.
    """

    case: int
    regimes: list[dict[str, float]]
    motions: list[dict[str, float]]
    table: list[list[int]]
    shares: list[tuple[float, int]]
    seconds: float
    periods: int

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """The motion to which most starts of each regime come, of those with one."""
        table = np.array(self.table)[:-1]
        return [(row, int(np.argmax(table[row]))) for row in range(len(table))]

    @property
    def agrees(self) -> bool:
        """Whether regimes and motions are the same: each of one the most frequent of just one of the other."""
        reached = [motion for _, motion in self.pairs]
        return sorted(reached) == list(range(len(self.motions))) and all(
            self.regimes[regime]["regime.order"] == self.motions[motion]["order"] for regime, motion in self.pairs
        )

    @property
    def misplaced(self) -> int:
        """Starts whose long run comes to another motion than the most of their regime."""
        table = np.array(self.table)
        return int(table.sum() - sum(table[pair] for pair in self.pairs) - table[-1, -1])


def regimes_of(batch: StartedBatch) -> list[dict[str, float]]:
    """What distinguishes the regimes of a batch of one case."""
    names = (
        "regime", "regime.order", "regime.multiplier", "regime.share", "regime.share.low", "regime.share.high",
        "shaft.speed.mean", "pendulums.0.angle.mean",
    )  # fmt: skip
    rows = np.concatenate([batch.values, batch.further_values])
    found = []
    for row in rows[~np.isnan(rows[:, _NAMES.index("regime")])]:
        values = {name: float(row[_NAMES.index(name)]) for name in names}
        values["regime.order"] = float(np.nan_to_num(values["regime.order"]))
        found.append({name: value if np.isfinite(value) else -1.0 for name, value in values.items()})
    return found


def crossed(regimes: Ints, motions: Ints, shape: tuple[int, int]) -> Ints:
    """How many starts each regime has in common with each motion; numbers of -1 count as the last ones."""
    table = np.zeros((shape[0] + 1, shape[1] + 1), dtype=np.int64)
    np.add.at(table, (regimes, motions), 1)
    return table


def one_point(case: int, ranges: dict[str, list[float]], some: int, many: int, periods: int) -> Point:
    """Compute a point."""
    begin = time.process_time()
    columns: dict[str, Any] = W1.columns(np.array([case]))
    first = {path: np.array(values) for path, values in drawn(ranges, some, 1).items()}
    batch = settle_starts(columns, _SETTINGS, first, cases=1)
    regimes = regimes_of(batch)
    others = {path: np.array(values) for path, values in drawn(ranges, many + 1, 2).items()}
    both = {path: np.concatenate([first[path], others[path]]) for path in first}
    joint = settle_starts(columns, _SETTINGS, both, cases=1).members[0]
    shares = []
    for number in range(int(joint.max()) + 1):
        own = batch.members[0, joint[:some] == number]
        own = own[own >= 0]
        like = int(np.bincount(own).argmax()) if len(own) else -1
        shares.append((float(np.mean(joint[some:] == number)), like))
    spread = started_columns(columns, first, some, 1)
    for length in (periods, _LONGER * periods):
        motions: Motions = long_motions(spread, some, length)
        table = crossed(batch.members[0], motions.members, (len(regimes), len(motions.rows))).tolist()
        point = Point(case, regimes, motions.rows, table, shares, time.process_time() - begin, length)
        if point.agrees:
            break
    return point


def order_of_points(ranges: dict[str, list[float]]) -> list[int]:
    """All points of W1, those with several regimes in turn with the others first."""
    starts = {path: np.array(values) for path, values in drawn(ranges, _SCAN, _SEED).items()}
    found = settle_starts(W1.columns(np.arange(CASES)), _SETTINGS, starts, cases=CASES)
    several = found.values[:, _NAMES.index("regime.count")] > 1
    random = np.random.default_rng(_SEED)
    groups = [random.permutation(np.flatnonzero(chosen)).tolist() for chosen in (several, ~several)]
    shorter = min(map(len, groups))
    turns = [case for pair in zip(*groups, strict=False) for case in pair]
    return turns + groups[0][shorter:] + groups[1][shorter:]


def report(points: list[Point], starts: int) -> None:
    """Print the figures of all points."""
    several = [point for point in points if len(point.regimes) > 1 or len(point.motions) > 1]
    print(f"{len(points)} points, {len(several)} of them with several motions; {starts} starts each")
    for name, some in (("all", points), ("several motions", several)):
        agree = sum(point.agrees for point in some)
        print(f"{name}: the same regimes as the long runs at {agree} of {len(some)} points")
        longer = [point.case for point in some if point.periods > min(point.periods for point in points)]
        print(f"  after longer runs at the points {longer}")
        misplaced = sum(point.misplaced for point in some if point.agrees)
        print(f"  starts of these points in another regime than their long run: {misplaced} of {agree * starts}")
        missed = sum(share > _FREQUENT and like < 0 for point in some for share, like in point.shares)
        frequent = sum(share > _FREQUENT for point in some for share, _ in point.shares)
        print(f"  regimes with more than {_FREQUENT:.0%} of many starts that are missed: {missed} of {frequent}")
        inside = total = 0
        for point in some:
            for number, regime in enumerate(point.regimes):
                share = sum(one for one, like in point.shares if like == number)
                inside += regime["regime.share.low"] <= share <= regime["regime.share.high"]
                total += 1
        print(f"  shares of many starts within the intervals: {inside} of {total} ({inside / max(total, 1):.1%})")
    for point in points:
        if not point.agrees:
            print(f"  point {point.case}: {point.table}")
            print(f"    regimes {point.regimes}\n    motions {point.motions}")
    print(f"{sum(point.seconds for point in points):.0f} s of processor time")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("results", type=Path)
    parser.add_argument("--points", type=int, default=200)
    parser.add_argument("--starts", type=int, default=256)
    parser.add_argument("--many", type=int, default=4_096)
    parser.add_argument("--long", type=int, default=20_000, metavar="PERIODS")
    parser.add_argument("--speed", type=float, nargs=2, default=(0.0, 30.0), help="range of the shaft's speed, rad/s")
    parser.add_argument("--angle", type=float, nargs=2, default=(-0.3, 0.3), help="range of the pendulum's angle, rad")
    chosen = parser.parse_args()
    ranges = {"shaft.initial_speed": list(chosen.speed), "pendulums.0.initial_angle": list(chosen.angle)}
    asked = {"starts": chosen.starts, "many": chosen.many, "long": chosen.long, "ranges": ranges}
    if not chosen.results.exists():
        chosen.results.write_text(json.dumps({**asked, "order": order_of_points(ranges)}) + "\n", encoding="utf-8")
    first, *lines = chosen.results.read_text(encoding="utf-8").splitlines()
    order = json.loads(first).pop("order")
    if json.loads(first) != {**asked, "order": order}:
        parser.error(f"{chosen.results} has points with other settings")
    points = [Point(**json.loads(line)) for line in lines]
    done = {point.case for point in points}
    with chosen.results.open("a", encoding="utf-8") as file:
        for case in [case for case in order if case not in done][: max(0, chosen.points - len(done))]:
            point = one_point(case, ranges, chosen.starts, chosen.many, chosen.long)
            print(json.dumps(asdict(point)), file=file, flush=True)
            print(f"point {case}: {point.table}, agrees: {point.agrees}, {point.seconds:.1f} s", flush=True)
            points.append(point)
    report(points, chosen.starts)


if __name__ == "__main__":
    main()
