"""The worked example of the guide to tolerances."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sprag_study.service.answers.tolerances import RibbonLine, YieldLine
from sprag_study.service.cli.shown import yield_text
from sprag_study.service.jobs.local import run_here
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.views.drives import RibbonQuery, RibbonView, YieldQuery, YieldView
from sprag_study.service.views.study_view import answer_of

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "guide-tolerances.md").read_text(encoding="utf-8")
SPEED = "shaft.speed.mean"


@contextmanager
def answers(spec: dict[str, Any]) -> Iterator[tuple[RibbonLine, YieldLine]]:
    """Ribbon and yield of the guide."""
    parsed = parse_spec(spec)
    with run_here(parsed.spec, parsed.study, processes=0) as done:
        library: Any = SimpleNamespace(store=done.store)
        ribbons, yields, study = RibbonView(), YieldView(), done.record.id
        ribbon = ribbons.json(answer_of(library, study, ribbons, RibbonQuery((SPEED,))))
        reached = yields.json(answer_of(library, study, yields, YieldQuery((f"{SPEED} >= 90 % of nominal",))))
        yield ribbon["lines"][0], reached["lines"][0]


def tables() -> list[list[list[float]]]:
    """The numbers of the tables of the page."""
    blocks = re.findall(r"(?:^\| \d.*\n)+", PAGE, re.MULTILINE)
    return [[[float(cell) for cell in re.findall(r"\d[\d.]*", row)] for row in block.splitlines()] for block in blocks]


def test_the_example_of_the_guide_has_its_numbers() -> None:
    spec = json.loads((ROOT / "examples" / "tolerances.json").read_text(encoding="utf-8"))
    (fields,) = re.findall(r"```json\n(.*?)```", PAGE, re.DOTALL)
    assert json.loads(f"{{{fields}}}").items() <= spec.items()
    ribbon_rows, yield_rows = tables()
    first, second = (text.split("\n")[0] for text in PAGE.split("\n> ")[1:])
    with answers(spec) as (ribbon, reached):
        speed = ribbon["results"][SPEED]
        numbers = zip(ribbon["x"], speed["nominal"], *speed["values"], strict=True)
        assert ribbon_rows == [pytest.approx(row, abs=0.006) for row in numbers]
        shares = [(x, *(100.0 * one[part] for part in ("value", "low", "high")))
                  for x, one in zip(reached["x"], reached["each"], strict=True)]  # fmt: skip
        assert yield_rows == [pytest.approx(row, abs=0.06) for row in shares]
        assert first == f"at every place: {yield_text(reached['all'])}"
        written = [float(text) for text in re.findall(r"(\d+\.\d) % of (?:the variance|that of)", PAGE)]
        found = [causes["shares"][2]["share"] for causes in (speed["causes"], reached["causes"])]
        assert written == pytest.approx([100.0 * share for share in found], abs=0.06)
        assert all(share["share"] < share["error"] for share in reached["causes"]["shares"][:2])
    spec["tolerances"][2]["plus_minus"] = "3 %"
    with answers(spec) as (_, reached):
        assert second == yield_text(reached["all"])
