"""Drills: ``python -m benchmarks.faults NAME``; each prints its figures, or fails."""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.faults.badcases import badcases
from benchmarks.faults.cache import cache
from benchmarks.faults.clients import clients
from benchmarks.faults.cluster import cluster
from benchmarks.faults.disk import disk, file_limit
from benchmarks.faults.dispatchers import dispatchers
from benchmarks.faults.flips import flips
from benchmarks.faults.kills import kills
from benchmarks.faults.link import link
from benchmarks.faults.nights import nights
from benchmarks.faults.powercut import powercut
from benchmarks.faults.rounds import rounds
from benchmarks.faults.served_rounds import served_rounds
from benchmarks.faults.stopped import stopped
from benchmarks.faults.sweeps import sweeps


def main() -> None:
    """Run the drill that is named."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.faults", description=__doc__)
    drills = parser.add_subparsers(required=True, metavar="NAME")

    def drill(name: str, run: Callable[..., dict[str, Any]], help_text: str, **defaults: int | float | str) -> None:
        command = drills.add_parser(name, help=help_text)
        for option, default in defaults.items():
            command.add_argument(f"--{option}", type=type(default), default=default)
        command.set_defaults(run=run)

    drill("kills", kills, "kill -9 at random moments", cases=20_000, count=100, seed=1, periods=60.0, drives=0)
    drill(
        "cluster", cluster, "kill -9 of the parts of a Dask cluster at random moments",
        cases=20_000, count=30, seed=1, periods=60.0,
    )  # fmt: skip
    drill(
        "link", link, "links between hosts are cut (as root: it makes network namespaces)", cases=2_000, periods=200.0
    )
    drill("powercut", powercut, "the power goes between any two system calls of a commit", studies=12, seed=1)
    drill(
        "dispatchers", dispatchers, "kill -9 and lost connections of two dispatchers on one PostgreSQL database",
        count=50, seed=1, studies=8, cases=200, url="",
    )  # fmt: skip
    drill("rounds", rounds, "kill -9 in a study that chooses its own cases", count=50, seed=1, url="")
    drill(
        "servedrounds", served_rounds, "kill -9 of processes of a service in a study that chooses its own cases",
        count=20, seed=1,
    )  # fmt: skip
    drill(
        "sweeps", sweeps, "kill -9 of processes of a service in the middle of swept lines", count=20, seed=1, lines=30
    )
    drill("nights", nights, "kill -9 between the due times of schedules and their reports", count=50, seed=1, url="")
    drill("stopped", stopped, "dispatchers are stopped, replaced and woken", cases=4_000, rounds=10, seed=1)
    drill(
        "badcases", badcases, "cases that crash or never return",
        cases=20_000, crashing=5, hanging=0, seed=1, periods=3000.0, timeout=600.0,
    )  # fmt: skip
    drill("cache", cache, "the cache of compiled kernels is damaged", cases=512)
    drill("disk", disk, "the disk is full (as root: it mounts a small one)", cases=20_000, megabytes=40)
    drill("filelimit", file_limit, "files may not grow", cases=16_000, studies=4)
    drill(
        "clients", clients, "clients write and read while a study runs",
        readers=20, writers=20, seconds=120.0, cases=4_000, periods=1000.0,
    )  # fmt: skip
    drill("flips", flips, "single bits of a database file are flipped", count=1_000, seed=1, cases=2_000)
    options = vars(parser.parse_args())
    run = options.pop("run")
    with tempfile.TemporaryDirectory(prefix="sprag-drill-") as folder:
        print(json.dumps(run(Path(folder), **options), indent=2))


if __name__ == "__main__":
    main()
