"""One service for the tests of several files that ask it things and do nothing to it."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import pytest

from tests import otlp
from tests.acceptance.processes import Service, service
from tests.service.schedules.receivers import Hook, MailBox, mail_server, webhook


@dataclass(frozen=True)
class Office:
    """Where the service sends mails, webhooks and traces, and the key by which it signs its webhooks."""

    mails: MailBox
    hook: Hook
    traces: otlp.Receiver
    key: bytes = bytes(range(32))

    @property
    def settings(self) -> dict[str, str]:
        """The environment of the service."""
        return {
            "SPRAG_SMTP_URL": f"smtp+plain://localhost:{self.mails.port}",
            "SPRAG_MAIL_FROM": "sprag@example.com",
            "SPRAG_WEBHOOK_ORIGINS": self.hook.address,
            "SPRAG_WEBHOOK_SECRET": f"whsec_{base64.b64encode(self.key).decode()}",
            "SPRAG_PUBLIC_URL": "https://sprag.example",
            **self.traces.environment,
        }


_SHARED = pytest.StashKey[tuple[ExitStack, Office, Service]]()
_FIXTURES = {"office", "running"}


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    """End the service before a file that needs none: it looks for work and files as long as it runs."""
    try:
        return (yield)
    finally:
        goes_on = nextitem is not None and (nextitem.path == item.path or _FIXTURES & set(nextitem.fixturenames))
        if not goes_on and _SHARED in item.config.stash:
            item.config.stash[_SHARED][0].close()
            del item.config.stash[_SHARED]


@pytest.fixture(scope="module")
def _shared(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> tuple[Office, Service]:
    stash = request.config.stash
    if _SHARED not in stash:
        stack = ExitStack()
        request.config.add_cleanup(stack.close)
        office = Office(
            stack.enter_context(mail_server()), stack.enter_context(webhook()), stack.enter_context(otlp.receiver())
        )
        folder = tmp_path_factory.mktemp("served")
        options = {"SPRAG_CHUNK_CASES": "7", **office.settings}
        stash[_SHARED] = stack, office, stack.enter_context(service(folder, "--processes", 1, **options))
    return stash[_SHARED][1:]


@pytest.fixture(scope="module")
def office(_shared: tuple[Office, Service]) -> Office:
    """Receivers for what `running` sends."""
    return _shared[0]


@pytest.fixture(scope="module")
def running(_shared: tuple[Office, Service]) -> Service:
    """A running service with one process for cases, which the files share that need it and follow each other.

    Other tests submit studies to it too. Its chunks are short.
    """
    return _shared[1]
