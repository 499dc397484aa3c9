"""Tables of cases that are counted before they are built: the parts of which a study's cases are composed."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.worker.study import Axis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Column = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """Some of the cases that a spec requests.

    Attributes
    ----------
    pointer : str
        JSON Pointer of the field that requests them.
    paths : tuple of str
        Parameters that vary in them.
    count : int
        Number of cases; may be huge.
    make : callable
        Returns their columns: path -> values (SI), shape (count,). Tied paths share one array. None when a value is
        invalid; the fault is recorded.
    lines : tuple of int
        Line of the user's text for each case; () where the cases do not come from a text.
    """

    pointer: str
    paths: tuple[str, ...]
    count: int
    make: Callable[[], dict[str, Column] | None]
    lines: tuple[int, ...] = ()


def block_columns(blocks: Iterable[Block]) -> list[dict[str, Column]] | None:
    """The columns of every block; None when any block is invalid."""
    found = [block.make() for block in blocks]
    return None if None in found else [columns for columns in found if columns is not None]


def each(columns: Mapping[str, Column], change: Callable[[Column], Column]) -> dict[str, Column]:
    """Apply ``change`` to every column; tied paths still share one array."""
    done: dict[int, Column] = {}
    return {path: done.setdefault(id(column), change(column)) for path, column in columns.items()}


def product(tables: Sequence[dict[str, Column]], counts: Sequence[int]) -> dict[str, Column]:
    """Every combination of rows; those of the first table vary slowest."""
    found: dict[str, Column] = {}
    for index, columns in enumerate(tables):
        inner, outer = _product(counts[index + 1 :]), _product(counts[:index])
        found |= each(columns, lambda column, i=inner, o=outer: np.tile(np.repeat(column, i), o))  # type: ignore[misc]
    return found


def _product(counts: Sequence[int]) -> int:
    return int(np.prod(counts, dtype=np.int64)) if counts else 1


def side_by_side(tables: Sequence[dict[str, Column]]) -> dict[str, Column]:
    """Rows of equally long tables put together."""
    return {path: column for columns in tables for path, column in columns.items()}


def one_after_another(
    tables: Sequence[dict[str, Column]], counts: Sequence[int], base: Mapping[str, float]
) -> dict[str, Column]:
    """All rows of all tables, each row once; parameters that a table does not vary take their value from ``base``."""
    paths = list(dict.fromkeys(path for columns in tables for path in columns))
    joined: dict[tuple[object, ...], Column] = {}
    found: dict[str, Column] = {}
    for path in paths:
        parts = [columns.get(path) for columns in tables]
        # Tied in every part, and equal elsewhere: tied in the whole.
        key = tuple(base[path] if part is None else id(part) for part in parts)
        if key not in joined:
            filled = [
                np.full(count, base[path]) if part is None else part for part, count in zip(parts, counts, strict=True)
            ]
            joined[key] = np.concatenate(filled)
        found[path] = joined[key]
    return chosen(found, first_rows(found))


def first_rows(columns: Mapping[str, Column]) -> NDArray[np.int64]:
    """Positions of the first occurrence of each row, ascending."""
    distinct = list({id(column): column for column in columns.values()}.values())
    order = np.lexsort(distinct)  # the sort is stable: equal rows stay in order
    again = np.ones(order.size, dtype=np.bool_)
    again[:1] = False
    for column in distinct:
        again[1:] &= column[order[1:]] == column[order[:-1]]
    return np.sort(order[~again])


def chosen(columns: Mapping[str, Column], rows: NDArray[Any]) -> dict[str, Column]:
    """Select rows by position or by mask."""
    return each(columns, lambda column: column[rows])


def as_axes(columns: Mapping[str, Column]) -> tuple[Axis, ...]:
    """The columns as zipped axes, tied paths on one."""
    tied: dict[int, list[str]] = {}
    for path, column in columns.items():
        tied.setdefault(id(column), []).append(path)
    return tuple(Axis(tuple(paths), columns[paths[0]] + 0.0) for paths in tied.values())
