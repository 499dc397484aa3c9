"""The service under the filters of the unit for systemd, with the unit's environment: it computes, draws, backs up."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from benchmarks.faults.harness import COMMAND, kill_family, until
from sprag_study.service.storage.store import Store
from tests.acceptance.containers import SPARING
from tests.acceptance.unit import settings
from tests.conftest import ROOT
from tests.service.timed_spec import SPEC

UNIT = ROOT / "examples" / "sprag.service"
#: Stands for the file system of the unit: its folders are below this one.
_FOLDERS = {"%S": "/var/lib", "%C": "/var/cache"}


def _missing() -> str | None:
    """Why the filters cannot be set up here; None where they can."""
    if sys.platform != "linux":
        return "needs Linux"
    if shutil.which("systemd-analyze") is None:
        return "needs systemd-analyze, of the package systemd"
    try:
        ctypes.CDLL("libseccomp.so.2")
    except OSError:
        return "needs libseccomp, of the package libseccomp2"
    return None


@pytest.fixture(scope="module", autouse=True)
def _filters() -> None:
    """Without filters these tests say nothing; in the gate that is a failure."""
    if reason := _missing():
        assert "CI" not in os.environ, reason
        pytest.skip(reason)


def environment(root: Path, **more: str) -> dict[str, str]:
    """The environment that the unit gives its service, with its folders below ``root``.

    Compiled kernels are those of the tests, as their sources are the same.
    """
    found = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin", "PYTHONPATH": str(ROOT)}
    for line in settings(UNIT)["Environment"]:
        name, _, value = line.partition("=")
        for letter, folder in _FOLDERS.items():
            value = value.replace(letter, folder)
        found[name] = value.replace("/var/", f"{root}/var/")
    return {**found, **SPARING, **more}


def under(unit: Path, *command: str) -> list[str]:
    """A command under the filters of a unit."""
    return [sys.executable, "-m", "tests.acceptance.unit", str(unit), *command]


def confined(*command: str, cwd: Path, unit: Path = UNIT) -> str:
    """What a command prints that ends in order under the filters of the unit, whose folders are below ``cwd``."""
    done = subprocess.run(
        under(unit, *command), env=environment(cwd), cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folders that systemd makes for the unit, and no others."""
    root = tmp_path_factory.mktemp("root")
    for name, parent in (("StateDirectory", "lib"), ("CacheDirectory", "cache")):
        for folder in settings(UNIT).get(name, ()):
            (root / "var" / parent / folder).mkdir(parents=True, mode=0o700)
    return root


@pytest.fixture(scope="module")
def served(root: Path) -> Iterator[httpx.Client]:
    """The service that the unit starts, on a free port."""
    log = root / "log"
    with log.open("wb") as errors:
        process = subprocess.Popen(
            under(UNIT, *COMMAND, "serve", "--json", "--port", "0"),
            stdout=subprocess.PIPE, stderr=errors, env=environment(root), cwd=ROOT,
        )  # fmt: skip
    assert process.stdout is not None
    try:
        with process.stdout as output:
            line = output.readline()
        assert line, log.read_text()
        address = json.loads(line)["address"]
        with httpx.Client(base_url=address, trust_env=False, timeout=600) as client:
            yield client
        process.terminate()
        assert process.wait(600) == 0
    finally:
        if process.poll() is None:
            kill_family(process)
        print(log.read_text())


def test_a_study_runs_to_its_end(served: httpx.Client) -> None:
    study = served.post("/api/v1/studies", json=SPEC).json()["id"]
    states: list[str] = []

    def over() -> bool:
        states.append(served.get(f"/api/v1/studies/{study}").json()["state"])
        return states[-1] == "finished" or "has ended 3 times" in served.get("/readyz").text

    until(over, "the study has ended, or its worker again and again", look=1.0)
    assert states[-1] == "finished"
    assert served.get("/readyz").json()["status"] == "ok"
    rows = served.get(f"/api/v1/studies/{study}/results", params={"format": "csv"}).text.splitlines()
    assert len(rows) == 1 + 9, rows
    for form in ("xlsx", "netcdf"):
        assert len(served.get(f"/api/v1/studies/{study}/results", params={"format": form}).content) > 1_000, form
    pdf = served.get(f"/api/v1/studies/{study}/report", params={"format": "pdf"})
    assert pdf.content.startswith(b"%PDF"), pdf.text


def test_kernels_are_compiled(root: Path) -> None:
    """The compiler writes memory and then executes it, which the unit leaves open."""
    code = "import numba; print(numba.njit(lambda x: x + 1)(41))"
    assert confined(sys.executable, "-c", code, cwd=root).strip() == "42"


def test_what_the_filters_forbid_ends_no_process_of_the_pool(root: Path, tmp_path: Path) -> None:
    """Units that were installed before, and other administrators' own, forbid even giving way to others."""
    unit = tmp_path / UNIT.name
    text = UNIT.read_text().replace("SystemCallFilter=setpriority\n", "")
    assert text != UNIT.read_text()
    unit.write_text(text)
    code = (
        "import errno, os\n"
        "from sprag_study.worker.pool.processes import give_way\n"
        "try: os.nice(0)\n"
        "except OSError as error: print(errno.errorcode[error.errno])\n"
        "give_way()\n"
        "print('goes on')"
    )
    assert confined(sys.executable, "-c", code, unit=unit, cwd=root) == "EPERM\ngoes on\n"


def test_backups_are_written(served: httpx.Client, root: Path) -> None:
    assert served.get("/livez").status_code == 200
    copy = Path(environment(root)["SPRAG_BACKUP_FOLDER"]) / "copy.sqlite3"
    copy.parent.mkdir(exist_ok=True)
    confined(*COMMAND, "db", "backup", str(copy), cwd=root)
    with Store.open(f"sqlite:///{copy}") as store:
        assert store.studies.page().studies


def test_home_and_cache_are_where_the_unit_may_write(root: Path) -> None:
    """Files of the database's server and of TLS are looked for at home, columns of ended studies in the cache."""
    found = environment(root)
    assert Path(found["HOME"]).is_dir()
    assert Path(found["XDG_CACHE_HOME"]).is_dir()
    code = "from sprag_study.service.views.columns import default_folder; print(default_folder())"
    assert Path(confined(sys.executable, "-c", code, cwd=root).strip()).is_relative_to(root)
