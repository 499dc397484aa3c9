"""What makes two processes give the same bits, and how a difference is told."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sprag.engine.sources import source_hash
from sprag.worker import fingerprint, known_answers
from tests.conftest import ROOT
from tests.worker.fakes import numpy_features

SOURCES = "sources of engine and worker"
OWN = {"numpy": "2.1", "processor features": "avx avx2 fma", "numba settings": ""}


def collected(code: str = "print(fingerprint.digest())", **environment: str) -> str:
    """What a process of its own prints: by default its digest."""
    command = [sys.executable, "-c", f"import json; from sprag.worker import fingerprint; {code}"]
    return subprocess.run(
        command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT), **environment}, capture_output=True, text=True,
        check=True, timeout=600,
    ).stdout.strip()  # fmt: skip


def test_every_process_of_one_installation_has_the_same() -> None:
    assert collected() == fingerprint.digest() == collected(NUMBA_NUM_THREADS="1", SPRAG_PROCESSES="3")


@pytest.mark.parametrize(
    "setting",
    ["NUMBA_CPU_FEATURES=+sse2", "NUMBA_ENABLE_AVX=0", "NUMBA_OPT=0", "NUMBA_CPU_NAME=generic", "SPRAG_COMPILER=plain"],
)
def test_settings_that_change_the_code_change_it(setting: str) -> None:
    name, value = setting.split("=")
    assert collected(**{name: value}) != fingerprint.digest()


def test_another_choice_of_numpy_or_the_c_library_changes_it() -> None:
    features = numpy_features()
    if not features:
        pytest.skip("this processor has no feature that numpy chooses by")
    other = collected(code="print(json.dumps(fingerprint.collect()))", NPY_DISABLE_CPU_FEATURES=" ".join(features))
    assert fingerprint.differences(fingerprint.own(), json.loads(other)).startswith("known answers of numpy: ")


def test_answers_that_differ_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    before = fingerprint.collect()
    for name in ("_NUMPY", "_C"):
        functions = getattr(known_answers, name)
        monkeypatch.setattr(known_answers, name, (functions[1], functions[0], *functions[2:]))
    monkeypatch.setattr(fingerprint, "known_answers", known_answers.known_answers.__wrapped__)
    after = fingerprint.collect()
    assert [name for name in before if before[name] != after[name]] == [
        "known answers of numpy",
        "known answers of the C library",
    ]


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
        ({**OWN, "processor features": "avx sse5"}, "processor features: without avx2, fma and with sse5"),
        ({**OWN, "processor features": ""}, "processor features: without avx, avx2, fma"),
        ({**OWN, "more": "1"}, "more: 1 instead of unknown"),
        ({"numpy": "2.1", "numba settings": "NUMBA_OPT=0"},
         "processor features: without avx, avx2, fma and with unknown; numba settings: NUMBA_OPT=0 instead of none"),
        ("2", "it runs another version of Sprag, which does not tell its fingerprint"),
        (None, "it runs another version of Sprag, which does not tell its fingerprint"),
    ],
)  # fmt: skip
def test_differences_are_named(other: object, said: str) -> None:
    assert fingerprint.differences(OWN, other) == said
