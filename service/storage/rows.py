"""Rows of a chunk as the database takes them."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag.service.storage.tables import KEY_COLUMNS, results_table
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sprag.worker.models import ChunkResult


@lru_cache(maxsize=64)
def target(model: str, variant: str) -> tuple[str, tuple[str, ...]]:
    """A results table and its columns in the order of `tuples`."""
    names = (*KEY_COLUMNS, *(info.column for info in models.result_infos(model, variant)))
    return results_table(model, variant).name, names


def tuples(
    study: int, numbers: Sequence[int], result: ChunkResult, infos: Sequence[models.ResultInfo]
) -> list[tuple[Any, ...]]:
    """Rows for `target`, of the cases with those numbers: NaN and infinities become NULL, counts and codes integers."""
    columns: list[list[Any]] = []
    for index, info in enumerate(infos):
        column = result.values[:, index]
        finite = np.isfinite(column)
        if info.kind != "real":
            cells: list[Any] = np.where(finite, column, 0.0).astype(np.int64).tolist()
        else:
            cells = column.tolist()
        if not finite.all():
            cells = [cell if known else None for cell, known in zip(cells, finite.tolist(), strict=True)]
        columns.append(cells)
    return list(zip([study] * result.count, numbers, result.endings, result.flags, *columns, strict=True))


@contextmanager
def without_collector() -> Iterator[None]:
    """Disable the garbage collector while many rows are built: its repeated scans took half of the time."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
