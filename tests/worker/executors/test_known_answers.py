"""Kernels answer before they run a chunk: once in each process, and as when they were compiled."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

from sprag_study.worker import fingerprint, models
from sprag_study.worker.executors import known_answers
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.executors.process_pool import ProcessPoolExecutor
from sprag_study.worker.models import KernelShape
from sprag_study.worker.ports import Chunk, Fate, Outcome
from tests.worker import fakes


@pytest.fixture
def answers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[bytes]:
    """What the kernel of the fakes' studies answers next, the last one for ever; in a cache of its own."""
    given = [b"sound"]
    model = models.model_of(fakes.study(1).model)
    monkeypatch.setattr(models, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(type(model), "known_answers", lambda *_: given.pop(0) if len(given) > 1 else given[0])
    monkeypatch.setattr(type(model), "load", lambda *_: None)
    monkeypatch.setattr(models, "run_task", fakes.run)
    monkeypatch.setattr(known_answers, "_ANSWERS", {})
    return given


def another_process() -> None:
    """Forget what a kernel has answered, as a process that has just been started."""
    known_answers._ANSWERS.clear()


def shape() -> KernelShape:
    return models.shape_of(fakes.study(1))


def run_chunk() -> Outcome:
    """The outcome of a chunk by the default of an executor without processes."""
    executor = InlineExecutor()
    executor.submit(1, fakes.study(4), Chunk(1, 0, 0, 4))
    (outcome,) = executor.wait(600.0)
    return outcome


def test_a_kernel_that_answers_otherwise_runs_nothing(answers: list[bytes]) -> None:
    known_answers.load(shape())
    another_process()
    assert run_chunk().fate is Fate.DONE
    another_process()
    answers[:] = [b"damaged"]
    refused = run_chunk()
    assert refused.fate is Fate.CRASHED
    assert "known answers of its kernel" in str(refused.detail)
    with pytest.raises(known_answers.OtherAnswersError):
        known_answers.load(shape())


def test_each_process_asks_once(answers: list[bytes]) -> None:
    answers[:] = [b"sound", b"not asked again"]
    assert [run_chunk().fate for _ in range(3)] == [Fate.DONE] * 3
    assert answers == [b"not asked again"]


def test_a_kernel_that_is_compiled_anew_has_answers_of_its_own(answers: list[bytes]) -> None:
    """Where the kernels are thrown away, and under another fingerprint, the first process says what is right."""
    known_answers.load(shape())
    another_process()
    models.mark_of(shape()).unlink()
    answers[:] = [b"compiled anew"]
    assert run_chunk().fate is Fate.DONE
    another_process()
    models.mark_of(shape()).write_text("of-another-fingerprint 0123456789abcdef")
    assert run_chunk().fate is Fate.DONE
    assert models.mark_of(shape()).read_text().split()[0] == fingerprint.digest()
    another_process()
    models.mark_of(shape()).write_bytes(b"")  # as earlier versions left it
    assert run_chunk().fate is Fate.DONE


def test_the_pool_asks_too() -> None:
    """Its processes run the same functions."""
    defaults = inspect.signature(ProcessPoolExecutor).parameters
    assert defaults["run"].default is known_answers.run_task
    assert defaults["load"].default is known_answers.load
