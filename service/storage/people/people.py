"""People: users with the quotas of what belongs to them, tokens, and the sessions of browsers.

A user has no password: users log in with a token of theirs or at an OpenID provider, or a trusted proxy names them. A
token is shown once and never stored; only its SHA-256 digest is. A digest without salt or key stretching is enough: a
token consists of 256 random bits, which nobody can guess. The cookie of a session contains its expiry and a signature,
so a session needs no row of its own and a login with a token no write: the database has the key that signs, and the
sessions that were ended early.
"""

from __future__ import annotations

import hashlib
import logging
import secrets
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.sentences import Sentence
from sprag_study.service.actor import SERVED, Role, act_as, acting
from sprag_study.service.faults import FaultError, parameter_error
from sprag_study.service.json_text import timestamp
from sprag_study.service.languages import N_, grouped, recorded
from sprag_study.service.storage.components import COMPONENTS
from sprag_study.service.storage.errors import TokenNotFoundError, UserExistsError, UserNotFoundError
from sprag_study.service.storage.part import Part, micros_of, moment, optional_moment
from sprag_study.service.storage.people.audit import differences, note
from sprag_study.service.storage.people.pools import pool_of
from sprag_study.service.storage.people.scopes import TokenScope, TokenState, require_one_limit
from sprag_study.service.storage.people.tables import ENDED_SESSIONS, SESSION_KEY, TOKENS, USERS
from sprag_study.service.storage.saved_views import SAVED_VIEWS
from sprag_study.service.storage.schedules.tables import SCHEDULES
from sprag_study.service.storage.tables import ENDED, HELD_AT_DEADLINE, STUDIES

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping
    from datetime import datetime, timedelta

    from sprag_study.service.settings import Settings
    from sprag_study.service.storage.people.accounts import Account

_LOG = logging.getLogger("sprag.access")

_U = USERS.c
#: The texts of a study, which people can make long.
TEXTS: Final = ("name", "spec", "study", "warnings", "notes", "tags", "search")
#: What the rest of a study takes: its row, its first chunk, its key, and their places in indexes.
STUDY_BYTES: Final = 1024
#: Condition: a study has not ended, and is not held at its deadline.
WAITING_STUDY = ~ENDED & STUDIES.c.waits_for.is_distinct_from(HELD_AT_DEADLINE)
#: Prefix of a token, so that people and secret scanners recognise it.
TOKEN_PREFIX: Final = "sprag_"  # noqa: S105 - the beginning of all tokens is no secret
_TOKEN_BYTES: Final = 32
_KEY_BYTES: Final = 32
_SALT_BYTES: Final = 16
#: A day in microseconds.
_DAY: Final = 24 * 3600 * 1_000_000
#: Primary key of the only row of the key's table.
_ONLY: Final = 1


@dataclass(frozen=True, slots=True)
class Quota:
    """Limits of one user: cases that wait, bytes of results, simultaneous checks of specs.

    0: no limit; None: as the settings have it.
    """

    cases: int | None = None
    bytes: int | None = None
    checks: int | None = None

    def over(self, default: Quota) -> Quota:
        """This quota, where it says nothing ``default``."""
        return Quota(
            *(getattr(default if getattr(self, name) is None else self, name) for name in ("cases", "bytes", "checks"))
        )


def quota_of(settings: Settings) -> Quota:
    """The quota of users who have none of their own."""
    return Quota(settings.user_cases, settings.user_storage * 2**20, settings.user_checks)


@dataclass(frozen=True, slots=True)
class UserRecord:
    """A user; ``removed_at`` is None for one who may use the service. ``quota`` is the user's own.

    ``session_salt`` is signed with the sessions that begin at the OpenID provider: they end when it changes.
    """

    name: str
    role: Role
    created_at: datetime
    removed_at: datetime | None
    quota: Quota
    session_salt: str = field(default="", repr=False)


@dataclass(frozen=True, slots=True)
class Usage:
    """What belongs to a user: cases that wait, and rough bytes of results."""

    cases: int
    bytes: int


@dataclass(frozen=True, slots=True)
class TokenRecord:
    """A token without its secret; ``digest`` is the SHA-256 of the secret in hexadecimal digits.

    ``owner`` is the user whose token it is, None for nobody's; ``used_at`` the time of its last use, to the minute.
    A token that was renewed is revoked some time later: then ``revoked_at`` lies ahead.
    """

    id: str
    name: str
    scope: TokenScope
    digest: str
    created_at: datetime
    revoked_at: datetime | None
    owner: str | None = None
    expires_at: datetime | None = None
    used_at: datetime | None = None

    def revoked_by(self, now: datetime) -> bool:
        """Whether the token is revoked at that time."""
        return self.revoked_at is not None and self.revoked_at <= now

    def state_at(self, now: datetime, user: UserRecord | None) -> TokenState:
        """The state of the token; ``user`` is the record of its owner, None where there is none."""
        if self.revoked_by(now):
            return TokenState.REVOKED
        if self.owner is not None and (user is None or user.removed_at is not None):
            return TokenState.USER_REMOVED
        return TokenState.VALID if self.expires_at is None or now < self.expires_at else TokenState.EXPIRED


def digest_of(token: bytes) -> str:
    """The digest that is stored for a token."""
    return hashlib.sha256(token).hexdigest()


@dataclass(frozen=True, slots=True)
class SessionSecrets:
    """The data that validate sessions: the signing key, and the signatures of the sessions that were ended early."""

    #: None before the very first login.
    key: bytes | None
    #: Signature and expiry (seconds since 1970-01-01 UTC).
    ended: Mapping[str, int]


class People(Part):
    """The users of a database, their tokens, and the sessions of their browsers."""

    #: Quotas of users who have none of their own; set by the service.
    default_quota = Quota()
    #: Valid tokens of one user; 0: no limit. Set by the service.
    most_tokens = 0

    def add_user(self, name: str, role: Role, quota: Quota | None = None) -> UserRecord:
        """Add a user; raises UserExistsError, also for the name of a removed one."""
        values = {"name": name, "role": role.value, "created_at": self._now(), **_columns(quota or Quota())}
        with self.session.write() as connection:
            _require_standing(connection, self._now())
            if connection.execute(sa.select(_U.name).where(_U.name == name)).first():
                raise UserExistsError(f"there is a user {name!r} already, or was one, who can be restored")
            row = connection.execute(sa.insert(USERS).values(values).returning(USERS)).one()
            note(connection, self._now(), "user.add", name, role=role.value, **_set(quota))
            return _user_record(row)

    def users(self) -> tuple[UserRecord, ...]:
        """Every user, removed ones included, by name."""
        return tuple(map(_user_record, self._all(sa.select(USERS).order_by(_U.name))))

    def change_user(
        self,
        name: str,
        role: Role | None = None,
        quota: Quota | None = None,
        *,
        removed: bool | None = None,
        as_set: Collection[str] = (),
    ) -> UserRecord:
        """Change the given fields of a user, whose studies, schedules and tokens are kept; raises UserNotFoundError.

        A number of ``quota`` that is None is kept, but where ``as_set`` names it (cases, bytes, checks): then the
        settings have it again; both at once raise FaultError. Tokens of a removed user are worth nothing until the user
        is restored, which forgets the account at the OpenID provider; sessions from there end. A removed user is
        not removed again, nor an active one restored. In a service the last administrator stays: raises FaultError.
        """
        given = {column: value for column, value in _columns(quota or Quota()).items() if value is not None}
        require_one_limit({column.removeprefix("most_") for column in given}, as_set)
        values: dict[str, Any] = {**given, **({} if role is None else {"role": role.value})}
        values |= {f"most_{number}": None for number in as_set}
        with self.session.write() as connection:
            _require_standing(connection, self._now())
            old = connection.execute(sa.select(USERS).where(_U.name == name)).one_or_none()
            if old is None:
                raise UserNotFoundError(name)
            moved = removed is not None and removed != (old.removed_at is not None)
            if moved and removed:
                values |= {"removed_at": self._now(), "session_salt": _salt()}
            elif moved:  # the account at the OpenID provider may be another one by now
                values |= {"removed_at": None, "subject": None, "issuer": None}
            if not values:
                return _user_record(old)
            before = acting().door in SERVED and _is_administered(connection)
            row = connection.execute(sa.update(USERS).where(_U.name == name).values(values).returning(USERS)).one()
            if before and not _is_administered(connection):
                raise parameter_error("role", "conflict", N_("is that of the last administrator"), name)
            detail = _changes(old, row)
            if moved and not removed and old.subject is not None:
                detail["account_forgotten"] = True
            if moved or detail:
                action = "user.change" if not moved else "user.remove" if removed else "user.restore"
                note(connection, self._now(), action, name, **detail)
            return _user_record(row)

    def sign_in(self, account: Account, role: Role | None, *, create: bool) -> UserRecord:
        """The user of an account at the OpenID provider, with the ``role`` that its groups give; None: the present one.

        The first login of an account takes the user of its name; with ``create`` it adds one who is not there. From
        then on the account is that user, whatever its name, until the user is restored, or an account of another issuer
        takes the user in the same way. The last administrator keeps the role. Raises FaultError where nobody may come
        in by the account.
        """
        with self.session.write() as connection:
            row = _of_account(connection, account)
            row = row or connection.execute(sa.select(USERS).where(_U.name == account.name)).one_or_none()
            now, link = self._now(), {"subject": account.subject, "issuer": account.issuer}
            if row is None:
                if not create or role is None:
                    raise FaultError("not-allowed", Sentence(recorded.NO_USER, user=account.name))
                values = {**link, "name": account.name, "role": role.value, "session_salt": _salt()}
                row = connection.execute(sa.insert(USERS).values(created_at=now, **values).returning(USERS)).one()
                _note_login(connection, now, "user.add", row.name, role=row.role, login=True)
                return _user_record(row)
            if row.removed_at is not None:
                raise FaultError("not-allowed", Sentence(recorded.USER_REMOVED, user=row.name))
            first = row.subject != account.subject
            if first and row.subject is not None and row.issuer in (None, account.issuer):
                raise FaultError("not-allowed", Sentence(recorded.OTHER_ACCOUNT, user=row.name))
            salt = {"session_salt": _salt()} if first else {}  # sessions of another account end
            after, detail = _changed_by_login(connection, row, role, **link, **salt)
            if first or detail:
                _note_login(connection, now, "user.change", row.name, **({"login": True} if first else {}), **detail)
            return _user_record(after)

    def withdraw(self, account: Account) -> None:
        """End the sessions of the user of an account whose groups give no role any more; the user becomes a viewer.

        The last administrator keeps the role. Nothing is done for an account that is no user yet.
        """
        with self.session.write() as connection:
            row = _of_account(connection, account)
            if row is not None and row.removed_at is None:
                _, detail = _changed_by_login(connection, row, Role.VIEWER, session_salt=_salt())
                _note_login(connection, self._now(), "user.change", row.name, sessions_ended=True, **detail)

    def hand_over(self, name: str, heir: str) -> tuple[int, int]:
        """Give the studies, schedules, components and views of a user to another; returns the numbers of the first two.

        Raises UserNotFoundError, and FaultError for a user and the same again.
        """
        if name == heir:
            raise parameter_error("to", "conflict", N_("is the user whose studies these are"), heir)
        with self.session.write() as connection:
            _require_standing(connection, self._now())
            for each in (name, heir):
                require_user(connection, each, removed=each == name)
            present = STUDIES.c.deleted_at.is_(None) | (STUDIES.c.purge_at > self._now())  # those can be restored
            studies, schedules = (
                connection.execute(
                    sa.update(table)
                    .where(table.c.owner == name, present if table is STUDIES else table.c.deleted_at.is_(None))
                    .values(owner=heir, **({"revision": table.c.revision + 1} if table is STUDIES else {}))
                ).rowcount
                for table in (STUDIES, SCHEDULES)
            )
            for kept in (COMPONENTS, SAVED_VIEWS):
                connection.execute(sa.update(kept).where(kept.c.owner == name).values(owner=heir))
            note(connection, self._now(), "user.hand-over", name, to=heir, studies=studies, schedules=schedules)
        return studies, schedules

    def usage(self, name: str) -> Usage:
        """What counts against the quota of a user."""
        with self.session.read() as connection:
            return _usage(connection, name)

    def require_quota(self, connection: sa.Connection, cases: int, size: int) -> None:
        """Raise FaultError where that many more cases or bytes exceed a quota of the present user."""
        user = acting().user
        if user is None:
            return
        row = connection.execute(sa.select(USERS).where(_U.name == user)).one_or_none()
        quota = (Quota() if row is None else _quota(row)).over(self.default_quota)
        used = _usage(connection, user)
        if cases and quota.cases and used.cases + cases > quota.cases:
            raise FaultError(
                "quota-exceeded",
                f"{cases:,} more cases exceed the quota of {user}: {used.cases:,} of {quota.cases:,} wait already.",
            )
        if size > 0 and quota.bytes and used.bytes + size > quota.bytes:
            raise FaultError(
                "quota-exceeded",
                f"That would take about {_mib(size)} MiB more, and {user} has used {_mib(used.bytes)} of "
                f"{_mib(quota.bytes)} MiB: delete studies for good first; deleted ones that can be restored count too.",
            )

    def create_token(
        self, name: str, scope: TokenScope, *, owner: str | None = None, expires_at: datetime | None = None
    ) -> tuple[str, TokenRecord]:
        """Create a token; returns its secret, which cannot be shown again, and its record.

        ``owner`` is the user whose token it is; raises UserNotFoundError, and FaultError beyond `most_tokens`.
        """
        ends = None if expires_at is None else micros_of(expires_at)
        with self.session.write() as connection:
            _require_standing(connection, self._now())
            self._require_few_tokens(connection, owner)
            fields = {"name": name, "scope": scope.value, "owner": owner}
            return _new_token(connection, self._now(), fields, ends)

    def renew_token(self, token_id: str, grace: timedelta) -> tuple[str, TokenRecord]:
        """Another token of the same name, scope, owner and length of life; the former is valid for ``grace`` at most.

        Returns what `create_token` returns; raises TokenNotFoundError, also for one that was revoked or renewed, or
        has expired, UserNotFoundError, and FaultError beyond `most_tokens`, for which the former counts while it runs.
        """
        c, now = TOKENS.c, self._now()
        valid = c.revoked_at.is_(None) & sa.func.coalesce(c.expires_at > now, sa.true())
        with self.session.write() as connection:
            _require_standing(connection, self._now())
            row = connection.execute(sa.select(TOKENS).where(c.id == token_id, valid)).one_or_none()
            if row is None:
                raise TokenNotFoundError(token_id)
            self._require_few_tokens(connection, row.owner)
            ends = None if row.expires_at is None else now + row.expires_at - row.created_at
            last = micros_of(moment(now) + grace)
            connection.execute(sa.update(TOKENS).where(c.id == token_id).values(revoked_at=last))
            same = {"name": row.name, "scope": row.scope, "owner": row.owner}
            return _new_token(connection, now, same, ends, instead_of=token_id)

    def _require_few_tokens(self, connection: sa.Connection, owner: str | None) -> None:
        """Raise FaultError where a user has the most valid tokens, or was given four times as many within a day."""
        if owner is None or not self.most_tokens:
            return
        c, now = TOKENS.c, self._now()
        valid = sa.func.coalesce(c.revoked_at > now, sa.true()) & sa.func.coalesce(c.expires_at > now, sa.true())
        today = c.created_at > now - _DAY
        count = (sa.func.coalesce(sa.func.sum(sa.case((each, 1), else_=0)), 0) for each in (valid, today))
        there, lately = connection.execute(sa.select(*count).where(c.owner == owner)).one()
        if there >= self.most_tokens:
            raise FaultError("quota-exceeded", Sentence(recorded.MANY_TOKENS, user=owner, count=int(there)))
        if lately >= 4 * self.most_tokens:
            raise FaultError("quota-exceeded", Sentence(recorded.TOKENS_LATELY, user=owner, count=int(lately)))

    def tokens(self) -> tuple[TokenRecord, ...]:
        """Every token ever created, newest first."""
        rows = self._all(sa.select(TOKENS).order_by(TOKENS.c.number.desc()))
        return tuple(map(_token_record, rows))

    def revoke_token(self, token_id: str) -> TokenRecord:
        """Revoke a token; raises TokenNotFoundError. Revoking it twice has no further effect."""
        now, revoked = self._now(), TOKENS.c.revoked_at
        with self.session.write() as connection:
            _require_standing(connection, self._now())
            row = connection.execute(
                sa.update(TOKENS)
                .where(TOKENS.c.id == token_id)
                .values(revoked_at=sa.case((revoked <= now, revoked), else_=now))
                .returning(TOKENS)
            ).one_or_none()
            if row is None:
                raise TokenNotFoundError(token_id)
            same = {"name": row.name, "owner": row.owner, "scope": row.scope}
            note(connection, self._now(), "token.revoke", token_id, **same)
            return _token_record(row)

    def note_uses(self, uses: Mapping[str, int]) -> None:
        """Record when tokens were last used: µs since 1970 by id."""
        with self.session.write_rows() as connection:
            for token_id, used in sorted(uses.items()):  # in one order, so that two services do not wait for each other
                later = TOKENS.c.used_at.is_(None) | (TOKENS.c.used_at < used)
                connection.execute(sa.update(TOKENS).where(TOKENS.c.id == token_id, later).values(used_at=used))

    def session_secrets(self) -> SessionSecrets:
        """The key, and the sessions that were ended early."""
        with self.session.read() as connection:
            key = connection.execute(sa.select(SESSION_KEY.c.key)).scalar_one_or_none()
            ended = dict(connection.execute(sa.select(ENDED_SESSIONS.c.seal, ENDED_SESSIONS.c.ends_at)).all())
        return SessionSecrets(None if key is None else bytes.fromhex(key), ended)

    def create_session_key(self) -> bytes:
        """The signing key; created where there is none."""
        with self.session.write() as connection:
            key: str | None = connection.execute(sa.select(SESSION_KEY.c.key)).scalar_one_or_none()
            if key is None:
                key = secrets.token_hex(_KEY_BYTES)
                connection.execute(sa.insert(SESSION_KEY).values(id=_ONLY, key=key, created_at=self._now()))
        return bytes.fromhex(key)

    def end_session(self, seal: str, ends_at: int) -> None:
        """Record that a session was ended before its expiry; forget the expired ones."""
        c = ENDED_SESSIONS.c
        with self.session.write() as connection:
            connection.execute(sa.delete(ENDED_SESSIONS).where(c.ends_at < self._now() // 1_000_000))
            known = connection.execute(sa.select(c.seal).where(c.seal == seal)).scalar_one_or_none()
            if known is None:
                connection.execute(sa.insert(ENDED_SESSIONS).values(seal=seal, ends_at=ends_at))


def require_queue(connection: sa.Connection, most: int | None) -> None:
    """Raise FaultError where ``most`` studies wait already, or as many of the present sender's as are its share."""
    pool = None if most is None else pool_of(connection, STUDIES, WAITING_STUDY, most)
    if pool is None or pool.takes():
        return
    if not pool.free:
        raise FaultError("queue-full", Sentence(recorded.MANY_STUDIES, count=grouped(pool.taken)))
    shares = {"mine": grouped(pool.mine), "free": grouped(pool.free)}
    raise FaultError("queue-full", Sentence(recorded.SHARE_OF_QUEUE, **shares))


def require_user(connection: sa.Connection, name: str, *, removed: bool = False) -> None:
    """Raise UserNotFoundError where there is no such user; ``removed``: one who was removed will do."""
    query = sa.select(_U.name).where(_U.name == name, sa.true() if removed else _U.removed_at.is_(None))
    if connection.execute(query).first() is None:
        raise UserNotFoundError(name)


def _is_administered(connection: sa.Connection) -> bool:
    """Whether any user is an administrator."""
    administers = (_U.role == Role.ADMINISTRATOR.value) & _U.removed_at.is_(None)
    return connection.execute(sa.select(_U.name).where(administers)).first() is not None


def _of_account(connection: sa.Connection, account: Account) -> Any:
    """The row of the user that an account is; None where it is none yet."""
    return connection.execute(sa.select(USERS).where(_U.subject == account.subject)).one_or_none()


def _changed_by_login(
    connection: sa.Connection, row: Any, role: Role | None, **values: str
) -> tuple[Any, dict[str, Any]]:
    """The row of a user with the ``role`` of a login and further ``values``, and what the log says of it.

    Where nobody else is an administrator, the user stays one: otherwise nobody could let people in on pages.
    """
    mine, detail = _U.name == row.name, {}
    given = row.role if role is None else role.value
    after = connection.execute(sa.update(USERS).where(mine).values(role=given, **values).returning(USERS)).one()
    if row.role == Role.ADMINISTRATOR.value and not _is_administered(connection):
        after = connection.execute(sa.update(USERS).where(mine).values(role=row.role).returning(USERS)).one()
        detail = {"role_kept": row.role, "role_of_groups": given}
        _LOG.warning("%r is the last administrator and stays one; the groups of the login give: %s.", row.name, given)
    names = ("role", "issuer") if row.issuer is not None else ("role",)
    return after, {**detail, **_changes(row, after, names)}


def _note_login(connection: sa.Connection, now: int, action: str, name: str, **detail: Any) -> None:
    """Note what a login changed; the user acts, whatever the name at the provider is."""
    with act_as(replace(acting(), name=name, user=name)):
        note(connection, now, action, name, **detail)


def _salt() -> str:
    return secrets.token_hex(_SALT_BYTES)


def _require_standing(connection: sa.Connection, now: int) -> None:
    """Raise FaultError where who acts in a service was removed or revoked meanwhile, or is no longer an administrator.

    A service reads users and tokens anew every two seconds; what it read must not decide who may let people in.
    """
    actor = acting()
    if actor.door not in SERVED:
        return
    user = connection.execute(sa.select(USERS).where(_U.name == actor.user)).one_or_none()
    token = connection.execute(sa.select(TOKENS.c.revoked_at).where(TOKENS.c.id == actor.token)).one_or_none()
    removed = user is not None and user.removed_at is not None
    lowered = user is not None and actor.everything and user.role != Role.ADMINISTRATOR.value
    if removed or lowered or (token is not None and token.revoked_at is not None and token.revoked_at <= now):
        raise FaultError("not-allowed", Sentence(recorded.NO_LONGER))


def _new_token(
    connection: sa.Connection, now: int, fields: dict[str, str | None], ends: int | None, **noted: str
) -> tuple[str, TokenRecord]:
    """Insert a token of these fields, and note it: its secret and its record."""
    secret = TOKEN_PREFIX + secrets.token_urlsafe(_TOKEN_BYTES)
    token_id, owner = f"tk_{secrets.token_hex(6)}", fields["owner"]
    if owner is not None:
        require_user(connection, owner)
    expires = None if ends is None else timestamp(moment(ends))
    note(connection, now, "token.create", token_id, **fields, expires=expires, **noted)
    digest = digest_of(secret.encode("ascii"))
    values = {**fields, "id": token_id, "digest": digest, "created_at": now, "expires_at": ends}
    row = connection.execute(sa.insert(TOKENS).values(values).returning(TOKENS)).one()
    return secret, _token_record(row)


def _usage(connection: sa.Connection, name: str) -> Usage:
    """What counts against the quota: cases that wait, and what lies on the disk, of deleted studies too.

    A study has its rows, all of them or, once it has ended, those that it got; the texts that describe it; and what
    every study takes.
    """
    c = STUDIES.c
    most = sa.func.coalesce(c.most_cases, c.cases)
    whole = sa.func.coalesce(c.estimated_bytes, 0)
    rows = sa.case((ENDED & (most > 0), whole * c.done / sa.func.nullif(most, 0)), else_=whole)
    texts = sum((_octets(connection, c[name]) for name in TEXTS), start=sa.literal(STUDY_BYTES))
    waits = WAITING_STUDY & c.deleted_at.is_(None)
    row = connection.execute(
        sa.select(
            sa.func.coalesce(sa.func.sum(sa.case((waits, most - c.done), else_=0)), 0).label("cases"),
            sa.func.coalesce(sa.func.sum(rows + texts), 0).label("bytes"),
        ).where(c.owner == name)
    ).one()
    return Usage(int(row.cases), int(row.bytes))


def size_of_texts(values: Mapping[str, str]) -> int:
    """Bytes that these texts of a study take, by column; those that are missing are empty."""
    return sum(len(values.get(name, "").encode()) for name in TEXTS)


def _octets(connection: sa.Connection, column: sa.Column[str]) -> sa.ColumnElement[int]:
    """The length of a text in bytes of UTF-8."""
    if connection.dialect.name == "postgresql":
        return sa.func.octet_length(column)
    return sa.func.length(sa.cast(column, sa.LargeBinary))  # octet_length is missing before SQLite 3.43


def _columns(quota: Quota) -> dict[str, int | None]:
    return {"most_cases": quota.cases, "most_bytes": quota.bytes, "most_checks": quota.checks}


def _set(quota: Quota | None) -> dict[str, int]:
    """The numbers that a quota has, for the log."""
    return {name: value for name, value in _columns(quota or Quota()).items() if value is not None}


def _changes(old: Any, new: Any, names: Iterable[str] = ("role", *_columns(Quota()))) -> dict[str, Any]:
    """What differs of these columns of a user, before and after, for the log; a quota that is None is as set."""
    return differences(*({name: getattr(row, name) for name in names} for row in (old, new)))


def _quota(row: Any) -> Quota:
    return Quota(row.most_cases, row.most_bytes, row.most_checks)


def _user_record(row: Any) -> UserRecord:
    removed, salt = optional_moment(row.removed_at), row.session_salt or ""
    return UserRecord(row.name, Role(row.role), moment(row.created_at), removed, _quota(row), salt)


def _mib(size: int) -> str:
    return f"{size / 2**20:,.{0 if size >= 100 * 2**20 else 1}f}"


def _token_record(row: Any) -> TokenRecord:
    return TokenRecord(
        row.id,
        row.name,
        TokenScope(row.scope),
        row.digest,
        moment(row.created_at),
        optional_moment(row.revoked_at),
        row.owner,
        optional_moment(row.expires_at),
        optional_moment(row.used_at),
    )
