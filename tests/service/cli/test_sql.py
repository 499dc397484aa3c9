"""``sprag show SPEC|ID sql``: the same table of a spec and of a study of a service, as text, JSON and a file."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from sprag_study.service.cli import remote
from sprag_study.worker.models import run_chunk
from tests.conftest import Finished
from tests.service import conftest
from tests.service.conftest import Service
from tests.service.timed_spec import SPEC

STATEMENT = 'select "case", flags, "shaft.load", "shaft.speed.mean", null as gap from cases order by 1'
_SMALL = {**SPEC, "axes": [{"path": "shaft.load", "values": ["0 N*m", "0.1 N*m"]}]}


@pytest.fixture
def sources(
    service: Service, connected: Callable[[ModuleType], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[str, str]:
    """A study as a file, and the same study of a service."""
    monkeypatch.setattr(conftest, "made_up", lambda study: run_chunk(study, 0, study.cases))
    connected(remote)
    file = tmp_path / "study.json"
    file.write_text(json.dumps(_SMALL))
    study_id = service.submit(_SMALL)
    service.fill(study_id)
    return str(file), study_id


def test_rows_of_a_study_by_sql(sprag: Callable[..., Finished], sources: tuple[str, str], tmp_path: Path) -> None:
    here, there = (sprag("show", source, "sql", STATEMENT, "--units", "rpm") for source in sources)
    assert (here.code, there.code) == (0, 0), (here.err, there.err)
    assert here.out == there.out
    head, *rows = (line.split("\t") for line in here.out.splitlines())
    assert head == ["case", "flags", "shaft.load [N*m]", "shaft.speed.mean [rpm]", "gap"]
    assert [row[0] for row in rows] == ["0", "1"]
    shown = json.loads(sprag("show", sources[1], "sql", STATEMENT, "--json").out)
    assert [column["unit"] for column in shown["columns"]] == [None, None, "N*m", "rad/s", None]
    assert [row[:3] for row in shown["rows"]] == [[0, [], 0.0], [1, [], 0.1]]
    file = tmp_path / "rows.csv"
    done = sprag("show", sources[1], "sql", STATEMENT, "-o", file)
    assert (done.code, done.out) == (0, ""), done.err
    read = list(csv.reader(file.read_text().splitlines()))
    assert read[0][3] == "shaft.speed.mean [rad/s]"
    assert [float(row[3]) for row in read[1:]] == [row[3] for row in shown["rows"]]
    done = sprag("show", sources[0], "sql", STATEMENT, "-o", file, "--decimal", "comma")
    assert file.read_text(encoding="utf-8-sig").splitlines()[2].startswith("1;;0,1;")
    assert sprag("show", sources[1], "sql", STATEMENT, "--decimal", "comma").code == 2


def test_a_file_has_the_numbers_and_texts_of_every_csv_file(
    sprag: Callable[..., Finished], sources: tuple[str, str], tmp_path: Path
) -> None:
    """Decimal commas in every number, and quotes around a text that looks like one."""
    file = tmp_path / "rows.csv"
    statement = (
        "select 1.5, 12.118::decimal(8, 3) as d, '65.00' as t, '12,1175' as c, true as b, flags from cases limit 1"
    )
    for option, line in (
        ((), '1.5,12.118,"65.00","12,1175",True,""'),
        (("--decimal", "comma"), '1,5;12,118;"65.00";"12,1175";True;""'),
    ):
        done = sprag("show", sources[1], "sql", statement, "-o", file, *option)
        assert done.code == 0, done.err
        assert file.read_text(encoding="utf-8-sig").splitlines()[1] == line


def test_sums_are_numbers_and_columns_of_one_name_are_shown(
    sprag: Callable[..., Finished], sources: tuple[str, str]
) -> None:
    done = sprag("show", sources[1], "sql", 'select sum("case") as n, 0.5 as n from cases', "--json")
    assert json.loads(done.out) == {
        "columns": [{"name": "n", "unit": None}, {"name": "n_1", "unit": None}],
        "rows": [[1, 0.5]],
    }


def test_a_wrong_statement_is_wrong_input(sprag: Callable[..., Finished], sources: tuple[str, str]) -> None:
    for statement, said in (("select shaft.load from cases", "double quotes"), ("drop view cases", "only reads")):
        done = sprag("show", sources[1], "sql", statement)
        assert (done.code, done.out) == (2, ""), done.err
        assert said in done.err
