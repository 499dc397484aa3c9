"""Installations of one engine share its compiled kernels."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any, cast

import numba
import pytest
from numba.core.caching import UserProvidedCacheLocator

from sprag_study.engine.compile import jit, places
from sprag_study.engine.compile.cache import cache_folder
from sprag_study.engine.sources import engine_folder
from tests.conftest import ROOT

#: Compiles a short function or loads it, and says which.
_PROGRAM = """\
import json
import numpy as np
from sprag_study.engine.machine_shaft import kernels
value = kernels.series_value(np.array([1.0, 2.0, 3.0]), 3, 2.0)
stats = kernels.series_value.stats
print(json.dumps([kernels.__file__, value, sum(stats.cache_misses.values()), sum(stats.cache_hits.values())]))
"""


def ask(folder: Path, cache: Path) -> list[object]:
    """What the program says of the engine in ``folder``."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "SPRAG_KERNEL_CACHE": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", _PROGRAM], cwd=folder, env=environment, capture_output=True, check=True
    )
    answer: list[object] = json.loads(done.stdout)
    return answer


def test_a_second_installation_compiles_nothing(tmp_path: Path) -> None:
    second = tmp_path / "second"
    second.mkdir()
    (second / "sprag_study").symlink_to(ROOT / "sprag_study")
    first_file, value, *compiled = ask(ROOT, tmp_path / "cache")
    second_file, again, *loaded = ask(second, tmp_path / "cache")
    assert (value, again) == (21.5, 21.5)  # 1 + 2 P1(2) + 3 P2(2), with P1(2) = 2 and P2(2) = 5.5
    assert first_file != second_file
    assert (compiled, loaded) == ([1, 0], [0, 1])


def test_functions_have_their_folder_after_a_variable_of_numba_has_changed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pool of processes changes one, and the next compilation resets all settings of numba."""
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1" if os.environ.get("NUMBA_NUM_THREADS") != "1" else "2")
    numba.core.config.reload_config()
    assert not numba.config.CACHE_DIR
    stats = cast(Any, jit.compiled(lambda: 1)).stats
    assert Path(stats.cache_path).is_relative_to(cache_folder())


def test_functions_of_others_have_folders_of_their_own() -> None:
    inside, outside = places.EngineCacheLocator, UserProvidedCacheLocator
    own = inside.from_function(places.use_cache, str(engine_folder() / "compile" / "places.py"))
    assert Path(own.get_cache_path()).name == "engine-compile"
    assert inside.from_function(ask, __file__) is None
    assert outside.from_function(ask, __file__).get_cache_path() != own.get_cache_path()


def test_a_folder_that_cannot_be_written_to_is_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(places, "cache_folder", lambda: tmp_path / "file")
    assert places.EngineCacheLocator.from_function(places.use_cache, str(engine_folder() / "run.py")) is None
