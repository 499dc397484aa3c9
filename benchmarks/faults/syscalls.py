"""What a process writes to chosen files, system call by system call: a debugger of a few lines, for Linux.

It notes every write, cut and synchronisation of the files, and what the process says on its standard output, in the
one order in which they happened. From that the files can be put together as a power cut would have left them.
"""

from __future__ import annotations

import ctypes
import os
import platform
import signal
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

_ATTACH, _SYSCALL, _SETOPTIONS = 16, 24, 0x4200
_GOOD_STOPS, _KILL_WITH_TRACER = 1, 1 << 20
_SYSCALL_STOP = signal.SIGTRAP | 0x80
#: Numbers of the system calls by machine.
_NUMBERS = {
    "x86_64": {1: "write", 18: "pwrite", 74: "sync", 75: "sync", 77: "cut"},
    "aarch64": {64: "write", 68: "pwrite", 82: "sync", 83: "sync", 46: "cut"},
}


@dataclass(frozen=True, slots=True)
class Call:
    """One system call on a file (``path``): "pwrite", "sync", "cut", or "said" for a line on standard output."""

    kind: str
    path: str
    data: bytes = b""
    offset: int = 0


def _ptrace(request: int, pid: int, data: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    libc.ptrace.restype = ctypes.c_long
    libc.ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    if libc.ptrace(request, pid, None, data) < 0:
        code = ctypes.get_errno()
        raise OSError(code, f"ptrace: {os.strerror(code)}")


def record(command: Sequence[str], files: Sequence[Path], environment: Mapping[str, str]) -> list[Call]:
    """Run ``command``, which first reads a line from its standard input, and give what it did to ``files``.

    Only its first thread is watched.
    """
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=dict(environment)) as child:
        return _watch(child, files)


def _watch(child: subprocess.Popen[bytes], files: Sequence[Path]) -> list[Call]:
    assert child.stdin is not None
    assert child.stdout is not None
    child.stdout.readline()  # it says that it has read its program and is about to wait
    _ptrace(_ATTACH, child.pid, 0)
    os.waitpid(child.pid, 0)
    _ptrace(_SETOPTIONS, child.pid, _GOOD_STOPS | _KILL_WITH_TRACER)
    child.stdin.write(b"go\n")
    child.stdin.flush()
    calls: list[Call] = []
    names = {str(path) for path in files}
    entering, passed_on = True, 0
    while True:
        _ptrace(_SYSCALL, child.pid, passed_on)
        passed_on = 0
        _, status = os.waitpid(child.pid, 0)
        if os.WIFEXITED(status) or os.WIFSIGNALED(status):
            child.returncode = os.waitstatus_to_exitcode(status)
            assert child.returncode == 0, f"the program ended with {child.returncode}"
            return calls
        if os.WSTOPSIG(status) != _SYSCALL_STOP:
            passed_on = os.WSTOPSIG(status)
            continue
        if entering and (call := _look(child.pid, names)) is not None:
            calls.append(call)
        entering = not entering


def _look(pid: int, names: set[str]) -> Call | None:
    """The system call that the stopped process is about to make, if it is one to note."""
    fields = Path(f"/proc/{pid}/syscall").read_text().split()
    kind = _NUMBERS[platform.machine()].get(int(fields[0])) if fields[0].isdigit() else None
    if kind is None:
        return None
    descriptor, second, third, fourth = (int(field, 16) for field in fields[1:5])
    if kind == "write" and descriptor == 1:
        return Call("said", "", _memory(pid, second, third))
    path = os.readlink(f"/proc/{pid}/fd/{descriptor}")
    if path not in names:
        return None
    if kind == "write":
        raise AssertionError(f"{path} is written without a position")
    if kind == "pwrite":
        return Call(kind, path, _memory(pid, second, third), fourth)
    return Call(kind, path, offset=second)


def _memory(pid: int, address: int, size: int) -> bytes:
    with open(f"/proc/{pid}/mem", "rb", 0) as memory:
        memory.seek(address)
        found = memory.read(size)
    assert len(found) == size
    return found


class Disk:
    """Files as calls leave them: what was written, and what of it a power cut cannot take any more."""

    def __init__(self, files: Sequence[Path]) -> None:
        self.written = {str(path): bytearray(path.read_bytes()) for path in files}
        self.safe = {path: bytes(content) for path, content in self.written.items()}
        self.pending: dict[str, list[Call]] = {path: [] for path in self.written}

    def do(self, call: Call) -> None:
        """Apply one call."""
        if call.kind == "sync":
            self.safe[call.path] = bytes(self.written[call.path])
            self.pending[call.path].clear()
        elif call.kind in ("pwrite", "cut"):
            _apply(self.written[call.path], call)
            self.pending[call.path].append(call)

    def after_power_cut(self, path: str, survived: Sequence[bool]) -> bytes:
        """A file of which some of the writes since its last synchronisation reached the disk."""
        content = bytearray(self.safe[path])
        for call, reached in zip(self.pending[path], survived, strict=True):
            if reached:
                _apply(content, call)
        return bytes(content)


def _apply(content: bytearray, call: Call) -> None:
    if call.kind == "cut":
        content[call.offset :] = bytes(max(0, call.offset - len(content)))
        return
    if len(content) < call.offset:
        content.extend(bytes(call.offset - len(content)))
    content[call.offset : call.offset + len(call.data)] = call.data
