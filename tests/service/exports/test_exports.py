"""Files of all rows, read back with the tools people use: each number is the double that was stored."""

from __future__ import annotations

import io
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import openpyxl
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import xarray as xr
from openpyxl.utils import get_column_letter

from sprag_study.service import exports
from sprag_study.service.client.frames import grid_of
from sprag_study.service.exports import Source, xlsx
from sprag_study.service.formats import FORMATS, MEDIA_TYPES, SUFFIXES, Format, format_of
from sprag_study.service.storage.studies.records import RowBlock
from sprag_study.worker import fingerprint, models
from sprag_study.worker.study import Study
from tests.service.conftest import made_up

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.worker.models import ChunkResult
    from tests.service.conftest import Service

API = "/api/v1"
LOADS = [0.02, 0.1, 0.3]


@dataclass
class Filled:
    """A finished study, its rows, and its files."""

    service: Service
    id: str
    study: Study
    rows: ChunkResult

    def file(self, form: str, **asked: str) -> bytes:
        """The bytes of all rows in a format."""
        response = self.service.http.get(f"{API}/studies/{self.id}/results", params={"format": form, **asked})
        assert response.status_code == 200, response.text
        assert response.headers["content-type"] == MEDIA_TYPES[form]  # type: ignore[index]
        assert f"{self.id}.{SUFFIXES[form][0]}" in response.headers["content-disposition"]  # type: ignore[index]
        return response.content

    @property
    def names(self) -> list[str]:
        """Result names."""
        return [info.name for info in models.study_results(self.study)]

    @property
    def computed_by(self) -> list[dict[str, Any]]:
        """Where the rows come from: all of them from this process."""
        chunks = len(range(0, self.study.cases, self.service.store.studies.get(self.id).chunk_cases))
        digest, cases = fingerprint.digest(), self.study.cases
        return [{"host": None, "fingerprint": digest, "chunks": chunks, "cases": cases, "differs": None}]

    def column(self, name: str) -> NDArray[np.float64]:
        """A result as it was stored."""
        return self.rows.values[:, self.names.index(name)]

    def same(self, found: Any) -> None:
        """Every column of a table has the numbers and texts that were stored."""
        for path, column in self.study.columns(range(self.study.cases)).items():
            np.testing.assert_array_equal(np.asarray(found[path], dtype=np.float64), column)
        for name in self.names:
            np.testing.assert_array_equal(np.asarray(found[name], dtype=np.float64), self.column(name))
        assert list(found["case"]) == list(range(self.study.cases))
        assert list(found["ending"]) == self.rows.endings


@pytest.fixture
def filled(service: Service, spec: dict[str, Any]) -> Filled:
    """A grid of three loads, a tied pair of amplitudes and two frequencies, rows that cover every size of double.

    The shaft's inertia is derived from the load.
    """
    del spec["base"]["shaft"]["inertia"]
    spec["derive"] = {"shaft.inertia": "2e-3 kg*m^2 * (1 + shaft.load / 1 N*m)"}
    spec["axes"] = [
        {"path": "shaft.load", "values": LOADS},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "3 mm"]},
        {"path": "excitation.frequency", "values": ["16.1 Hz", "35 Hz"]},
    ]
    study_id = service.submit(spec)
    rows = service.fill(study_id)
    return Filled(service, study_id, service.store.studies.study(study_id), rows)


def test_pandas_reads_every_table_back(filled: Filled) -> None:
    filled.same(pd.read_csv(io.BytesIO(filled.file("csv"))))
    filled.same(pd.read_parquet(io.BytesIO(filled.file("parquet"))))
    filled.same(pd.read_json(io.BytesIO(filled.file("jsonl")), lines=True, precise_float=True, dtype=False))
    sheet = pd.read_excel(io.BytesIO(filled.file("xlsx")), sheet_name="cases", header=1, keep_default_na=False)
    filled.same(sheet.replace("", np.nan))


def test_polars_reads_every_table_back(filled: Filled) -> None:
    filled.same(pl.read_csv(io.BytesIO(filled.file("csv")), infer_schema_length=None))
    filled.same(pl.read_parquet(io.BytesIO(filled.file("parquet"))))
    filled.same(pl.read_ipc_stream(io.BytesIO(filled.file("arrow"))))
    filled.same(pl.read_ndjson(io.BytesIO(filled.file("jsonl"))))


def test_parquet_and_arrow_tell_units_and_the_study(filled: Filled) -> None:
    parquet = pq.read_table(io.BytesIO(filled.file("parquet")))
    arrow = pa.ipc.open_stream(filled.file("arrow")).read_all()
    assert parquet.equals(arrow)
    for table in (parquet, arrow):
        assert table.schema.field("shaft.load").metadata[b"unit"] == b"N*m"
        assert table.schema.field("shaft.speed.mean").metadata[b"unit"] == b"rad/s"
        assert table.schema.field("run.events").type == pa.int64()
        about = json.loads(table.schema.metadata[b"sprag"])
        assert about["study"] == filled.id
        assert about["computed_by"] == filled.computed_by
        assert about["base"]["pendulums.0.mass"] == 0.5
        assert about["derive"] == {"shaft.inertia": "0.002 * (1 + shaft.load / 1.0)"}
        assert b"derived: 0.002" in table.schema.field("shaft.inertia").metadata[b"description"]
    # What could not be computed is null, and nothing else is.
    assert arrow["shaft.speed.mean"].null_count == sum(ending != "ok" for ending in filled.rows.endings)
    assert arrow["flags"].to_pylist() == [flags.split(",") if flags else [] for flags in filled.rows.flags]


def test_openpyxl_reads_typed_cells_units_and_inputs(filled: Filled) -> None:
    book = openpyxl.load_workbook(io.BytesIO(filled.file("xlsx")))
    rows = list(book["cases"].iter_rows(values_only=True))
    names, units = rows[1], dict(zip(rows[1], rows[0], strict=True))
    assert (units["shaft.load"], units["excitation.frequency"]) == ("N*m", "Hz")
    table = {name: [row[index] for row in rows[2:]] for index, name in enumerate(names)}
    filled.same(table)
    assert all(isinstance(cell, int | float) for cell in table["shaft.load"])
    assert table["shaft.speed.mean"][4] is None
    assert filled.rows.endings[4] != "ok"
    inputs = {row[0]: row[1:3] for row in book["inputs"].iter_rows(values_only=True)}
    assert inputs["shaft.inertia"] == ("0.002 * (1 + shaft.load / 1.0)", "kg*m^2")
    assert {row[0]: row[4] for row in book["inputs"].iter_rows(values_only=True)}["shaft.inertia"] == "derived"
    assert inputs["derive.shaft.inertia"][0] == "2e-3 kg*m^2 * (1 + shaft.load / 1 N*m)"
    assert inputs["pendulums.0.mass"] == (0.5, "kg")
    assert inputs["shaft.load"] == ("varies", "N*m")
    assert inputs["study"][0] == filled.id
    assert inputs["duration"][0] == "60 periods"


def test_the_cases_of_a_spreadsheet_are_a_table_with_filters(filled: Filled) -> None:
    sheet = openpyxl.load_workbook(io.BytesIO(filled.file("xlsx")))["cases"]
    (table,) = sheet.tables.values()
    corner = f"{get_column_letter(sheet.max_column)}{filled.study.cases + 2}"
    assert (table.name, table.ref, table.autoFilter.ref) == ("cases", f"A2:{corner}", f"A2:{corner}")
    heads = [cell.value for cell in sheet[2]]
    assert table.column_names == heads
    assert sheet.freeze_panes == "B3"
    # Neighbours of one width stand as one entry.
    wide = {n: entry.width for entry in sheet.column_dimensions.values() for n in range(entry.min, entry.max + 1)}
    for index, head in enumerate(heads, 1):
        longest = max(len(cell.value) for (cell,) in sheet.iter_rows(min_col=index, max_col=index, min_row=2)
                      if isinstance(cell.value, str))  # fmt: skip
        assert min(longest, 60) <= wide[index] <= 61, head
        assert wide[index] >= min(len(head) + 4, 60), "room for the button of the filter"


def test_the_table_of_a_study_without_rows_has_an_empty_row(service: Service) -> None:
    content = service.http.get(f"{API}/studies/{service.submit()}/results?format=xlsx").content
    (table,) = openpyxl.load_workbook(io.BytesIO(content))["cases"].tables.values()
    assert re.fullmatch(r"A2:[A-Z]+3", table.ref)


@pytest.mark.parametrize("units", [None, "rpm"])
def test_the_header_of_csv_may_have_every_unit(filled: Filled, units: str | None) -> None:
    asked = {"header": "units", **({} if units is None else {"units": units})}
    heads = filled.file("csv", **asked).decode().partition("\n")[0].split(",")
    speed = "rad/s" if units is None else units
    assert {"case", "shaft.load [N*m]", "ending", "flags", "efficiency", f"shaft.speed.mean [{speed}]"} <= set(heads)
    bare = filled.file("csv", header="names").decode().partition("\n")[0].split(",")
    assert [head.partition(" [")[0] for head in heads] == bare
    assert filled.file("csv") == filled.file("csv", header="names")


@pytest.mark.parametrize(("form", "header"), [("xlsx", "units"), ("csv", "captions")])
def test_a_header_that_a_file_does_not_have_is_refused(filled: Filled, form: str, header: str) -> None:
    asked = {"format": form, "header": header}
    refused = filled.service.http.get(f"{API}/studies/{filled.id}/results", params=asked)
    assert refused.status_code == 422
    (fault,) = refused.json()["errors"]
    assert (fault["parameter"], fault["value"]) == ("header", header)
    assert fault["allowed"]


def test_a_spreadsheet_goes_on_on_a_further_sheet(filled: Filled, tmp_path: Path) -> None:
    blocks = filled.service.store.rows.blocks(filled.id)
    source = Source(filled.study, models.study_results(filled.study), blocks, {})
    book = openpyxl.load_workbook(xlsx._write(source, tmp_path, sheet_rows=7))
    assert book.sheetnames == ["cases", "cases 2", "cases 3", "inputs"]
    tables = [(table.name, table.ref) for sheet in book for table in sheet.tables.values()]
    assert [(name, re.sub("[A-Z]", "", ref)) for name, ref in tables] == [
        ("cases", "2:7"), ("cases_2", "2:7"), ("cases_3", "2:4"),
    ]  # fmt: skip
    found = [row[0] for name in book.sheetnames[:3] for row in book[name].iter_rows(min_row=3, values_only=True)]
    assert found == list(range(12))


def test_the_client_opens_a_labelled_grid(filled: Filled) -> None:
    with grid_of(filled.file("netcdf")) as grid:
        assert dict(grid.sizes) == {"shaft.load": 3, "excitation.amplitude_x": 2, "excitation.frequency": 2}
        assert grid["shaft.speed.mean"].attrs["units"] == "rad/s"
        assert grid["shaft.load"].attrs["units"] == "N*m"
        for name in filled.names:
            np.testing.assert_array_equal(grid[name].values.reshape(-1), filled.column(name))
        # A value chosen by its labels is that of the case with those values: 0.1 N*m, 3 mm, 16.1 Hz is case 1*4+1*2+0.
        speed = grid["shaft.speed.mean"].sel({"shaft.load": 0.1, "excitation.amplitude_x": 3e-3})
        np.testing.assert_array_equal(
            speed.sel({"excitation.frequency": 16.1}).values, filled.column("shaft.speed.mean")[6]
        )
        assert grid["excitation.amplitude_y"].dims == ("excitation.amplitude_x",)
        inertia = grid.coords["shaft.inertia"]
        np.testing.assert_array_equal(inertia.values[:, 1, 0], 2e-3 * (1 + np.array(LOADS)))
        assert (inertia.attrs["units"], inertia.dims) == ("kg*m^2", grid["case"].dims)
        assert decoded(grid["ending"]) == filled.rows.endings
        assert grid["flags"].values.reshape(-1).tolist() == [int(bool(text)) for text in filled.rows.flags]
        assert grid["case"].dims == grid["ending"].dims
        assert grid["case"].values.reshape(-1).tolist() == list(range(12))
        assert json.loads(grid.attrs["base"])["pendulums.0.mass"] == 0.5


def decoded(variable: xr.DataArray) -> list[str]:
    """Endings of all cases by the table that stands in the file."""
    names = variable.attrs["flag_meanings"].split()
    table = dict(zip(variable.attrs["flag_values"].tolist(), names, strict=True))
    return [table[code] for code in variable.values.reshape(-1).tolist()]


def netcdf(filled: Filled, endings: list[str], flags: list[str]) -> xr.Dataset:
    """The grid of a study whose cases ended so."""
    infos = models.study_results(filled.study)
    block = RowBlock(infos, np.arange(filled.study.cases), endings, flags, filled.rows.values)
    data = b"".join(exports.export(Source(filled.study, infos, [block], {}), "netcdf"))
    return xr.load_dataset(io.BytesIO(data), engine="h5netcdf")


def test_an_ending_and_a_flag_have_one_number_in_every_file(filled: Filled) -> None:
    cases = filled.study.cases
    one = netcdf(filled, ["inertia_insufficient", *["ok"] * (cases - 1)], ["not_settled", *[""] * (cases - 1)])
    other = netcdf(
        filled, ["ok", *["timed_out"] * (cases - 1)], ["windup_out_of_data,not_settled", *[""] * (cases - 1)]
    )
    assert one["ending"].values.reshape(-1)[:2].tolist() == [5, 0]
    assert other["ending"].values.reshape(-1)[:2].tolist() == [0, 101]
    assert (int(one["flags"].values.flat[0]), int(other["flags"].values.flat[0])) == (2, 3)
    for name in ("ending", "flags"):
        assert str(one[name].attrs) == str(other[name].attrs)


def test_cases_move_with_coordinates_that_are_sorted(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = [
        {"path": "shaft.load", "values": [0.1, 0.3, 0.02]},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["3 mm", "1 mm"]},
    ]
    study_id = service.submit(spec)
    rows = service.fill(study_id)
    content = io.BytesIO(service.http.get(f"{API}/studies/{study_id}/results?format=netcdf").content)
    with grid_of(content.getvalue()) as grid:
        # Coordinates only rise or only fall; the cases move with their labels.
        assert grid["shaft.load"].values.tolist() == [0.02, 0.1, 0.3]
        assert grid["excitation.amplitude_x"].values.tolist() == [3e-3, 1e-3]
        assert grid["case"].values.tolist() == [[4, 5], [0, 1], [2, 3]]
        assert decoded(grid["ending"]) == [rows.endings[case] for case in grid["case"].values.reshape(-1)]
        speed = grid["shaft.speed.mean"]
        np.testing.assert_array_equal(speed.values.reshape(-1), rows.values[[4, 5, 0, 1, 2, 3], 0])


def test_a_study_of_one_case_is_a_grid_without_dimensions(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = []
    study_id = service.submit(spec)
    rows = service.fill(study_id)
    with grid_of(service.http.get(f"{API}/studies/{study_id}/results?format=netcdf").content) as grid:
        assert (dict(grid.sizes), int(grid["case"]), int(grid["ending"])) == ({}, 0, 0)
        assert float(grid["shaft.speed.mean"]) == rows.values[0, 0]


def test_a_grid_that_is_not_finished_has_holes_where_cases_are_missing(service: Service) -> None:
    study_id = service.submit()
    rows = service.fill(study_id, range(1, 4))
    with grid_of(service.http.get(f"{API}/studies/{study_id}/results?format=netcdf").content) as grid:
        assert grid["ending"].values.reshape(-1).tolist() == [-1, -1, 0, 0, -1, -1, -1, -1, -1]
        speed = grid["shaft.speed.mean"].values.reshape(-1)
    expected = rows.values[:, 0].copy()
    expected[[0, 1, 4, 5, 6, 7, 8]] = np.nan
    assert models.study_results(service.store.studies.study(study_id))[0].name == "shaft.speed.mean"
    np.testing.assert_array_equal(speed, expected)


def test_axes_that_go_together_are_labels_of_the_cases(service: Service, spec: dict[str, Any]) -> None:
    spec["combine"] = "zip"
    spec["axes"] = [
        {"path": "shaft.load", "values": LOADS},
        {"path": "excitation.frequency", "values": [16, 16, 20]},
    ]
    study_id = service.submit(spec)
    service.fill(study_id)
    with grid_of(service.http.get(f"{API}/studies/{study_id}/results?format=netcdf").content) as grid:
        assert grid["shaft.speed.mean"].dims == ("case",)
        assert grid["shaft.load"].values.tolist() == LOADS
        assert grid["excitation.frequency"].dims == ("case",)


@pytest.mark.parametrize("form", FORMATS)
def test_a_study_without_rows_is_an_empty_table(service: Service, form: str) -> None:
    study_id = service.submit()
    response = service.http.get(f"{API}/studies/{study_id}/results", params={"format": form})
    assert response.status_code == 200
    content = io.BytesIO(response.content)
    found = {
        "csv": lambda: len(pd.read_csv(content)),
        "json": lambda: len(json.load(content)["rows"]),
        "jsonl": lambda: len(content.read()),
        "parquet": lambda: len(pd.read_parquet(content)),
        "arrow": lambda: len(pl.read_ipc_stream(content)),
        "xlsx": lambda: len(list(openpyxl.load_workbook(content)["cases"].iter_rows(min_row=3))),
        "netcdf": lambda: int((xr.load_dataset(content, engine="h5netcdf")["ending"] != -1).sum()),
    }[form]()
    assert found == 0


@pytest.mark.parametrize("form", FORMATS)
def test_the_format_is_chosen_by_accept_too(filled: Filled, form: Format) -> None:
    accept = {"Accept": MEDIA_TYPES[form].partition(";")[0]}
    response = filled.service.http.get(f"{API}/studies/{filled.id}/results", headers=accept)
    assert response.headers["content-type"] == MEDIA_TYPES[form]


def test_the_ending_of_a_file_tells_its_format() -> None:
    for form, endings in SUFFIXES.items():
        assert [format_of(f"a.b/rows.{ending.upper()}") for ending in endings] == [form] * len(endings)
    assert format_of("rows") is None


def test_a_text_that_looks_like_a_formula_is_text(filled: Filled, tmp_path: Path) -> None:
    about = {"name": '=HYPERLINK("x")'}
    source = Source(filled.study, models.study_results(filled.study), iter(()), about)
    sheet = openpyxl.load_workbook(xlsx._write(source, tmp_path))["inputs"]
    cells = {row[0].value: row[1] for row in sheet.iter_rows()}
    assert (cells["name"].value, cells["name"].data_type) == ('=HYPERLINK("x")', "s")


def test_made_up_rows_need_all_digits(filled: Filled) -> None:
    """The rows of these tests would tell a format that writes 16 digits."""
    values = made_up(filled.study).values
    known = values[np.isfinite(values)]
    assert any(float(f"{value:.16g}") != value for value in known.tolist())


def test_every_description_of_the_study_tells_where_rows_come_from(filled: Filled) -> None:
    digest = fingerprint.digest()
    assert filled.service.get(f"/studies/{filled.id}")["computed_by"] == filled.computed_by
    assert json.loads(filled.file("json"))["computed_by"] == filled.computed_by
    sheet = openpyxl.load_workbook(io.BytesIO(filled.file("xlsx")))["inputs"]
    rows = [row for row in sheet.iter_rows(values_only=True) if row[0] == "computed_by"]
    assert [row[2] for row in rows] == [digest]
    with xr.open_dataset(io.BytesIO(filled.file("netcdf"))) as grid:
        assert json.loads(grid.attrs["computed_by"]) == filled.computed_by
    page = filled.service.http.get(f"/studies/{filled.id}").text
    assert f"copied from other studies, fingerprint {digest[:12]}: {filled.study.cases}" in page
    report = filled.service.http.get(f"{API}/studies/{filled.id}/report", params={"appendix": "all"}).text
    assert digest[:12] in report
