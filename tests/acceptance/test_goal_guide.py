"""The worked example of the guide to goals, and the presets with goals."""

from __future__ import annotations

import json
import re
import tomllib
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sprag.service.jobs.local import run_here
from sprag.service.presets import preset_text
from sprag.service.results.fronts import designs_of, front_json
from sprag.service.results.rounds import sentence
from sprag.service.spec.document import parse_spec

PAGE = Path(__file__).resolve().parents[2] / "docs" / "guide-goals.md"
SMALL = {"population": 8, "generations": 2}


def spec_of(name: str) -> dict[str, Any]:
    """The spec of a preset with a search that is as small as that of the guide."""
    spec = tomllib.loads(preset_text(name)[1])
    spec["goal"] |= SMALL
    return spec


def test_the_example_of_the_guide_has_its_designs() -> None:
    page = PAGE.read_text(encoding="utf-8")
    (fields,) = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    spec = spec_of("least_flywheel")
    parsed = parse_spec({**spec, **json.loads(f"{{{fields}}}")})
    assert parsed.study == parse_spec(spec).study
    with run_here(parsed.spec, parsed.study, processes=0) as done:
        study, rounds = done.store.study(done.record.id), done.store.rounds(done.record.id)
        found = designs_of(study, rounds, partial(done.store.rows_for_cases, done.record.id))
        progress = done.store.progress(done.record.id).rounds
    assert progress is not None
    assert page.split("\n> ")[1].startswith(sentence(progress))
    rows = [
        [float(cell) for cell in line.strip("|").split("|")] for line in re.findall(r"^\| \d.*$", page, re.MULTILINE)
    ]
    designs = front_json("st", found, len(rows))["designs"]
    assert len(rows) > 2
    for row, design in zip(rows, designs, strict=True):
        values = [*design["goals"].values(), *design["variables"].values(), *design["results"]["irregularity"]]
        assert row == pytest.approx([design["design"], *values], rel=1e-3)
