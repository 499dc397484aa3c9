"""How long each stage of a study took: as it was measured, and as the times of its chunks show."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from sprag_study.service.schedules.stages import StudyTimes
from sprag_study.service.storage.part import Part, moment, row_of
from sprag_study.service.storage.tables import CHUNKS, STAGES, STUDIES
from sprag_study.worker.stages import Stage
from sprag_study.worker.states import ChunkState

if TYPE_CHECKING:
    from collections.abc import Mapping

_S, _C = STAGES.c, CHUNKS.c
#: Microseconds between a chunk and all those that were claimed before it; negative where they overlap.
_GAPS = (
    sa.select(
        _C.claimed_at,
        _C.finished_at,
        (_C.claimed_at - sa.func.max(_C.finished_at).over(order_by=_C.claimed_at, rows=(None, -1))).label("gap"),
    )
    .where(_C.study == sa.bindparam("study"), _C.state == ChunkState.DONE, _C.claimed_at.is_not(None))
    .subquery()
)
_CHUNK_TIMES = sa.select(
    sa.func.min(_GAPS.c.claimed_at).label("began"),
    sa.func.max(_GAPS.c.finished_at).label("ended"),
    sa.func.sum(sa.case((_GAPS.c.gap > 0, _GAPS.c.gap), else_=0)).label("idle"),
)


class TimesByStage(Part):
    """The times of studies by stage."""

    def add(self, spent: Mapping[int, Mapping[Stage, float]]) -> None:
        """Add seconds to the stages of studies; those of studies that are gone are left out."""
        with self.session.write() as connection:
            c = STUDIES.c
            still = sa.select(c.number).where(c.number.in_(spent)).with_for_update(read=True, key_share=True)
            rows = [
                {"study": number, "stage": stage.value, "seconds": seconds}
                for number in connection.execute(still).scalars().all()
                for stage, seconds in spent[number].items()
            ]
            if rows:
                dialect = postgresql if connection.dialect.name == "postgresql" else sqlite
                more = dialect.insert(STAGES)
                total = {"seconds": _S.seconds + more.excluded.seconds}
                connection.execute(more.on_conflict_do_update(index_elements=[_S.study, _S.stage], set_=total), rows)

    def of_study(self, study_id: str) -> StudyTimes:
        """The times of a study; raises StudyNotFoundError."""
        with self.session.read() as connection:
            row = row_of(connection, study_id, STUDIES.c.number, STUDIES.c.created_at)
            chunks = connection.execute(_CHUNK_TIMES, {"study": row.number}).one()
            measured = connection.execute(sa.select(_S.stage, _S.seconds).where(_S.study == row.number)).all()
        known = {Stage(stage): seconds for stage, seconds in measured}
        if chunks.began is None:
            return StudyTimes(moment(row.created_at), None, None, 0.0, known)
        idle = float(chunks.idle) / 1e6
        return StudyTimes(moment(row.created_at), moment(chunks.began), moment(chunks.ended), idle, known)
