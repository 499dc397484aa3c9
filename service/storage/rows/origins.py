"""Where the rows of a study come from: the hosts that computed them, and under which fingerprint.

What fingerprints say is stored once each: chunks and dispatchers have their digests only.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import sqlalchemy as sa
from sqlalchemy.dialects import postgresql, sqlite

from sprag_study.service.languages import _, grouped
from sprag_study.service.storage.tables import FINGERPRINTS
from sprag_study.worker import fingerprint

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


#: Between the hosts of a chunk whose rows come from several.
HOSTS_BETWEEN: Final = ", "
_MOST_CHARACTERS: Final = 255


def names_of(hosts: Iterable[str]) -> str | None:
    """Hosts as a chunk keeps them, in order of the alphabet; as many as there is room for. None for none."""
    text = HOSTS_BETWEEN.join(sorted(set(hosts)))
    if len(text) > _MOST_CHARACTERS:
        more = f"{HOSTS_BETWEEN}..."
        text = text[: _MOST_CHARACTERS - len(more)].rpartition(HOSTS_BETWEEN)[0] + more
    return text or None


@dataclass(frozen=True, slots=True)
class Origin:
    """Finished chunks of a study with one origin.

    Attributes
    ----------
    host : str or None
        Where they were computed, also those rows that were copied from other studies: several hosts with
        `HOSTS_BETWEEN` between them. None where the cases were given up or hosts were not recorded, as before revision
        0022.
    fingerprint : str or None
        Digest of the code and libraries of the process (`sprag_study.worker.fingerprint`); None where the
        cases were given up, and for chunks from before revision 0022.
    chunks, cases : int
    differs : str or None
        How the fingerprint differs from that of the first origin of the study, as a clause; None where it does not, or
        was stored before revision 0031.
    """

    host: str | None
    fingerprint: str | None
    chunks: int
    cases: int
    differs: str | None = None

    @property
    def sentence(self) -> str:
        """The origin in words, with the first digits of the fingerprint, in the language of the task."""
        copied = _("copied from other studies") if self.fingerprint else _("not computed, or not recorded")
        place = self.host or copied
        count = {"cases": grouped(self.cases), "chunks": grouped(self.chunks)}
        if not self.fingerprint:
            return _("{place}: {cases} cases in {chunks} chunks", place=place, **count)
        digest = self.fingerprint[:12]
        told = _("{place}, fingerprint {digest}: {cases} cases in {chunks} chunks", place=place, digest=digest, **count)
        return told if self.differs is None else _("{origin} ({difference})", origin=told, difference=self.differs)


@dataclass(frozen=True, slots=True)
class CasesOf:
    """Cases ``first`` to ``last`` of a study, computed under one fingerprint."""

    fingerprint: str
    first: int
    last: int


def remember(connection: sa.Connection) -> None:
    """Store the fingerprint of this process, unless it is there."""
    insert = postgresql.insert if connection.dialect.name == "postgresql" else sqlite.insert
    own = insert(FINGERPRINTS).values(digest=fingerprint.digest(), content=fingerprint.text_of(fingerprint.present()))
    connection.execute(own.on_conflict_do_nothing())


def differences_of(connection: sa.Connection, digests: Sequence[str | None]) -> list[str | None]:
    """How each fingerprint differs from the first one, as a clause; None where it does not, or one is not stored."""
    first, several = (digests[0] if digests else None), {digest for digest in digests if digest}
    if first is None or len(several) < 2:
        return [None] * len(digests)
    c = FINGERPRINTS.c
    rows = connection.execute(sa.select(c.digest, c.content).where(c.digest.in_(sorted(several)))).all()
    stored = {row.digest: json.loads(row.content) for row in rows}
    if first not in stored:
        return [None] * len(digests)
    return [
        fingerprint.differences(stored[first], stored[digest]) or None if digest in stored else None
        for digest in digests
    ]
