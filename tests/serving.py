"""A real server around an application of the test's own process."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import uvicorn

from sprag_study.service.http.timeouts import TimeoutProtocol


@contextmanager
def served(app: Any, port: int = 0) -> Iterator[str]:
    """The address of a server of ``app`` in a thread, which has ended when the block is left; by default any port."""
    config = uvicorn.Config(app, port=port, http=TimeoutProtocol, ws="none", log_config=None, server_header=False)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        assert thread.is_alive()
        time.sleep(0.01)
    try:
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join()
