"""The demonstration, and the commands of the first study and the README, run as they stand there on a real service."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest

from benchmarks.faults.harness import kill_family
from tests.acceptance.processes import EXAMPLES, INTERRUPTIBLE, ROOT, SECONDS, environment

README = (ROOT / "README.md").read_text()
FIRST_STUDY = (ROOT / "docs" / "first-study.md").read_text()
PRINTED = "http://127.0.0.1:8000"


def blocks() -> list[str]:
    """The shell commands of both pages after the two that set everything up."""
    walk, (setting_up, *others) = (
        re.findall(r"^```sh\n(.*?)^```$", page, re.DOTALL | re.MULTILINE) for page in (FIRST_STUDY, README)
    )
    assert setting_up.split() == ["make", "demo", *setting_up.split()[2:]]
    return [*walk, *others]


def tools(folder: Path) -> str:
    """A PATH on which `.venv/bin/sprag` and curl are found."""
    binaries = folder / ".venv" / "bin"
    binaries.mkdir(parents=True)
    (binaries / "sprag").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m sprag_study.service.cli "$@"\n')
    (binaries / "sprag").chmod(0o755)
    if shutil.which("curl") is None:
        stand_in = Path(__file__).with_name("curl.py")
        (binaries / "curl").write_text(f'#!/bin/sh\nexec "{sys.executable}" "{stand_in}" "$@"\n')
        (binaries / "curl").chmod(0o755)
    return f"{binaries}{os.pathsep}{os.environ['PATH']}"


@dataclass
class Demonstration:
    """A demonstration that goes on serving, in ``folder``; what it says is in two files there."""

    folder: Path
    process: subprocess.Popen[bytes]

    @property
    def said(self) -> str:
        """Its messages."""
        return (self.folder / "said").read_text(encoding="utf-8")

    @property
    def address(self) -> str:
        """Where it serves, once it has shown its study."""
        limit = time.monotonic() + SECONDS
        while not (found := re.search(r"^Open (http://127\.0\.0\.1:\d+)/studies/", self.said, re.MULTILINE)):
            assert self.process.poll() is None, self.said
            assert time.monotonic() < limit, self.said
            time.sleep(0.1)
        return found[1]


@pytest.fixture(scope="module")
def demonstration(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demonstration]:
    """One demonstration, whose service the commands ask."""
    folder = tmp_path_factory.mktemp("demonstration")
    with (folder / "shown").open("wb") as output, (folder / "said").open("wb") as errors:
        process = subprocess.Popen(
            [*INTERRUPTIBLE, "demo"],
            cwd=folder,
            stdout=output,
            stderr=errors,
            env=environment(SPRAG_PROCESSES="1"),
        )
    yield Demonstration(folder, process)
    kill_family(process)


def test_every_command_of_the_two_pages_does_what_it_says(tmp_path: Path, demonstration: Demonstration) -> None:
    """The demonstration has run the example study already, and its rows are taken from its database."""
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    path = tools(tmp_path)
    script = "".join(blocks())
    assert PRINTED in script
    for page in (FIRST_STUDY, README):
        assert "$ .venv/bin/sprag serve\n" in page
    done = subprocess.run(
        ["/bin/sh", "-eu", "-c", script.replace(PRINTED, demonstration.address)],
        cwd=tmp_path,
        env=environment(PATH=path, no_proxy="127.0.0.1", SPRAG_PROCESSES="1"),
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


def test_the_python_of_the_first_study_prints_its_curve(tmp_path: Path, demonstration: Demonstration) -> None:
    shutil.copytree(EXAMPLES, tmp_path / "examples")
    (program,) = re.findall(r"^```python\n(.*?)^```$", FIRST_STUDY, re.DOTALL | re.MULTILINE)
    done = subprocess.run(
        [sys.executable, "-c", program.replace(PRINTED, demonstration.address)],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=SECONDS,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    heading, *rows = done.stdout.splitlines()
    assert {"shaft.load", "shaft.speed.mean", "efficiency"} <= set(heading.split())
    assert len(rows) > 3


def test_the_demonstration_shows_its_curve_and_serves_until_it_is_interrupted(demonstration: Demonstration) -> None:
    address, folder = demonstration.address, demonstration.folder
    assert httpx.get(f"{address}/livez", timeout=SECONDS).status_code == 200
    demonstration.process.send_signal(signal.SIGINT)
    assert demonstration.process.wait(SECONDS) == 0, demonstration.said
    text = (folder / "shown").read_text(encoding="utf-8")
    assert "Mechanical characteristic at excitation.frequency 25 Hz" in text
    assert "mean speed" in text
    assert max(map(len, text.splitlines())) <= 80
    assert "512 cases" in demonstration.said
    assert "Traceback" not in demonstration.said
    assert (folder / "demo" / "curve.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(httpx.ConnectError):
        httpx.get(address, timeout=SECONDS)
