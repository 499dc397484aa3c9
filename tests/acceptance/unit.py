"""A unit of systemd without systemd: its settings, and a process under its own filters of system calls.

As a program: ``python -m tests.acceptance.unit UNIT COMMAND...`` replaces itself by the command, which then has the
filters, niceness and umask of the unit. libseccomp, which systemd itself uses, makes the filters.
"""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import socket
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Final

_ALLOW: Final = 0x7FFF0000
_ERRNO: Final = 0x00050000
#: Comparisons of libseccomp.
_GREATER, _EQUAL, _MASKED_EQUAL = 6, 4, 7
#: The flags of new namespaces in clone, unshare and setns: cgroup, ipc, net, mnt, pid, user, uts, time.
_NAMESPACES: Final = (0x02000000, 0x08000000, 0x40000000, 0x00020000, 0x20000000, 0x10000000, 0x04000000, 0x80)
#: Families of addresses up to this number are compared one by one.
_FAMILIES: Final = 64


class _Comparison(ctypes.Structure):
    """``struct scmp_arg_cmp``: an argument, the comparison, and its one or two values."""

    _fields_ = (
        ("argument", ctypes.c_uint),
        ("comparison", ctypes.c_int),
        ("first", ctypes.c_uint64),
        ("second", ctypes.c_uint64),
    )


def settings(unit: Path) -> dict[str, list[str]]:
    """The values of each setting of a unit, in their order."""
    values: dict[str, list[str]] = {}
    for line in unit.read_text(encoding="utf-8").splitlines():
        name, sign, value = line.partition("=")
        if sign and not line.startswith("#"):
            values.setdefault(name, []).append(value)
    return values


@cache
def _members(name: str) -> frozenset[str]:
    """The system calls of a set such as ``@resources``, with those of the sets in it; of a call, that call."""
    if not name.startswith("@"):
        return frozenset({name})
    tool = shutil.which("systemd-analyze")
    assert tool is not None, "needs systemd-analyze, of the package systemd"
    lines = subprocess.run([tool, "syscall-filter", name], capture_output=True, text=True, check=True).stdout
    listed = [line.strip() for line in lines.splitlines()[1:] if not line.strip().startswith("#")]
    return frozenset().union(*(_members(member) for member in listed if member))


def allowed_calls(lines: list[str]) -> frozenset[str]:
    """The system calls that lines of ``SystemCallFilter=`` allow, of which the first one names what is allowed."""
    assert not lines[0].startswith("~")
    allowed = _members("@default")
    for line in lines:
        named = frozenset().union(*map(_members, line.removeprefix("~").split()))
        allowed = allowed - named if line.startswith("~") else allowed | named
    return allowed


class _Filter:
    """A filter of system calls; what no rule names ends as ``otherwise``."""

    def __init__(self, otherwise: int) -> None:
        self._library = ctypes.CDLL("libseccomp.so.2", use_errno=True)
        self._library.seccomp_init.restype = ctypes.c_void_p
        self._context = ctypes.c_void_p(self._library.seccomp_init(ctypes.c_uint32(otherwise)))
        assert self._context

    def rule(self, action: int, call: str, *compared: tuple[int, int, int, int]) -> None:
        """Let a call whose arguments compare so end as ``action``; nothing where this machine has no such call."""
        number = self._library.seccomp_syscall_resolve_name(call.encode())
        if number < 0:
            return
        array = (_Comparison * len(compared))(*compared)
        code = self._library.seccomp_rule_add_array(
            self._context, ctypes.c_uint32(action), number, ctypes.c_uint(len(compared)), array
        )
        assert code == 0, f"{call}: {os.strerror(-code)}"

    def load(self) -> None:
        """Put this thread under the filter, without a way back."""
        code = self._library.seccomp_load(self._context)
        assert code == 0, os.strerror(-code)
        self._library.seccomp_release(self._context)


def confine(unit: Path) -> None:
    """Put this process, and what it starts, under the filters, niceness and umask of a unit."""
    found = settings(unit)
    allowed = allowed_calls(found["SystemCallFilter"])
    refused = _ERRNO | getattr(errno, found["SystemCallErrorNumber"][0])
    families = {getattr(socket, name) for name in found["RestrictAddressFamilies"][0].split()}
    assert found["RestrictNamespaces"] == ["yes"]
    os.nice(int(found["Nice"][0]))
    os.umask(int(found["UMask"][0], 8))
    arguments = _Filter(_ALLOW)
    for family in set(range(_FAMILIES)) - families:
        arguments.rule(_ERRNO | errno.EAFNOSUPPORT, "socket", (0, _EQUAL, family, 0))
    arguments.rule(_ERRNO | errno.EAFNOSUPPORT, "socket", (0, _GREATER, _FAMILIES - 1, 0))
    for flag in _NAMESPACES:
        for call in ("clone", "unshare"):
            arguments.rule(_ERRNO | errno.EPERM, call, (0, _MASKED_EQUAL, flag, flag))
    arguments.rule(_ERRNO | errno.ENOSYS, "clone3")  # its flags lie in memory, which no filter reads
    arguments.load()
    calls = _Filter(refused)
    for call in allowed:
        calls.rule(_ALLOW, call)
    calls.load()


if __name__ == "__main__":
    confine(Path(sys.argv[1]))
    os.execvp(sys.argv[2], sys.argv[2:])
