"""Faults on purpose: only where they are asked for and allowed, and only in the cases that are named."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from sprag_study.engine import faults

COLUMNS = {"shaft.load": np.array([0.1, 0.25, 0.3]), "excitation.frequency": 25.0}


@pytest.fixture
def hits(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What would have been done to this process."""
    done: list[str] = []
    monkeypatch.setattr(faults, "_crash", lambda: done.append("crash"))
    monkeypatch.setattr(faults, "_hang", lambda: done.append("hang"))
    monkeypatch.setenv(faults.ALLOWED_VARIABLE, "yes")
    return done


@pytest.mark.parametrize(
    ("wanted", "expected"),
    [
        ("crash shaft.load=0.25", ["crash"]),
        ("hang excitation.frequency=24,25", ["hang"]),
        ("crash shaft.load=0.2, 0.4; hang shaft.load = 0.3", ["hang"]),
        ("crash shaft.load=0.26", []),
        ("crash shaft.inertia=0.25", []),
        ("", []),
    ],
)
def test_named_cases_are_hit(
    hits: list[str], monkeypatch: pytest.MonkeyPatch, wanted: str, expected: list[str]
) -> None:
    monkeypatch.setenv(faults.FAULTS_VARIABLE, wanted)
    faults.inject(COLUMNS, 3)
    assert hits == expected


@pytest.mark.parametrize("allowed", ["", "no", "1"])
def test_nothing_happens_unless_it_is_allowed(hits: list[str], monkeypatch: pytest.MonkeyPatch, allowed: str) -> None:
    monkeypatch.setenv(faults.ALLOWED_VARIABLE, allowed)
    monkeypatch.setenv(faults.FAULTS_VARIABLE, "crash shaft.load=0.25")
    faults.inject(COLUMNS, 3)
    monkeypatch.delenv(faults.ALLOWED_VARIABLE)
    faults.inject(COLUMNS, 3)
    assert hits == []


def test_words_that_are_not_understood_are_no_fault_that_is_passed_over(
    hits: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(faults.FAULTS_VARIABLE, "burn shaft.load=0.25")
    with pytest.raises(ValueError, match="is not a fault"):
        faults.inject(COLUMNS, 3)


def test_a_crash_is_the_end_of_the_process() -> None:
    program = "from sprag_study.engine.faults import inject; inject({'shaft.load': 0.25}, 1); print('alive')"
    wanted = {faults.ALLOWED_VARIABLE: "yes", faults.FAULTS_VARIABLE: "crash shaft.load=0.25"}
    ended = subprocess.run([sys.executable, "-c", program], env=os.environ | wanted, capture_output=True, check=False)
    assert (ended.returncode, ended.stdout) == (-signal.SIGKILL, b"")
