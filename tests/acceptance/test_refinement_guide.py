"""The worked example of the guide to refinement."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path

import pytest

from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.jobs.local import run_here
from sprag_study.service.results.curve_cases import draw, select
from sprag_study.service.results.defaults import main_query
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker.planning import planner_of
from sprag_study.worker.planning.curves import Why

ROOT = Path(__file__).resolve().parents[2]
#: A finest step of the example, N*m.
STEP = 1.2 / 256.0


def tables(page: str) -> list[list[list[str]]]:
    """The cells of the tables of a page."""
    parts = re.findall(r"((?:^\|.*\n)+)", page, re.MULTILINE)
    return [[[cell.strip() for cell in row.strip("|").split("|")] for row in part.split("\n")[2:-1]] for part in parts]


def test_the_example_of_the_guide_has_its_numbers() -> None:
    page = (ROOT / "docs" / "guide-refinement.md").read_text(encoding="utf-8")
    spec = json.loads((ROOT / "examples" / "one_pendulum.json").read_text(encoding="utf-8"))
    (fields,) = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    parsed = parse_spec({**spec, **json.loads(f"{{{fields}}}")})
    assert parsed.study.plan is not None
    planner = planner_of(parsed.study.plan)
    assert f"at most {planner.most_cases} cases in at most {planner.most_rounds} rounds" in page
    with run_here(parsed.spec, parsed.study, processes=0, chunk_cases=64) as done:
        study = done.store.studies.study(done.record.id)
        query = main_query(study)
        assert query is not None
        drawn = draw(select(study, query), partial(done.store.rows.for_cases, done.record.id))
    (told,) = re.findall(r"needs (\d+)\s+cases", page)
    assert study.cases == pytest.approx(int(told), rel=0.05)
    sentence = page.split("\n> ")[1].split(" (")[0]
    assert curves_figure([("", drawn)]).below.startswith(sentence)
    data = drawn.to_json()
    assert all(curve["passed"] for curve in data["curves"])
    found = [(curve["by"]["excitation.frequency"], jump) for curve in data["curves"] for jump in curve["jumps"]]
    jumps, reasons = tables(page)
    assert len(jumps) == len(found)
    for (frequency, low, high, why, results), (own, jump) in zip(jumps, found, strict=True):
        assert (float(frequency), why.strip("`")) == (own, jump["why"])
        assert re.findall(r"`(.*?)`", results) == jump["results"]
        assert (jump["low"], jump["high"]) == pytest.approx((float(low), float(high)), abs=2.0 * STEP)
    assert [row[0].strip("`") for row in reasons] == [why.value for why in Why]
