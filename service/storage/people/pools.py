"""What everybody shares: queue, schedules, views, components; and which priorities count against others."""

from __future__ import annotations

from dataclasses import dataclass

import sqlalchemy as sa

from sprag_study.service.actor import Door, Role, acting
from sprag_study.service.storage.people.tables import USERS

_U = USERS.c


@dataclass(frozen=True, slots=True)
class Pool:
    """A pool of the size ``most``: how much of it is ``taken``, and how much of that is the sender's (``mine``).

    Where there are users (``shared``), none takes more than is left for the others: whoever has as much as is still
    free gets no more. A single one so gets half of the pool, the next one half of the rest, and nobody can fill it.
    """

    most: int
    taken: int
    mine: int
    shared: bool

    @property
    def free(self) -> int:
        """What nobody has."""
        return max(self.most - self.taken, 0)

    def takes(self, more: int = 1) -> bool:
        """Whether the sender gets so many more, one after the other."""
        after = Pool(self.most, self.taken + more - 1, self.mine + more - 1, self.shared)
        return after.free > (after.mine if self.shared else 0)

    def refusal(self, names: str) -> str:
        """Why the sender gets no more of the things of that name."""
        if not self.free or not self.shared:
            return f"there can be {self.most:,} {names}, and {self.taken:,} are there already; delete some first"
        return (
            f"{self.mine:,} {names} are yours, and {self.free:,} more can be there, which are for others; delete some "
            "first"
        )


def pool_of(connection: sa.Connection, table: sa.Table, condition: sa.ColumnElement[bool], most: int) -> Pool:
    """The rows of a table with ``condition``, at most ``most``, as a pool of all owners."""
    own = table.c.owner.is_not_distinct_from(acting().user)
    count = sa.select(sa.func.count(), sa.func.coalesce(sa.func.sum(sa.case((own, 1), else_=0)), 0))
    taken, mine = connection.execute(count.select_from(table).where(condition)).one()
    return Pool(most, int(taken), int(mine), _any_user(connection))


def rank_of(connection: sa.Connection, priority: int) -> int:
    """The part of a priority that counts against studies of other owners.

    Where there are users, whoever is no administrator can only let others go first.
    """
    actor = acting()
    if actor.door is Door.SCHEDULE:
        role = sa.select(_U.role).where(_U.name == (actor.user or ""), _U.removed_at.is_(None))
        above = connection.execute(role).scalar_one_or_none() == Role.ADMINISTRATOR.value
    else:
        above = actor.everything
    return priority if above or not _any_user(connection) else min(priority, 0)


def _any_user(connection: sa.Connection) -> bool:
    return connection.execute(sa.select(_U.name).limit(1)).first() is not None
