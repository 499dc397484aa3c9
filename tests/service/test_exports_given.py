"""What the user wrote travels with the numbers: two machines that differ in a word have files that differ in it."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import xarray as xr

from service.exports.source import given_texts
from service.report.content import report_of
from service.spec import load_spec

if TYPE_CHECKING:
    from tests.service.conftest import Service

EXAMPLES = Path(__file__).parents[2] / "examples"


def got(service: Service, spec: dict[str, Any], form: str) -> bytes:
    """The bytes of a study's rows, or of its report, in a format."""
    study_id = service.submit(spec)
    where = "report" if form in {"html", "pdf"} else "results"
    response = service.http.get(f"/api/v1/studies/{study_id}/{where}", params={"format": form})
    assert response.status_code == 200, response.text
    return response.content


def press(**changes: Any) -> dict[str, Any]:
    """The crank press, its base changed."""
    spec = load_spec((EXAMPLES / "press.toml").read_text(encoding="utf-8"), "toml")
    spec["base"].update(changes)
    return spec


def given_in(content: bytes, form: str) -> Any:
    """What a file says of the machine as it was given."""
    file = io.BytesIO(content)
    if form == "parquet":
        return json.loads(pq.read_schema(file).metadata[b"sprag"])["given"]
    if form == "arrow":
        return json.loads(pa.ipc.open_stream(file).schema.metadata[b"sprag"])["given"]
    if form == "netcdf":
        with xr.open_dataset(file, engine="h5netcdf") as grid:
            return json.loads(grid.attrs["given"])
    return json.loads(content)["given"]


@pytest.mark.parametrize("form", ["parquet", "arrow", "netcdf", "json"])
def test_files_for_programs_have_the_machine_as_it_was_given(service: Service, form: str) -> None:
    spec = press(mean_speed_is="time")
    assert given_in(got(service, spec, form), form) == {"base": spec["base"]}


def test_files_for_programs_have_the_run_and_the_clutch_of_a_drive(service: Service) -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    found = given_in(got(service, spec, "parquet"), "parquet")
    assert found["base"] == spec["base"]
    assert found.get("run") == spec.get("run")


def test_sheets_of_two_machines_differ_where_the_machines_do(service: Service) -> None:
    sheets = []
    for mean in ("midrange", "time"):
        book = openpyxl.load_workbook(io.BytesIO(got(service, press(mean_speed_is=mean), "xlsx")))
        sheets.append({row[0]: row[1] for row in book["inputs"].iter_rows(values_only=True) if row[0]})
    assert [sheet["base.mean_speed_is"] for sheet in sheets] == ["midrange", "time"]
    assert sheets[0]["base.cycle"] == "1 revolution"
    assert sheets[0]["base.mean_speed"] == "120 rpm"
    assert "run" not in sheets[0]


def test_the_report_says_it_too(service: Service) -> None:
    page = got(service, press(mean_speed_is="time"), "html").decode()
    assert "<td>base.mean_speed_is</td><td>time</td>" in page
    assert got(service, press(), "pdf").startswith(b"%PDF")


def test_a_long_table_is_whole_in_files_and_cut_in_the_report(service: Service) -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    path, text = max(given_texts(spec).items(), key=lambda item: len(item[1]))
    shown = report_of(service.store, service.submit(spec)).given[path]
    assert shown == text if len(text) <= 1000 else shown == f"{text[:1000]} ... ({len(text)} characters in all)"


def test_flat_texts_reach_every_leaf() -> None:
    spec = {"base": {"a": {"b": "2 mm", "t": [[0, 1.5], [1, 2]]}, "p": [{"m": 1}, {"m": True}]}, "run": {}, "axes": [1]}
    assert given_texts(spec) == {
        "base.a.b": "2 mm",
        "base.a.t": "[[0, 1.5], [1, 2]]",
        "base.p.0.m": "1",
        "base.p.1.m": "true",
    }
