"""Installs the oldest version of every package that pyproject.toml admits, and runs tests with them.

    python -m benchmarks.lower_bounds                    a choice of tests that touch all of these packages
    python -m benchmarks.lower_bounds tests/service      those tests

Packages without a lower bound are the newest ones that go with these.
The environment is a temporary one. Exit code 0: everything could be installed together, and the tests passed.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
#: Extras whose packages are included.
EXTRAS = ("tables", "server", "postgres", "cluster")
TOOLS = ("pytest", "hypothesis", "jsonschema", "openpyxl", "pandas", "polars", "psutil", "openapi-spec-validator")
TESTS = (
    "tests/test_foreign_parts.py",
    "tests/engine/compile",
    "tests/engine/vibration_drive/test_balances.py",
    "tests/service/http",
    "tests/service/exports",
    "tests/service/reading/test_units.py",
    "tests/service/storage",
    "tests/worker/executors",
)


def lowest() -> dict[str, str]:
    """The lower end of each range, by package."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    texts = list(project["dependencies"])
    for extra in EXTRAS:
        texts += project["optional-dependencies"].get(extra, [])
    found = {}
    for requirement in map(Requirement, texts):
        for bound in requirement.specifier:
            if bound.operator == ">=":
                found[requirement.name] = bound.version
    return found


def main() -> int:
    """Install the packages, print their versions, run the tests."""
    low = lowest()
    with tempfile.TemporaryDirectory() as folder:
        python = Path(folder) / "bin" / "python"
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        wanted = [f"{name}=={version}" for name, version in low.items()]
        install = [python, "-m", "pip", "--disable-pip-version-check", "install", "-q"]
        started = time.monotonic()
        subprocess.run([*install, f"{ROOT}[{','.join(EXTRAS)}]", *wanted, *TOOLS], check=True, cwd=folder)
        print(f"installed in {time.monotonic() - started:.0f} s")
        listed = subprocess.run([python, "-m", "pip", "freeze"], check=True, capture_output=True, text=True).stdout
        for name in low:
            line = re.search(rf"^{re.escape(name)}(==.*)$", listed, re.IGNORECASE | re.MULTILINE)
            print(f"  {name}{line[1] if line else ' is not installed'}", flush=True)
        tests = sys.argv[1:] or [test for test in TESTS if (ROOT / test).exists()]
        done = subprocess.run([python, "-m", "pytest", "-q", "-p", "no:cacheprovider", *tests], cwd=ROOT, check=False)
        return done.returncode


if __name__ == "__main__":
    sys.exit(main())
