"""How long each stage of a study took, as the dispatcher and the scheduler measure it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from sprag_study.service.storage.part import Part, micros_of, moment, row_of
from sprag_study.service.storage.tables import STAGES, STUDIES
from sprag_study.worker.stages import Spent, Stage

if TYPE_CHECKING:
    from collections.abc import Mapping

_S = STAGES.c


class TimesByStage(Part):
    """The times of studies by stage."""

    def add(self, spent: Mapping[int, Mapping[Stage, Spent]]) -> None:
        """Add to the stages of studies, by number; those of studies that are gone are left out."""
        with self.session.write_rows() as connection:
            c = STUDIES.c
            # Locked so that nobody removes them before the end, and in ascending order so that writers cannot deadlock.
            still = sa.select(c.number).where(c.number.in_(spent)).order_by(c.number)
            still = still.with_for_update(read=True, key_share=True)
            rows = [
                {
                    "study": number,
                    "stage": stage.value,
                    "seconds": time.seconds,
                    "began_at": micros_of(time.begin),
                    "ended_at": micros_of(time.end),
                }
                for number in connection.execute(still).scalars().all()
                for stage, time in sorted(spent[number].items())
            ]
            if rows:
                dialect = postgresql if connection.dialect.name == "postgresql" else sqlite
                more = dialect.insert(STAGES)
                new = more.excluded
                total = {
                    "seconds": _S.seconds + new.seconds,
                    "began_at": sa.case((_S.began_at < new.began_at, _S.began_at), else_=new.began_at),
                    "ended_at": sa.case((_S.ended_at > new.ended_at, _S.ended_at), else_=new.ended_at),
                }
                connection.execute(more.on_conflict_do_update(index_elements=[_S.study, _S.stage], set_=total), rows)

    def of_study(self, study_id: str) -> dict[Stage, Spent]:
        """What was measured of a study; raises StudyNotFoundError."""
        with self.session.read() as connection:
            study = row_of(connection, study_id, STUDIES.c.number, STUDIES.c.created_at)
            columns = (_S.stage, _S.seconds, _S.began_at, _S.ended_at)
            rows = connection.execute(sa.select(*columns).where(_S.study == study.number)).all()
        return {
            Stage(row.stage): Spent(
                row.seconds,
                moment(study.created_at if row.began_at is None else row.began_at),
                moment(study.created_at if row.ended_at is None else row.ended_at),
            )
            for row in rows
        }
