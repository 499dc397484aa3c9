"""Processor time of machine shafts in this checkout against another one, for machines that both know.

Each checkout computes in a process of its own. Both get the same machines (the presets of the other checkout) with the
same inertias, in turn: other, this, this, other, and so on, so that a slow spell of the machine meets both. Prints, for
each machine, the cases a second of this checkout over those of the other: the median of all pairs and their range.
Above 1 this checkout is faster.

    git worktree add /tmp/before REVISION
    python -m benchmarks.other_checkout /tmp/before [--cases 1024] [--pairs 15]
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any, Final

_HERE: Final = Path(__file__).resolve().parent.parent
#: Runs in either checkout: reads a spec from each line, and answers with the processor seconds of its cases.
_COMPUTE: Final = """
import json, sys, time
sys.path.insert(0, "")
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import models
for line in sys.stdin:
    spec = json.loads(line)
    study = parse_spec(spec).study
    start = time.process_time()
    models.run_chunk(study, 0, spec["axes"][0]["linspace"][2])
    print(time.process_time() - start, flush=True)
"""


class Checkout:
    """A process that computes studies with the code of a folder."""

    def __init__(self, folder: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _COMPUTE], cwd=folder, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )

    def seconds(self, spec: dict[str, Any]) -> float:
        """Processor seconds of all cases of ``spec``."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(spec) + "\n")
        self._process.stdin.flush()
        return float(self._process.stdout.readline())

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()


def machines(folder: Path, cases: int) -> dict[str, dict[str, Any]]:
    """Studies of the presets of a checkout over the drive's inertia, from that of the preset to the double."""
    found = {}
    for file in sorted((folder / "service" / "presets").glob("*.toml")):
        spec = tomllib.loads(file.read_text(encoding="utf-8"))
        if spec["model"] != "machine-shaft" or "goal" in spec or file.stem.startswith("question_"):
            continue
        inertia, unit = str(spec["base"]["drive"]["inertia"]).partition(" ")[::2]
        ends = [f"{float(inertia) * factor} {unit}".strip() for factor in (1, 2)]
        axis = {"path": "drive.inertia", "linspace": [*ends, cases]}
        found[file.stem] = {name: spec[name] for name in ("sprag", "model", "base")} | {"axes": [axis]}
    # A motor by its table, and losses by the direction of a load: torques with kinks that follow from the motion.
    slotter = found["slotter"]
    rows = [["0 rpm", "700 N*m"], ["26 rpm", "900 N*m"], ["29 rpm", "650 N*m"], ["32 rpm", "0 N*m"]]
    motor = {"kind": "table", "table": rows, "interpolation": "linear"}
    drive, operation = slotter["base"]["drive"] | {"motor": motor}, slotter["base"]["operation"] | {"efficiency": 0.9}
    found["slotter, table"] = slotter | {"base": slotter["base"] | {"drive": drive}}
    found["slotter, losses"] = slotter | {"base": slotter["base"] | {"operation": operation}}
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("other", type=Path, help="folder of the other checkout")
    parser.add_argument("--cases", type=int, default=1_024)
    parser.add_argument("--pairs", type=int, default=15)
    arguments = parser.parse_args()
    other, this = Checkout(arguments.other), Checkout(_HERE)
    print(f"{'machine':24}{'cases/s':>10}{'ratio':>8}{'range':>16}")
    for name, spec in machines(arguments.other, arguments.cases).items():
        for checkout in (other, this):
            checkout.seconds(spec)
        ratios, rates = [], []
        for pair in range(arguments.pairs):
            if pair % 2 == 0:
                before = other.seconds(spec)
                now = this.seconds(spec)
            else:
                now = this.seconds(spec)
                before = other.seconds(spec)
            ratios.append(before / now)
            rates.append(arguments.cases / now)
        spread = f"{min(ratios):.2f} to {max(ratios):.2f}"
        print(f"{name:24}{statistics.median(rates):10.0f}{statistics.median(ratios):8.2f}{spread:>16}", flush=True)
    other.close()
    this.close()


if __name__ == "__main__":
    main()
