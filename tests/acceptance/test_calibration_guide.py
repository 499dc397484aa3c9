"""The worked example of the guide to calibrations."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path

import pytest

from sprag_study.service.jobs.local import run_here
from sprag_study.service.results.calibration import calibration_of
from sprag_study.service.results.calibration_answers import calibration_json
from sprag_study.service.spec.document import parse_spec

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "guide-calibration.md"


def test_the_example_of_the_guide_has_its_values() -> None:
    page = PAGE.read_text(encoding="utf-8")
    (fields,) = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    spec = json.loads((ROOT / "examples" / "one_pendulum.json").read_text(encoding="utf-8"))
    spec = {name: value for name, value in spec.items() if name not in {"axes", "combine", "run"}}
    parsed = parse_spec({**spec, **json.loads(f"{{{fields}}}")})
    # Each round is one chunk: cases that run side by side take hardly more time than a few of them.
    with run_here(parsed.spec, parsed.study, processes=0, chunk_cases=64) as done:
        study_id, store = done.record.id, done.store
        rows = partial(store.rows.for_cases, study_id)
        found = calibration_json(
            study_id, calibration_of(store.studies.study(study_id), store.studies.rounds(study_id), rows)
        )
    assert found["complete"]
    table = re.findall(r"^\| (\S+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", page, re.MULTILINE)
    assert [row[0] for row in table] == [one["name"] for one in found["parameters"]]
    for row, one in zip(table, found["parameters"], strict=True):
        assert one["interval"] is not None
        assert [float(cell) for cell in row[1:]] == pytest.approx([one["value"], *one["interval"]], rel=1e-3)
    assert found["correlations"] is not None
    assert found["correlations"][0][1] == pytest.approx(0.89, abs=0.01)
    assert re.findall(r"^> (.*)$", page, re.MULTILINE) == found["sentences"]
