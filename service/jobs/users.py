"""Users and tokens as administrators list and change them: by the interface for programs, and by commands on the
database.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import timedelta
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.actor import Role
from sprag_study.service.answers import filled
from sprag_study.service.answers.people import CreatedToken, HandedOver, QuotaUse, Token, User
from sprag_study.service.faults import FaultError
from sprag_study.service.spec.described import Described, Record
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.service.storage.people.people import Quota
from sprag_study.service.storage.people.scopes import MAX_USER_NAME, MOST_DAYS, TokenScope, token_name, user_name
from sprag_study.worker.limits import MAX_NAME_LENGTH

if TYPE_CHECKING:
    from sprag_study.service.storage.people.people import People, TokenRecord, UserRecord

_NAME: Final[dict[str, Any]] = {"type": "string", "minLength": 1, "maxLength": MAX_USER_NAME}
_ROLE: Final = Described("role", "", "what the user may do", "choice", choices=tuple((role, "") for role in Role))
_SCOPE: Final = Described(
    "scope", "", "read everything, or change it too", "choice", choices=tuple((scope, "") for scope in TokenScope)
)
_REMOVED: Final = Described("removed", "", "whether the user may no longer use the service", "flag")
#: The limits of a user: what each limits, its name in a quota, and the highest one.
_LIMITS: Final = {
    "most_cases": ("cases that wait", "cases", 2**63 - 1),
    "most_bytes": ("bytes of results", "bytes", 2**63 - 1),
    "most_checks": ("checks of specs, fits and pictures at the same time", "checks", 64),
}
_SCHEMAS: Final[dict[str, Any]] = {
    name: {
        "type": ["integer", "null"], "minimum": 0, "maximum": most,
        "description": f"most {what}; 0: no limit; null: as the settings have it",
    }
    for name, (what, _, most) in _LIMITS.items()
}  # fmt: skip

USER: Final = Record({"name": _NAME, "role": _ROLE, **_SCHEMAS}, "A user to add.", required=("name", "role"))
CHANGE: Final = Record(
    {"role": _ROLE, "removed": _REMOVED, **_SCHEMAS}, "The fields of a user to change; what is left out is kept."
)
TOKEN: Final = Record(
    {
        "name": {"type": "string", "minLength": 1, "maxLength": MAX_NAME_LENGTH, "description": "owner or purpose"},
        "scope": _SCOPE,
        "user": {"type": ["string", "null"], "description": "whose it is; null: nobody's, with the role of a designer"},
        "days": {
            "type": ["integer", "null"], "minimum": 1, "maximum": MOST_DAYS,
            "description": "days for which it is valid; null: always",
        },
    },
    "A token to create.",
    required=("name",),
)  # fmt: skip
HAND_OVER: Final = Record(
    {"name": _NAME, "to": _NAME}, "Two users: to the second belongs what was the first's.", required=("name", "to")
)


@dataclass(frozen=True, slots=True)
class NewUser:
    """A user to add."""

    name: str
    role: Role
    quota: Quota


@dataclass(frozen=True, slots=True)
class NewToken:
    """A token to create; ``days`` is None where it is valid always."""

    name: str
    scope: TokenScope
    owner: str | None
    days: int | None


@dataclass(frozen=True, slots=True)
class UserChange:
    """A change of a user; what is None is kept. ``as_set`` names numbers of the quota that the settings have again."""

    role: Role | None
    removed: bool | None
    quota: Quota
    as_set: tuple[str, ...]


def read_user(data: object) -> NewUser:
    """The user that a request adds; raises SpecError with every fault."""
    node = Node(Report(data), "", data)
    USER.read(node)
    name, role, (quota, _) = _read_name(node["name"]), _ROLE.read(node), _read_limits(node)
    node.report.raise_if_any()
    return NewUser(name, Role(role), quota)


def read_user_change(data: object) -> UserChange:
    """The change of a user that a request asks for; raises SpecError with every fault."""
    node = Node(Report(data), "", data)
    CHANGE.read(node, null=False)
    role = _ROLE.read(node) if "role" in node else None
    removed = _REMOVED.read(node) if "removed" in node else None
    quota, as_set = _read_limits(node)
    node.report.raise_if_any()
    return UserChange(None if role is None else Role(role), removed, quota, as_set)


def read_token(data: object) -> NewToken:
    """The token that a request creates; raises SpecError with every fault."""
    node = Node(Report(data), "", data)
    TOKEN.read(node)
    name = _read_name(node["name"], token_name, "must be the name of a token")
    scope = _SCOPE.read(node) if "scope" in node else TokenScope.WRITE
    owner = _read_name(node["user"]) if node["user"].value is not None else None
    days = node["days"].whole(1, MOST_DAYS) if node["days"].value is not None else None
    node.report.raise_if_any()
    return NewToken(name, TokenScope(scope), owner, days)


def read_hand_over(data: object) -> tuple[str, str]:
    """The names of who has it and of who gets it; raises SpecError with every fault."""
    node = Node(Report(data), "", data)
    HAND_OVER.read(node)
    names = _read_name(node["name"]), _read_name(node["to"])
    node.report.raise_if_any()
    return names


def _read_name(node: Node, named: Callable[[str], str] = user_name, mistake: str = "must be the name of a user") -> str:
    if not isinstance(node.value, str):
        node.mistake(mistake)
        return ""
    try:
        return named(node.value)
    except FaultError as error:
        fault = error.faults[0]
        node.refuse("invalid-text", fault.message, allowed=fault.allowed)
        return ""


def _read_limits(user: Node) -> tuple[Quota, tuple[str, ...]]:
    """The numbers that are given, and the names of those that the settings have again."""
    numbers, as_set = {}, []
    for name, (_, own, most) in _LIMITS.items():
        if name not in user:
            continue
        if user[name].value is None:
            as_set.append(own)
        else:
            numbers[own] = user[name].whole(0, most)
    return Quota(**numbers), tuple(as_set)


def quota_json(people: People, name: str, own: Quota) -> QuotaUse:
    """The quotas of a user, and what is used of them."""
    quota, used = own.over(people.default_quota), people.usage(name)
    return {
        "cases": used.cases,
        "most_cases": quota.cases or None,
        "bytes": used.bytes,
        "most_bytes": quota.bytes or None,
        "most_checks": quota.checks or None,
    }


def user_json(people: People, record: UserRecord) -> User:
    """A user as JSON data."""
    own = {name: getattr(record.quota, number) for name, (_, number, _) in _LIMITS.items()}
    return filled(User, record, quota=quota_json(people, record.name, record.quota), **own)


def tokens_json(people: People, records: Iterable[TokenRecord]) -> list[Token]:
    """Tokens as JSON data."""
    now, owners = people.clock.now(), {user.name: user for user in people.users()}
    return [
        filled(Token, record, user=record.owner, state=record.state_at(now, owners.get(record.owner or "")).value)
        for record in records
    ]


def _token_json(people: People, record: TokenRecord) -> Token:
    (token,) = tokens_json(people, [record])
    return token


class StoredUsers:
    """The users and tokens of a database; its methods are those of the client of a service."""

    def __init__(self, people: People) -> None:
        self._people = people

    def users(self) -> list[User]:
        """Every user, removed ones included, by name."""
        return [user_json(self._people, record) for record in self._people.users()]

    def add_user(self, name: str, role: str = Role.DESIGNER, **limits: int | None) -> User:
        """Add a user; raises SpecError, and as `People.add_user`."""
        return added(self._people, read_user({"name": name, "role": str(role), **limits}))

    def change_user(self, name: str, **fields: Any) -> User:
        """Change the given fields of a user; raises SpecError, and as `People.change_user`."""
        return changed(self._people, name, read_user_change(fields))

    def hand_over_user(self, name: str, to: str) -> HandedOver:
        """Give what belongs to a user to another; raises as `People.hand_over`."""
        return handed_over(self._people, name, to)

    def tokens(self) -> list[Token]:
        """Every token, newest first."""
        return tokens_json(self._people, self._people.tokens())

    def create_token(self, name: str, **fields: Any) -> CreatedToken:
        """Create a token; raises SpecError, and as `People.create_token`."""
        return created(self._people, read_token({"name": name, **fields}))

    def revoke_token(self, token_id: str) -> Token:
        """Revoke a token; raises TokenNotFoundError."""
        return revoked(self._people, token_id)


def created(people: People, token: NewToken) -> CreatedToken:
    """Create a token; raises as `People.create_token`."""
    ends = None if token.days is None else people.clock.now() + timedelta(days=token.days)
    secret, record = people.create_token(token.name, token.scope, owner=token.owner, expires_at=ends)
    return {**_token_json(people, record), "token": secret}


def revoked(people: People, token_id: str) -> Token:
    """Revoke a token; raises TokenNotFoundError."""
    return _token_json(people, people.revoke_token(token_id))


def added(people: People, user: NewUser) -> User:
    """Add a user; raises UserExistsError."""
    return user_json(people, people.add_user(user.name, user.role, user.quota))


def changed(people: People, name: str, change: UserChange) -> User:
    """Change a user; raises as `People.change_user`."""
    record = people.change_user(name, change.role, change.quota, removed=change.removed, as_set=change.as_set)
    return user_json(people, record)


def handed_over(people: People, name: str, to: str) -> HandedOver:
    """Give what belongs to a user to another; raises as `People.hand_over`."""
    studies, schedules = people.hand_over(name, to)
    return {"studies": studies, "schedules": schedules}
