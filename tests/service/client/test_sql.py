"""SQL over rows: the same of a study here and of a service, of several studies, and nothing but reading."""

from __future__ import annotations

import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import polars as pl
import pytest

import sprag_study as sprag
from sprag_study.service.client import Client, Study, statements
from sprag_study.service.client.statements import CASES, selected
from tests.service.conftest import Service

LOAD, SPEED = "shaft.load", "shaft.speed.mean"
BEST = f'select "{LOAD}", max("{SPEED}") as "{SPEED}", count(*) as cases from cases group by all order by 1'


def test_rows_are_selected_here_and_of_a_service(pair: tuple[Study, Study]) -> None:
    there, here = (study.sql(BEST) for study in pair)
    pd.testing.assert_frame_equal(there, here)
    assert there.attrs == here.attrs == {"units": {LOAD: "N*m", SPEED: "rad/s"}}
    table = pair[0].table()
    np.testing.assert_array_equal(there[SPEED], table.groupby(LOAD)[SPEED].max())
    assert there["cases"].sum() == len(table)
    whole = pair[0].sql("from cases")
    pd.testing.assert_frame_equal(whole.drop(columns="flags"), table.drop(columns="flags"))
    assert whole.attrs["units"] == table.attrs["units"]


def test_units_and_polars(pair: tuple[Study, Study]) -> None:
    in_rpm = pair[0].sql(BEST, units="rpm")
    assert in_rpm.attrs["units"][SPEED] == "rpm"
    np.testing.assert_allclose(in_rpm[SPEED], pair[0].sql(BEST)[SPEED] * 30.0 / np.pi, rtol=1e-12)
    other = pair[1].sql("select flags, ending from cases where ending <> 'ok'", polars=True)
    assert isinstance(other, pl.DataFrame)
    assert other.to_dicts() == [{"flags": [], "ending": "chatter"}]


def test_several_studies_are_tables_with_their_names(pair: tuple[Study, Study], service: Service) -> None:
    there, here = pair
    names = {"there": there, "in this process": here}
    count = sprag.sql("select study, count(*) as cases from cases group by all order by all", names)
    assert count.to_dict("list") == {"study": ["in this process", "there"], "cases": [9, 9]}
    joined = sprag.sql(f'select a."{LOAD}" from there a join "in this process" b using ("case")', names)
    assert len(joined) == 9
    assert joined.attrs["units"] == {LOAD: "N*m"}
    name = there.detail()["name"]
    assert len(sprag.sql(f'from "{name}"', [there])) == 9
    client = there._client
    assert isinstance(client, Client)
    assert client.sql("from cases select distinct study", [there.id])["study"].tolist() == [name]
    assert len(client.sql("from before", {"before": there.id}, polars=True)) == 9


@pytest.mark.parametrize("names", [[], ["a", "A"], ["Cases"], [""], ["a", ""]])
def test_names_of_tables_are_different(pair: tuple[Study, Study], names: list[str]) -> None:
    with pytest.raises(sprag.SpragError, match="of different names") as refused:
        sprag.sql("from cases", dict.fromkeys(names, pair[0]))
    assert isinstance(refused.value, ValueError)


def test_a_name_with_points_needs_quotes_and_the_error_says_so(pair: tuple[Study, Study]) -> None:
    with pytest.raises(sprag.StatementError, match=f'stands in double quotes: "{LOAD}"'):
        pair[1].sql(f"select {LOAD} from cases")
    with pytest.raises(sprag.StatementError, match="speed_of_light") as refused:
        pair[1].sql("select speed_of_light from cases")
    assert "double quotes" not in str(refused.value)


#: What would reach files, addresses, settings, or variables of the program.
BEYOND = (
    "copy cases to '{file}'",
    "from read_csv('{there}')",
    "from read_text('{there}')",
    "from '{there}'",
    "from glob('{folder}/*')",
    "from read_parquet('http://127.0.0.1:9/rows.parquet')",
    "attach '{file}'",
    "export database '{folder}'",
    "set enable_external_access = true",
    "from enable_logging(storage = 'file', storage_path = '{file}')",
    "install httpfs",
    "load httpfs",
    "from frame",
    "drop view cases",
    "create table more as from cases",
    "select 1; select 2",
    "create table more as pivot cases on a using count(*)",
    "with p as (pivot cases on a using count(*)) delete from cases returning *",
    "copy (pivot cases on a using count(*)) to '{file}'",
    "pragma database_list",
    "",
    "selec 1",
)


@pytest.mark.parametrize("statement", BEYOND)
def test_a_statement_only_reads_the_rows(tmp_path: Path, statement: str) -> None:
    frame = pd.DataFrame({"case": [1], "a": [2.0]})
    there, file = tmp_path / "there.csv", tmp_path / "written"
    there.write_text("a\n1\n")
    frame.to_parquet(tmp_path / "rows.parquet")
    rows = {CASES: (tmp_path / "rows.parquet").read_bytes()}
    assert selected("from cases select a", rows, False)["a"].tolist() == [2.0]
    with pytest.raises(sprag.StatementError):
        selected(statement.format(file=file, there=there, folder=tmp_path), rows, False)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["rows.parquet", "there.csv"]


@pytest.fixture
def rows() -> dict[str, bytes]:
    """Three cases as `selected` takes them."""
    file = io.BytesIO()
    pd.DataFrame({"case": [0, 1, 2], "a": [1.0, 2.0, 4.0], "kind": ["u", "v", "u"]}).to_parquet(file)
    return {CASES: file.getvalue()}


def test_sums_and_decimals_are_numbers(rows: dict[str, bytes]) -> None:
    statement = 'select sum("case") as n, 1.5 as d, 1e3::decimal(9, 2) as e, sum(2 ** 63::hugeint) as h from cases'
    frame = selected(statement, rows, False)
    assert [kind.kind for kind in frame.dtypes] == ["i", "f", "f", "f"]
    assert frame.iloc[0].tolist() == [3, 1.5, 1000.0, 3 * 2.0**63]
    nested = "select [1.5, 2] as items, {'a': 0.1} as parts, [sum(\"case\")] as whole from cases"
    assert selected(nested, rows, True).to_dicts() == [{"items": [1.5, 2.0], "parts": {"a": 0.1}, "whole": [3]}]


@pytest.mark.parametrize("polars", [False, True])
def test_columns_of_one_name_are_numbered(pair: tuple[Study, Study], polars: bool) -> None:
    statement = f'select "{LOAD}", "{LOAD}", a."{SPEED}" from cases a order by "case"'
    table: Any = pair[1].sql(statement, polars=polars)
    assert list(table.columns) == [LOAD, f"{LOAD}_1", SPEED]
    if not polars:
        assert table.attrs["units"] == {LOAD: "N*m", f"{LOAD}_1": "N*m", SPEED: "rad/s"}


def test_a_pivot_only_reads(rows: dict[str, bytes]) -> None:
    for statement in (
        "pivot cases on kind using sum(a);",
        "from (pivot cases on kind using sum(a)) -- both",
    ):
        assert {"u", "v"} <= set(selected(statement, rows, False).columns)


@pytest.mark.parametrize(
    ("statement", "polars"),
    [
        ("select union_value(a := 1) as u", False),
        ("select [union_value(a := 1)] as u", True),
        ("select interval 1 day as u", True),
    ],
)
def test_types_that_tables_do_not_have_are_refused(rows: dict[str, bytes], statement: str, polars: bool) -> None:
    with pytest.raises(sprag.StatementError, match='the column "u" has the type'):
        selected(statement, rows, polars)


def test_a_date_that_python_does_not_have_is_refused(rows: dict[str, bytes]) -> None:
    with pytest.raises(sprag.StatementError, match="year 50000 is out of range"):
        selected("select date '50000-01-01' as d", rows, False)


def test_no_setting_is_named_where_memory_is_short(rows: dict[str, bytes], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(statements._CLOSED, "memory_limit", "10MB")
    with pytest.raises(sprag.StatementError, match="fewer columns or cases") as refused:
        selected("from range(10_000_000) t(a) order by random()", rows, False)
    assert "SET " not in str(refused.value)


def test_nothing_is_asked_for_before_the_statement_is_read(pair: tuple[Study, Study]) -> None:
    study = Study(pair[1]._client, "st_0123456789abcdef")
    with pytest.raises(sprag.StatementError, match="only reads"):
        study.sql("delete from cases")


def test_the_extra_is_named(pair: tuple[Study, Study], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "duckdb", None)
    with pytest.raises(sprag.MissingExtraError, match=r'pip install "sprag-study\[frames\]"'):
        pair[1].sql("from cases")


def test_studies_whose_columns_have_different_units_are_not_mixed(service: Service, spec: dict[str, Any]) -> None:
    first, second = (
        b"".join(_rows(service, spec | {"name": name}, units)) for name, units in (("a", "rpm"), ("b", "si"))
    )
    with pytest.raises(sprag.SpragError, match="the same units of every study"):
        selected("from cases", {"a": first, "b": second}, False)


def _rows(service: Service, spec: dict[str, Any], units: str) -> Any:
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.row_files import pieces

    study_id = service.submit(spec)
    service.fill(study_id)
    return pieces(Library(service.store), study_id, "parquet", units, "names", "")
