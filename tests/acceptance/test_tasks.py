"""The page of tasks: every line of it is typed, from a spec to a service and its administration."""

from __future__ import annotations

import re
import runpy
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from benchmarks.faults.harness import until
from tests.acceptance.processes import SECONDS, service
from tests.conftest import ROOT

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.conftest import Finished

PAGE = (ROOT / "docs" / "tasks.md").read_text(encoding="utf-8")
HERE, SERVICE, ADMINISTRATION = re.split(r"^## .*\n", PAGE, flags=re.MULTILINE)[1:]
#: Lines that may end with another exit code than 0: the schedule of the page has not run yet, nor has a backup.
CODES = {"sprag schedule night": {0, 4}, "sprag admin doctor": {0, 3}}
#: Where the machine is slow to type the next line, its study is over.
TOO_LATE = {"sprag study cancel latest": "A study that is finished cannot take 'cancel'"}


def lines(part: str) -> Iterator[str]:
    """The lines of a part of the page that are typed into a shell."""
    for block in re.findall(r"^```sh\n(.*?)^```$", part, re.DOTALL | re.MULTILINE):
        yield from block.splitlines()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sprag: Callable[..., Finished]) -> Path:
    """A folder with the spec of the page, and a user who has not used the program before."""
    (block,) = re.findall(r"^```toml\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
    (tmp_path / "drive.toml").write_text(block)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    monkeypatch.setenv("SPRAG_DATABASE", str(tmp_path / "sprag.sqlite3"))
    for name in ("SPRAG_SERVER", "SPRAG_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def typed(line: str, sprag: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch) -> None:
    """Do what the shell would do with a line; commands of the program are executed in this process."""
    name, wrapped = re.fullmatch(r"export (\w+)=\$\((.*)\)", line), line
    if name is not None:
        wrapped = name[2]
    command, _, file = wrapped.partition(" > ")
    if not command.startswith("sprag "):
        subprocess.run(["sh", "-c", line], check=True, timeout=SECONDS)
        return
    done = sprag(*shlex.split(command)[1:])
    late = command in TOO_LATE and TOO_LATE[command] in done.err
    assert late or done.code in CODES.get(command, {0}), (line, done.err)
    if file:
        Path(file).write_text(done.out)
    if name is not None:
        monkeypatch.setenv(name[1], done.out.strip())


def test_every_task_has_its_number() -> None:
    assert re.findall(r"^\*\*(\d+)\. ", PAGE, re.MULTILINE) == [str(number) for number in range(1, 34)]


def test_studies_run_here(
    folder: Path, sprag: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for line in lines(HERE):
        typed(line, sprag, monkeypatch)
    assert (folder / "commas.csv").read_bytes().startswith(b"\xef\xbb\xbfcase;")
    for name in ("motion.png", "report.pdf", "rows.parquet", "rows.xlsx", "curves.png"):
        assert (folder / name).stat().st_size > 1000
    (script,) = re.findall(r"^```python\n(.*?)^```$", HERE, re.DOTALL | re.MULTILINE)
    (folder / "script.py").write_text(script)
    runpy.run_path("script.py", run_name="__main__")
    assert "shaft.speed.mean" in capsys.readouterr().out


def test_a_service_and_its_administration(
    folder: Path, sprag: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch
) -> None:
    with service(folder, "--processes", 1) as running:
        monkeypatch.setenv("SPRAG_SERVER", running.address)
        for line in (*lines(SERVICE), *lines(ADMINISTRATION)):
            typed(line, sprag, monkeypatch)
        assert "feeder, first" in sprag("list").out
        added = sprag("admin", "user", "add", "carla").err
        assert "`sprag admin token create --user carla --name PURPOSE` prints" in added
        monkeypatch.delenv("SPRAG_TOKEN")
        until(lambda: sprag("list").code, "the open service has read its first tokens, which takes up to two seconds")
        refused = sprag("list")
        assert (refused.code, "or keep it with `sprag login`" in refused.err) == (3, True)
