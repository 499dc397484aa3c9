"""The demonstration, and every command of the README's walk, run as it stands there against a real service."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from tests.acceptance.processes import EXAMPLES, ROOT, SECONDS, Ended, environment, service, sprag

README = (ROOT / "README.md").read_text()
PRINTED = "http://127.0.0.1:8000"


def blocks() -> list[str]:
    """The shell commands of the page after the two that set everything up."""
    found = re.findall(r"^```sh\n(.*?)^```$", README, re.DOTALL | re.MULTILINE)
    assert found[0].split() == ["make", "demo", *found[0].split()[2:]]
    return found[1:]


def tools(folder: Path) -> str:
    """A PATH on which `.venv/bin/sprag` and curl are found."""
    binaries = folder / ".venv" / "bin"
    binaries.mkdir(parents=True)
    (binaries / "sprag").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sprag.service.cli "$@"\n')
    (binaries / "sprag").chmod(0o755)
    if shutil.which("curl") is None:
        stand_in = Path(__file__).with_name("curl.py")
        (binaries / "curl").write_text(f'#!/bin/sh\nexec "{sys.executable}" "{stand_in}" "$@"\n')
        (binaries / "curl").chmod(0o755)
    return f"{binaries}{os.pathsep}{os.environ['PATH']}"


@pytest.fixture(scope="module")
def demonstration(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Ended]:
    """What the demonstration left, and what it said."""
    folder = tmp_path_factory.mktemp("demonstration")
    return folder / "demo", sprag("demo", "--exit", cwd=folder)


def test_the_demonstration(demonstration: tuple[Path, Ended]) -> None:
    folder, done = demonstration
    assert done.code == 0, done.err
    text = done.out.decode()
    assert "Mechanical characteristic at excitation.frequency 25 Hz" in text
    assert "mean speed" in text
    assert max(map(len, text.splitlines())) <= 80
    assert "512 cases" in done.err
    assert (folder / "curve.png").read_bytes().startswith(b"\x89PNG")
    address = re.search(r"http://127\.0\.0\.1:\d+", done.err)
    assert address is not None
    with pytest.raises(httpx.ConnectError):
        httpx.get(address[0], timeout=SECONDS)


def test_every_command_of_the_readme_does_what_it_says(tmp_path: Path, demonstration: tuple[Path, Ended]) -> None:
    """The demonstration has run the example study already, and its rows are taken from its database."""
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    path = tools(tmp_path)
    script = "".join(blocks())
    assert PRINTED in script
    assert "$ .venv/bin/sprag serve\n" in README
    with service(demonstration[0]) as running:
        done = subprocess.run(
            ["/bin/sh", "-eu", "-c", script.replace(PRINTED, running.address)],
            cwd=tmp_path,
            env=environment(PATH=path, no_proxy="127.0.0.1"),
            capture_output=True,
            timeout=SECONDS,
            check=False,
        )
    out, err = done.stdout.decode(), done.stderr.decode()
    assert done.returncode == 0, err
    assert "Traceback" not in err
    # One request of the walk is wrong on purpose.
    assert out.count('"type":"/problems/') == 1
    assert out.count('"type":"/problems/invalid-spec"') == 1
    for expected in (
        '"state":',
        '"curves":',
        '"z":',
        '"case":178',
        '"variables":',
        '"degree":',
        '"estimated_seconds":',
    ):
        assert expected in out, expected
    assert "<svg" in (tmp_path / "curves.svg").read_text()
    assert len((tmp_path / "results.csv").read_text().splitlines()) == 1 + 512
    assert (tmp_path / "rows.csv").read_text() == (tmp_path / "results.csv").read_text()
    assert (tmp_path / "motion.csv").read_text().startswith("time,")
