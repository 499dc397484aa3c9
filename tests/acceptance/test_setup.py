"""What a fresh machine is set up from."""

from __future__ import annotations

import os
import re
import subprocess
import tomllib

from tests.acceptance.processes import ROOT

CONSTRAINTS = (ROOT / "constraints.txt").read_text()


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def test_constraints_are_names_and_exact_versions_only() -> None:
    lines = [line for line in CONSTRAINTS.splitlines() if not line.startswith("#")]
    assert lines
    for line in lines:
        assert re.fullmatch(r"[A-Za-z0-9._-]+==[0-9][A-Za-z0-9.+!]*", line), line


def test_every_library_the_project_names_is_constrained() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    named = [*project["dependencies"], *extras["dev"], *extras["benchmark"], "cloudpickle"]  # the last is heyoka's
    constrained = {normal(line.split("==")[0]) for line in CONSTRAINTS.splitlines() if "==" in line}
    for requirement in named:
        found = re.match(r"[A-Za-z0-9._-]+", requirement)
        assert found
        assert normal(found[0]) in constrained, requirement


def test_the_gate_is_the_test_command_of_the_readme() -> None:
    gate = ROOT / ".ci" / "run"
    assert os.access(gate, os.X_OK)
    assert gate.read_text().rstrip().endswith("make test")
    assert subprocess.run(["bash", "-n", gate], check=False).returncode == 0
    assert "make test" in (ROOT / "README.md").read_text()
