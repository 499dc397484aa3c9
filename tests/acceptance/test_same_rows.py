"""A study of 512 cases goes in over HTTP and comes out as curves that equal the rows of `sprag run`, bit for bit."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.acceptance.processes import EXAMPLES, service, sprag

CASES = 512
RESULTS = ("shaft.speed.mean", "shaft.speed.max", "torque.max", "power.useful.mean", "efficiency", "run.events")
CUTS = [(processes, chunk) for processes in (1, 2) for chunk in (1, 7, 512)]
TIMED = {"duration": "60 periods", "window": ["40 periods", "60 periods"]}


def _example(folder: Path, **changes: Any) -> Path:
    """The example study with other entries, as a file."""
    spec = json.loads((EXAMPLES / "one_pendulum.json").read_text(encoding="utf-8"))
    file = folder / "spec.json"
    file.write_text(json.dumps(spec | changes), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def spec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The example as a study of a given time, which takes a fifth of what a settled one takes."""
    return _example(tmp_path_factory.mktemp("spec"), run=TIMED)


@pytest.fixture(scope="module")
def reference(spec: Path) -> list[dict[str, Any]]:
    """The rows as `sprag run` gives them with its own choice of processes and chunks."""
    done = sprag("run", spec, "--json")
    assert done.code == 0, done.err
    rows: list[dict[str, Any]] = done.data["rows"]
    assert [row["case"] for row in rows] == list(range(CASES))
    assert {row["ending"] for row in rows} == {"ok"}
    return rows


@pytest.mark.parametrize(("processes", "chunk"), CUTS)
def test_run_gives_the_same_rows(spec: Path, reference: list[dict[str, Any]], processes: int, chunk: int) -> None:
    done = sprag("run", spec, "--json", "--processes", processes, "--chunk", chunk)
    assert done.code == 0, done.err
    # Python reads and writes floats exactly, so equal lists are equal bits.
    assert done.data["rows"] == reference


def test_coarse_to_fine_gives_the_same_rows(spec: Path, reference: list[dict[str, Any]]) -> None:
    done = sprag("run", spec, "--json", "--processes", 2, "--chunk", 7, "--finish-by", "1 h")
    assert done.code == 0, done.err
    assert done.data["rows"] == reference


@pytest.fixture(scope="module", params=[(1, 512), (2, 7)], ids=lambda cut: f"{cut[0]} processes, chunks of {cut[1]}")
def finished(
    spec: Path, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[httpx.Client]:
    """A client at the address of the study, which a service with this cut has run."""
    processes, chunk = request.param
    with service(tmp_path_factory.mktemp("served"), "--processes", processes, "--chunk", chunk) as running:
        done = sprag("submit", spec, "--wait", "--json", "--server", running.address)
        assert done.code == 0, done.err
        assert done.data["progress"]["endings"] == {"ok": CASES}
        with httpx.Client(base_url=f"{running.address}/api/v1/studies/{done.data['id']}", timeout=60) as client:
            yield client


def test_http_gives_the_same_rows_and_curves(reference: list[dict[str, Any]], finished: httpx.Client) -> None:
    assert finished.get("/results", params={"format": "json"}).json()["rows"] == reference

    query = {"x": "shaft.load", "y": RESULTS, "by": ["excitation.frequency", "excitation.amplitude_x"]}
    curves = finished.get("/curves", params=query).json()["curves"]
    assert len(curves) == 16 * 4
    seen = set()
    for curve in curves:
        for point, case in enumerate(curve["cases"]):
            row = reference[case]
            seen.add(case)
            assert row["parameters"]["shaft.load"] == curve["x"][point]
            assert {path: row["parameters"][path] for path in query["by"]} == curve["by"]
            assert {name: curve["y"][name][point] for name in RESULTS} == {n: row["results"][n] for n in RESULTS}
    assert seen == set(range(CASES))


def test_csv_has_the_same_numbers(spec: Path, reference: list[dict[str, Any]], tmp_path: Path) -> None:
    file = tmp_path / "rows.csv"
    assert sprag("run", spec, "-o", file, "--processes", 2).code == 0
    header, *lines = [line.split(",") for line in file.read_text().splitlines()]
    assert len(lines) == CASES
    for line, row in zip(lines, reference, strict=True):
        cells = dict(zip(header, line, strict=True))
        for name, value in {**row["parameters"], **row["results"]}.items():
            assert (float(cells[name]) if cells[name] else None) == value
    json.dumps(reference, allow_nan=False)


def test_settled_cases_have_the_same_rows_in_any_chunks(tmp_path: Path) -> None:
    axes = [
        {"path": "excitation.frequency", "linspace": ["20 Hz", "35 Hz", 5]},
        {"path": "shaft.load", "values": [0, 0.2, 0.7, 1.6]},
    ]
    settled = _example(tmp_path, axes=axes)
    runs = [
        sprag("run", settled, "--json", "--processes", processes, "--chunk", chunk)
        for processes, chunk in ((1, 20), (2, 7), (1, 1))
    ]
    assert {row["ending"] for row in runs[0].data["rows"]} == {"ok"}
    assert all(run.data["rows"] == runs[0].data["rows"] for run in runs)
    assert {row["results"]["regime"] for row in runs[0].data["rows"]} >= {"periodic", "coasting"}
