"""What is wrong with the deployment, and is said to its administrators once, when it begins.

An alert stays until its cause is gone. So each event is reported once, however often and by whom it is noticed, and
again only after all was well.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import sqlalchemy as sa

from sprag_study.sentences import Sentence
from sprag_study.service.actor import Role
from sprag_study.service.delivery import is_mail_address, origin_of
from sprag_study.service.json_text import timestamp
from sprag_study.service.storage.part import Part, moment
from sprag_study.service.storage.people.audit import note
from sprag_study.service.storage.people.tables import USERS
from sprag_study.service.storage.schedules.reports import add_reports
from sprag_study.service.storage.stored_sentences import sentence_in, written
from sprag_study.service.storage.tables import METADATA

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from datetime import datetime

    from sprag_study.service.delivery import Delivery

AlertKind = Literal["backup", "disk"]

#: One row for each alert whose cause is still there.
ALERTS: Final = sa.Table(
    "alerts",
    METADATA,
    # "backup": the latest one failed; "disk": less is free than should be.
    sa.Column("kind", sa.String(12), primary_key=True),
    sa.Column("begun_at", sa.BigInteger, nullable=False),
    # Why, and the values of the sentence (`sprag_study.service.storage.stored_sentences`).
    sa.Column("problem", sa.Text, nullable=False),
    sa.Column("problem_values", sa.Text),
)
_A = ALERTS.c


@dataclass(frozen=True, slots=True)
class Alert:
    """What is wrong since ``begun_at``, as a sentence."""

    kind: str
    begun_at: datetime
    problem: str


class Alerts(Part):
    """The alerts of a database."""

    def begin(
        self,
        kind: AlertKind,
        problem: Sentence,
        targets: Sequence[str] = (),
        zone: str = "UTC",
        delivery: Delivery | None = None,
    ) -> bool:
        """Note that something is wrong, and add a report to each of the ``targets``; False where it is known.

        A target is a mail address or the address of a webhook; without any, administrators whose names are mail
        addresses get one. Those that ``delivery`` does not reach get none; None reaches all. Reports have times of the
        ``zone``.
        """
        with self.session.read() as connection:
            if kind in connection.execute(sa.select(_A.kind)).scalars().all():
                return False
        with self.session.write() as connection:
            if kind in connection.execute(sa.select(_A.kind)).scalars().all():
                return False
            now = self._now()
            connection.execute(sa.insert(ALERTS).values(kind=kind, begun_at=now, **written("problem", problem)))
            content = {
                "alert": kind,
                "sentence": str(problem),
                "begun": timestamp(moment(now)),
                "zone": zone,
                "known": {"sentence_values": problem.to_json()},
            }
            note(connection, now, "alert.begin", kind, problem=str(problem))
            reached = targets or _administrators(connection)
            if delivery is not None:
                reached = [target for target in reached if delivery.reaches(target)]
            add_reports(connection, now, None, now, kind, _channels(reached), content)
            return True

    def end(self, kind: AlertKind) -> bool:
        """Note that all is well again; False where nothing was wrong."""
        with self.session.read() as connection:
            if kind not in connection.execute(sa.select(_A.kind)).scalars().all():
                return False
        with self.session.write() as connection:
            gone = bool(connection.execute(sa.delete(ALERTS).where(_A.kind == kind)).rowcount)
            if gone:
                note(connection, self._now(), "alert.end", kind)
        return gone

    def present(self) -> tuple[Alert, ...]:
        """Every alert whose cause is still there, earliest first."""
        rows = self._all(sa.select(ALERTS).order_by(_A.begun_at, _A.kind))
        return tuple(Alert(row.kind, moment(row.begun_at), sentence_in(row, "problem") or "") for row in rows)


def _administrators(connection: sa.Connection) -> list[str]:
    u = USERS.c
    query = sa.select(u.name).where(u.role == Role.ADMINISTRATOR.value, u.removed_at.is_(None)).order_by(u.name)
    return [name for name in connection.execute(query).scalars() if is_mail_address(name)]


def _channels(targets: Iterable[str]) -> list[tuple[str, str]]:
    return [("webhook" if origin_of(target) is not None else "email", target) for target in targets]
