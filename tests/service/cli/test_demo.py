"""How the demonstration ends; tests/acceptance/test_readme.py runs the whole of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.cli import demo
from tests.conftest import Finished


class Process:
    """A service that serves until somebody waits for it."""

    waited = 0

    def wait(self) -> int:
        self.waited += 1
        return 0


@pytest.fixture
def process(monkeypatch: pytest.MonkeyPatch) -> Process:
    """The service of a demonstration that shows nothing."""
    started = Process()

    @contextmanager
    def service(_database: Path) -> Iterator[tuple[str, Process]]:
        yield "http://127.0.0.1:1", started

    monkeypatch.setattr(demo, "_service", service)
    monkeypatch.setattr(demo, "served_by", lambda *_: nullcontext())
    return started


@pytest.mark.parametrize(("ok", "code"), [(512, 0), (511, 4)])
def test_it_serves_on_unless_it_is_told_to_stop(
    process: Process,
    ok: int,
    code: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    sprag: Callable[..., Finished],
) -> None:
    shown: dict[str, Any] = {"progress": {"ok": ok, "total": 512}, "links": {"page": "/studies/st_1"}}
    monkeypatch.setattr(demo, "_show", lambda *_: shown)
    assert sprag("demo", "--dir", tmp_path / "demo", "--exit").code == code
    assert process.waited == 0
    served = sprag("demo", "--dir", tmp_path / "demo")
    assert served.code == code
    assert served.err == "Open http://127.0.0.1:1/studies/st_1 (Ctrl-C ends the service).\n"
    assert process.waited == 1
