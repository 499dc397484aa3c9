"""The client stands apart: it is imported without engine, database and server, and where there is no POSIX."""

from __future__ import annotations

import subprocess
import sys

import pytest

#: Modules that only POSIX has, and packages that only the server needs.
POSIX = ("fcntl", "grp", "posix", "pwd", "resource", "termios", "tty")
SERVER = (
    "sprag_study.engine",
    "fastapi",
    "jinja2",
    "matplotlib",
    "numba",
    "pysqlite3",
    "sqlalchemy",
    "starlette",
    "uvicorn",
)

#: The standard library itself imports its POSIX modules on such a system, so they are refused to our own modules alone.
BLOCKED = """
import builtins, sys

genuine = builtins.__import__

def refuse(name, globals=None, *rest):
    importer = (globals or {{}}).get("__name__", "")
    if importer.startswith(("sprag_study.service", "sprag_study.worker")) and name.partition(".")[0] in {posix}:
        raise ImportError(f"{{importer}} imports {{name}}")
    return genuine(name, globals, *rest)

builtins.__import__ = refuse
sys.modules.update(dict.fromkeys({server}))
import {module}
"""


def imported(module: str) -> subprocess.CompletedProcess[str]:
    program = BLOCKED.format(posix=POSIX, server=SERVER, module=module)
    return subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    "module",
    [
        "sprag_study.service.client",
        "sprag_study.service.cli.app",
        *(
            f"sprag_study.service.client.{name}"
            for name in ("bars", "comparison", "frames", "motions", "retries", "sketch")
        ),
    ],
)
def test_the_client_is_imported_without_the_rest(module: str) -> None:
    done = imported(module)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("module", "missing"),
    [("sprag_study.worker.executors.dask_tasks", "fcntl"), ("sprag_study.service.http.app", "fastapi")],
)
def test_the_modules_are_really_refused(module: str, missing: str) -> None:
    done = imported(module)
    assert done.returncode != 0
    assert missing in done.stderr
