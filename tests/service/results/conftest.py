"""What tests of settled studies share: such a study, and commands that talk to the service of the test."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.client import Client
from tests.service.conftest import PortalTransport, Service
from tests.service.results.settled import settled

Linked = Callable[[str], None]


@pytest.fixture
def linked(service: Service, portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch) -> Linked:
    """Lets the commands of a module of `sprag_study.service.cli` talk to the service of the test."""

    def connected(*_: object) -> Client:
        return Client("http://localhost", transport=PortalTransport(service.app, portal))

    def link(module: str) -> None:
        monkeypatch.setattr(f"sprag_study.service.cli.{module}.connection", connected)

    return link


@pytest.fixture
def study_id(service: Service) -> str:
    """A settled study whose rows are there."""
    return settled(service)
