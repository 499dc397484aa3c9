"""Certificates for the processes of a cluster, made by the commands of docs/deployment.md."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conftest import ROOT

SECTION = (ROOT / "docs" / "deployment.md").read_text(encoding="utf-8").split("## A Dask cluster")[1]
CERTIFICATES, SETTINGS = re.findall(r"```sh\n(.*?)```", SECTION, re.DOTALL)[:2]


def require_openssl() -> None:
    """Skip a test that needs certificates where nothing makes them; CI has what it takes."""
    if shutil.which("openssl") is None:
        assert "CI" not in os.environ, "CI installs openssl"
        pytest.skip("there is no command openssl to make certificates with")


def tls_environment(folder: Path) -> dict[str, str]:
    """Certificates in ``folder``, and the variables by which Dask's processes find them."""
    require_openssl()
    _shell(CERTIFICATES.replace("/etc/sprag", str(folder)), folder)
    shown = _shell(f"{SETTINGS.replace('/etc/sprag', str(folder))}\nenv -0", folder)
    found = dict(line.split("=", 1) for line in shown.split("\0") if line.startswith("DASK_DISTRIBUTED__COMM__"))
    assert len(found) == 8
    return found


def _shell(command: str, folder: Path) -> str:
    return subprocess.run(["bash", "-ec", command], cwd=folder, check=True, capture_output=True, text=True).stdout
