"""A service whose clock is set by hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.http.app import chunking, create_app
from sprag_study.service.storage.store import Store
from tests.service.conftest import InThread, Service
from tests.worker.fakes import HandClock

if TYPE_CHECKING:
    import httpx

    from sprag_study.service.settings import Settings

NEW_YEAR = datetime(2026, 1, 1, tzinfo=UTC)  # where the clock of the tests begins: a Thursday


class Clock(HandClock):
    """A clock that is set by hand to a time of UTC."""

    def set(self, text: str) -> None:
        """Stand at that time."""
        self.seconds = (datetime.fromisoformat(text).replace(tzinfo=UTC) - NEW_YEAR).total_seconds()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def service(settings: Settings, clock: Clock, connect: Callable[..., httpx.Client]) -> Iterator[Service]:
    """A service by the clock of the test."""
    computer, checker = InThread(), InThread()
    with Store.open(settings.database_url, chunking=chunking(settings), clock=clock) as store:
        app = create_app(settings, store=store, computer=computer, checker=checker)
        yield Service(app, connect(app), store, computer, checker)
