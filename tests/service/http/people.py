"""A service with users of every role, for tests of what each may do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag_study.service.actor import Door, Role, act_as, of_machine
from sprag_study.service.http.app import create_app
from sprag_study.service.storage.people.scopes import TokenScope

if TYPE_CHECKING:
    from collections.abc import Callable

    import httpx
    from fastapi import FastAPI

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

#: Users by role.
NAMES: Final = {Role.VIEWER: "vera", Role.DESIGNER: "dora", Role.ADMINISTRATOR: "ada"}
OWN: Final = {"Sec-Fetch-Site": "same-origin"}


class Office:
    """The service, its users and their tokens."""

    def __init__(
        self, settings: Settings, service: Service, connect: Callable[..., httpx.Client], **more: object
    ) -> None:
        self.store = service.store
        self.tokens: dict[str, str] = {}
        self.ids: dict[str, str] = {}
        with act_as(of_machine(Door.COMMAND)):
            for role, name in NAMES.items():
                self.store.people.add_user(name, role)
                self.add_token(name)
        self.app: FastAPI = create_app(
            settings.model_copy(update=more), store=service.store, computer=service.computer, checker=service.checker
        )
        self._connect = connect

    def add_token(self, name: str) -> None:
        """Give a user a token."""
        self.tokens[name], record = self.store.people.create_token(f"of {name}", TokenScope.WRITE, owner=name)
        self.ids[name] = record.id

    def program(self, name: str | None) -> httpx.Client:
        """A client with the token of a user, or with none."""
        headers = {} if name is None else {"Authorization": f"Bearer {self.tokens[name]}"}
        return self._connect(self.app, headers=headers)

    def behind_proxy(self, **headers: str | bytes) -> httpx.Client:
        """A client of the proxy at 127.0.0.1."""
        return self._connect(self.app, headers=headers)
