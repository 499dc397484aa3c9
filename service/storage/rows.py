"""Rows of a chunk as the database takes them."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag.service.storage.tables import KEY_COLUMNS, further_table, results_table
from sprag.worker import models
from sprag.worker.models import ChunkResult

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


@lru_cache(maxsize=64)
def target(model: str, variant: str) -> tuple[str, tuple[str, ...]]:
    """A results table and its columns in the order of `tuples`."""
    names = (*KEY_COLUMNS, *(info.column for info in models.result_infos(model, variant)))
    return results_table(model, variant).name, names


@lru_cache(maxsize=64)
def further_target(model: str, variant: str) -> tuple[str, tuple[str, ...]] | None:
    """The same of the table with further rows of a case; None where there is none."""
    table = further_table(model, variant)
    return None if table is None else (table.name, target(model, variant)[1])


def all_tuples(
    study: int, numbers: Sequence[int], result: ChunkResult, infos: Sequence[models.ResultInfo]
) -> tuple[list[tuple[Any, ...]], list[tuple[Any, ...]]]:
    """Rows for `target` and for `further_target`, of the cases with those numbers."""
    own = tuples(study, numbers, result, infos)
    if result.further is None:
        return own, []
    cases = [numbers[place] for place in result.further.of.tolist()]
    rows = ChunkResult(result.first, [models.OK] * len(cases), result.further.flags, result.further.values)
    return own, tuples(study, cases, rows, infos)


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
