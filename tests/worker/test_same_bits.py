"""What decides which cases a study has does not depend on the processor either: any dispatcher goes on with it."""

from __future__ import annotations

from pathlib import Path

from sprag_study import worker
from tests.engine.test_same_bits import calls

#: What people are told of a calibration in the end; no case follows from it.
ANSWER = {"planning/calibrate/answer.py", "planning/calibrate/lack_of_fit.py"}


def test_cases_do_not_go_through_blas_or_functions_of_libraries() -> None:
    (folder,) = map(Path, worker.__path__)
    files = {file.relative_to(folder).as_posix(): file.read_text(encoding="utf-8") for file in folder.rglob("*.py")}
    # Powers are squares and those of whole numbers here.
    assert {name for name, source in files.items() if calls(source) - {"**"}} == ANSWER
