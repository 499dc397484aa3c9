"""Information about a process from Linux's /proc; nothing is known on other systems."""

from __future__ import annotations

from pathlib import Path

#: Field of /proc/PID/stat after the name, which may contain blanks.
_START = 19


def start_time(pid: int) -> int | None:
    """Clock ticks from the machine's start to that of process ``pid``; together with the id it identifies a process
    uniquely.

    None where there is no such process or the time is unknown.
    """
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    return int(text.rpartition(")")[2].split()[_START])
