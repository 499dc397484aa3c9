"""Files and folders of killed processes: removed by the next one, those in use left alone."""

from __future__ import annotations

import os
import tempfile
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.cli.files import output
from sprag_study.service.jobs.local import run_here
from sprag_study.service.stale_files import YOUNG_SECONDS, mark, sweep
from sprag_study.worker.executors.inline import InlineExecutor
from tests.worker import fakes

if TYPE_CHECKING:
    from pathlib import Path


def age(path: Path, seconds: float = 2.0 * YOUNG_SECONDS) -> Path:
    """Make a file or folder look so old."""
    then = path.stat().st_mtime - seconds
    os.utime(path, (then, then))
    return path


def test_a_run_removes_the_folders_of_killed_runs_and_is_left_alone_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    left, young, other = tmp_path / "sprag-run-a", tmp_path / "sprag-run-b", tmp_path / "else"
    for folder in (left, young, other):
        folder.mkdir()
        (folder / "run.sqlite3").touch()
    age(left)
    age(other)
    with run_here({}, fakes.study(4), processes=0, executor=InlineExecutor(fakes.run)) as run:
        own = age(run.store.session.path.parent)
        sweep(tmp_path.glob("sprag-run-*"))
        assert own.exists()
    assert sorted(tmp_path.iterdir()) == [other, young]


def test_an_output_removes_the_parts_of_killed_ones(tmp_path: Path) -> None:
    target = tmp_path / "rows[1].csv"
    left = age(_touch(tmp_path / ".rows[1].csv.x.part"))
    kept = [age(_touch(tmp_path / name)) for name in (".rows1.csv.x.part", ".rows[1].csv.x", "rows[1].csv.part")]
    young = _touch(tmp_path / ".rows[1].csv.young.part")
    used = age(_touch(tmp_path / ".rows[1].csv.used.part"))
    link = tmp_path / ".rows[1].csv.link.part"
    link.symlink_to(kept[0])
    with used.open("rb") as file:
        mark(file.fileno())
        with output(str(target)) as write:
            for part in tmp_path.glob(".*.part"):
                if part not in (young, link):
                    age(part)
            with output(str(target)) as other:
                other(b"other")
            write(b"rows")
    assert target.read_bytes() == b"rows"
    assert not left.exists()
    assert {*tmp_path.iterdir()} == {target, young, used, link, *kept}


def _touch(path: Path) -> Path:
    path.touch()
    return path
