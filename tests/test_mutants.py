"""Every mutant of `benchmarks.mutants` applies to the code as it is."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.mutants import MUTANTS, ROOT, Mutant, chosen, copy_program


def test_what_runs_in_the_copy_is_the_copy(tmp_path: Path) -> None:
    copy_program(tmp_path)
    names = ("sprag_study.engine", "sprag_study.worker")
    where = f"from importlib.util import find_spec; print(*(find_spec(name).origin for name in {names}))"
    environment = {"PYTHONPATH": str(tmp_path)}
    told = subprocess.run(
        [sys.executable, "-c", where], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    for name, origin in zip(("engine", "worker"), told.stdout.split(), strict=True):
        assert Path(origin).resolve() == (tmp_path / name / "__init__.py").resolve()


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_the_place_to_change_is_there_once(mutant: Mutant) -> None:
    assert (ROOT / mutant.file).read_text(encoding="utf-8").count(mutant.before) == 1
    assert mutant.after != mutant.before
    for test in mutant.tests:
        file, _, name = test.partition("::")
        assert f"def {name.partition('[')[0]}" in (ROOT / file).read_text(encoding="utf-8")


def test_a_word_that_no_mutant_has_is_an_error() -> None:
    name = MUTANTS[-1].name
    assert chosen([]) == list(MUTANTS)
    assert MUTANTS[-1] in chosen([name])
    with pytest.raises(SystemExit, match="no such word"):
        chosen([name, "no such word"])
