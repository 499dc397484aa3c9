"""The worked example of the guide to goals, and the presets with goals."""

from __future__ import annotations

import json
import re
import tomllib
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.jobs.local import run_here
from sprag_study.service.presets import preset_text
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Reading
from sprag_study.service.results.fronts import designs_of, front_json
from sprag_study.service.results.headlines.search import search_headline
from sprag_study.service.results.rounds import sentence
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker.states import StudyState

PAGE = Path(__file__).resolve().parents[2] / "docs" / "guide-goals.md"
SMALL = {"population": 8, "generations": 2}


def spec_of(name: str) -> dict[str, Any]:
    """The spec of a preset with a search that is as small as that of the guide."""
    spec = tomllib.loads(preset_text(name)[1])
    spec["goal"] |= SMALL
    return spec


@pytest.mark.parametrize("section", ["What it answers", "A design that keeps its limits when it is built"])
def test_the_examples_of_the_guide_have_their_designs(section: str) -> None:
    before, _, page = PAGE.read_text(encoding="utf-8").partition(f"\n## {section}\n")
    page = page.split("\n## ")[0]
    fields = re.findall(r"```json\n(.*?)```", page if "```json" in page else before, re.DOTALL)[-1]
    spec = spec_of("least_flywheel")
    parsed = parse_spec({**spec, **json.loads(f"{{{fields}}}")})
    if section == "What it answers":
        assert parsed.study == parse_spec(spec).study
    with run_here(parsed.spec, parsed.study, processes=0, chunk_cases=64) as done:
        study, rounds = done.store.studies.study(done.record.id), done.store.studies.rounds(done.record.id)
        found = designs_of(study, rounds, partial(done.store.rows.for_cases, done.record.id))
        progress = done.store.studies.progress(done.record.id).rounds
    assert progress is not None
    assert page.split("\n> ")[1].startswith(sentence(progress, StudyState.FINISHED))
    if "fresh_drives" in page:
        headline = search_headline(found, over=True).said(Reading(study.model, Units()))
        assert page.split("\n> ")[2].partition("\n")[0] in headline
    rows = [
        [float(cell) for cell in line.strip("|").split("|")] for line in re.findall(r"^\| \d.*$", page, re.MULTILINE)
    ]
    designs = front_json("st", found, len(rows))["designs"]
    assert len(rows) > 2
    for row, design in zip(rows, designs, strict=True):
        limits = [value for name, at in design["results"].items() if name not in design["goals"] for value in at]
        values = [design["design"], *design["goals"].values(), *design["variables"].values(), *limits]
        assert row == pytest.approx(values[: len(row)], rel=1e-3)
