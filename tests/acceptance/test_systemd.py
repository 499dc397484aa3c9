"""The unit for systemd: what it keeps from the service, judged by systemd's own tool."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.conftest import ROOT

UNIT = ROOT / "examples" / "sprag.service"
#: The exposure that is allowed, from 0 (none) to 10.
MOST_EXPOSURE = 3.0


@pytest.fixture(scope="module")
def analyze() -> str:
    """systemd's tool for units; its absence is a failure in the gate."""
    found = shutil.which("systemd-analyze")
    if found is None:
        reason = "needs systemd-analyze, of the package systemd"
        assert "CI" not in os.environ, reason
        pytest.skip(reason)
    return found


def run(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_the_service_is_hardly_exposed(analyze: str) -> None:
    told = run(analyze, "security", "--offline=true", "--no-pager", str(UNIT))
    exposure = re.search(r"Overall exposure level for sprag\.service: ([0-9.]+)", told)
    assert exposure is not None, told
    assert float(exposure[1]) < MOST_EXPOSURE


@pytest.mark.parametrize("optional", [False, True], ids=["as it is", "with what it offers"])
def test_systemd_understands_every_line(analyze: str, tmp_path: Path, optional: bool) -> None:
    unit = tmp_path / UNIT.name
    text, count = re.subn(r"^ExecStart=.*$", "ExecStart=/bin/true", UNIT.read_text(), flags=re.MULTILINE)
    assert count == 1
    if optional:
        text, offered = re.subn(r"^#(\w+=)", r"\1", text, flags=re.MULTILINE)
        names = dict.fromkeys(re.findall(r"^#(\w+)=", UNIT.read_text(), re.MULTILINE))
        assert (offered, list(names)) == (6, ["LoadCredential", "Environment", "ReadWritePaths"])
    unit.write_text(text)
    # Besides what is wrong in a unit, it tells of every other unit of the machine.
    assert UNIT.name not in run(analyze, "verify", "--man=no", str(unit))


def test_the_unit_needs_no_file_of_settings() -> None:
    """A file that is not there ends neither the unit (the sign `-`) nor the program (no SPRAG_SETTINGS)."""
    text = UNIT.read_text()
    files = re.findall(r"^EnvironmentFile=(.*)$", text, re.MULTILINE)
    assert files
    assert all(file.startswith("-/") for file in files)
    assert "SPRAG_SETTINGS" not in re.findall(r"^Environment=(\w+)=", text, re.MULTILINE)
    assert re.search(r"^(UMask=0077|MemoryMax=.+)$", text, re.MULTILINE)
