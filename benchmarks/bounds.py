"""Installs the lowest or the highest version of every package that pyproject.toml admits, and runs tests with them.

    python -m benchmarks.bounds lowest                   quick tests of what rests on these packages
    python -m benchmarks.bounds highest tests/service    those tests

Lowest: packages without a lower bound are the newest ones that go with the lowest of the others. Highest: the newest
versions that go together, whatever `constraints.txt` says. The environment is a temporary one. Exit code 0: everything
could be installed together, and the tests passed.
"""

from __future__ import annotations

import argparse
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
EXTRAS = ("frames", "server", "postgres", "cluster", "oidc", "traces")
TOOLS = ("pytest", "hypothesis", "jsonschema", "openpyxl", "polars", "ruamel.yaml", "openapi-spec-validator")
#: None of them compiles a kernel or starts a browser.
TESTS = (
    "tests/test_foreign_parts.py",
    "tests/service/cli/test_completion.py",
    *(
        f"tests/service/http/test_{name}.py"
        for name in ("timeouts", "server", "guard", "drain", "tls", "prefix", "metrics", "fault_connection", "roles")
    ),
    "tests/service/exports",
    "tests/service/reading/test_units.py",
    "tests/service/storage/test_store.py",
    "tests/service/storage/test_tables.py",
    "tests/worker/test_traces.py",
    "tests/worker/executors/test_dask_link.py",
    "tests/worker/executors/test_dask_settings.py",
)


def bounded() -> dict[str, str]:
    """The packages whose range has ends, with the lower one; "" where there is only an upper one."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    texts = list(project["dependencies"])
    for extra in EXTRAS:
        texts += project["optional-dependencies"].get(extra, [])
    return {
        requirement.name: next((bound.version for bound in requirement.specifier if bound.operator == ">="), "")
        for requirement in map(Requirement, texts)
        if requirement.specifier
    }


def main() -> int:
    """Install the packages, print their versions, run the tests."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("end", choices=("lowest", "highest"))
    parser.add_argument("tests", nargs="*", default=[test for test in TESTS if (ROOT / test).exists()])
    options = parser.parse_args()
    ends = bounded()
    lowest = [f"{name}=={version}" for name, version in ends.items() if version] if options.end == "lowest" else []
    with tempfile.TemporaryDirectory() as folder:
        python = Path(folder) / "bin" / "python"
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        install = [python, "-m", "pip", "--disable-pip-version-check", "install", "-q", "--no-compile"]
        started = time.monotonic()
        subprocess.run([*install, f"{ROOT}[{','.join(EXTRAS)}]", *lowest, *TOOLS], check=True, cwd=folder)
        print(f"installed in {time.monotonic() - started:.0f} s")
        listed = subprocess.run([python, "-m", "pip", "freeze"], check=True, capture_output=True, text=True).stdout
        for name in ends:
            line = re.search(rf"^{re.escape(name)}(==.*)$", listed, re.IGNORECASE | re.MULTILINE)
            print(f"  {name}{line[1] if line else ' is not installed'}", flush=True)
        command = [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options.tests]
        return subprocess.run(command, cwd=ROOT, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
