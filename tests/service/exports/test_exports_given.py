"""What the user wrote travels with the numbers: two machines that differ in a word have files that differ in it."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import openpyxl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import xarray as xr

from sprag_study.service.exports.source import given_texts
from sprag_study.service.report.document import report_of
from sprag_study.service.spec.document import load_spec
from sprag_study.service.views.library import Library

if TYPE_CHECKING:
    from tests.service.conftest import Service

EXAMPLES = Path(__file__).parents[3] / "examples"


def got(service: Service, spec: dict[str, Any], form: str, **asked: str) -> bytes:
    """The bytes of a study's rows, or of its report, in a format."""
    study_id = service.submit(spec)
    where = "report" if form in {"html", "pdf"} else "results"
    response = service.http.get(f"/api/v1/studies/{study_id}/{where}", params={"format": form, **asked})
    assert response.status_code == 200, response.text
    return response.content


def press(**changes: Any) -> dict[str, Any]:
    """The crank press, its base changed."""
    spec = load_spec((EXAMPLES / "press.toml").read_text(encoding="utf-8"), "toml")
    spec["base"].update(changes)
    return spec


def part_of(content: bytes, form: str, name: str) -> Any:
    """What a file says of the machine: as it was ``given``, its ``choices``, its ``defaults``."""
    file = io.BytesIO(content)
    if form == "parquet":
        return json.loads(pq.read_schema(file).metadata[b"sprag"])[name]
    if form == "arrow":
        return json.loads(pa.ipc.open_stream(file).schema.metadata[b"sprag"])[name]
    if form == "netcdf":
        with xr.open_dataset(file, engine="h5netcdf") as grid:
            return json.loads(grid.attrs[name])
    return json.loads(content)[name]


@pytest.mark.parametrize("form", ["parquet", "arrow", "netcdf", "json"])
def test_files_for_programs_have_the_machine_as_it_was_given(service: Service, form: str) -> None:
    spec = press(mean_speed_is="time")
    assert part_of(got(service, spec, form), form, "given") == {"base": spec["base"]}


def test_files_for_programs_have_the_run_and_the_clutch_of_a_drive(service: Service) -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    found = part_of(got(service, spec, "parquet"), "parquet", "given")
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


#: What docs/reference.md has a default for and examples/press.toml does not write, with the cycle taken out of it.
PRESS_DEFAULTS = {
    "cycle": "1 revolution",
    "drive.torque": 0,
    "friction_torque": 0,
    "gravity": 9.80665,
    "mechanism.slider_crank.offset": 0,
    "operation.efficiency": 1,
    "operation.scale": 1,
    "operation.sense": "resisting",
    "phi_c": "the first at which T rises",
}


def test_the_sheet_has_what_nobody_wrote_and_says_so(service: Service) -> None:
    spec = press()
    del spec["base"]["cycle"]
    book = openpyxl.load_workbook(io.BytesIO(got(service, spec, "xlsx")))
    rows = {row[0]: row for row in book["inputs"].iter_rows(values_only=True) if row[4]}
    assert {path: row[1] for path, row in rows.items() if row[4] == "default"} == PRESS_DEFAULTS
    assert rows["mechanism.slider_crank.rod"][1:] == (0.4, "m", rows["mechanism.slider_crank.rod"][3], "given")
    assert (rows["mean_speed_is"][1], rows["mean_speed_is"][4]) == ("midrange", "given")
    assert (rows["mean_speed"][1], rows["mean_speed"][4]) == ("varies", "axes")


@pytest.mark.parametrize("form", ["parquet", "arrow", "netcdf", "json"])
def test_files_for_programs_name_the_defaults(service: Service, form: str) -> None:
    spec = press()
    del spec["base"]["cycle"], spec["base"]["mean_speed_is"]
    content = got(service, spec, form)
    found = part_of(content, form, "defaults")
    assert sorted(found) == sorted(f"base.{path}" for path in (*PRESS_DEFAULTS, "mean_speed_is"))
    chosen, numbers = part_of(content, form, "choices"), part_of(content, form, "base")
    assert chosen["mean_speed_is"] == "midrange"
    assert numbers["gravity"] == 9.80665


def test_a_fitted_clutch_is_told_from_a_given_one_and_the_run_has_its_defaults(service: Service) -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    spec["run"] = {"duration": "60 periods"}
    book = openpyxl.load_workbook(io.BytesIO(got(service, spec, "xlsx")))
    origins = {row[0]: (row[1], row[4]) for row in book["inputs"].iter_rows(values_only=True) if row[4]}
    assert origins["pendulums.0.clutch.coefficients.1"][1] == "fitted"
    assert origins["pendulums.0.clutch.max_degree"] == ("7", "given")
    assert origins["pendulums.0.clutch.through_origin"] == ("true", "default")
    assert origins["window"] == ("the last third", "default")
    assert origins["tolerance"] == ("1e-09", "default")
    page = got(service, spec, "html", appendix="inputs", names="codes").decode()
    assert re.search(r"<td[^>]*>9.80665</td><td>m/s²</td><td>default</td><td>gravity</td>", page)
    window = r'<th scope="row">Run: evaluated window</th><td[^>]*>the last third</td><td></td><td>default</td>'
    assert re.search(window, page)


def test_the_report_says_it_too_in_words(service: Service) -> None:
    study_id = service.submit(press(mean_speed_is="time"))
    service.fill(study_id)
    page = service.http.get(f"/api/v1/studies/{study_id}/report?format=html&appendix=given").text
    assert '<th scope="row">Mean speed is</th><td>Time</td>' in page


def test_a_long_table_is_whole_in_files_and_cut_in_the_report(service: Service) -> None:
    spec = json.loads((EXAMPLES / "measured_clutch.json").read_text(encoding="utf-8"))
    path, text = max(given_texts(spec).items(), key=lambda item: len(item[1]))
    shown = report_of(Library(service.store), service.submit(spec)).given[path]
    assert shown == text if len(text) <= 1000 else shown == f"{text[:1000]} ... ({len(text)} characters in all)"


def test_flat_texts_reach_every_leaf() -> None:
    spec = {"base": {"a": {"b": "2 mm", "t": [[0, 1.5], [1, 2]]}, "p": [{"m": 1}, {"m": True}]}, "run": {}, "axes": [1]}
    assert given_texts(spec) == {
        "base.a.b": "2 mm",
        "base.a.t": "[[0, 1.5], [1, 2]]",
        "base.p.0.m": "1",
        "base.p.1.m": "true",
    }
