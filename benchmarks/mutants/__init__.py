"""Every safety mechanism is necessary: without it, the corresponding test fails.

    python -m benchmarks.mutants [WORD ...]

Every mutant is a copy of the program with one change; the test must pass on a copy without it. Words choose the mutants
with one of them in their name. A test that takes five times as long as on the program itself, and at least three
minutes, counts as failed.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.faults.harness import PATIENCE
from benchmarks.mutants.motion import MOTION
from benchmarks.mutants.mutant import Mutant
from benchmarks.mutants.storage import STORAGE

__all__ = ("MUTANTS", "ROOT", "Mutant", "chosen", "copy_program", "main")

ROOT = Path(__file__).resolve().parents[2]
MUTANTS = (*STORAGE, *MOTION)
_FOLDERS = ("sprag_study", "engine", "worker", "service", "migrations", "tests", "benchmarks")
_PASSED, _FAILED, _ENDLESS = "passed", "failed", "came to no end"
#: A test of a mutant is stopped after this many times the time of the program itself, or these seconds if that is less.
_TIMES, _LEAST = 5.0, 180.0


def chosen(words: Sequence[str]) -> list[Mutant]:
    """The mutants with one of the words in their name, or all; a word that is in none is an error."""
    unknown = [word for word in words if not any(word in mutant.name for mutant in MUTANTS)]
    if unknown:
        raise SystemExit(f"in the name of no mutant: {', '.join(unknown)}")
    return [mutant for mutant in MUTANTS if not words or any(word in mutant.name for word in words)]


def copy_program(tree: Path) -> None:
    """Copy the program and its tests; the links in ``sprag_study/`` stay links: the changed copy is imported."""
    for name in _FOLDERS:
        shutil.copytree(ROOT / name, tree / name, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "examples"):
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, tree / name)


def outcome(tree: Path, tests: tuple[str, ...], limit: float) -> str:
    """How the tests end in that copy, within ``limit`` seconds.

    What a mutant loses is waited for in vain: some tests come to no end.
    """
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(
            command, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree), "CI": "true"}, capture_output=True,
            timeout=limit, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return _ENDLESS
    assert done.returncode in (0, 1), done.stdout.decode()[-2000:]
    return _FAILED if done.returncode else _PASSED


def main() -> None:
    """Run every test on the program and on its mutant; exit code 1 when some mutant lives."""
    mutants = chosen(sys.argv[1:])
    alive = []
    with tempfile.TemporaryDirectory(prefix="sprag-mutant-") as folder:
        tree = Path(folder)
        copy_program(tree)
        for mutant in mutants:
            begin = time.monotonic()
            sound = outcome(tree, mutant.tests, PATIENCE) == _PASSED
            limit = max(_LEAST, _TIMES * (time.monotonic() - begin))
            file = tree / mutant.file
            original = file.read_text()
            assert original.count(mutant.before) == 1, f"{mutant.name}: the place to change is not there"
            file.write_text(original.replace(mutant.before, mutant.after))
            found = outcome(tree, mutant.tests, limit)
            file.write_text(original)
            dead = sound and found != _PASSED
            if not dead:
                alive.append(mutant.name)
            verdict = f"dead, its test {found}" if dead else "ALIVE" if sound else "the test fails without it"
            print(f"{mutant.name}: {verdict} ({time.monotonic() - begin:.0f} s)", flush=True)
    if alive:
        raise SystemExit(1)
