"""Who acts: the user, token, command or schedule for which the running code changes something, and from where.

Each way in (`Door`) names its actor; the store writes the name into the audit log in the transaction of the change,
makes the user the owner of what is new, and refuses to change what belongs to somebody else.
"""

from __future__ import annotations

import getpass
import os
import socket
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator


class Door(StrEnum):
    """The ways by which a change comes."""

    API = "api"
    PAGE = "page"
    COMMAND = "command"
    PROGRAM = "program"
    SCHEDULE = "schedule"
    SERVICE = "service"


#: The ways in through a running service, which reads users and tokens anew every two seconds only.
SERVED: Final = frozenset({Door.API, Door.PAGE})


class Role(StrEnum):
    """Role of a user: each allows what the ones before it allow."""

    VIEWER = "viewer"
    DESIGNER = "designer"
    ADMINISTRATOR = "administrator"

    def allows(self, needed: Role) -> bool:
        """Whether this role allows what ``needed`` does."""
        order = list(Role)
        return order.index(self) >= order.index(needed)


@dataclass(frozen=True, slots=True)
class Actor:
    """Who acts.

    Attributes
    ----------
    door : Door
    name : str
        Name of the user, otherwise of the token, the schedule or the user of the machine; "" where nobody logs in.
    address : str
        Of the client; of a command the name of the machine.
    user : str, optional
        The user to whom new studies and schedules belong; None: to nobody.
    everything : bool
        Whether studies and schedules of others may be changed.
    token, request : str, optional
        Ids of the token and of the request.
    """

    door: Door
    name: str
    address: str
    user: str | None = None
    everything: bool = True
    token: str | None = None
    request: str | None = None

    @property
    def share(self) -> str:
        """Whose requests these are: see `share_of`."""
        return share_of(self.user, self.token)


def share_of(user: str | None, token: str | None) -> str:
    """Who sends requests, with whatever token: a user, or a token without a user by its id; "" where nobody logs in.

    What each sender has a share or a name space of its own of is counted under this name.
    """
    return token or "" if user is None else f"user {user}"


_ACTING: ContextVar[Actor | None] = ContextVar("acting", default=None)


def acting() -> Actor:
    """The present actor; by default the program of the machine's user."""
    return _ACTING.get() or of_machine(Door.PROGRAM)


@contextmanager
def act_as(actor: Actor) -> Iterator[None]:
    """Make ``actor`` the current actor within the block."""
    token = _ACTING.set(actor)
    try:
        yield
    finally:
        _ACTING.reset(token)


def of_machine(door: Door) -> Actor:
    """The user of the operating system at this machine."""
    try:
        name = getpass.getuser()
    except (OSError, KeyError):  # a user without a name, as in some containers
        name = f"user {os.getuid()}" if hasattr(os, "getuid") else "unknown"
    return Actor(door, name, socket.gethostname())
