"""Who asks: the identity of a token or of a user, and the role."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from sprag_study.service.actor import Role, share_of
from sprag_study.service.languages import N_
from sprag_study.service.storage.people.scopes import TokenScope


@dataclass(frozen=True, slots=True)
class Grant:
    """Who asks: the identity of a token (``id``, ``name``) or of a user, and the role.

    ``scope`` is that of the token, None without one: whoever has one that only reads has the role of a viewer. ``user``
    is the name of the user, None for a token without a user; ``checks`` is the user's own quota of simultaneous
    checks, None where the settings have it.
    """

    id: str
    name: str
    role: Role
    scope: TokenScope | None = None
    user: str | None = None
    checks: int | None = None

    @property
    def label(self) -> str:
        """Who it is, as the subject of a sentence: the user, unless the token allows less than the user may do."""
        return f"Token {self.name or self.id}" if self.user is None or self._only_reads else f"User {self.user}"

    @property
    def token(self) -> str | None:
        """Name of the token, or its id where it has none; None where a proxy names the user or no token is needed."""
        return None if self.id == f"user {self.user}" else self.name or self.id or None

    @property
    def reading(self) -> str:
        """The rest of that sentence for a viewer."""
        return N_("is read-only") if self._only_reads else N_("has the role viewer, which cannot change anything")

    @property
    def _only_reads(self) -> bool:
        return self.scope is TokenScope.READ

    @property
    def share(self) -> str:
        """Whose share of the service's work a request takes: a user's, with whatever token."""
        return share_of(self.user, self.id)


#: The grant of everybody where no token is needed.
OPEN: Final = Grant("", "", Role.ADMINISTRATOR)
