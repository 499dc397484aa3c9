"""Real processes of the program, as users start them."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.faults import harness
from benchmarks.faults.harness import COMMAND, ROOT, with_tables

__all__ = [
    "COMMAND",
    "EXAMPLES",
    "INTERRUPTIBLE",
    "ROOT",
    "SECONDS",
    "Ended",
    "Service",
    "environment",
    "service",
    "sprag",
]

EXAMPLES = ROOT / "examples"
#: Generous: the machine may be busy with other tests.
SECONDS = 600
#: A process that was started in the background may have been told to ignore interrupts and hangups; this
#: one is not.
INTERRUPTIBLE = (
    sys.executable,
    "-c",
    "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
    "signal.signal(signal.SIGHUP, signal.SIG_DFL); "
    "from sprag_study.service.cli import main; main()",
)


def environment(**more: str) -> dict[str, str]:
    """That of the drills, with one process for cases: each further one loads the engine first."""
    return harness.environment(**{"SPRAG_PROCESSES": "1", **more})


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int
    out: bytes
    err: str

    @property
    def data(self) -> Any:
        """Standard output as JSON."""
        return json.loads(self.out)


def sprag(*arguments: object, cwd: Path | None = None, **more: str) -> Ended:
    """Run one command to its end."""
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=SECONDS,
        env=environment(**more),
        check=False,
    )
    err = done.stderr.decode()
    assert "Traceback" not in err
    return Ended(done.returncode, done.stdout, err)


@dataclass(frozen=True)
class Service:
    """A running service."""

    address: str
    process: subprocess.Popen[bytes]


@contextmanager
def service(folder: Path, *options: object, **more: str) -> Iterator[Service]:
    """``sprag serve`` on a free port with a database in ``folder``; has ended, in order, when the block is left."""
    database = with_tables(folder / "sprag.sqlite3")
    command = [*COMMAND, "serve", "--json", "--port", "0", "--db", str(database), *map(str, options)]
    log = folder / "service.log"
    with log.open("wb") as errors:
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, env=environment(**more))
    assert process.stdout is not None
    with process.stdout as output:
        line = output.readline()
    try:
        assert line, log.read_text()
        yield Service(json.loads(line)["address"], process)
    finally:
        process.send_signal(signal.SIGTERM)
        code = process.wait(SECONDS)
    said = log.read_text()
    assert code == 0, said
    assert "Traceback" not in said, said
