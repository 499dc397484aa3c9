"""Kernels answer a short case before they run any other: in each process, and as when they were compiled.

The answers are the same bytes on every processor (docs/adr/0031-processors-may-differ.md), so other ones are those of a
faulty processor or memory, or of a damaged cache.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from sprag_study.worker import fingerprint, models

if TYPE_CHECKING:
    from pathlib import Path

    from sprag_study.worker.models import ChunkResult, ChunkTask, KernelShape

#: The answers of the kernels that have answered in this process.
_ANSWERS: Final[dict[KernelShape, str]] = {}


class OtherAnswersError(Exception):
    """A kernel answers otherwise than when it was compiled; the message says how."""


def load(shape: KernelShape) -> None:
    """Compile a kernel or load it from the cache, and let it answer. Raises OtherAnswersError."""
    models.load(shape)
    require_answers(shape)


def run_task(task: ChunkTask) -> ChunkResult:
    """Run a chunk with a kernel that has answered in this process. Raises OtherAnswersError."""
    require_answers(task.shape)
    return models.run_task(task)


def answers_of(shape: KernelShape) -> str:
    """A hash of the known answers of a kernel."""
    return hashlib.sha256(models.model_of(shape.model).known_answers(shape)).hexdigest()[:16]


def require_answers(shape: KernelShape) -> str:
    """The answers of a kernel, computed once in each process and compared with those that stand beside it in the cache.

    The first process under a fingerprint writes them there. Raises OtherAnswersError.
    """
    if shape in _ANSWERS:
        return _ANSWERS[shape]
    answers, under = answers_of(shape), fingerprint.digest()
    noted = _noted(models.mark_of(shape))
    if noted[:1] == [under] and noted[1:] != [answers]:
        raise OtherAnswersError(f"known answers of its kernel: {answers} instead of {' '.join(noted[1:])}")
    if not noted or noted[0] != under:
        with suppress(OSError):
            models.mark_of(shape).write_text(f"{under} {answers}", encoding="ascii")
    return _ANSWERS.setdefault(shape, answers)


def _noted(mark: Path) -> list[str]:
    """Fingerprint and answers in the file beside a kernel; nothing where there are none."""
    try:
        return mark.read_text(encoding="ascii").split()
    except (OSError, UnicodeDecodeError):
        return []
