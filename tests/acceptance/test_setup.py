"""What a fresh machine is set up from."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions

from packaging.requirements import Requirement

from tests.acceptance.processes import ROOT

PACKAGES = ("sprag_study", "engine", "worker", "service", "migrations")  # folders; all are parts of sprag_study
#: Extras of the program itself, beside its dependencies.
RUNTIME = ("tables", "frames", "server", "report", "postgres", "cluster", "oidc", "traces")
#: A line that imports a module, of which ruff allows one a line. Parsing all modules takes ten times as long.
IMPORT = re.compile(r"^[ \t]*(?:import (\w+)[\w.]*(?: as \w+)?[ \t]*(?:#.*)?$|from (\w+)[\w.]* import )", re.MULTILINE)
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
    named = [*project["dependencies"], *(name for extra in extras.values() for name in extra)]
    named = [name for name in named if not name.startswith("sprag-study[")] + ["cloudpickle"]  # the last is heyoka's
    constrained = {normal(line.split("==")[0]) for line in CONSTRAINTS.splitlines() if "==" in line}
    for requirement in named:
        found = re.match(r"[A-Za-z0-9._-]+", requirement)
        assert found
        assert normal(found[0]) in constrained, requirement


def imported() -> dict[str, str]:
    """The modules that the program imports, wherever it does, and a file that imports each."""
    found: dict[str, str] = {}
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            for names in IMPORT.findall(path.read_text(encoding="utf-8")):
                found.setdefault("".join(names), str(path.relative_to(ROOT)))
    return {name: path for name, path in found.items() if name not in {*PACKAGES, *sys.stdlib_module_names}}


def test_every_library_that_is_imported_is_named() -> None:
    """What only another library brings goes away with that."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    named = project["dependencies"] + [name for extra in RUNTIME for name in extras[extra]]
    own = {normal(Requirement(name).name) for name in named}
    distributions = packages_distributions()
    missing = {
        module: path
        for module, path in imported().items()
        if not {normal(name) for name in distributions.get(module, ())} & own
    }
    assert not missing


def test_the_base_installation_is_the_client() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    names = [Requirement(text).name for text in project["dependencies"]]
    assert names == ["annotated-types", "httpx", "polib", "rich", "typer"]
    assert "'.[server]'" in (ROOT / "Makefile").read_text()


def test_the_gate_is_the_test_command_of_the_readme() -> None:
    gate = ROOT / ".ci" / "run"
    assert os.access(gate, os.X_OK)
    assert gate.read_text().rstrip().endswith("make test")
    assert subprocess.run(["bash", "-n", gate], check=False).returncode == 0
    assert "make test" in (ROOT / "README.md").read_text()
