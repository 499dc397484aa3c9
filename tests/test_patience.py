"""No test fails because a process is slow, or a page is just being replaced by the next one; long ones come first."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from tests.conftest import LONG, ROOT, TOGETHER

#: Seconds after which a wait is a failure, on a machine that does many other things. Shorter than `LOOK` it is a look.
LIMIT, LOOK = 600.0, 5.0
_WAITS = {"wait", "join", "acquire", "poll", "result"}
#: In a page that is being replaced there is no such element, and a predicate that throws is not asked again.
_THROWS = re.compile(r"(querySelector|getElementById)\([^)]*\)\.")


def calls() -> Iterator[tuple[Path, ast.Call, str]]:
    """Every call of a method in tests, benchmarks and the programs of the docs, and the method's name."""
    for path in (path for folder in ("tests", "benchmarks", "docs") for path in (ROOT / folder).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                yield path, node, node.func.attr


def limits(call: ast.Call, name: str) -> Iterator[float]:
    """The limits that a call sets by numbers, in seconds."""
    given = [word.value for word in call.keywords if word.arg == "timeout"]
    for value in given + (call.args if name in _WAITS and len(call.args) == 1 else []):
        if isinstance(value, ast.Constant) and isinstance(value.value, int | float):
            yield float(value.value)


def test_what_is_waited_for_may_take_long() -> None:
    found = [(path, call, limit) for path, call, name in calls() for limit in limits(call, name)]
    assert len(found) > 20
    assert [f"{path}:{call.lineno}: {limit:g} s" for path, call, limit in found if LOOK <= limit < LIMIT] == []


def test_predicates_of_pages_hold_on_pages_without_the_element() -> None:
    predicates = [(path, call) for path, call, name in calls() if name == "wait_for_function"]
    assert len(predicates) > 10
    assert [f"{path}:{call.lineno}" for path, call in predicates if _THROWS.search(ast.unparse(call))] == []


def test_files_with_a_place_in_the_order_exist() -> None:
    """One that was given another name would be among the last ones again, while other processes have nothing to do."""
    names = [*(f"tests/{name}" for name in LONG), *(name for group in TOGETHER for name in group)]
    assert [name for name in names if not (ROOT / name).is_file()] == []
