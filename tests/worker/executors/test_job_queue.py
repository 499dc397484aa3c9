"""The example for batch systems: the scripts of its jobs, and jobs that run, die and are submitted again."""

from __future__ import annotations

import itertools
import os
import re
import runpy
import shlex
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from benchmarks.faults.harness import free_port, kill_family
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.dask import DaskExecutor
from sprag_study.worker.states import StudyState
from tests.conftest import ROOT
from tests.worker import fakes
from tests.worker.executors.certificates import tls_environment
from tests.worker.executors.clusters import DEADLINE

EXAMPLE = ROOT / "examples" / "job_queue.py"
JOB = ("--cores", 4, "--memory", "8 GiB", "--time", "02:30:00", "--queue", "long", "--account", "drives")
#: Submits a job: runs its script, in a session of its own whose number is the job's.
SBATCH = """#!/bin/sh
cp "$1" "$JOBS/script"
setsid bash "$JOBS/script" >"$JOBS/log" 2>&1 </dev/null &
echo $! >>"$JOBS/numbers"
echo "Submitted batch job $!"
"""


def started(*options: object, **environment: str) -> subprocess.Popen[str]:
    """The example as a process."""
    command = [sys.executable, "-W", "ignore", str(EXAMPLE), *map(str, options)]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
    )  # fmt: skip


def script_of(system: str, *options: object, **environment: str) -> str:
    """The script of a job."""
    place = ("--host", "127.0.0.1", "--port", 0)
    process = started(system, *place, *JOB, *options, "--print", **environment)
    out, err = process.communicate()
    assert process.returncode == 0, err
    return out


@pytest.fixture(scope="module")
def options() -> Callable[[], object]:
    """The reader of the example's command line."""
    read: Callable[[], object] = runpy.run_path(str(EXAMPLE))["options"]
    return read


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (("--cores", 0), "'0' must be a whole number from 1"),
        (("--jobs", 0), "'0' must be a whole number from 1"),
        (("--memory", "much"), "'much' must be an amount such as '64 GiB'"),
        (("--account", "two words"), "'two words' must be one word"),
    ],
)
def test_mistakes_are_one_sentence(
    options: Callable[[], object],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    wrong: tuple[object, ...],
    said: str,
) -> None:
    words = (EXAMPLE, "slurm", "--host", "127.0.0.1", "--port", 0, *JOB, *wrong)
    monkeypatch.setattr(sys, "argv", [str(word) for word in words])
    with pytest.raises(SystemExit) as ended:
        options()
    assert ended.value.code == 2
    assert said in capsys.readouterr().err.splitlines()[-1]


def test_a_port_in_use_is_one_sentence() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        process = started("slurm", "--host", "127.0.0.1", "--port", port, *JOB, "--print")
        _, err = process.communicate()
    assert err.startswith(f"job_queue.py: the scheduler cannot start at 127.0.0.1:{port}: [Errno ")


def directives(script: str, mark: str) -> dict[str, str]:
    """What a job asks of its system, by option."""
    lines = re.findall(rf"^{re.escape(mark)} (-\S+?)(?:[ =](.*))?$", script, re.MULTILINE)
    assert lines
    return {f"{name} {value.partition('=')[0]}" if name == "-l" else name: value for name, value in lines}


def command_of(script: str) -> list[str]:
    """The words of the command that a job runs; the script is one that a shell reads."""
    subprocess.run(["bash", "-n"], input=script, text=True, check=True)
    last = script.strip().splitlines()[-1]
    return shlex.split(last)


@pytest.mark.parametrize(
    ("system", "mark", "wanted"),
    [
        ("slurm", "#SBATCH", {"-p": "long", "-A": "drives", "-n": "1", "--cpus-per-task": "4", "--mem": "8G",
                              "-t": "02:30:00", "-J": "sprag", "--exclusive": ""}),
        ("pbs", "#PBS", {"-q": "long", "-A": "drives", "-l select": "select=1:ncpus=4:mem=8192MB",
                         "-l walltime": "walltime=02:30:00", "-N": "sprag", "--exclusive": ""}),
        ("sge", "#$", {"-q": "long", "-P": "drives", "-l h_rt": "h_rt=02:30:00", "-N": "sprag", "-cwd": "",
                       "-j": "y", "--exclusive": ""}),
    ],
)  # fmt: skip
def test_a_job_asks_for_what_the_command_says(system: str, mark: str, wanted: dict[str, str]) -> None:
    script = script_of(system, "--directive=--exclusive")
    assert script.startswith("#!/usr/bin/env bash\n")
    assert directives(script, mark) == wanted
    words = command_of(script)
    assert words[:3] == [sys.executable, "-m", "distributed.cli.dask_worker"]
    assert re.fullmatch(r"tcp://127\.0\.0\.1:\d+", words[3])
    options = dict(itertools.pairwise(words))
    assert (options["--nworkers"], options["--nthreads"]) == ("4", "1")  # a worker for each core
    assert options["--memory-limit"] == "0"  # given twice, and the last one counts
    assert {"--nanny", "--no-dashboard"} <= {*words}
    # What is in the folder is executed: its name must not be foreseen by others on the node.
    assert 'export SPRAG_KERNEL_CACHE="$(mktemp -d)"' in script.splitlines()


def test_the_workers_of_jobs_have_certificates(tmp_path: Path) -> None:
    environment = tls_environment(tmp_path)
    words = command_of(script_of("slurm", "--python", "/opt/my sprag/bin/python", **environment))
    options = dict(itertools.pairwise(words))
    assert words[0] == "/opt/my sprag/bin/python"
    assert re.fullmatch(r"tls://127\.0\.0\.1:\d+", words[3])
    assert options["--tls-ca-file"] == environment["DASK_DISTRIBUTED__COMM__TLS__CA_FILE"]
    assert options["--tls-cert"] == environment["DASK_DISTRIBUTED__COMM__TLS__WORKER__CERT"]
    assert options["--tls-key"] == environment["DASK_DISTRIBUTED__COMM__TLS__WORKER__KEY"]


def test_a_job_that_is_killed_is_submitted_again(tmp_path: Path) -> None:
    """The batch system is a command that runs scripts; a job dies during a study, which ends with all rows."""
    numbers, programs = tmp_path / "numbers", tmp_path / "bin"
    programs.mkdir()
    for name, text in {"sbatch": SBATCH, "scancel": '#!/bin/sh\nkill -9 -- "-$1"\n'}.items():
        (programs / name).write_text(text)
        (programs / name).chmod(0o755)
    port, cases, kills = free_port(), 400, 0
    queue = started(
        "slurm", "--host", "127.0.0.1", "--port", port, "--cores", 1, "--memory", "1 GiB",
        PATH=os.pathsep.join([str(programs), os.environ["PATH"]]), JOBS=str(tmp_path),
        DASK_DISTRIBUTED__DEPLOY__LOST_WORKER_TIMEOUT="1s",
    )  # fmt: skip
    assert queue.stdout is not None
    try:
        url = queue.stdout.readline().strip().removeprefix("SPRAG_EXECUTOR=")
        assert url == f"dask://127.0.0.1:{port}"
        with Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=20)) as store:
            record = store.studies.create({}, fakes.study(cases))
            executor = DaskExecutor(url, 0, chunk_timeout=DEADLINE, run=fakes.run, load=fakes.load)

            def stopping() -> bool:
                nonlocal kills
                now = store.studies.get(record.id)
                if not kills and now.done >= cases // 4:
                    os.killpg(int(numbers.read_text().split()[0]), signal.SIGKILL)
                    kills += 1
                return now.state.terminal

            Dispatcher(store.work, executor, SystemClock()).run(stopping)
            ended = store.studies.get(record.id)
            assert (ended.state, ended.done, ended.ok) == (StudyState.FINISHED, cases, cases)
            blocks = list(store.rows.blocks(record.id))
            np.testing.assert_array_equal(np.concatenate([block.values for block in blocks]), fakes.values(0, cases))
        assert (kills, len(numbers.read_text().split())) == (1, 2)
        queue.send_signal(signal.SIGTERM)
        assert queue.wait(DEADLINE) == 0
    finally:
        kill_family(queue)
        queue.communicate()
        for number in numbers.read_text().split() if numbers.exists() else ():
            subprocess.run(["kill", "-9", "--", f"-{number}"], check=False, capture_output=True)
