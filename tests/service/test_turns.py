"""Turns: one at a time, a few waiting, the others refused at once."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from service import plots
from service.errors import ApiError
from service.turns import Turns


def test_one_at_a_time_and_only_so_many_waiting() -> None:
    turns, inside, go_on = Turns("pictures", 2), threading.Event(), threading.Event()
    together: list[int] = []
    refused = threading.Semaphore(0)

    def work() -> bool:
        try:
            with turns.take():
                together.append(1)
                inside.set()
                assert go_on.wait(60)
                assert together.pop() == 1
                assert not together
        except ApiError:
            refused.release()
            return False
        return True

    with ThreadPoolExecutor(5) as threads:
        made = [threads.submit(work)]
        assert inside.wait(60)
        made += [threads.submit(work) for _ in range(4)]
        for _ in range(2):  # while nobody goes on, two wait and two are refused
            assert refused.acquire(timeout=60)
        go_on.set()
        assert sorted(future.result() for future in made) == [False, False, True, True, True]
    with turns.take():
        pass


def test_a_failure_gives_the_turn_back() -> None:
    turns = Turns("pictures", 0)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError), turns.take():
            raise ZeroDivisionError


def test_pictures_take_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    turns = Turns("pictures", 0)
    monkeypatch.setattr(plots, "_TURNS", turns)
    with turns.take(), pytest.raises(ApiError, match="Too many pictures are waiting") as refused:
        plots.render(lambda _: None, "svg", (1.0, 1.0))
    assert refused.value.problem == "unavailable"
    assert plots.render(lambda _: None, "svg", (1.0, 1.0)).startswith(b"<?xml")
