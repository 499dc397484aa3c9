"""How several dispatchers share the studies of a database, without I/O.

Each study has one dispatcher at a time. A dispatcher leaves a new study to another that has fewer, and one with rows to
a dispatcher of the fingerprint of these rows; of its own, it gives one away where another has two fewer. So the numbers
of studies differ by one at most once they have settled. One that can run nothing leaves its studies to those that can.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sprag_study.worker.ports import ActiveStudy, Peer


def takes(study: ActiveStudy, fingerprint: str, studies: int, peers: Sequence[Peer], *, stuck: bool = False) -> bool:
    """Whether a dispatcher with this fingerprint and number of studies takes a study that belongs to nobody.

    ``stuck``: whether it can run nothing at present.
    """
    if study.fingerprint:
        alike = [peer for peer in peers if peer.fingerprint == study.fingerprint]
        if fingerprint != study.fingerprint and alike:
            return False
        peers = alike if fingerprint == study.fingerprint else peers
    return not (stuck and peers) and all(peer.studies >= studies for peer in peers)


def gives(own: Iterable[ActiveStudy], peers: Sequence[Peer], *, stuck: bool = False) -> int | None:
    """Number of the study that a dispatcher gives away: its latest of the lowest rank and priority; None for none.

    A study with rows goes to dispatchers of their fingerprint only. ``stuck``: whether it can run nothing at present,
    and therefore gives all of them away, one after the other.
    """
    mine = sorted(own, key=lambda study: (study.rank, study.priority, -study.number))
    for study in mine:
        able = (peer for peer in peers if not study.fingerprint or peer.fingerprint == study.fingerprint)
        if any(stuck or peer.studies + 2 <= len(mine) for peer in able):
            return study.number
    return None
