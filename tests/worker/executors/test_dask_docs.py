"""The commands of docs/deployment.md for a cluster, run as they stand there with other names of hosts and folders."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from benchmarks.faults.harness import free_port, kill_family
from tests.conftest import ROOT, Finished
from tests.worker.executors.certificates import CERTIFICATES, SECTION, SETTINGS, require_openssl

_COMMANDS = re.findall(r"```sh\n(.*?)```", SECTION, re.DOTALL)[2]
_SPEC = ROOT / "examples" / "one_pendulum.json"


def shell(command: str, folder: Path) -> subprocess.Popen[bytes]:
    """A command of the shell with the programs of this environment, in a folder of its own."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    return subprocess.Popen(
        ["bash", "-ec", command], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env={**os.environ, "PATH": path, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def run(command: str, folder: Path) -> bytes:
    """Standard output of a command that succeeds."""
    process = shell(command, folder)
    out, said = process.communicate()
    assert process.returncode == 0, said.decode()
    return out


def test_the_commands_for_a_cluster_give_the_rows_of_a_run_here(tmp_path: Path, sprag: Callable[..., Finished]) -> None:
    require_openssl()
    place = f"127.0.0.1:{free_port()}"

    def here(text: str) -> str:
        host, port = place.split(":")
        return text.replace("/etc/sprag", str(tmp_path)).replace("head.example", host).replace("8786", port)

    scheduler, worker, service = here(_COMMANDS).splitlines()
    assert (scheduler.split()[:2], worker.split()[:2]) == (["dask", "scheduler"], ["dask", "worker"])
    setting, _ = service.split(" ", 1)
    run(here(CERTIFICATES), tmp_path)
    settings = here(SETTINGS)
    started = [shell(f"{settings}\nexec {command} >parts.log 2>&1", tmp_path) for command in (scheduler, worker)]
    try:
        by_cluster = run(f"{settings}\n{setting} sprag run {_SPEC}", tmp_path)
    finally:
        for process in started:
            kill_family(process)
            process.communicate()
    assert by_cluster.decode() == sprag("run", _SPEC).out


def test_a_run_on_a_cluster_without_certificates_is_refused(
    sprag: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SPRAG_EXECUTOR", "dask://head.example:8786")
    refused = sprag("run", _SPEC)
    assert refused.code == 3
    assert "the scheduler head.example:8786 is spoken to by TLS, which needs certificates" in refused.err
