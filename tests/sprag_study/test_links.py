"""A checkout without symbolic links, as git makes it on some machines: its links are text files."""

from __future__ import annotations

import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

from tests.conftest import ROOT

if TYPE_CHECKING:
    from pathlib import Path


def test_a_checkout_without_links_says_so(tmp_path: Path) -> None:
    package = tmp_path / "sprag_study"
    package.mkdir()
    for source in (ROOT / "sprag_study").iterdir():
        if source.is_symlink():
            (package / source.name).write_text(str(source.readlink()), encoding="utf-8")
        elif source.suffix == ".py":
            shutil.copy(source, package)
    command = [sys.executable, "-S", "-c", "import sprag_study.engine"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1].startswith(f"ImportError: {package / 'engine'} is a text file")
    assert "core.symlinks" in ended.stderr
