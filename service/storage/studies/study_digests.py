"""Digests of studies: flipped bits in what was asked, and in the numbers of cases, are noticed.

A study whose texts differ is not run and not read: nobody but a backup knows what was asked. Numbers of cases follow
from the rows, and are counted again.
"""

from __future__ import annotations

import hashlib
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.part import row_of
from sprag_study.service.storage.tables import CHUNKS, ENDINGS, STUDIES, results_table
from sprag_study.worker import models
from sprag_study.worker.states import ChunkState, StudyState

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

_C = STUDIES.c
#: What says which cases a study has and what its numbers mean.
COVERED: Final[tuple[sa.Column[Any], ...]] = (
    _C.id, _C.model, _C.variant, _C.cases, _C.engine_version, _C.physics_hash, _C.spec, _C.study, _C.coarse,
    _C.most_cases, _C.most_rounds, _C.created_at,
)  # fmt: skip
WITH_DIGEST: Final[tuple[sa.Column[Any], ...]] = (*COVERED, _C.digest)


def undecodable(error: sa.exc.DBAPIError) -> bool:
    """Whether a text that was read is none: a bit of it was flipped."""
    return "Could not decode" in str(error.orig)


@contextmanager
def readable(study_id: str) -> Iterator[None]:
    """Raise DatabaseError for a text of a study that is none."""
    try:
        yield
    except sa.exc.DBAPIError as error:
        if not undecodable(error):
            raise
        raise DatabaseError(changed(study_id, "inputs"), "database-damaged") from error


def changed(study_id: str, what: str) -> str:
    """A sentence on that part of a study."""
    return (
        f"the {what} of the study {study_id} changed on the disk: put a backup in place, or delete the study and "
        "submit it again"
    )


def digest_of_study(values: Mapping[str, Any]) -> int:
    """The digest of a study with these values by column, as the database keeps it: a signed number of 64 bits."""
    hashed = hashlib.blake2b(digest_size=8)
    for column in COVERED:
        text = str(values.get(column.name)).encode("utf-8", "surrogatepass")
        hashed.update(b"%d:" % len(text) + text)
    return int.from_bytes(hashed.digest(), "little", signed=True)


def is_sound(row: Any) -> bool:
    """Whether a study is as it was stored; of its row `WITH_DIGEST`. One from before revision 0039 counts as sound."""
    return row.digest is None or bool(digest_of_study(row._asdict()) == row.digest)


def require_as_stored(row: Any) -> None:
    """Raise DatabaseError where a study is not as it was stored; of its row `WITH_DIGEST`."""
    if not is_sound(row):
        raise DatabaseError(changed(row.id, "inputs"), "database-damaged")


def grown_digest(connection: sa.Connection, number: int, **values: object) -> int | None:
    """The digest of a study after these ``values`` change; one that is not as it was stored keeps its own."""
    row: Any = connection.execute(sa.select(*WITH_DIGEST).where(_C.number == number)).one()
    if row.digest is None or not is_sound(row):
        kept: int | None = row.digest
        return kept
    return digest_of_study({**row._asdict(), **values})


def problem_of(connection: sa.Connection, row: Any) -> str | None:
    """What is wrong with the inputs or the list of chunks of a study; of its row `WITH_DIGEST`, number and state.

    Its rows say nothing then: which cases they are of is not known.
    """
    if is_sound(row) and _chunks_fit(connection, row):
        return None
    what = "list of chunks" if is_sound(row) else "inputs"
    return changed(row.id, what)


def require_whole(connection: sa.Connection, study_id: str) -> None:
    """Raise DatabaseError where `problem_of` a study is something, and StudyNotFoundError."""
    with readable(study_id):
        row = row_of(connection, study_id, *WITH_DIGEST, _C.number, _C.state)
    if problem := problem_of(connection, row):
        raise DatabaseError(problem, "database-damaged")


def counts_differ(connection: sa.Connection, study_id: str) -> bool:
    """Whether the numbers of cases of a study, by ending and together, are not those of its rows.

    Raises StudyNotFoundError.
    """
    row = row_of(connection, study_id, _C.number, _C.model, _C.variant, _C.done, _C.ok)
    e, c = ENDINGS.c, results_table(row.model, row.variant).c
    told = connection.execute(sa.select(e.ending, e.cases).where(e.study == row.number)).all()
    rows = sa.select(c.ending, sa.func.count()).where(c.study == row.number).group_by(c.ending)
    counted = {ending: int(cases) for ending, cases in connection.execute(rows)}
    sums = (sum(counted.values()), counted.get(models.OK, 0))
    return {ending: cases for ending, cases in told if cases} != counted or (row.done, row.ok) != sums


def _chunks_fit(connection: sa.Connection, row: Any) -> bool:
    """Whether the chunks of a study have each of its cases once; of a cancelled one, each at most once."""
    c = CHUNKS.c
    known = connection.execute(
        sa.select(c["first"], c["count"], sa.cast(c.state, sa.String)).where(c.study == row.number).order_by(c["first"])
    )
    end, states = 0, {str(state) for state in ChunkState}
    gaps = row.state == StudyState.CANCELLED
    for first, count, state in known:
        if not (isinstance(first, int) and isinstance(count, int)) or count < 1 or state not in states:
            return False
        if first < end or (first > end and not gaps):
            return False
        end = first + count
    return bool(end <= row.cases if gaps else end == row.cases)
