"""Tables of cases that are counted first and made only then: the pieces that a study's cases are put together from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag.worker.study import Axis

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Column = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """Some cases that a spec asks for.

    Attributes
    ----------
    pointer : str
        JSON Pointer of what asks for them.
    paths : tuple of str
        Parameters that vary in them.
    count : int
        How many cases; may be huge.
    make : callable
        Gives their columns: path -> values (SI), shape (count,). Tied paths share one array. None when something is
        wrong with a value, which is noted.
    lines : tuple of int
        Lines of the user's text in which the cases stand one by one; () where they do not stand in one.
    """

    pointer: str
    paths: tuple[str, ...]
    count: int
    make: Callable[[], dict[str, Column] | None]
    lines: tuple[int, ...] = ()


def made(blocks: Iterable[Block]) -> list[dict[str, Column]] | None:
    """The columns of every block; None when any has a problem."""
    found = [block.make() for block in blocks]
    return None if None in found else [columns for columns in found if columns is not None]


def each(columns: Mapping[str, Column], change: Callable[[Column], Column]) -> dict[str, Column]:
    """Every column changed; tied paths go on sharing one array."""
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
    """All rows of all tables, each row once; a parameter that varies elsewhere has its value of ``base``."""
    paths = list(dict.fromkeys(path for columns in tables for path in columns))
    joined: dict[tuple[object, ...], Column] = {}
    found: dict[str, Column] = {}
    for path in paths:
        parts = [columns.get(path) for columns in tables]
        # Tied in every part, and of one value elsewhere: tied in the whole.
        key = tuple(base[path] if part is None else id(part) for part in parts)
        if key not in joined:
            filled = [
                np.full(count, base[path]) if part is None else part for part, count in zip(parts, counts, strict=True)
            ]
            joined[key] = np.concatenate(filled)
        found[path] = joined[key]
    return chosen(found, first_rows(found))


def first_rows(columns: Mapping[str, Column]) -> NDArray[np.int64]:
    """Positions of the rows that have not come before, ascending."""
    distinct = list({id(column): column for column in columns.values()}.values())
    order = np.lexsort(distinct)  # equal rows stay in order, side by side
    again = np.ones(order.size, dtype=np.bool_)
    again[:1] = False
    for column in distinct:
        again[1:] &= column[order[1:]] == column[order[:-1]]
    return np.sort(order[~again])


def chosen(columns: Mapping[str, Column], rows: NDArray[Any]) -> dict[str, Column]:
    """The rows at positions, or where a mask is true."""
    return each(columns, lambda column: column[rows])


def as_axes(columns: Mapping[str, Column]) -> tuple[Axis, ...]:
    """The columns as zipped axes, tied paths on one."""
    tied: dict[int, list[str]] = {}
    for path, column in columns.items():
        tied.setdefault(id(column), []).append(path)
    return tuple(Axis(tuple(paths), columns[paths[0]] + 0.0) for paths in tied.values())
