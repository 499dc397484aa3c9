"""Rounds of studies that choose their own cases: what they have, and the next one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import sqlalchemy as sa

from sprag.service.storage.case_keys import KEYED, add_keys
from sprag.service.storage.checked_rows import CheckedRows
from sprag.service.storage.errors import DatabaseError
from sprag.service.storage.part import add_chunks
from sprag.service.storage.round_table import add_round, rounds_of
from sprag.service.storage.studies import Studies
from sprag.service.storage.study_digests import grown_digest
from sprag.service.storage.tables import ROUNDS, STUDIES
from sprag.service.storage.work import Work
from sprag.worker import models
from sprag.worker.case_keys import case_keys
from sprag.worker.chunking import spans
from sprag.worker.planning.rounds import Rows
from sprag.worker.ports import Chunk, UnreadableStudyError
from sprag.worker.reuse import taken
from sprag.worker.states import StudyState

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag.service.storage.records import RoundRecord
    from sprag.worker.study import Study


class Rounds(Studies, CheckedRows, Work):
    """The rounds of studies."""

    def rounds(self, study_id: str) -> list[RoundRecord]:
        """The rounds of a study, in order; none where its cases were given. Raises StudyNotFoundError."""
        with self.session.read() as connection:
            return rounds_of(connection, self._row(connection, study_id, STUDIES.c.number).number)

    def rounds_done(self, number: int) -> list[range] | None:
        """The cases of every round of a study that needs its next one; None where it needs none now.

        It needs none while rows of its rounds that changed on the disk are run again. Raises UnreadableStudyError.
        """
        with self.session.read() as connection:
            if not _needs_round(connection, number):
                return None
            c = ROUNDS.c
            query = sa.select(c.first, c["count"]).where(c.study == number, c["count"] > 0).order_by(c.round)
            rounds = [range(first, first + count) for first, count in connection.execute(query)]
            damaged = self.damaged_chunks(connection, number, np.arange(max(cases.stop for cases in rounds)))
            study_id = connection.execute(sa.select(STUDIES.c.id).where(STUDIES.c.number == number)).scalar_one()
        try:
            return None if damaged and self.run_damaged_again(study_id) else rounds
        except DatabaseError as error:
            raise UnreadableStudyError(str(error)) from error

    def round_rows(self, number: int, study: Study, cases: range, results: Sequence[str]) -> Rows:
        """The rows of one round."""
        with self.session.read() as connection:
            study_id = connection.execute(sa.select(STUDIES.c.id).where(STUDIES.c.number == number)).scalar_one()
        names = models.with_half_widths(results, (info.name for info in models.study_results(study)))
        columns = self.rows_for_cases(study_id, np.arange(cases.start, cases.stop), names)
        ok = models.usable(study.model, columns.endings, columns.flags)
        return Rows(study.points(cases), ok, columns.values)

    def append_round(
        self, epoch: int, number: int, study: Study, first: int, summary: Mapping[str, Any]
    ) -> list[Chunk] | None:
        """Give a study its next round: the cases of ``study`` from number ``first`` on, as waiting chunks.

        ``summary`` is what the rows before them show. None, and no change, where the study does not need that round.
        """
        count = study.cases - first
        sizes = list(spans(count, self.chunking.cases_of(study, count)))
        text = study.to_text()
        added = taken(study, np.arange(first, study.cases))
        with self.session.write() as connection:
            if not self._may_change(connection, epoch, number) or not _needs_round(connection, number, first):
                return None
            add_round(connection, number, first, count, summary, self._now())
            chunks = [Chunk(number, first + start, size) for start, size in sizes]
            add_chunks(connection, chunks)
            mine = (STUDIES.c.number == number) & (STUDIES.c.keyed == KEYED)
            kin = connection.execute(sa.select(STUDIES.c.kin_hash).where(mine)).scalar_one_or_none()
            if kin is not None:
                add_keys(connection, number, case_keys(added, kin))
            digest = grown_digest(connection, number, cases=study.cases, study=text)
            self._change(connection, number, cases=study.cases, study=text, digest=digest)
        self._forget_reuse(number)
        return chunks


def _needs_round(connection: sa.Connection, number: int, cases: int | None = None) -> bool:
    """Whether a study with that many cases waits for its next round."""
    c = STUDIES.c
    row = connection.execute(
        sa.select(c.state, c.cases, c.done, c.most_cases).where(c.number == number, c.deleted_at.is_(None))
    ).one_or_none()
    if row is None or row.most_cases is None or not StudyState(row.state).going:
        return False
    return row.done == row.cases and cases in {None, row.cases}
