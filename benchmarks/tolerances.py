"""Batches of drives: what the intervals hold, what 2,000 drives at 25 loads cost, and the memory of the service.

    python -m benchmarks.tolerances [DRIVES [LOADS [SEEDS]]]

Coverage: the 5, 50 and 95 % quantiles and the yield of a linear function of three normal deviations, whose exact values
are known, from 512 drives of each seed. Cost: the example of the guide to tolerances, settled, in this process; the
engine's share is the processor time of the chunks. Memory: the largest resident size of each process of a service that
has run the same study and has answered its ribbon, yield and page, and questions of Explore about all of its results.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from scipy.stats import norm, qmc

from sprag_study.service.client import Client
from sprag_study.service.results.explore import MOST_SHOWN
from sprag_study.service.results.tolerances.quantiles import proportion, quantiles
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.service.views.drives import RibbonQuery, YieldQuery, both
from sprag_study.service.views.library import Library
from sprag_study.worker import models
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor

_P = (0.05, 0.5, 0.95)
_EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "tolerances.json"
_CONDITION = "shaft.speed.mean >= 90 % of nominal"


def spec(drives: int, loads: int) -> dict[str, Any]:
    """The example with so many drives and loads."""
    made: dict[str, Any] = json.loads(_EXAMPLE.read_text())
    made["axes"] = [{"path": "shaft.load", "linspace": ["0.05 N*m", "0.35 N*m", loads]}]
    return {**made, "drives": drives}


def coverage(seeds: int, drives: int = 512) -> None:
    """Print how many intervals hold the exact value, and their mean widths."""
    slopes = np.array([3.0, 2.0, 1.0])
    deviation = float(np.sqrt((slopes**2).sum()))
    exact, limit = norm.ppf(_P)[:, None] * deviation, -deviation
    print(f"of {seeds} seeds of {drives} drives, 95 % intervals that hold the exact value (and their mean widths)")
    for method in ("random", "latin_hypercube", "sobol"):
        results = np.empty((seeds, drives))
        for seed in range(seeds):
            rng = np.random.default_rng(seed)
            unit = {
                "random": lambda rng=rng: rng.random((drives, 3)),
                "latin_hypercube": lambda rng=rng: qmc.LatinHypercube(3, rng=rng).random(drives),
                "sobol": lambda rng=rng: qmc.Sobol(3, rng=rng).random(drives),
            }[method]()
            results[seed] = norm.ppf(np.clip(unit, 1e-15, 1.0 - 1e-15)) @ slopes
        found = quantiles(results, _P)
        held = ((found.low <= exact) & (exact <= found.high)).mean(axis=1)
        widths = (found.high - found.low).mean(axis=1)
        share = proportion((results >= limit).sum(axis=1), np.full(seeds, drives))
        reached = float(norm.cdf(1.0))
        good = float(((share.low <= reached) & (reached <= share.high)).mean())
        told = ", ".join(f"{p:.0%} {h:.1%} ({w:.3f})" for p, h, w in zip(_P, held, widths, strict=True))
        print(f"  {method}: {told}, yield {good:.1%} ({float((share.high - share.low).mean()):.4f})")


def cost(drives: int, loads: int) -> None:
    """Print the processor times of a study and of its answers, in this process."""
    parsed = parse_spec(spec(drives, loads))
    models.warm_up(parsed.study)
    engine = 0.0

    def timed(task: models.ChunkTask) -> models.ChunkResult:
        nonlocal engine
        begin = time.process_time()
        try:
            return models.run_task(task)
        finally:
            engine += time.process_time() - begin

    with tempfile.TemporaryDirectory() as folder:
        url = f"sqlite:///{Path(folder) / 'tolerances.sqlite3'}"
        with Store.open(url) as store:
            begin = time.process_time()
            record = store.studies.create(parsed.spec, parsed.study, fresh=True)
            over = lambda: store.studies.get(record.id).over  # noqa: E731
            Dispatcher(store.work, InlineExecutor(timed), SystemClock(), owner="benchmark").run(over)
            whole = time.process_time() - begin
            begin = time.process_time()
            library: Any = Library(store)
            ribbon, reached = both(library, record.id, RibbonQuery(("shaft.speed.mean",)), YieldQuery((_CONDITION,)))
            answers = time.process_time() - begin
    share = reached["lines"][0]["all"]["value"] or 0.0
    print(
        f"{parsed.study.cases:,} cases: {whole:.1f} s of processor time, {engine / whole:.1%} of it in the engine; "
        f"ribbon and yield ({share:.1%} of drives) {answers:.2f} s, {len(ribbon['lines'][0]['x'])} places"
    )


def memory(drives: int, loads: int) -> None:
    """Print the largest resident size of every process of a service that runs the study and answers."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "sprag_study.service.cli", "serve", "--json", "--port", "0"]
        with subprocess.Popen(
            [*command, "--db", str(Path(folder) / "s.sqlite3")], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        ) as service:
            try:
                assert service.stdout is not None
                address = json.loads(service.stdout.readline())["address"]
                with Client(address) as client:
                    study = client.submit(spec(drives, loads)).wait()
                infos = models.study_results(parse_spec(spec(drives, loads)).study)
                names = [info.name for info in infos if info.kind != "category"]
                of = f"{address}/api/v1/studies/{study.id}"
                asked: list[tuple[str, dict[str, Any]]] = [
                    (f"{of}/ribbon", {"y": "shaft.speed.mean"}),
                    (f"{of}/yield", {"condition": _CONDITION}),
                    (f"{address}/studies/{study.id}/drives", {}),
                ]
                for first in range(0, len(names), MOST_SHOWN):
                    shown = names[first : first + MOST_SHOWN]
                    asked.append((f"{of}/explore", {"sort": f"-{shown[0]}", "show": shown}))
                for question, query in asked:
                    httpx.get(question, params=query, timeout=600.0).raise_for_status()
                for name, size in _sizes(service.pid):
                    print(f"  {name}: {size:.0f} MB")
            finally:
                service.terminate()


def _sizes(root: int) -> list[tuple[str, float]]:
    """Largest resident sizes (MB) of a process and all below it, with the ends of their command lines."""
    parents = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    family = [root]
    for process in family:
        family += [child for child, parent in parents.items() if parent == process]
    found = []
    for process in family:
        status = (Path("/proc") / str(process) / "status").read_text()
        peak = next(line for line in status.splitlines() if line.startswith("VmHWM"))
        words = (Path("/proc") / str(process) / "cmdline").read_bytes().decode().split("\0")
        found.append((" ".join(words[1:5])[:60], int(peak.split()[1]) / 1024.0))
    return found


def main() -> None:
    """Print all figures."""
    given = [int(text) for text in sys.argv[1:]]
    drives, loads, seeds = (given + [2000, 25, 500][len(given) :])[:3]
    coverage(seeds)
    cost(drives, loads)
    print("largest resident sizes of the processes of a service:")
    memory(drives, loads)


if __name__ == "__main__":
    main()
