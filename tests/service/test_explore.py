"""Exploring all cases over HTTP, by both clients, by the command, and on the page."""

from __future__ import annotations

import csv
import html
import io
import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import httpx
import numpy as np
import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.cli import remote
from sprag_study.service.client import AsyncClient, Client, RefusedError
from sprag_study.service.views.columns import Columns
from tests.conftest import ROOT, Finished
from tests.service.conftest import API, PortalTransport, Service

AXES = [
    {"path": "excitation.frequency", "linspace": ["20 Hz", "30 Hz", 6]},
    {"path": "shaft.load", "values": [0, 0.1, 0.2, 0.4, 0.8]},
]


@pytest.fixture
def filled(service: Service, spec: dict[str, Any]) -> tuple[Service, str]:
    """A finished study of thirty cases with made-up rows."""
    study_id = service.submit({**spec, "axes": AXES})
    service.fill(study_id)
    return service, study_id


def best(service: Service, study_id: str, name: str, most: float) -> list[int]:
    """Cases with a load of at most ``most``, the largest result first."""
    study, block = service.store.studies.study(study_id), service.store.rows.block(study_id)
    values = block.values[:, [info.name for info in block.infos].index(name)]
    load = study.columns(block.cases)["shaft.load"]
    places = [place for place in np.argsort(-values, kind="stable").tolist() if load[place] <= most]
    return block.cases[places].tolist()


async def asynchronous(service: Service, study_id: str) -> Any:
    async with AsyncClient("http://localhost", transport=httpx.ASGITransport(service.app)) as client:
        return await (await client.study(study_id)).explore("shaft.load <= 300 N*mm", sort="-efficiency", limit=4)


def test_the_best_cases_within_a_range(filled: tuple[Service, str], portal: BlockingPortal) -> None:
    service, study_id = filled
    asked = {"where": "shaft.load <= 300 N*mm", "sort": "-efficiency", "limit": 4}
    found = service.get(f"/studies/{study_id}/explore", **asked)
    assert (found["known"], found["selected"]) == (30, 18)
    assert [row["case"] for row in found["cases"]] == best(service, study_id, "efficiency", 0.3)[:4]
    for row in found["cases"]:
        alone = service.get(f"/studies/{study_id}/cases/{row['case']}")
        assert row["parameters"] == alone["parameters"]
        assert row["results"].items() <= alone["results"].items()
        assert (row["ending"], row["flags"]) == (alone["ending"], alone["flags"])
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(study_id).explore("shaft.load <= 0.3", sort="-efficiency", limit=4) == found
    assert portal.call(partial(asynchronous, service, study_id)) == found
    text = service.http.get(f"{API}/studies/{study_id}/explore", params={**asked, "format": "csv"}).text
    rows = list(csv.DictReader(io.StringIO(text)))
    assert [(int(row["case"]), float(row["efficiency"])) for row in rows] == [
        (row["case"], row["results"]["efficiency"]) for row in found["cases"]
    ]
    picture = service.http.get(f"{API}/studies/{study_id}/explore", params={**asked, "format": "svg"})
    assert picture.text.startswith("<?xml")


def test_wrong_questions_name_what_is_wrong(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    for query, parameter in (("where=x", "where"), ("sort=x", "sort"), ("limit=0", "limit"), ("format=svg&x=a", "x")):
        refused = service.http.get(f"{API}/studies/{study_id}/explore?{query}")
        assert (refused.status_code, refused.json()["errors"][0]["parameter"]) == (422, parameter)


def test_columns_are_read_once_until_there_are_other_rows(
    service: Service, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    study_id = service.submit({**spec, "axes": AXES})
    service.fill(study_id, range(10))
    columns, reads = Columns(service.store), list[list[str]]()
    read = service.store.rows.columns

    def counting(study: str, names: list[str]) -> Any:
        reads.append(list(names))
        return read(study, names)

    monkeypatch.setattr(service.store.rows, "columns", counting)
    assert len(columns.of(study_id, ["efficiency"]).cases) == 10
    both = columns.of(study_id, ["efficiency", "torque.mean"])
    assert set(both.values) == {"efficiency", "torque.mean"}
    columns.of(study_id, ["torque.mean"])
    assert reads == [["efficiency"], ["torque.mean"]]
    service.fill(study_id)
    whole = columns.of(study_id, ["efficiency"])
    block = service.store.rows.block(study_id)
    np.testing.assert_array_equal(
        whole.values["efficiency"], block.values[:, [info.name for info in block.infos].index("efficiency")]
    )
    assert [whole.kinds[kind] for kind in whole.kind] == list(zip(block.endings, block.flags, strict=True))


@pytest.mark.usefixtures("terminal")
def test_the_command_lists_and_writes_them(
    filled: tuple[Service, str],
    sprag: Callable[..., Finished],
    connected: Callable[[ModuleType], None],
    tmp_path: Path,
) -> None:
    connected(remote)
    service, study_id = filled
    options = ("--where", "shaft.load <= 0.3", "--sort=-efficiency", "--limit", 3)
    shown = sprag("show", study_id, "explore", *options, "-o", tmp_path / "best.csv")
    assert shown.out.splitlines()[0].strip() == "18 of 30 cases"
    cases = [
        int(line.split()[0]) for line in shown.out.splitlines() if line.split()[:1] and line.split()[0].isdecimal()
    ]
    expected = best(service, study_id, "efficiency", 0.3)
    assert cases[-3:] == expected[:3]
    with (tmp_path / "best.csv").open(newline="") as file:
        assert [int(row["case"]) for row in csv.DictReader(file)] == expected
    told = json.loads(sprag("show", study_id, "explore", *options, "--json").out)
    assert [row["case"] for row in told["cases"]] == expected[:3]


def test_so_it_does_by_the_client_as_the_documentation_shows(
    filled: tuple[Service, str], portal: BlockingPortal
) -> None:
    service, study_id = filled
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    starts = ("found = study.explore", "study.select", "study.side_by_side")
    ask, select, beside = (re.findall(f"`({re.escape(start)}[^`]*)`", page)[0] for start in starts)
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        study = client.study(study_id)
        names: dict[str, Any] = {"study": study}
        exec("\n".join((ask, f"made = {select}", f"beside = {beside}")), names)
        assert study.select(limit=10, key="once").id == study.select(limit=10, key="once").id
        with pytest.raises(RefusedError, match="no case is selected"):
            study.select("shaft.load >= 7")
    made = service.store.studies.study(names["made"].id)
    wanted = [case["parameters"] for case in names["found"]["cases"]]
    assert [made.case_parameters(case) for case in range(made.cases)] == wanted
    assert len(wanted) == 10
    first, other = (service.get(f"/studies/{study_id}/cases/{case}") for case in (3, 7))
    table = names["beside"]
    assert table.columns.tolist() == ["unit", 3, 7]
    assert table.loc["efficiency"].tolist() == ["1", first["results"]["efficiency"], other["results"]["efficiency"]]
    assert table.loc["shaft.load"].tolist() == ["N*m", *(row["parameters"]["shaft.load"] for row in (first, other))]
    assert table.loc["ending", [3, 7]].tolist() == [first["ending"], other["ending"]]


def test_an_empty_database_leads_to_a_study_with_one_button(service: Service) -> None:
    page = service.http.get("/").text
    fields = re.findall(r'<input type="hidden" name="([^"]+)" value="([^"]*)">', page)
    sent = {name: html.unescape(value) for name, value in fields} | {"do": "submit"}
    answer = service.http.post("/new", data=sent, follow_redirects=False)
    assert answer.status_code == 303
    made = answer.headers["location"].removeprefix("/studies/")
    assert service.get(f"/studies/{made}")["cases"] == 512
    assert "Run an example" not in service.http.get("/").text
