"""Where the rows of a study come from: the hosts that computed them, and under which fingerprint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag.service.languages import _, grouped

if TYPE_CHECKING:
    from collections.abc import Iterable


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
        Digest of the code and libraries of the process (`sprag.worker.fingerprint`); None where the
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
