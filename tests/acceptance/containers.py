"""Containers without a container engine: a recipe's steps and a compose file's commands, executed in a clean folder.

The paths of the containers are folders below one root. A process gets the variables of the recipe, and of this machine
only where the libraries are, so that nothing is installed from the network.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from tests.conftest import ROOT

#: What is not sent to the builder: patterns from the first to the last, of which the last that fits decides.
IGNORED = tuple(
    line for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines() if line and line[0] != "#"
)
#: Compiled kernels of the tests serve the containers, too: their sources are the same. One process of each kind
#: suffices, and those of this machine's number of cores would each load the engine.
SPARING = {
    "SPRAG_KERNEL_CACHE": os.environ.get("SPRAG_KERNEL_CACHE", str(Path.home() / ".cache" / "sprag")),
    "SPRAG_PROCESSES": "1",
    "SPRAG_CHECK_PROCESSES": "1",
}
#: Top folders of the containers that lie below the root of a test.
_OWN = re.compile(r"(?<![\w.:/-])(?=/(?:opt|build|var)/?)")


def steps(recipe: Path) -> list[tuple[str, str]]:
    """The instructions of a recipe, (name, argument), without comments and with continued lines joined."""
    lines = [line for line in recipe.read_text(encoding="utf-8").splitlines() if not line.lstrip().startswith("#")]
    joined = "\n".join(lines).replace("\\\n", " ")
    parted = (line.strip().partition(" ") for line in joined.splitlines())
    return [(name, rest.strip()) for name, _, rest in parted if name]


def interpolated(text: str, variables: dict[str, str]) -> str:
    """A value of a compose file with its variables; ``${NAME:?...}`` needs the variable, ``$$`` is a dollar sign."""

    def value(match: re.Match[str]) -> str:
        return "$" if match[0] == "$$" else variables[match["name"]]

    return re.sub(r"\$\$|\$\{(?P<name>\w+)(:\?[^}]*)?\}", value, text)


def compose(file: Path) -> dict[str, Any]:
    """A compose file with its anchors and merges resolved."""
    found: dict[str, Any] = YAML(typ="safe", pure=True).load(file.read_text(encoding="utf-8"))
    return found


def started_before(services: dict[str, Any]) -> list[str]:
    """The names of the services in an order in which each comes after those on which it depends."""
    order: list[str] = []
    while len(order) < len(services):
        ready = [n for n, s in services.items() if n not in order and set(s.get("depends_on", ())) <= set(order)]
        assert ready, f"{set(services) - set(order)} wait for each other, or for a service that does not exist"
        order += ready
    return order


def is_sent(path: str) -> bool:
    """Whether a file of the repository, or a folder with all of its files, gets into the context of a build."""
    sent = True
    for pattern in IGNORED:
        if _fits(pattern.removeprefix("!"), path):
            sent = pattern.startswith("!")
    return sent


def _fits(pattern: str, path: str) -> bool:
    """Whether a pattern of ``.dockerignore`` fits a path or a folder above it; ``*`` stays within a name."""
    parts = re.split(r"(\*\*/|\*)", pattern)
    words = {"**/": "(?:.*/)?", "*": "[^/]*"}
    return re.fullmatch("".join(words.get(part, re.escape(part)) for part in parts) + "(?:/.*)?", path) is not None


@dataclass
class Image:
    """What a recipe's steps leave in the folder ``root``, and how its processes are started."""

    root: Path
    environment: dict[str, str] = field(default_factory=dict)
    folder: str = "/"
    user: str = "root"
    command: list[str] = field(default_factory=list)
    health: list[str] = field(default_factory=list)
    #: What EXPOSE, STOPSIGNAL and VOLUME say.
    declared: dict[str, str] = field(default_factory=dict)
    #: The steps whose commands need root, and were left out.
    left_out: list[str] = field(default_factory=list)
    _stage: str = ""

    @classmethod
    def built(cls, recipe: Path, root: Path) -> Image:
        """The image of a recipe whose context is the repository."""
        image = cls(root)
        for name, rest in steps(recipe):
            image.take(name, rest)
        return image

    def here(self, text: str) -> str:
        """A text with the container's paths below the root."""
        return _OWN.sub(str(self.root), text)

    def path(self, inside: str) -> Path:
        """A path of the container."""
        return Path(self.here(str(Path(self.folder) / inside)))

    def variables(self, **more: str) -> dict[str, str]:
        """The environment of a process in a container."""
        base = self.root.parent / "base"
        if not base.exists():  # the image that the recipe starts from has a python
            base.mkdir(parents=True)
            version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
            (base / "python").symlink_to(Path(sys.base_prefix) / "bin" / version)
        found = {
            "PATH": f"{base}:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
            "HOME": str(self.root),
            # The libraries that the recipe would load from an index.
            "PYTHONPATH": sysconfig.get_path("purelib"),
            "PIP_CONFIG_FILE": os.devnull,
            "PIP_NO_INDEX": "1",
            "PIP_NO_BUILD_ISOLATION": "0",  # pip reads it the other way round
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
            "PIP_COMPILE": "0",  # modules are compiled as they are imported, which are half of them
            "PYTHONWARNINGS": "ignore",
        }
        for name, value in {**self.environment, **more}.items():
            found[name] = self.here(value).replace("$PATH", found["PATH"])
        return found

    def run(self, command: list[str], **more: str) -> str:
        """Run a command to its successful end; gives what it printed."""
        done = subprocess.run(
            [self.here(word) for word in command], cwd=self.path("."), env=self.variables(**more),
            stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=900, check=False,
        )  # fmt: skip
        assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def start(self, command: list[str], log: Path, **more: str) -> subprocess.Popen[bytes]:
        """Start a command; what it prints goes to ``log``."""
        environment = self.variables(**more)
        words = [self.here(word) for word in command]
        # Libraries come from this environment, without their programs.
        words[:1] = ["python", "-m", "dask"] if words[0] == "dask" else words[:1]
        found = shutil.which(words[0], path=environment["PATH"])
        assert found, f"{words[0]} is not in the image"
        argv = [found, *words[1:]]
        with log.open("ab") as output:
            return subprocess.Popen(
                argv, cwd=self.path("."), env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=output
            )

    def take(self, name: str, rest: str) -> None:
        """Execute one step of a recipe."""
        match name:
            case "FROM":
                self._begin(rest)
            case "WORKDIR":
                self.folder = rest
                self.path(".").mkdir(parents=True, exist_ok=True)
            case "COPY":
                self._copy(rest)
            case "RUN" if rest.startswith("useradd "):
                self._add_user(rest)
            case "RUN":
                self.run(["sh", "-c", rest])
            case "ENV":
                self.environment |= dict(item.split("=", 1) for item in shlex.split(rest))
            case "USER":
                self.user = rest
            case "CMD":
                self.command = json.loads(rest)
            case "HEALTHCHECK":
                self.health = json.loads(rest.partition("CMD ")[2])
            case "EXPOSE" | "STOPSIGNAL" | "VOLUME":
                self.declared[name] = rest
            case _:
                raise AssertionError(f"the step {name} is not executed")

    def _begin(self, rest: str) -> None:
        """A stage: the folder of the last one is put aside, so that paths in scripts that are copied stay right."""
        if self._stage:
            self.root.rename(self.root.with_name(self._stage))
        self._stage = rest.rpartition(" ")[2] if " AS " in rest else "last"
        self.root.mkdir(parents=True)
        self.folder, self.user, self.environment = "/", "root", {}

    def _add_user(self, rest: str) -> None:
        """Adds the user to files below the root, never to those of this machine."""
        (self.root / "etc").mkdir()
        (self.root / "var" / "lib").mkdir(parents=True)
        for file in ("passwd", "group", "shadow", "gshadow"):
            (self.root / "etc" / file).touch()
        words = shlex.split(rest)
        if os.geteuid():
            self.left_out.append(rest)
            self.path(words[words.index("--home-dir") + 1]).mkdir(parents=True)
            return
        command = [words[0], "--prefix", str(self.root), *words[1:]]
        subprocess.run(command, check=True, capture_output=True)

    def _copy(self, rest: str) -> None:
        *sources, target = rest.split()
        context, own = ROOT, True
        if sources[0].startswith("--from="):
            context, own = self.root.with_name(sources.pop(0).removeprefix("--from=")), False
        to = self.path(target)
        for source in sources:
            place = to / source if target.endswith("/") else to
            found = context / source.lstrip("/")
            place.parent.mkdir(parents=True, exist_ok=True)
            if found.is_dir():
                shutil.copytree(found, place, symlinks=True, ignore=_left_out if own else None)
            else:
                assert not own or is_sent(source), f"{source} is not sent to the builder"
                shutil.copy(found, place)


def _left_out(folder: str, names: list[str]) -> list[str]:
    """The files of a folder of the repository that are not sent; its folders are entered."""
    found = [(name, Path(folder) / name) for name in names]
    return [
        name for name, path in found
        if (path.is_symlink() or not path.is_dir()) and not is_sent(path.relative_to(ROOT).as_posix())
    ]  # fmt: skip
