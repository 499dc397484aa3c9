"""Answers about users and the audit log."""

from __future__ import annotations

from typing import Annotated, Any

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Moment


class QuotaUse(TypedDict):
    """Quotas of a user and what is used of them; a limit that is null does not exist."""

    cases: Annotated[int, Doc("cases that wait")]
    most_cases: int | None
    bytes: Annotated[int, Doc("rough size of the results")]
    most_bytes: int | None
    most_checks: Annotated[int | None, Doc("checks of specs, fits and pictures at the same time")]


class Me(TypedDict):
    """Who asks."""

    user: Annotated[str | None, Doc("name of the user; null for a token without a user, or where no login is needed")]
    token: Annotated[str | None, Doc("name of the token, its id where it has no name; null without a token")]
    scope: Annotated[str | None, Doc("of the token: read or write; null without a token")]
    role: Annotated[str, Doc("viewer, designer or administrator; viewer for every read-only token")]
    quota: Annotated[QuotaUse | None, Doc("null where there is no user")]


class User(TypedDict):
    """A user."""

    name: str
    role: Annotated[str, Doc("viewer, designer or administrator")]
    created_at: Moment
    removed_at: Annotated[Moment | None, Doc("since then the user may not use the service")]
    most_cases: Annotated[int | None, Doc("the user's own limit; 0: no limit; null: as the settings have it")]
    most_bytes: Annotated[int | None, Doc("the user's own limit, as most_cases")]
    most_checks: Annotated[int | None, Doc("the user's own limit, as most_cases")]
    quota: QuotaUse


class UserList(TypedDict):
    """All users, by name."""

    users: list[User]


class Token(TypedDict):
    """A token, without its secret."""

    id: str
    name: str
    user: Annotated[str | None, Doc("whose it is; null: nobody's")]
    scope: Annotated[str, Doc("read or write")]
    state: Annotated[str, Doc("valid, expired, revoked, or user-removed")]
    created_at: Moment
    expires_at: Moment | None
    used_at: Annotated[Moment | None, Doc("of its last use, to the minute")]
    revoked_at: Annotated[Moment | None, Doc("of a renewed one the time until which it is valid")]


class TokenList(TypedDict):
    """All tokens, newest first."""

    tokens: list[Token]


class CreatedToken(Token):
    """A new token."""

    token: Annotated[str, Doc("its secret, which is shown only here")]


class HandedOver(TypedDict):
    """What belongs to another user now."""

    studies: int
    schedules: int


class AuditEntry(TypedDict):
    """A change: who, what, when, from where."""

    number: int
    at: Moment
    door: Annotated[str, Doc("by which way it came: api, page, command, program, schedule, service")]
    actor: Annotated[str, Doc("user, token, schedule or user of the machine; empty where no login is needed")]
    token: Annotated[str | None, Doc("id of the token")]
    address: Annotated[str, Doc("address of the client; of a command the name of its machine")]
    request: Annotated[str | None, Doc("id of the request, as in the log")]
    action: Annotated[str, Doc("what was done, such as study.create")]
    target: Annotated[
        str,
        Doc(
            "id of the study, schedule, component, view or token, or name of the user, the machine or the backup; "
            "empty for the database and the log"
        ),
    ]
    detail: Annotated[dict[str, Any], Doc("further details, by action")]


class AuditPage(TypedDict):
    """A page of the audit log, latest first."""

    entries: list[AuditEntry]
    next_page_token: Annotated[str | None, Doc("null on the last page")]
