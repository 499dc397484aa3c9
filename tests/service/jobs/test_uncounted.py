"""Loading what a process needs does not count against the limit of the function that needs it first."""

from __future__ import annotations

import math
import pickle
import tomllib
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.figures.pictures import picture_file
from sprag_study.service.jobs import checks
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import models
from sprag_study.worker.pool import child_process
from sprag_study.worker.pool.child_process import ChildProcess, uncounted
from tests.worker import fakes

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9"/>'
PRESS = tomllib.loads((Path(__file__).resolve().parents[3] / "examples" / "press.toml").read_text())


class Script:
    """A pipe whose process says things after known times, and the clock that they pass on."""

    def __init__(self, *said: tuple[float, Any]) -> None:
        self.said = list(said)
        self.now = 0.0

    def monotonic(self) -> float:
        """Seconds."""
        return self.now

    def wait(self, _: object, timeout: float) -> list[Script]:
        """Whether the next is said in time."""
        seconds = self.said[0][0]
        self.now += min(seconds, timeout)
        return [self] if seconds <= timeout else []

    def recv(self) -> Any:
        """What is said."""
        return self.said.pop(0)[1]


def answer(script: Script, timeout: float, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setattr(child_process, "wait", script.wait)
    monkeypatch.setattr(child_process, "time", script)
    return ChildProcess(int)._answer_of(script, timeout, None)  # type: ignore[arg-type]


def test_time_of_loading_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    said = ((1.0, "loading"), (100.0, "loaded"), (1.5, (True, 7)))
    assert answer(Script(*said), 3.0, monkeypatch) == (True, 7)
    with pytest.raises(TimeoutError, match="within 2 s"):
        answer(Script(*said), 2.0, monkeypatch)


def test_loading_that_never_ends_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(TimeoutError):
        answer(Script((0.0, "loading"), (math.inf, "loaded")), 3.0, monkeypatch)


@pytest.fixture
def checking() -> Iterator[ChildProcess]:
    """A process that checks."""
    process = ChildProcess(checks.prepare)
    process.start()
    yield process
    process.close()
    process.join()


def said(process: ChildProcess, function: Callable[..., Any], *args: Any) -> list[Any]:
    """Everything that the process says, until its answer: whether it is a value."""
    pipe = process._give(pickle.dumps((function, args)))
    found = [pipe.recv()]
    while not isinstance(found[-1], tuple):
        found.append(pipe.recv())
    return [*found[:-1], child_process._read(pipe, *found[-1], 300.0)[0]]


@pytest.mark.parametrize(
    "function", [partial(picture_file, SVG, "png"), partial(parse_spec, PRESS)], ids=["picture", "shaft"]
)
def test_what_is_loaded_for_the_first_is_not_counted(checking: ChildProcess, function: Callable[[], Any]) -> None:
    models.warm_up(parse_spec(PRESS).study)  # into the cache on disk
    assert said(checking, function) == ["loading", "loaded", True]
    assert said(checking, function) == [True]


def test_what_fails_while_it_is_loaded_is_told(checking: ChildProcess) -> None:
    with pytest.raises(ZeroDivisionError):
        checking.run(fakes.fail_while_loading, (), 300.0)
    assert checking.run(math.sqrt, (4.0,), 300.0) == 2.0


def test_outside_a_process_of_a_pool_nothing_changes() -> None:
    with uncounted():
        pass
