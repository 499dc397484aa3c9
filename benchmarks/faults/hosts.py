"""Hosts that are network namespaces of this machine, joined by a switch, whose links can be cut. For root alone."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path


class Hosts:
    """Namespaces by name; the first has the address 10.99.0.1, and so on."""

    def __init__(self, names: Sequence[str]) -> None:
        self._prefix = f"sprag{os.getpid()}"
        self._names = list(names)

    def make(self) -> None:
        """Make them. Raises PermissionError where this machine does not let us, with the reason."""
        switch = self._namespace("switch")
        _ip("netns", "add", switch)
        _ip("-n", switch, "link", "add", "bridge", "type", "bridge")
        _ip("-n", switch, "link", "set", "bridge", "up")
        for name in self._names:
            space = self._namespace(name)
            _ip("netns", "add", space)
            _ip("-n", switch, "link", "add", name, "type", "veth", "peer", "name", "eth0", "netns", space)
            _ip("-n", switch, "link", "set", name, "master", "bridge", "up")
            _ip("-n", space, "address", "add", f"{self.address(name)}/24", "dev", "eth0")
            _ip("-n", space, "link", "set", "eth0", "up")
            _ip("-n", space, "link", "set", "lo", "up")

    def address(self, name: str) -> str:
        """Address of a host."""
        return f"10.99.0.{self._names.index(name) + 1}"

    def begin(self, name: str) -> list[str]:
        """What comes before a command that is to run on a host."""
        return ["ip", "netns", "exec", self._namespace(name)]

    def cut(self, name: str) -> None:
        """Cut the link of a host: packets are lost silently."""
        _ip("-n", self._namespace("switch"), "link", "set", name, "nomaster")

    def mend(self, name: str) -> None:
        """Mend the link of a host."""
        _ip("-n", self._namespace("switch"), "link", "set", name, "master", "bridge")

    def remove(self) -> None:
        """Remove those that were made."""
        for name in ("switch", *self._names):
            if Path("/run/netns", self._namespace(name)).exists():
                _ip("netns", "delete", self._namespace(name))

    def _namespace(self, name: str) -> str:
        return f"{self._prefix}-{name}"


@contextmanager
def hosts(*names: str) -> Iterator[Hosts]:
    """Hosts that are gone in the end."""
    made = Hosts(names)
    try:
        made.make()
        yield made
    finally:
        made.remove()


def _ip(*arguments: str) -> None:
    if shutil.which("ip") is None:
        raise PermissionError("there is no command ip: install the package iproute2")
    done = subprocess.run(["ip", *arguments], capture_output=True, text=True, check=False)
    if done.returncode:
        raise PermissionError(f"ip {' '.join(arguments)}: {done.stderr.strip()}")
