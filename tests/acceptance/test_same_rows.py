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

from benchmarks.same_rows import SETTLED_AXES, TIMED, example, rows_of
from tests.acceptance.processes import SECONDS, service
from tests.conftest import Finished

RESULTS = ("shaft.speed.mean", "shaft.speed.max", "torque.max", "power.useful.mean", "efficiency", "run.events")
#: As the example has them, with fewer values.
AXES = [
    {"path": "excitation.frequency", "linspace": ["20 Hz", "35 Hz", 4]},
    {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "3 mm"]},
    {"path": "shaft.load", "values": [0, 0.1, 0.4, 1.6]},
]
FEW = example(run=TIMED, axes=AXES)


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """The rows of `FEW`, case by case in two processes and in an order of their own."""
    return rows_of(tmp_path_factory.mktemp("runs"), FEW, (2, 1, ("--finish-by", "1 h")))


def here(sprag: Callable[..., Finished], folder: Path, spec: dict[str, Any]) -> list[dict[str, Any]]:
    """The rows of a study that is run as one chunk."""
    (folder / "here.json").write_text(json.dumps(spec), encoding="utf-8")
    with pytest.MonkeyPatch.context() as settings:
        settings.setenv("SPRAG_CHUNK_CASES", "64")
        rows: list[dict[str, Any]] = sprag("run", folder / "here.json", "--json").data["rows"]
    assert [row["case"] for row in rows] == list(range(len(rows)))
    assert {row["ending"] for row in rows} == {"ok"}
    return rows


def test_settled_cases_have_the_same_rows_in_any_cut(tmp_path: Path, sprag: Callable[..., Finished]) -> None:
    spec = example(axes=SETTLED_AXES)
    rows = here(sprag, tmp_path, spec)
    assert rows_of(tmp_path, spec, (2, 7, ())) == rows
    assert {row["results"]["regime"] for row in rows} >= {"periodic", "coasting"}


def test_http_gives_the_same_rows_and_curves(tmp_path: Path, reference: list[dict[str, Any]]) -> None:
    with (
        service(tmp_path, "--processes", 2, SPRAG_CHUNK_CASES="7") as running,
        httpx.Client(base_url=f"{running.address}/api/v1", timeout=SECONDS) as client,
    ):
        study = f"/studies/{client.post('/studies', json=FEW).json()['id']}"
        with client.stream("GET", f"{study}/events") as events:
            assert "event: end" in events.iter_lines()
        assert client.get(study).json()["progress"]["endings"] == {"ok": 32}
        assert client.get(f"{study}/results", params={"format": "json"}).json()["rows"] == reference
        query = {"x": "shaft.load", "y": RESULTS, "by": ["excitation.frequency", "excitation.amplitude_x"]}
        curves = client.get(f"{study}/curves", params=query).json()["curves"]
    assert len(curves) == 4 * 2
    seen = set()
    for curve in curves:
        for point, case in enumerate(curve["cases"]):
            row = reference[case]
            seen.add(case)
            assert row["parameters"]["shaft.load"] == curve["x"][point]
            assert {path: row["parameters"][path] for path in query["by"]} == curve["by"]
            assert {name: curve["y"][name][point] for name in RESULTS} == {n: row["results"][n] for n in RESULTS}
    assert seen == set(range(32))


def test_run_gives_the_same_rows_in_any_cut_and_csv_the_same_numbers(
    tmp_path: Path, sprag: Callable[..., Finished], reference: list[dict[str, Any]]
) -> None:
    rows, file = here(sprag, tmp_path, FEW), tmp_path / "rows.csv"
    assert rows == reference
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
