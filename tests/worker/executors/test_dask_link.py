"""The connection to a scheduler: what it says of itself."""

from __future__ import annotations

from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import RLock, Thread

import pytest

from sprag_study.worker.executors.dask_link import Link


@pytest.mark.parametrize("page", ["status", "health"])
def test_a_dashboard_is_named_where_there_is_one(tmp_path: Path, page: str) -> None:
    """Dask names a port also for a server of health and metrics alone."""
    (tmp_path / page).write_text("ok", encoding="utf-8")
    answer = partial(SimpleHTTPRequestHandler, directory=str(tmp_path))
    with ThreadingHTTPServer(("127.0.0.1", 0), answer) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        link = Link("tcp://127.0.0.1:8786", None, "test", RLock())
        link._find_dashboard(server.server_port)
        expected = f"http://127.0.0.1:{server.server_port}/status" if page == "status" else ""
        assert link.dashboard == expected
        server.shutdown()
    link._find_dashboard(None)
    assert link.dashboard == ""
