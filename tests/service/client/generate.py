"""Makes what of the client is not written by hand: ``python -m tests.service.client.generate``.

Its methods of views are made of the descriptions of the views (`tests.service.client.view_methods`), the synchronous
client of the asynchronous one, the classes of drafts of the schema of the spec (`tests.service.client.draft_classes`).
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from tests.service.client import draft_classes, view_methods

ROOT = Path(__file__).resolve().parents[3]
SOURCE = ROOT / "service" / "client" / "asynchronous"
TARGET = SOURCE.with_name("synchronous")
VIEWS = SOURCE / "views.py"
MACHINES = SOURCE.with_name("machines")
#: Words and what stands for them, in this order.
WORDS = (
    (r"\basync (def|for|with)\b", r"\1"),
    (r"\bawait ", ""),
    (r"\bAsyncGenerator\[(.*), None\]", r"Generator[\1, None, None]"),
    (r"\bAsyncBaseTransport\b", "BaseTransport"),
    (r"\basynccontextmanager\b", "contextmanager"),
    (r"\bAsync(?=[A-Z])", ""),
    (r"\bhttpx\.AsyncClient\b", "httpx.Client"),
    (r"\b__a(enter|exit)__", r"__\1__"),
    (r"\b(self\._http\.)aclose\b", r"\1close"),
    (r"\baclosing\b", "closing"),
    (r"\baread\b", "read"),
    (r"\baiter_(bytes|lines)\b", r"iter_\1"),
    (r"\basyncio\b", "time"),
    (r"\basynchronous\b", "synchronous"),
)


def synchronous(text: str) -> str:
    """The synchronous form of a module."""
    for pattern, replacement in WORDS:
        text = re.sub(pattern, replacement, text)
    return text


def write(folder: Path, views: Path = VIEWS, machines: Path = MACHINES) -> None:
    """Write the methods of views, the classes of drafts, and the synchronous client but its first module."""
    views.write_text(view_methods.module(), encoding="utf-8")
    laid_out([views])
    machines.mkdir(exist_ok=True)
    for name, text in draft_classes.modules().items():
        (machines / f"{name}.py").write_text(text, encoding="utf-8")
    laid_out(sorted(machines.glob("*.py")))
    made = [folder / path.name for path in sorted(SOURCE.glob("[a-z]*.py"))]
    for path in made:
        source = views if path.name == VIEWS.name else SOURCE / path.name
        path.write_text(synchronous(source.read_text(encoding="utf-8")), encoding="utf-8")
    laid_out(made)


def laid_out(made: list[Path]) -> None:
    """Order and lay out modules by ruff."""
    for command in (
        ["check", "--fix-only", "--unsafe-fixes", "--select", "F401,SIM117,UP028,C416,PIE790"],
        ["check", "--fix-only", "--select", "I"],  # after it, as a long import that is split stays so
        ["format"],
    ):
        run = [
            sys.executable,
            "-m",
            "ruff",
            *command,
            "--quiet",
            "--no-cache",
            "--config",
            str(ROOT / "pyproject.toml"),
        ]
        subprocess.run([*run, *made], check=True, cwd=ROOT)


if __name__ == "__main__":
    write(TARGET)
