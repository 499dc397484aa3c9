"""The rows of a study do not depend on how it is run: any number of processes, any size of chunks, any order.

``python -m benchmarks.same_rows`` runs the example study (512 cases of 60 periods) with `sprag run` in every cut and
compares all rows bit for bit, then a study of settled motions. The suite does the same with fewer cases and cuts
(tests/acceptance/test_same_rows.py).
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from benchmarks.faults.harness import COMMAND, environment
from sprag_study.service.presets import preset_text

#: Processes, cases of a chunk, and further options.
Cut = tuple[int, int, tuple[str, ...]]

TIMED = {"duration": "60 periods", "window": ["40 periods", "60 periods"]}
#: The last one begins with a coarse selection of the cases.
CUTS: tuple[Cut, ...] = (
    *((processes, chunk, ()) for processes in (1, 2) for chunk in (1, 7, 512)),
    (2, 7, ("--finish-by", "1 h")),
)
SETTLED_AXES = [
    {"path": "excitation.frequency", "linspace": ["20 Hz", "35 Hz", 5]},
    {"path": "shaft.load", "values": [0, 0.2, 0.7, 1.6]},
]


def example(**changes: Any) -> dict[str, Any]:
    """The example study with other entries."""
    spec: dict[str, Any] = json.loads(preset_text("one_pendulum")[1])
    return spec | changes


def rows_of(folder: Path, spec: Mapping[str, Any], cut: Cut) -> list[dict[str, Any]]:
    """The rows of a study as `sprag run` gives them; Python reads and writes floats exactly."""
    processes, chunk, more = cut
    file = folder / "spec.json"
    file.write_text(json.dumps(spec), encoding="utf-8")
    options = ("--processes", processes, *more)
    done = subprocess.run(
        [*COMMAND, "run", str(file), "--json", *map(str, options)],
        capture_output=True, env=environment(SPRAG_CHUNK_CASES=str(chunk)), check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()
    rows: list[dict[str, Any]] = json.loads(done.stdout)["rows"]
    return rows


def same_rows(folder: Path, spec: Mapping[str, Any], cuts: Iterable[Cut]) -> list[dict[str, Any]]:
    """The rows of a study, which have to be the same in every cut, each ``ok``, in the order of the cases."""
    first, *others = cuts
    rows = rows_of(folder, spec, first)
    assert [row["case"] for row in rows] == list(range(len(rows)))
    assert {row["ending"] for row in rows} == {"ok"}
    for cut in others:
        assert rows_of(folder, spec, cut) == rows, cut
    return rows


def main() -> None:
    """Run both studies in every cut."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows = same_rows(Path(folder), example(run=TIMED), CUTS)
        print(f"{len(rows)} cases of 60 periods: the same rows in {len(CUTS)} cuts")
        settled = same_rows(Path(folder), example(axes=SETTLED_AXES), CUTS)
        regimes = {str(row["results"]["regime"]) for row in settled}
        assert regimes >= {"periodic", "coasting"}
        print(f"{len(settled)} settled cases ({', '.join(sorted(regimes))}): the same rows in {len(CUTS)} cuts")


if __name__ == "__main__":
    main()
