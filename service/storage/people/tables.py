"""The tables of users, their tokens and sessions, and of the audit log. Times are microseconds since 1970-01-01 UTC."""

import sqlalchemy as sa

from sprag_study.service.storage.tables import METADATA

USERS = sa.Table(
    "users",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    # The name under which the user owns things, and by which a proxy calls the user. It is never given to another.
    sa.Column("name", sa.String(80), nullable=False, unique=True),
    sa.Column("role", sa.String(16), nullable=False),
    sa.Column("created_at", sa.BigInteger, nullable=False),
    # A removed user stays listed and keeps the name, so nobody else inherits what the user owned.
    sa.Column("removed_at", sa.BigInteger),
    # Quotas; NULL where the settings apply, 0: no limit.
    sa.Column("most_cases", sa.BigInteger),
    sa.Column("most_bytes", sa.BigInteger),
    sa.Column("most_checks", sa.Integer),
    # SHA-256 of issuer and subject of the account at the OpenID provider; NULL for who never logged in there.
    sa.Column("subject", sa.String(64)),
    # The issuer of this account; NULL also for accounts from before revision 0045.
    sa.Column("issuer", sa.Text),
    # Signed with the cookies of sessions that begin at the provider, so that another text ends them; NULL: none.
    sa.Column("session_salt", sa.String(32)),
    sa.Index("ix_users_subject", "subject", unique=True),
    sqlite_autoincrement=True,
)

TOKENS = sa.Table(
    "tokens",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("id", sa.String(40), nullable=False, unique=True),
    sa.Column("name", sa.Text, nullable=False),
    sa.Column("scope", sa.String(8), nullable=False),
    sa.Column("digest", sa.String(64), nullable=False, unique=True),
    sa.Column("created_at", sa.BigInteger, nullable=False),
    # Revoked tokens stay listed, so a service that ever had a token never becomes open again.
    sa.Column("revoked_at", sa.BigInteger),
    # Name of the user whose token it is; NULL: nobody's.
    sa.Column("owner", sa.String(80)),
    # NULL: it never expires.
    sa.Column("expires_at", sa.BigInteger),
    # The last use, to the minute; NULL: never used.
    sa.Column("used_at", sa.BigInteger),
    sqlite_autoincrement=True,
)

SESSION_KEY = sa.Table(
    "session_key",
    METADATA,
    sa.Column("id", sa.Integer, primary_key=True, autoincrement=False),
    sa.Column("key", sa.String(64), nullable=False),
    sa.Column("created_at", sa.BigInteger, nullable=False),
)

ENDED_SESSIONS = sa.Table(
    "ended_sessions",
    METADATA,
    sa.Column("seal", sa.String(64), primary_key=True),
    # Seconds since 1970-01-01 UTC, as in the cookie; afterwards the row is useless.
    sa.Column("ends_at", sa.BigInteger, nullable=False),
)

#: One row for each change, written in the transaction of the change.
AUDIT_LOG = sa.Table(
    "audit_log",
    METADATA,
    sa.Column("number", sa.Integer, primary_key=True, autoincrement=True),
    sa.Column("at", sa.BigInteger, nullable=False, index=True),
    # By which way the change came (`sprag_study.service.actor`).
    sa.Column("door", sa.String(16), nullable=False),
    sa.Column("actor", sa.String(200), nullable=False, index=True),
    sa.Column("token", sa.String(40)),
    sa.Column("address", sa.String(200), nullable=False),
    sa.Column("request", sa.String(64)),
    sa.Column("action", sa.String(40), nullable=False),
    sa.Column("target", sa.String(200), nullable=False, index=True),
    # What else is to be known of it, as JSON data.
    sa.Column("detail", sa.Text, nullable=False),
    sqlite_autoincrement=True,
)
