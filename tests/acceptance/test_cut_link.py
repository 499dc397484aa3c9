"""Hosts whose links are cut: network namespaces, where this machine lets us make them."""

import os
import shutil
from pathlib import Path

import pytest

from benchmarks.faults.hosts import hosts
from benchmarks.faults.link import link


def test_cut_links_and_a_lost_host_lose_nothing(tmp_path: Path) -> None:
    try:
        with hosts("one"):
            pass
    except PermissionError as reason:
        pytest.skip(f"network namespaces cannot be made here: {reason}")
    if shutil.which("openssl") is None:
        assert "CI" not in os.environ, "CI installs openssl"
        pytest.skip("there is no command openssl to make certificates with")
    figures = link(tmp_path, cases=600, periods=100.0)
    assert figures["cuts"] == {"computing host": 1, "dispatcher": 1, "computing host, for good": 1}
