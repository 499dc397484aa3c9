"""What a message advises where a package is missing: an extra that there is, and that has the package."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Callable, Iterator
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from tests.conftest import Finished

ROOT = Path(__file__).resolve().parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["optional-dependencies"]
SOURCES = [
    file for room in ("engine", "worker", "service", "sprag_study") for file in sorted((ROOT / room).rglob("*.py"))
]


def packages(extra: str) -> set[str]:
    """The distributions of an extra."""
    named = set()
    for requirement in map(Requirement, EXTRAS[extra]):
        named |= set().union(*map(packages, requirement.extras)) if requirement.extras else set()
        named.add(requirement.name.lower().replace("_", "-"))
    return named


def guarded() -> Iterator[tuple[str, str, str]]:
    """The file, the extra and the package of every import for which a message names an extra."""
    for file in SOURCES:
        text = file.read_text("utf-8")
        for node in ast.walk(ast.parse(text)) if "naming_extra" in text else ():
            calls = [item.context_expr for item in node.items] if isinstance(node, ast.With) else []
            for call in calls:
                if not (isinstance(call, ast.Call) and getattr(call.func, "id", "") == "naming_extra"):
                    continue
                extra = ast.literal_eval(call.args[1]) if len(call.args) > 1 else "server"
                for inner in ast.walk(node):
                    names = [alias.name for alias in inner.names] if isinstance(inner, ast.Import) else []
                    names += [inner.module or ""] if isinstance(inner, ast.ImportFrom) else []
                    yield from ((file.name, extra, name.partition(".")[0]) for name in names)


def test_the_extra_that_a_message_names_has_the_package() -> None:
    distributions, checked = packages_distributions(), 0
    for file, extra, package in guarded():
        if package != "sprag_study":
            named = {name.lower().replace("_", "-") for name in distributions[package]}
            assert named & packages(extra), (file, extra, package)
            checked += 1
    assert checked >= 15


def test_every_message_names_an_extra_in_quotes_of_every_shell() -> None:
    texts = [text for file in SOURCES for text in re.findall(r"pip install .{0,3}sprag[^\n]*", file.read_text("utf-8"))]
    assert len(texts) >= 4
    for text in texts:
        (extra,) = re.findall(r'pip install "sprag-study\[([a-z]+|\{extra\})\]"', text)
        assert extra in EXTRAS or extra == "{extra}", text


@pytest.mark.parametrize(
    ("missing", "words", "extra"),
    [
        ("duckdb", ("show", "{study}", "sql", "select 1"), "frames"),
        ("typst", ("run", "{study}", "-o", "report.pdf"), "report"),
        ("pyarrow", ("run", "{study}", "-o", "rows.parquet"), "server"),
    ],
)
def test_a_command_without_its_package_names_the_extra(
    sprag: Callable[..., Finished], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, missing: str,
    words: tuple[str, ...], extra: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    study = tmp_path / "study.json"
    study.write_text((ROOT / "examples" / "one_pendulum.json").read_text("utf-8"))
    (tmp_path / "points.csv").write_text("shaft.load\n0.1\n")
    for name in [name for name in sys.modules if name == missing or name.startswith(f"{missing}.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, missing, None)
    done = sprag(*(word.format(study=study) for word in words), "--points", "points.csv")
    assert (done.code, f'pip install "sprag-study[{extra}]"' in done.err) == (3, True), done.err
    assert "bug" not in done.err
