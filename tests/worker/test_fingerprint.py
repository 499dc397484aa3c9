"""What makes two processes give the same bits, and how a difference is told."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sprag_study.engine.sources import source_hash
from sprag_study.worker import fingerprint
from tests.conftest import ROOT
from tests.worker.fakes import of_any_processor

SOURCES = "sources of engine and worker"
OWN = {"numpy": "2.1", "C library": "glibc 2.36", "numba settings": ""}


def collected(**environment: str) -> str:
    """The digest of a process of its own."""
    command = [sys.executable, "-c", "from sprag_study.worker import fingerprint; print(fingerprint.digest())"]
    return subprocess.run(
        command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT), **environment}, capture_output=True, text=True,
        check=True, timeout=600,
    ).stdout.strip()  # fmt: skip


def test_every_process_of_one_installation_has_the_same() -> None:
    assert collected() == fingerprint.digest() == collected(NUMBA_NUM_THREADS="1", SPRAG_PROCESSES="3")


def test_the_kind_of_processor_does_not_change_it() -> None:
    compiled = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "+sse2", "NUMBA_ENABLE_AVX": "0"}
    assert collected(**compiled, **of_any_processor()) == fingerprint.digest()


@pytest.mark.parametrize("setting", ["NUMBA_OPT=0", "SPRAG_COMPILER=plain"])
def test_settings_that_change_the_code_change_it(setting: str) -> None:
    name, value = setting.split("=")
    assert collected(**{name: value}) != fingerprint.digest()


def test_files_that_change_under_a_running_process_change_it(monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint.collect()
    monkeypatch.setattr(fingerprint, "_sources", lambda: "edited")
    after = fingerprint.collect()
    assert after[SOURCES].startswith(f"{before[SOURCES]}, changed to edited while process ")
    assert {name for name in before if before[name] != after[name]} == {SOURCES}


def test_the_code_that_decides_what_a_case_is_belongs_to_it(tmp_path: Path) -> None:
    """Reuse would pair rows with other parameters: those of a changed law of tolerances, for example."""
    engine, worker = (shutil.copytree(ROOT / name, tmp_path / name) for name in ("engine", "worker"))
    assert source_hash(engine, worker).startswith(fingerprint.collect()[SOURCES])
    (worker / "spread.py").write_text("# edited\n", encoding="utf-8")
    assert not source_hash(engine, worker).startswith(fingerprint.collect()[SOURCES])


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (OWN, ""),
        ({**OWN, "numpy": "2.2"}, "numpy: 2.2 instead of 2.1"),
        ({**OWN, "more": "1"}, "more: 1 instead of unknown"),
        ({"numpy": "2.1", "numba settings": "NUMBA_OPT=0"},
         "C library: unknown instead of glibc 2.36; numba settings: NUMBA_OPT=0 instead of none"),
        ({**OWN, "numba settings": "NUMBA_A=1 " * 40},
         f"numba settings: {'NUMBA_A=1 ' * 15}… instead of none"),
        ("2", "it runs another version of Sprag, which does not tell its fingerprint"),
        (None, "it runs another version of Sprag, which does not tell its fingerprint"),
    ],
)  # fmt: skip
def test_differences_are_named(other: object, said: str) -> None:
    assert fingerprint.differences(OWN, other) == said
