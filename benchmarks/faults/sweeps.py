"""kill -9 of pool processes, dispatcher and service in the middle of the lines of a sweep.

A case of a sweep starts from the one before it, and only whole lines are stored. Each kill comes when the study has got
to a case that was drawn, while further lines run, and when the lines that lost their process before have been run
again: a line that loses it twice is given up. In the end every row and flag is that of an undisturbed run.
"""

from __future__ import annotations

import json
import random
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks.faults import harness
from benchmarks.faults.kills import kill
from sprag_study.service.presets import preset_text
from sprag_study.service.storage.store import Store
from sprag_study.worker import models

#: How many lines have lost their process and have not been run again.
_LOST = "SELECT count(*) FROM chunks WHERE failures > 0 AND state <> 'done'"


def sweeps(folder: Path, *, count: int, seed: int, lines: int, processes: int = 2) -> dict[str, Any]:
    """Run a sweep of that many loads, up and down, under ``count`` kills; gives the figures."""
    draw = random.Random(seed)
    made = spec(lines)
    study = harness.study_of(made)
    whole = models.run_chunk(study, 0, study.cases)
    killed: Counter[str] = Counter()
    with harness.running(folder, "--processes", processes, SPRAG_CHUNK_CASES="1") as service:
        swept = service.submit(made)
        for mark in sorted(draw.randrange(study.cases) for _ in range(count)):
            harness.until(lambda mark=mark: harness.done(service.database, swept) >= mark, "the study goes on")
            harness.until(lambda: not harness.asked(service.database, _LOST), "lost lines are run again")
            killed[kill(service, draw)] += 1
        service.finish(swept)
    harness.compare(service.database, swept, made)
    with Store.open(f"sqlite:///{service.database}") as store:
        assert store.rows.block(swept).flags == whole.flags
    return {
        "cases": study.cases,
        "lines": 2 * lines,
        "jumps": sum("jumped" in flag for flag in whole.flags),
        "kills": dict(killed),
        "missing, doubled or other rows and flags": 0,
    }


def spec(lines: int) -> dict[str, Any]:
    """The one-pendulum example at that many loads, the frequency swept up and down over a jump."""
    made: dict[str, Any] = json.loads(preset_text("one_pendulum")[1])
    made.pop("run", None)
    made["base"]["excitation"] |= {"amplitude_x": "2 mm", "amplitude_y": "2 mm"}
    made["axes"] = [
        {"path": "shaft.load", "linspace": ["0.36 N*m", "0.42 N*m", lines]},
        {"path": "excitation.frequency", "linspace": ["16 Hz", "17.5 Hz", 13], "sweep": "both"},
    ]
    return made
