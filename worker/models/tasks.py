"""Chunks of cases of any model: what is sent to a process, and its run there."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.worker.models.common import ChunkResult, ChunkTask, WorkerEnding, run_accepted
from sprag_study.worker.models.parameters import refused_cases
from sprag_study.worker.models.registry import model_of
from sprag_study.worker.sweeps import lines_of

if TYPE_CHECKING:
    from sprag_study.worker.study import Study


def chunk_task(study: Study, first: int, count: int) -> ChunkTask:
    """The cases ``first`` .. ``first + count - 1`` of ``study``, ready for `run_task`; of a sweep whole lines."""
    cases = range(first, first + count)
    columns: dict[str, Any] = {**study.base, **study.columns(cases)}
    columns = {path: column for path, column in columns.items() if path not in study.beside}
    lines = None if study.sweep is None else lines_of(study, np.asarray(cases, dtype=np.int64))
    shape = model_of(study.model).shape_of(study)
    task = ChunkTask(first, count, shape, study.run, columns, study.structure, lines=lines, along=study.sweep)
    if study.spread is None:
        return task
    model = model_of(study.model)
    refused = refused_cases(study, columns, count) | model.invalid(study, columns, count)
    results = len(model.results(model.variant_of(study)))
    return replace(task, refused=refused, results=results) if refused.any() else task


def run_task(task: ChunkTask) -> ChunkResult:
    """Run the cases of a task.

    A physical failure is an ending in the result, never an exception; an exception is a bug.
    """
    from sprag_study.engine.faults import inject

    inject(task.columns, task.count)
    model = model_of(task.shape.model)
    return model.run(task) if task.refused is None else run_accepted(task, model.run, WorkerEnding.INVALID)


def run_chunk(study: Study, first: int, count: int) -> ChunkResult:
    """Run the cases ``first`` .. ``first + count - 1`` of ``study`` here."""
    return run_task(chunk_task(study, first, count))
