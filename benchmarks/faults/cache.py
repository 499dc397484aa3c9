"""The compiled kernels on disk are damaged, so that every chunk crashes: they are compiled anew, once."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.faults import harness
from sprag_study.worker import models


def cache(folder: Path, *, cases: int, size: int = 64) -> dict[str, Any]:
    """Run a study on a damaged copy of the cache; gives the figures.

    Every file of machine code keeps its first ``size`` bytes only.
    """
    made = harness.spec(cases, 4.0)
    copy = own_cache(folder, made) / "kernels" / models.cache_folder().name
    damaged = _code(copy)
    assert damaged, "there is no machine code in the cache"
    for file in damaged:
        os.truncate(file, size)
    with harness.running(
        folder, "--processes", 2, SPRAG_CHUNK_CASES=str(max(1, cases // 16)), SPRAG_KERNEL_CACHE=str(folder / "cache")
    ) as service:
        study = service.submit(made)
        service.finish(study)
    log = service.log.read_text()
    assert log.count("Its kernels are compiled anew") == 1, log
    assert "is held" not in log, log
    harness.compare(service.database, study, made)
    mended = [file for file in _code(copy) if file.stat().st_size > size]
    assert mended, "no machine code was made"
    return {"cases": cases, "files damaged": len(damaged), "times compiled anew": 1, "quarantined": 0}


def own_cache(folder: Path, made: dict[str, Any]) -> Path:
    """A copy of the cache in ``folder`` that has the study's kernel; the path to set as SPRAG_KERNEL_CACHE."""
    whole = models.cache_folder()
    copy = folder / "cache"
    shutil.copytree(whole, copy / "kernels" / whole.name)
    _warm_up(made, copy)
    return copy


def _warm_up(made: dict[str, Any], cache: Path) -> None:
    """Compile the study's kernel into ``cache``. What was copied saves time, but belongs to other paths in part."""
    program = "import json, sys; from benchmarks.faults import harness; from sprag_study.worker import models; "
    program += "models.warm_up(harness.study_of(json.loads(sys.argv[1])))"
    command = [sys.executable, "-c", program, json.dumps(made)]
    subprocess.run(command, env=harness.environment(SPRAG_KERNEL_CACHE=str(cache)), check=True)


def _code(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.nbc"))
