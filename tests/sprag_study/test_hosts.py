"""Which hosts are this machine."""

from __future__ import annotations

import pytest

from sprag_study.hosts import is_loopback


@pytest.mark.parametrize(
    ("host", "here"),
    [
        ("localhost", True), ("127.0.0.1", True), ("127.9.9.9", True), ("::1", True), ("[::1]", True),
        ("10.0.0.1", False), ("0.0.0.0", False), ("[::]", False), ("localhost.example", False), ("", False),
    ],
)  # fmt: skip
def test_only_this_machine_is_a_loopback(host: str, here: bool) -> None:
    assert is_loopback(host) is here
