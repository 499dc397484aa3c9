"""The folder of compiled kernels is used where nobody else can change what is in it, as that is executed."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from sprag_study.engine.compile import cache

#: Another user than this one and root.
OTHER = 12_345


@pytest.fixture
def chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of the setting; temporary files lie beside it."""
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("SPRAG_KERNEL_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    cache.cache_folder.cache_clear()
    yield tmp_path / "cache"
    cache.cache_folder.cache_clear()


def folder() -> Path:
    """The folder that a new process uses."""
    cache.cache_folder.cache_clear()
    return cache.cache_folder()


def test_it_is_created_for_this_user_alone(chosen: Path) -> None:
    before = os.umask(0)
    try:
        assert folder().is_relative_to(chosen)
    finally:
        os.umask(before)
    assert [place.stat().st_mode & 0o777 for place in (chosen, chosen / "kernels", folder())] == [0o700] * 3
    assert cache.is_wanted(folder())


def writable_by_others(place: Path) -> None:
    place.chmod(0o777)


def writable_by_a_group(place: Path) -> None:
    os.chown(place, -1, OTHER)
    place.chmod(0o775)


def of_another_user(place: Path) -> None:
    os.chown(place, OTHER, -1)


def link_of_another_user(place: Path) -> None:
    elsewhere = place.with_name(f"{place.name}-elsewhere")
    place.rename(elsewhere)
    place.symlink_to(elsewhere)
    os.chown(place, OTHER, -1, follow_symlinks=False)


def link_to_what_others_change(place: Path) -> None:
    elsewhere = place.parent / "shared" / place.name
    elsewhere.parent.mkdir()
    place.rename(elsewhere)
    place.symlink_to(elsewhere)
    elsewhere.parent.chmod(0o777)


@pytest.mark.parametrize("where", ["the folder", "a file", "a folder in it", "above", "far above"])
@pytest.mark.parametrize(
    "change",
    [writable_by_others, writable_by_a_group, of_another_user, link_of_another_user, link_to_what_others_change],
)
def test_what_others_could_have_changed_is_left_alone(chosen: Path, change: Callable[[Path], None], where: str) -> None:
    if os.geteuid() and change is not writable_by_others:
        pytest.skip("only root gives files away")
    inside = folder()
    (inside / "engine").mkdir()
    (inside / "kernel.py").write_text("raise SystemExit")
    place = {
        "the folder": inside, "a file": inside / "kernel.py", "a folder in it": inside / "engine",
        "above": inside.parent, "far above": chosen,
    }[where]  # fmt: skip
    change(place)
    used = folder()
    assert not used.is_relative_to(chosen)
    assert list(used.iterdir()) == []
    assert not cache.is_wanted(used)
    assert folder() == used, "every process has the substitute"


def test_the_substitute_is_looked_at_too(chosen: Path) -> None:
    chosen.mkdir(mode=0o777)
    chosen.chmod(0o777)
    substitute = folder()
    (substitute / "kernel.py").touch()
    (substitute / "kernel.py").chmod(0o666)
    assert folder() != substitute


def test_a_common_folder_is_allowed_where_each_user_s_files_are_safe(chosen: Path) -> None:
    chosen.parent.chmod(0o1777)
    assert folder().is_relative_to(chosen)
    (folder() / "kernel.py").touch()
    before = os.umask(0o022)
    try:
        (folder() / "kernel.nbi").touch()
    finally:
        os.umask(before)
    assert folder().is_relative_to(chosen)
