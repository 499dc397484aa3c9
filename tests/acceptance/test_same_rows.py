"""A study goes in over HTTP and comes out as curves that equal the rows of `sprag run`, bit for bit, however it is cut.

With every cut of the whole example: ``python -m benchmarks.same_rows``.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from benchmarks.same_rows import SETTLED_AXES, TIMED, Cut, example
from tests.acceptance.processes import SECONDS, Service
from tests.conftest import Finished

RESULTS = ("shaft.speed.mean", "shaft.speed.max", "torque.max", "power.useful.mean", "efficiency", "run.events")
#: As the example has them, with fewer values.
AXES = [
    {"path": "excitation.frequency", "linspace": ["20 Hz", "35 Hz", 4]},
    {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "3 mm"]},
    {"path": "shaft.load", "values": [0, 0.1, 0.4, 1.6]},
]
FEW = example(run=TIMED, axes=AXES)
#: All cases as one chunk, in this process.
WHOLE: Cut = (0, 64, ())


def run(sprag: Callable[..., Finished], folder: Path, spec: dict[str, Any], cut: Cut) -> list[dict[str, Any]]:
    """The rows of a study as `sprag run` gives them; 0 processes: all of it is computed in this one."""
    processes, chunk, more = cut
    (folder / "here.json").write_text(json.dumps(spec), encoding="utf-8")
    with pytest.MonkeyPatch.context() as settings:
        settings.setenv("SPRAG_CHUNK_CASES", str(chunk))
        options = (*(("--processes", processes) if processes else ()), *more)
        done = sprag("run", folder / "here.json", "--json", *options)
    rows: list[dict[str, Any]] = done.data["rows"]
    assert [row["case"] for row in rows] == list(range(len(rows)))
    assert {row["ending"] for row in rows} == {"ok"}
    return rows


def test_settled_cases_have_the_same_rows_in_any_cut(tmp_path: Path, sprag: Callable[..., Finished]) -> None:
    spec = example(axes=SETTLED_AXES)
    rows = run(sprag, tmp_path, spec, WHOLE)
    assert run(sprag, tmp_path, spec, (1, 7, ())) == rows
    assert {row["results"]["regime"] for row in rows} >= {"periodic", "coasting"}


def test_the_command_and_http_give_the_same_rows_in_any_cut_and_csv_the_same_numbers(
    running: Service, tmp_path: Path, sprag: Callable[..., Finished]
) -> None:
    """As one chunk, case by case in two processes and in an order of their own, and by the service seven at a time."""
    rows, file = run(sprag, tmp_path, FEW, WHOLE), tmp_path / "rows.csv"
    assert run(sprag, tmp_path, FEW, (2, 1, ("--finish-by", "1 h"))) == rows
    served(running, rows)
    assert sprag("run", tmp_path / "here.json", "-o", file).code == 0
    header, *lines = [line.split(",") for line in file.read_text().splitlines()]
    assert len(lines) == len(rows) == 32
    for line, row in zip(lines, rows, strict=True):
        cells = dict(zip(header, line, strict=True))
        for name, value in {**row["parameters"], **row["results"]}.items():
            if isinstance(value, str):
                assert cells[name] == value
            else:
                assert (float(cells[name]) if cells[name] else None) == value
    json.dumps(rows, allow_nan=False)


def served(running: Service, rows: list[dict[str, Any]]) -> None:
    """Submit `FEW` and compare its rows and curves."""
    with httpx.Client(base_url=f"{running.address}/api/v1", timeout=SECONDS) as client:
        study = f"/studies/{client.post('/studies', json=FEW).json()['id']}"
        with client.stream("GET", f"{study}/events") as events:
            assert "event: end" in events.iter_lines()
        assert client.get(study).json()["progress"]["endings"] == {"ok": 32}
        assert client.get(f"{study}/results", params={"format": "json"}).json()["rows"] == rows
        query = {"x": "shaft.load", "y": RESULTS, "by": ["excitation.frequency", "excitation.amplitude_x"]}
        curves = client.get(f"{study}/curves", params=query).json()["curves"]
    assert len(curves) == 4 * 2
    seen = set()
    for curve in curves:
        for point, case in enumerate(curve["cases"]):
            row = rows[case]
            seen.add(case)
            assert row["parameters"]["shaft.load"] == curve["x"][point]
            assert {path: row["parameters"][path] for path in query["by"]} == curve["by"]
            assert {name: curve["y"][name][point] for name in RESULTS} == {n: row["results"][n] for n in RESULTS}
    assert seen == set(range(32))
