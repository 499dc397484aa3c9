"""One service for the tests of several files that ask it things and do nothing to it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.acceptance.processes import Service, service


@pytest.fixture(scope="session")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A running service with one process for cases; other tests submit studies to it too."""
    with service(tmp_path_factory.mktemp("served"), "--processes", 1) as started:
        yield started
