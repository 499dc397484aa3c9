"""Information about a process from Linux's /proc; nothing is known on other systems."""

from __future__ import annotations

import os
from pathlib import Path

#: Fields of /proc/PID/stat after the name, which may contain blanks: processor time in user and system mode, start.
_USER, _SYSTEM, _START = 11, 12, 19


def _stat(pid: int) -> list[str]:
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
    except OSError:
        return []


def start_time(pid: int) -> int | None:
    """Clock ticks from the machine's start to that of process ``pid``; together with the id it identifies a process
    uniquely.

    None where there is no such process or the time is unknown.
    """
    fields = _stat(pid)
    return int(fields[_START]) if fields else None


def processor_seconds(pid: int) -> float | None:
    """Processor time (s) that all threads of process ``pid`` have used; None as for `start_time`."""
    fields = _stat(pid)
    return (int(fields[_USER]) + int(fields[_SYSTEM])) / os.sysconf("SC_CLK_TCK") if fields else None
