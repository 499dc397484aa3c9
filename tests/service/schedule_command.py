"""``sprag schedule`` against a service in the same process."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from sprag_study.service import client
from sprag_study.service.cli.app import execute

if TYPE_CHECKING:
    import pytest

    from tests.service.conftest import Service

Run = Callable[..., tuple[int, str, str]]


def runner(service: Service, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs a command; exit code, standard output, standard error."""

    class Connected(client.Client):
        def __init__(self, server: str, token: str | None = None) -> None:
            super().__init__(server, token)
            self._http.close()
            self._http = service.http

        def __exit__(self, *_: object) -> None:
            """The test goes on with it."""

    monkeypatch.setattr(client, "Client", Connected)

    def execute_and_read(*arguments: str) -> tuple[int, str, str]:
        code = execute(["schedule", *arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return execute_and_read
