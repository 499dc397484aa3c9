"""Rows of finished chunks as the database takes them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.storage.rows.hashes import as_kept
from sprag_study.service.storage.tables import KEY_COLUMNS, further_table, results_table
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from sprag_study.worker.arrays import Floats, Ints
    from sprag_study.worker.models import ChunkResult

#: Rows that are put together at once: fewer cost time each, more memory.
MERGED_ROWS: Final = 1_000
#: Rows that are Python's numbers at once: few enough to stay in the processor's cache.
TUPLE_ROWS: Final = 200


@dataclass(frozen=True, slots=True)
class Target:
    """A table of rows and its columns: `KEY_COLUMNS`, then a column for each result.

    ``whole[i]``: the result i is a count or a category and has a column of integers. ``generations``: those of the
    results (`ResultInfo`).
    """

    table: str
    columns: tuple[str, ...]
    whole: tuple[bool, ...]
    generations: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Block:
    """Rows for one table.

    Attributes
    ----------
    studies, cases : int64 arrays, shape (rows,)
        The number of the study and of the case of each.
    endings, flags : sequences of str, length rows
    values : float64 array, shape (rows, results)
        NaN and infinities are stored as NULL; counts and categories are whole numbers.
    """

    studies: Ints
    cases: Ints
    endings: Sequence[str]
    flags: Sequence[str]
    values: Floats


@lru_cache(maxsize=64)
def target(model: str, variant: str) -> Target:
    """The results table of a variant."""
    infos = models.result_infos(model, variant)
    columns = (*KEY_COLUMNS, *(info.column for info in infos))
    whole, generations = (info.kind != "real" for info in infos), (info.generation for info in infos)
    return Target(results_table(model, variant).name, columns, tuple(whole), tuple(generations))


@lru_cache(maxsize=64)
def further_target(model: str, variant: str) -> Target | None:
    """The table with further rows of a case; None where there is none."""
    table, own = further_table(model, variant), target(model, variant)
    return None if table is None else Target(table.name, own.columns, own.whole, own.generations)


def block(study: int, cases: Ints, result: ChunkResult) -> Block:
    """The rows of those cases for `target`."""
    return Block(np.full(cases.size, study, dtype=np.int64), cases, result.endings, result.flags, result.values)


def further_block(study: int, cases: Ints, result: ChunkResult) -> Block | None:
    """Their rows for `further_target`; None where no case has any."""
    further = result.further
    if further is None or not len(further.flags):
        return None
    rows = len(further.flags)
    return Block(
        np.full(rows, study, dtype=np.int64), cases[further.of], [models.OK] * rows, further.flags, further.values
    )


def merged(blocks: Iterable[Block]) -> Iterator[Block]:
    """The same rows in the same order, in blocks of at least `MERGED_ROWS` rows except for the last.

    Their values are as from `as_kept`.
    """
    waiting: list[Block] = []
    count = 0
    for part in blocks:
        waiting.append(part)
        count += len(part.cases)
        if count >= MERGED_ROWS:
            yield _merged(waiting)
            waiting, count = [], 0
    if waiting:
        yield _merged(waiting)


def _merged(blocks: Sequence[Block]) -> Block:
    if len(blocks) == 1:
        (one,) = blocks
        return Block(one.studies, one.cases, one.endings, one.flags, as_kept(one.values))
    return Block(
        np.concatenate([one.studies for one in blocks]),
        np.concatenate([one.cases for one in blocks]),
        list(chain.from_iterable(one.endings for one in blocks)),
        list(chain.from_iterable(one.flags for one in blocks)),
        as_kept(np.concatenate([one.values for one in blocks])),
    )


def tuples(rows: Block) -> Iterator[tuple[Any, ...]]:
    """Rows as tuples in the order of the table's columns, one after the other.

    Everything is a float: SQLite stores NaN as NULL, and whole numbers as integers in columns of integers.
    """
    return chain.from_iterable(_tuples(rows, first) for first in range(0, len(rows.cases), TUPLE_ROWS))


def _tuples(rows: Block, first: int) -> Iterator[tuple[Any, ...]]:
    """Some of the rows. They are put together of columns, because a loop over rows would take as long as SQLite."""
    part = slice(first, first + TUPLE_ROWS)
    keys = rows.studies[part].tolist(), rows.cases[part].tolist(), rows.endings[part], rows.flags[part]
    return zip(*keys, *rows.values[part].T.tolist(), strict=True)
