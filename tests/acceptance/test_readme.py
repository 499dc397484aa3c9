"""Every command of the README's walk, run as it stands there against a real service."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from tests.acceptance.processes import EXAMPLES, ROOT, SECONDS, environment, service

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


def test_every_command_of_the_readme_does_what_it_says(tmp_path: Path) -> None:
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    path = tools(tmp_path)
    script = "".join(blocks())
    assert PRINTED in script
    assert "$ .venv/bin/sprag serve\n" in README
    with service(tmp_path) as running:
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
