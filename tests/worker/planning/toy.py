"""A planner whose points depend on every bit of every row before them, so that nothing lost or changed stays unseen."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from sprag_study.worker import planning
from sprag_study.worker.planning.rounds import Rows, Step
from sprag_study.worker.study import Axis, Study
from tests.worker import fakes

RESULT = "shaft.speed.mean"
LOAD = (("shaft.load",),)


class Chained:
    """``rounds`` rounds of ``cases`` loads, hashed from the rows so far."""

    paths = LOAD
    results = (RESULT,)

    def __init__(self, plan: Mapping[str, Any]) -> None:
        self.most_rounds, self._cases = plan["rounds"], plan["cases"]
        self.most_cases = self.most_rounds * self._cases
        self.broken_at = plan.get("broken_at")
        self._hash = hashlib.sha256(b"start")
        self._told = 0

    def tell(self, rows: Rows) -> None:
        assert rows.points.shape == (self._cases, 1)
        for part in (rows.points, rows.ok, rows.values[RESULT]):
            self._hash.update(np.ascontiguousarray(part).tobytes())
        self._told += 1

    def ask(self) -> Step:
        if self._told == self.broken_at:
            raise ValueError("there is no such round")
        count = self._cases if self._told < self.most_rounds else 0
        digest = np.frombuffer(self._hash.digest()[:4], dtype="<u4")[0]
        points = np.random.default_rng(int(digest)).uniform(0.0, 1.0, (count, 1))
        return Step(points, {"told": self._told, "hash": self._hash.hexdigest()})


@contextmanager
def known() -> Iterator[None]:
    """The kind "toy" is known meanwhile."""
    planning.PLANNERS["toy"] = Chained
    try:
        yield
    finally:
        del planning.PLANNERS["toy"]


def study(rounds: int = 4, cases: int = 25, **more: object) -> Study:
    """A study with that many rounds of so many cases, with those of its first round."""
    plan = {"kind": "toy", "rounds": rounds, "cases": cases, **more}
    first = Chained({**plan, "broken_at": None}).ask().points
    axes = (Axis(("shaft.load",), first[:, 0]),)
    return Study("vibration-drive", "in rounds", dict(fakes.BASE), dict(fakes.RUN), axes, "zip", plan=plan)
