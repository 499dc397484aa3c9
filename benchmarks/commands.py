"""Processor time of a command that only shows something, against that of Python itself; modules are compiled before.

python -m benchmarks.commands [--times 11]
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from tempfile import TemporaryDirectory

COMMANDS = {
    "python -c pass": ["-c", "pass"],
    "sprag --version": ["-m", "sprag_study.service.cli", "--version"],
    "sprag --help": ["-m", "sprag_study.service.cli", "--help"],
    "sprag run --help": ["-m", "sprag_study.service.cli", "run", "--help"],
    "sprag show curves --help": ["-m", "sprag_study.service.cli", "show", "curves", "--help"],
}


def processor_seconds(arguments: list[str], compiled: str) -> float:
    """User and system time of one process, which finds and keeps compiled modules in the folder ``compiled``."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    environment = {**kept, "PYTHONPYCACHEPREFIX": compiled}
    process = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.DEVNULL, env=environment)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure the commands in turns; print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=11)
    times = parser.parse_args().times
    measured: dict[str, list[float]] = {name: [] for name in COMMANDS}
    with TemporaryDirectory() as compiled:
        for turn in range(times + 1):
            for name, arguments in COMMANDS.items():
                seconds = processor_seconds(arguments, compiled)
                if turn:  # the first one compiles
                    measured[name].append(seconds)
    python = statistics.median(measured["python -c pass"])
    for name, seconds in measured.items():
        median = statistics.median(seconds)
        ratio, spread = median / python, f"{min(seconds):.2f} to {max(seconds):.2f}"
        print(f"{name:24} {median:5.2f} s of processor time ({spread}), {ratio:4.1f} x")


if __name__ == "__main__":
    main()
