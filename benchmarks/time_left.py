"""How often the interval of the time left contains the actual time, for studies with different courses of cost.

The estimator is the service's own (`sprag_study.service.storage.studies.progress`). Chunks of synthetic cost are run on
simulated processes, in the order of the service; after certain commits the interval is compared with the actual time
left. With ``--real`` studies of the engine are run here too, and the intervals of ``sprag run`` are used.

    python -m benchmarks.time_left [--studies 60] [--seed 1] [--real]
"""

from __future__ import annotations

import argparse
import heapq
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from benchmarks.overhead import timed
from benchmarks.workloads import W1
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.service.jobs.local import run_here
from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.storage.studies.progress import RECENT_CHUNKS, FinishedChunk, RunningChunk, estimate
from sprag_study.service.storage.studies.records import Progress
from sprag_study.worker.chunking import work_of
from sprag_study.worker.order import order_of
from sprag_study.worker.study import Axis, Study

Costs = NDArray[np.float64]

#: Estimates per study, and the shares of elapsed time that count as early, middle and late.
_LOOKS = 40
#: Cases of a chunk of settled motions.
_CHUNK_CASES = (16, 64, 256)
_PARTS = (("early", 0.0, 1 / 3), ("middle", 1 / 3, 2 / 3), ("late", 2 / 3, 1.0))


@dataclass(frozen=True, slots=True)
class Look:
    """One interval and the actual time left, s; ``at`` is the elapsed share of the whole time."""

    at: float
    low: float
    high: float
    truth: float

    @property
    def inside(self) -> bool:
        """Whether the interval held."""
        return self.low <= self.truth <= self.high


def even(rng: np.random.Generator, count: int) -> Costs:
    """The same for all, up to the machine's noise."""
    return rng.lognormal(0.0, 0.05, count)


def noisy(rng: np.random.Generator, count: int) -> Costs:
    """Cases that differ much, in no order: a sampled design, or a machine that others work on."""
    return rng.lognormal(0.0, 0.5, count)


def rising(rng: np.random.Generator, count: int) -> Costs:
    """The cost rises or falls up to fourfold along the first axis."""
    slope = np.linspace(0.0, rng.uniform(-np.log(4.0), np.log(4.0)), count)
    return np.exp(slope) * rng.lognormal(0.0, 0.1, count)


def stepped(rng: np.random.Generator, count: int) -> Costs:
    """From some case on, the motion and its cost change."""
    cost = np.ones(count)
    cost[int(rng.uniform(0.2, 0.8) * count) :] = rng.uniform(0.4, 2.5)
    return cost * rng.lognormal(0.0, 0.1, count)


def waves(rng: np.random.Generator, count: int) -> Costs:
    """The cost goes up and down with an inner axis."""
    phase = np.arange(count) / count * rng.uniform(3.0, 30.0) * 2.0 * np.pi
    return (1.0 + rng.uniform(0.2, 0.7) * np.sin(phase)) * rng.lognormal(0.0, 0.1, count)


def rare(rng: np.random.Generator, count: int) -> Costs:
    """One chunk in thirty takes many times as long."""
    return np.where(rng.random(count) < 1 / 30, rng.uniform(3.0, 15.0, count), 1.0) * rng.lognormal(0.0, 0.05, count)


def interrupted(rng: np.random.Generator, count: int) -> Costs:
    """Other work slows the machine down by half for some time."""
    cost = even(rng, count)
    begin = int(rng.uniform(0.0, 0.9) * count)
    cost[begin : begin + int(rng.uniform(0.1, 0.4) * count)] *= 1.5
    return cost


def refined(rng: np.random.Generator, count: int) -> Costs:
    """The costs of `rising`, `stepped` or `waves` in the order of a study with a deadline, coarse to fine."""
    axis = Axis(("shaft.load",), tuple(map(float, range(count))))
    study = Study("vibration-drive", "", {"shaft.load": 0.0}, {}, (axis,))
    cost = (rising, stepped, waves)[int(rng.integers(3))]
    return cost(rng, count)[order_of(study).cases(np.arange(count))]


@cache
def _settled_periods() -> Costs:
    """Periods that W1's cases take until they are settled, on a finer grid: frequencies, amplitudes, loads."""
    shape = 48, 4, 40
    axes = np.linspace(100.0, 220.0, shape[0]), np.linspace(0.001, 0.003, 4), np.linspace(0.02, 0.3, shape[2])
    nu, amplitude, load = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    varied = {"excitation.frequency": nu / (2.0 * np.pi), "shaft.load": load}
    varied |= {f"excitation.amplitude_{direction}": amplitude for direction in "xy"}
    found: Costs = settle({**W1.columns(np.zeros(1, dtype=int)), **varied}, SettledRun(), cases=nu.size).spent
    return found.reshape(shape)


def _settled_cases(rng: np.random.Generator, cases: int) -> Costs:
    """Periods of the cases of a study of W1's machine, its axes in any order."""
    known = _settled_periods()
    inner = max(1, int(np.sqrt(cases / 4)))
    # Neighbours on a finer grid differ as those that are known do.
    order = rng.permutation(3)
    lengths = np.array([-(-cases // (4 * inner)), 4, inner])[order]
    places = np.stack(np.unravel_index(np.arange(cases), lengths), axis=1)[:, np.argsort(order)]
    whole = np.array([-(-cases // (4 * inner)), 4, inner])
    at = (places + 0.5) / whole * known.shape + rng.normal(0.0, 0.4, (cases, 3)) * (1.0, 0.0, 1.0)
    index = np.clip(at.astype(int), 0, np.array(known.shape) - 1)
    found: Costs = known[tuple(index.T)]
    return found


def _together(periods: Costs) -> Costs:
    """Cost of each chunk (a row of cases): a few cases that are left cost nearly as much as a set of them."""
    ordered = np.sort(periods, axis=1)
    steps = np.diff(ordered, axis=1, prepend=0.0)
    work = np.array([work_of(left) for left in range(periods.shape[1], 0, -1)])
    return steps @ work / 1e4


def settled(rng: np.random.Generator, count: int) -> Costs:
    """Cases that are run until they are settled, for 30 to 1,000 periods, neighbours often alike."""
    cases = int(rng.choice(_CHUNK_CASES))
    return _together(_settled_cases(rng, count * cases).reshape(count, cases))


def settled_refined(rng: np.random.Generator, count: int) -> Costs:
    """The same in the order of a study with a deadline."""
    cases = int(rng.choice(_CHUNK_CASES))
    periods = _settled_cases(rng, count * cases)
    axis = Axis(("shaft.load",), tuple(map(float, range(len(periods)))))
    study = Study("vibration-drive", "", {"shaft.load": 0.0}, {}, (axis,))
    return _together(periods[order_of(study).cases(np.arange(len(periods)))].reshape(count, cases))


STRUCTURES: dict[str, Callable[[np.random.Generator, int], Costs]] = {
    f.__name__: f for f in (even, noisy, rising, stepped, waves, rare, interrupted, refined, settled, settled_refined)
}


def simulate(costs: Costs, processes: int, sampled: bool, uneven: bool, cases: int = 16) -> Iterator[Look]:
    """Run chunks of ``cases`` cases with those costs (s) and look at the time left now and then."""
    free = [0.0] * processes
    done: list[FinishedChunk] = []
    for seconds in costs.tolist():
        begin = heapq.heappop(free)
        heapq.heappush(free, begin + seconds)
        done.append(FinishedChunk(begin, begin + seconds, cases))
    done.sort(key=lambda chunk: chunk.end)
    end = done[-1].end
    for look in sorted(set(np.linspace(1, len(done) - 1, _LOOKS, dtype=int).tolist())):
        now = done[look - 1].end
        recent = done[max(0, look - RECENT_CHUNKS) : look][::-1]
        # What is claimed and not done: a chunk for each process, and those that wait for one.
        running = [RunningChunk(chunk.begin, cases) for chunk in done[look:] if chunk.begin <= now]
        _, left = estimate((len(done) - look) * cases, recent, running, now, look * cases, sampled, uneven)
        if left is not None and now < end:
            yield Look(now / end, *left, end - now)


def real_looks(study: Study) -> Iterator[Look]:
    """Run a study of the engine here and take the intervals it tells."""
    taken: list[tuple[float, tuple[float, float]]] = []

    def note(progress: Progress) -> None:
        if progress.seconds_left is not None and progress.done < progress.total:
            taken.append((time.monotonic(), progress.seconds_left))

    start = time.monotonic()
    with run_here({}, study, processes=0, chunk_cases=32, on_progress=note):
        end = time.monotonic()
    for at, (low, high) in taken:
        yield Look((at - start) / (end - start), low, high, end - at)


def real_studies() -> Iterator[tuple[str, Study]]:
    """Studies whose cost has a structure: longer and shorter periods, more and fewer engagements."""
    example = parse_spec(load_spec(preset_text("one_pendulum")[1], "json")).study
    loads = tuple(np.linspace(0.0, 0.5, 150).tolist())
    frequencies = tuple(np.linspace(12.0, 40.0, 150).tolist())
    by_load = (Axis(("shaft.load",), loads), Axis(("excitation.frequency",), frequencies))
    yield "settled, loads outside", replace(example, axes=by_load)
    periods = timed(example, [60.0, "periods"])
    yield "loads outside", replace(example, axes=by_load, run=periods)
    yield "frequencies outside", replace(example, axes=by_load[::-1], run=periods)
    fixed = timed(example, [2.0, "s"])
    yield "fixed time, frequencies outside", replace(example, axes=by_load[::-1], run=fixed)


def print_line(name: str, looks: list[Look]) -> None:
    """Print one line: share of correct intervals and their width, for each part."""
    cells = []
    for _, begin, end in _PARTS:
        part = [look for look in looks if begin <= look.at < end]
        if not part:
            cells.append(f"{'-':>14}")
            continue
        held = sum(look.inside for look in part) / len(part)
        width = float(np.median([(look.high - look.low) / look.truth for look in part]))
        cells.append(f"{held:7.0%} ({width:4.2f})")
    held = sum(look.inside for look in looks) / len(looks)
    print(f"{name:32}{'  '.join(cells)}  {held:7.0%}  {len(looks):6d}")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--studies", type=int, default=60, help="studies of each structure")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--real", action="store_true", help="run studies of the engine, too")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    print("share of intervals that contained the actual time (median width relative to it)")
    print(f"{'structure of cost':32}{'  '.join(f'{name:>14}' for name, _, _ in _PARTS)}      all   looks")
    every: dict[str, list[Look]] = defaultdict(list)
    for name, cost in STRUCTURES.items():
        for _ in range(options.studies):
            count, processes = int(np.exp(rng.uniform(np.log(20), np.log(2000)))), int(rng.choice([1, 2, 8, 32]))
            uneven = name.startswith("settled")
            every[name] += simulate(cost(rng, count), processes, name.endswith("refined"), uneven)
        print_line(name, every[name])
    print_line("all synthetic studies", [look for looks in every.values() for look in looks])
    if options.real:
        for name, study in real_studies():
            print_line(name, list(real_looks(study)))


if __name__ == "__main__":
    main()
