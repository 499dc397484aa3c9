"""The failed cases of a study, to be run again, and no others; of a sweep the lines that have them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, starmap
from typing import TYPE_CHECKING, Any

import numpy as np
import sqlalchemy as sa

from sprag_study.service.storage.errors import NothingToRetryError
from sprag_study.service.storage.rows.columns import conditions
from sprag_study.service.storage.tables import CHUNKS, ENDINGS, STUDIES, results_table
from sprag_study.worker import models
from sprag_study.worker.chunking import MAX_CHUNKS
from sprag_study.worker.ports import Chunk
from sprag_study.worker.states import ChunkState
from sprag_study.worker.sweeps import LineOrder

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Sequence

    from sprag_study.worker.arrays import Ints
    from sprag_study.worker.order import Order

    #: Whether a chunk has the rows with that digest.
    IsSound = Callable[[Chunk, int], bool]

#: First and count of consecutive places: case numbers, or positions in the study's order.
Run = tuple[int, int]


@dataclass(frozen=True, slots=True)
class _Done:
    """A finished chunk; times in microseconds."""

    first: int
    count: int
    claimed_at: int
    finished_at: int
    detail: str | None
    host: str | None
    fingerprint: str | None
    digest: int | None


def nothing_to_retry(endings: Collection[str] | None) -> str:
    """Why there is no case with such an ending."""
    if endings is None:
        return "every case of the study ended ok: there is nothing to run again"
    return f"no case of the study ended as {' or '.join(sorted(endings))}: there is nothing to run again"


def failed_cases(connection: sa.Connection, number: int, endings: Collection[str] | None) -> dict[str, int]:
    """Number of cases to run again, by ending."""
    c = ENDINGS.c
    found = connection.execute(sa.select(c.ending, c.cases).where(c.study == number, c.ending != models.OK)).all()
    return {ending: cases for ending, cases in found if cases and (endings is None or ending in endings)}


def failed_runs(connection: sa.Connection, row: sa.Row[Any], endings: tuple[str, ...]) -> list[Run]:
    """The cases with those endings as runs, in order."""
    c = results_table(row.model, row.variant).c
    # Consecutive cases have the same difference from their index in the list.
    place = sa.func.row_number().over(order_by=c.case_number)
    found = (
        sa.select(c.case_number, (c.case_number - place).label("same"))
        .where(c.study == row.number, c.ending.in_(endings))
        .subquery()
    )
    first = sa.func.min(found.c.case_number).label("first")
    query = sa.select(first, sa.func.count()).group_by(found.c.same).order_by(first).limit(MAX_CHUNKS + 1)
    return _few([(int(number), int(count)) for number, count in connection.execute(query)])


def failed_places(connection: sa.Connection, row: sa.Row[Any], endings: tuple[str, ...], order: Order) -> list[Run]:
    """The same for a study with an order of its own: runs of positions in it; of a sweep whole lines."""
    c = results_table(row.model, row.variant).c
    query = sa.select(c.case_number).where(c.study == row.number, c.ending.in_(endings))
    places = np.sort(order.positions(np.fromiter(connection.execute(query).scalars(), dtype=np.int64)))
    if isinstance(order, LineOrder):
        places = order.lines_at(places)
    edges = np.flatnonzero(np.diff(places) > 1) + 1
    return _few([(int(run[0]), run.size) for run in np.split(places, edges)])


def _few(runs: list[Run]) -> list[Run]:
    if len(runs) > MAX_CHUNKS:
        raise NothingToRetryError(
            f"the failed cases lie in more than {MAX_CHUNKS} places: select fewer by their ending, or submit them as "
            "a study of their own"
        )
    return runs


def give_back(
    connection: sa.Connection,
    row: sa.Row[Any],
    runs: Sequence[Run],
    counts: dict[str, int],
    cases: Ints | None,
    is_sound: IsSound,
) -> list[Chunk]:
    """Delete the rows that are run again and cut the chunks so that exactly these cases wait.

    They are ``cases``, ascending, or all with the endings of ``counts``, which has their number by ending. Returns the
    finished pieces of chunks that have the rows of their digest. Those of others keep it, so that they stay damaged.
    """
    finished = _cut(connection, row.number, runs, is_sound)
    table = results_table(row.model, row.variant)
    own = [table.c.ending.in_(tuple(counts))] if cases is None else conditions(table.c.case_number, cases)
    for condition in own:
        connection.execute(sa.delete(table).where(table.c.study == row.number, condition))
    for ending, count in counts.items():
        this = (ENDINGS.c.study == row.number) & (ENDINGS.c.ending == ending)
        connection.execute(sa.update(ENDINGS).where(this).values(cases=ENDINGS.c.cases - count))
    connection.execute(sa.delete(ENDINGS).where(ENDINGS.c.study == row.number, ENDINGS.c.cases == 0))
    connection.execute(
        sa.update(STUDIES)
        .where(STUDIES.c.number == row.number)
        .values(done=STUDIES.c.done - sum(counts.values()), ok=STUDIES.c.ok - counts.get(models.OK, 0))
    )
    return finished


def _cut(connection: sa.Connection, number: int, runs: Sequence[Run], is_sound: IsSound) -> list[Chunk]:
    c = CHUNKS.c
    chunks = connection.execute(
        sa.select(c["first"], c["count"], c.claimed_at, c.finished_at, c.detail, c.host, c.fingerprint, c.digest)
        .where(c.study == number)
        .order_by(c["first"])
    ).all()
    gone: list[dict[str, int]] = []
    sealed: list[Chunk] = []
    made: list[dict[str, Any]] = []
    at = 0
    for chunk in starmap(_Done, chunks):
        end = chunk.first + chunk.count
        while at < len(runs) and sum(runs[at]) <= chunk.first:
            at += 1
        inside = []
        for first, count in runs[at:]:
            if first >= end:
                break
            inside.append((max(first, chunk.first), min(first + count, end)))
        if inside:
            gone.append({"gone": chunk.first})
            made += (pieces := _pieces(number, chunk, inside))
            if chunk.digest is not None and is_sound(Chunk(number, chunk.first, chunk.count), chunk.digest):
                kept = (piece for piece in pieces if piece["state"] is ChunkState.DONE)
                sealed += [Chunk(number, piece["first"], piece["count"]) for piece in kept]
    connection.execute(sa.delete(CHUNKS).where(c.study == number, c["first"] == sa.bindparam("gone")), gone)
    connection.execute(sa.insert(CHUNKS), made)
    return sealed


def _pieces(number: int, chunk: _Done, inside: Sequence[Run]) -> list[dict[str, Any]]:
    """A finished chunk as waiting pieces (``inside``) and the finished pieces between them.

    The finished pieces share its time in proportion to their cases, so the reported speed stays correct; where its rows
    come from is where theirs do.
    """
    waiting = {first for first, _ in inside}
    borders = sorted({chunk.first, chunk.first + chunk.count, *(border for part in inside for border in part)})
    pace = (chunk.finished_at - chunk.claimed_at) / chunk.count
    nothing = dict.fromkeys(("claimed_at", "finished_at", "detail", "host", "fingerprint", "digest"))
    pieces = []
    for first, end in pairwise(borders):
        piece: dict[str, Any] = {"study": number, "first": first, "count": end - first, "failures": 0}
        if first in waiting:
            piece |= {"state": ChunkState.WAITING, **nothing}
        else:
            begin, finish = (chunk.claimed_at + round(pace * (border - chunk.first)) for border in (first, end))
            piece |= {"state": ChunkState.DONE, "claimed_at": begin, "finished_at": finish}
            piece |= {name: getattr(chunk, name) for name in ("detail", "host", "fingerprint", "digest")}
        pieces.append(piece)
    return pieces
