"""The programs of docs/exports.md read the files of a study."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd
import pytest

from tests.conftest import ROOT
from tests.serving import served

if TYPE_CHECKING:
    from tests.service.conftest import Service

PAGE = (ROOT / "docs" / "exports.md").read_text(encoding="utf-8")
#: The programs of the page by the library that they import.
PROGRAMS = {match[2]: match[1] for match in re.finditer(r"(?ms)^```python\n(import (\w+)$.*?)^```", PAGE)}
ADDRESS = "http://127.0.0.1:8000/api/v1/studies/ID"


@pytest.fixture
def study_id(service: Service, spec: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A finished study whose files lie in the current folder."""
    study_id = service.submit(spec)
    service.fill(study_id)
    for name, form in (("rows.parquet", "parquet"), ("rows.xlsx", "xlsx"), ("study.nc", "netcdf")):
        answer = service.http.get(f"/api/v1/studies/{study_id}/results", params={"format": form})
        (tmp_path / name).write_bytes(answer.content)
    monkeypatch.chdir(tmp_path)
    return study_id


def run(library: str, address: str = ADDRESS) -> dict[str, Any]:
    """What the names of a program of the page stand for after it ran."""
    names: dict[str, Any] = {}
    exec(compile(PROGRAMS[library].replace(ADDRESS, address), "docs/exports.md", "exec"), names)
    return names


def wanted() -> list[dict[str, Any]]:
    """Of each frequency the row with the largest efficiency, found row by row."""
    best: dict[float, dict[str, Any]] = {}
    for row in pd.read_parquet("rows.parquet").to_dict("records"):
        kept = best.get(row["excitation.frequency"])
        if row["ending"] == "ok" and (kept is None or row["efficiency"] > kept["efficiency"]):
            best[row["excitation.frequency"]] = row
    return [best[frequency] for frequency in sorted(best)]


def columns(rows: list[dict[str, Any]], *names: str) -> list[tuple[Any, ...]]:
    """Some columns of rows."""
    return [tuple(row[name] for name in names) for row in rows]


def test_every_program_of_the_page_is_run_here() -> None:
    assert sorted(PROGRAMS) == ["duckdb", "pandas", "polars", "xarray"]
    assert PAGE.count("```python") == len(PROGRAMS)


@pytest.mark.usefixtures("study_id")
def test_pandas(capsys: pytest.CaptureFixture[str]) -> None:
    names = run("pandas")
    right = [row for row in wanted() if row["efficiency"] > 0.3]
    assert right
    shown = ("excitation.frequency", "shaft.load", "efficiency")
    assert columns(names["best"].to_dict("records"), *shown) == columns(right, *shown)
    assert names["sheet"]["efficiency"].dropna().tolist() == names["table"]["efficiency"].dropna().tolist()
    assert "efficiency" in capsys.readouterr().out


@pytest.mark.usefixtures("study_id")
def test_duckdb() -> None:
    names = run("duckdb")
    found = names["best"].sort_values("excitation.frequency").to_dict("records")
    assert columns(found, "excitation.frequency", "efficiency", "load") == columns(
        wanted(), "excitation.frequency", "efficiency", "shaft.load"
    )
    assert {ending for ending, _ in names["endings"]} == set(pd.read_parquet("rows.parquet")["ending"])
    assert sum(count for _, count in names["endings"]) == 9


def test_polars_reads_columns_over_http_by_parts(service: Service, study_id: str) -> None:
    asked: list[bytes | None] = []

    async def noting(scope: Any, receive: Any, send: Any) -> None:
        if scope["type"] == "http":
            asked.append(dict(scope["headers"]).get(b"range"))
        await service.app(scope, receive, send)

    with served(noting) as address:
        speeds = run("polars", f"{address}/api/v1/studies/{study_id}")["speeds"]
    table = pd.read_parquet("rows.parquet")
    for column in ("shaft.load", "shaft.speed.mean"):
        assert [value for value in speeds[column] if value is not None] == table[column].dropna().tolist()
    assert asked
    assert None not in asked, "the whole file was requested"


@pytest.mark.usefixtures("study_id")
def test_xarray() -> None:
    names = run("xarray")
    with names["grid"]:
        assert names["speeds"].dims == ("excitation_frequency",)
