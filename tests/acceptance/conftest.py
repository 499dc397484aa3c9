"""One service for the tests of several files that ask it things and do nothing to it."""

from __future__ import annotations

import base64
from collections.abc import Iterator
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


@pytest.fixture(scope="session")
def office() -> Iterator[Office]:
    """Receivers for what `running` sends."""
    with mail_server() as mails, webhook() as hook, otlp.receiver() as traces:
        yield Office(mails, hook, traces)


@pytest.fixture(scope="session")
def running(tmp_path_factory: pytest.TempPathFactory, office: Office) -> Iterator[Service]:
    """A running service with one process for cases; other tests submit studies to it too. Its chunks are short."""
    folder = tmp_path_factory.mktemp("served")
    with service(folder, "--processes", 1, SPRAG_CHUNK_CASES="7", **office.settings) as started:
        yield started
