"""What people change on the page Me: administrators every user and token, others their own tokens."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from typing import TYPE_CHECKING, Final

from sprag_study.service.actor import Role
from sprag_study.service.faults import choice_of, parameter_error
from sprag_study.service.http.current import current
from sprag_study.service.languages import N_
from sprag_study.service.reading.numbers import whole_number
from sprag_study.service.storage.errors import UserExistsError
from sprag_study.service.storage.people.people import Quota
from sprag_study.service.storage.people.scopes import TokenScope, TokenState, token_name, user_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.service.http.context import Context
    from sprag_study.service.storage.people.people import TokenRecord, UserRecord

#: For how long a renewed token still lets in, so that programs can be given the new one.
GRACE: Final = timedelta(days=1)
#: Longest life of a token that has an end, in days.
_MOST_DAYS: Final = 36_500
_MIB: Final = 2**20
#: The numbers of a quota in a form, and what each is below.
_QUOTAS: Final = {"cases": 2**63, "storage": 2**43, "checks": 65}
#: Their names in a quota.
_OWN: Final = {"cases": "cases", "storage": "bytes", "checks": "checks"}


def administers() -> bool:
    """Whether the reader is an administrator."""
    grant = current().grant
    return grant is not None and grant.role is Role.ADMINISTRATOR


def own_name() -> str | None:
    """The user who reads; None where no user is known."""
    grant = current().grant
    return None if grant is None else grant.user


def listed_tokens(
    context: Context, owner: str | None = None, users: Sequence[UserRecord] | None = None
) -> list[tuple[TokenRecord, TokenState]]:
    """Every token, or those of one user, with its state; ``users`` where they are read already."""
    people = context.store.people
    now, known = context.store.clock.now(), {user.name: user for user in users or people.users()}
    return [
        (token, token.state_at(now, known.get(token.owner or "")))
        for token in people.tokens()
        if owner is None or token.owner == owner
    ]


def token_to_revoke(context: Context, token_id: str) -> tuple[TokenRecord, TokenState] | None:
    """A token that the reader may revoke, with its state; None where there is none."""
    every = administers()
    owner = own_name()
    listed = listed_tokens(context, None if every else owner) if every or owner else []
    return next(((token, state) for token, state in listed if token.id == token_id), None)


def change_user(context: Context, values: Mapping[str, str], *, first: bool) -> tuple[str, TokenRecord] | None:
    """Do what a form of a user asks for; raises FaultError and StoreError.

    ``first``: requests need no token yet, and will from the first user on. So this is an administrator, who gets a
    token at once: its secret and record.
    """
    people, name = context.store.people, values.get("name", "").strip()
    do = choice_of("do", values.get("do", ""), ("add", "change", "remove", "restore", "hand-over"))
    if do == "hand-over":
        people.hand_over(name, values.get("to", ""))
        return None
    if do in ("remove", "restore"):
        people.change_user(name, removed=do == "remove")
        return None
    role = Role(choice_of("role", values.get("role", ""), list(Role)))
    cases, storage, checks = (_count(values, field, below) for field, below in _QUOTAS.items())
    quota = Quota(cases, None if storage is None else storage * _MIB, checks)
    if do == "change":
        known = next((user for user in people.users() if user.name == name), None)
        if known is not None and known.removed_at is not None:
            raise parameter_error("name", "conflict", N_("is removed: restore this user first"), name)
        as_set = [own for field, own in _OWN.items() if values.get(f"{field} as set")]
        if known is not None:  # the form repeats the present numbers, in MiB
            kept = {
                own: None
                for own in as_set
                if _shown(getattr(quota, own), own) == _shown(getattr(known.quota, own), own)
            }
            quota = replace(quota, **kept)
        people.change_user(name, role, quota, as_set=as_set)
        return None
    if first and role is not Role.ADMINISTRATOR:
        raise parameter_error("role", "conflict", N_("of the first user must be administrator"), role)
    try:
        people.add_user(user_name(name), role, quota)
    except UserExistsError as error:
        raise parameter_error(
            "name", "conflict", N_("is a user already, or was one who can be restored"), name
        ) from error
    return people.create_token(name, TokenScope.WRITE, owner=name) if first else None


def change_token(
    context: Context, values: Mapping[str, str], *, every: bool, first: bool = False
) -> tuple[str, TokenRecord] | None:
    """Do what a form of a token asks for, of ``every`` user or of the reader: secret and record of a new token.

    ``first`` is that of `change_user`. Raises FaultError and StoreError.
    """
    people, user = context.store.people, own_name()
    do = choice_of("do", values.get("do", ""), ("create", "renew", "revoke"))
    if first:
        raise parameter_error("user", "required", N_("is missing: add an administrator first, who gets a token"))
    if do == "create":
        owner = (values.get("user") or None) if every else user
        if owner is None and not every:
            raise parameter_error("user", "required", N_("is missing: your token belongs to no user"))
        days = _count(values, "days", _MOST_DAYS + 1, least=1)
        ends = context.store.clock.now() + timedelta(days=days) if days else None
        scope = TokenScope(choice_of("scope", values.get("scope", ""), list(TokenScope)))
        return people.create_token(token_name(values.get("name", "").strip()), scope, owner=owner, expires_at=ends)
    token_id = values.get("id", "")
    if not every and (user is None or token_id not in {token.id for token, _state in listed_tokens(context, user)}):
        raise parameter_error("id", "unknown-value", N_("is not a token of yours"), token_id)
    if do == "renew":
        return people.renew_token(token_id, GRACE)
    people.revoke_token(token_id)
    return None


def _shown(number: int | None, own: str) -> int | None:
    """A number of a quota as the form has it."""
    return number // _MIB if number is not None and own == "bytes" else number


def _count(values: Mapping[str, str], field: str, below: int, least: int = 0) -> int | None:
    """A whole number of a form; None where the field is empty."""
    text = values.get(field, "").strip()
    number = whole_number(text, below)
    if text and (number is None or number < least):
        raise parameter_error(field, "out-of-range", N_("must be a whole number"), text, f"{least} … {below - 1}")
    return number
