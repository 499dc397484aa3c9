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

from sprag.service.cli import study_views
from sprag.service.client import AsyncClient, Client, RefusedError
from sprag.service.http.web import explore as explore_pages
from sprag.service.http.web.form.spec import spec_of
from sprag.service.reading.wording import number
from sprag.service.views.columns import Columns
from tests.conftest import ROOT, Finished
from tests.service.conftest import API, PortalTransport, Service
from tests.service.http.web.controls import Controls

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


def test_the_command_lists_and_writes_them(
    filled: tuple[Service, str],
    sprag: Callable[..., Finished],
    connected: Callable[[ModuleType], None],
    tmp_path: Path,
) -> None:
    connected(study_views)
    service, study_id = filled
    options = ("--where", "shaft.load <= 0.3", "--sort=-efficiency", "--limit", 3)
    shown = sprag("explore", study_id, *options, "-o", tmp_path / "best.csv")
    assert shown.out.splitlines()[0].strip() == "18 of 30 cases"
    cases = [
        int(line.split()[0]) for line in shown.out.splitlines() if line.split()[:1] and line.split()[0].isdecimal()
    ]
    expected = best(service, study_id, "efficiency", 0.3)
    assert cases[-3:] == expected[:3]
    with (tmp_path / "best.csv").open(newline="") as file:
        assert [int(row["case"]) for row in csv.DictReader(file)] == expected
    told = json.loads(sprag("explore", study_id, *options, "--json").out)
    assert [row["case"] for row in told["cases"]] == expected[:3]


def test_a_file_that_has_not_the_whole_selection_says_so(
    filled: tuple[Service, str],
    sprag: Callable[..., Finished],
    connected: Callable[[ModuleType], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    connected(study_views)
    service, study_id = filled
    assert ">The selection as" in service.http.get(f"/studies/{study_id}/explore").text
    monkeypatch.setattr(explore_pages, "MAX_SELECTED", 10)
    monkeypatch.setattr(study_views, "_most_rows", lambda _question: 10)
    assert ">The first 10 cases of the selection as" in service.http.get(f"/studies/{study_id}/explore").text
    file = tmp_path / "first.csv"
    done = sprag("explore", study_id, "-o", file)
    assert done.err.splitlines()[-1] == f"table: {file}, the first 10 cases of the selection"
    assert len(file.read_text(encoding="utf-8").splitlines()) == 1 + 10


def test_the_page_has_its_choice_in_the_address(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    address = f"/studies/{study_id}/explore?max:shaft.load=300 N*mm&sort=-efficiency&limit=4&x=shaft.load&y=efficiency"
    text = service.http.get(address).text
    assert "<strong>18</strong> of 30" in text
    shown = [int(case) for case in re.findall(rf'<td class="num"><a href="/studies/{study_id}/cases/(\d+)">', text)]
    assert shown == best(service, study_id, "efficiency", 0.3)[:4]
    assert 'name="max:shaft.load" value="300 N*mm"' in text
    quantities = service.get(f"/studies/{study_id}/explore")["quantities"]
    assert text.count('<g class="dimension"') == len(quantities) + 1
    assert re.search(r'data-name="ending".*?class="end">ok</text>', text, re.DOTALL)
    (figure,) = re.findall(r'data-figure="([^"]+)"', text)
    drawn = service.http.get(figure.replace("&amp;", "&")).json()
    assert [trace["name"] for trace in drawn["data"]][-1] == "first in the table"
    assert sorted(drawn["data"][-1]["customdata"]) == sorted(shown)
    (picture,) = re.findall(r'<noscript><img src="([^"]+)"', text)
    assert service.http.get(picture.replace("&amp;", "&")).text.startswith("<?xml")
    (download,) = re.findall(r'href="([^"]+format=csv)"', text)
    rows = list(csv.DictReader(io.StringIO(service.http.get(download.replace("&amp;", "&")).text)))
    assert len(rows) == 18


@pytest.mark.parametrize(
    ("query", "field", "name"),
    [
        ("limit=-1", "limit", "Rows"),
        ("limit=1e999", "limit", "Rows"),
        ("min:efficiency=3 mm", "min:efficiency", "Efficiency, from"),
        ("max:shaft.load=abc", "max:shaft.load", "Load torque, to"),
    ],
)
def test_the_page_says_at_its_field_what_is_wrong_and_asks_the_rest(
    filled: tuple[Service, str], query: str, field: str, name: str
) -> None:
    service, study_id = filled
    page = service.http.get(f"/studies/{study_id}/explore?{query}&max:excitation.frequency=24&sort=-efficiency")
    assert page.status_code == 422
    assert f"<p>{name}: " in page.text
    assert f"got <code>{query.partition('=')[2]}</code>" in page.text
    (wrong,) = re.findall(r'<span class="wrong" id="wrong:([^"]+)">[^<]', page.text)
    assert wrong == field
    (entry,) = re.findall(r'<input name="([^"]+)" value="([^"]+)"[^>]*aria-invalid="true"', page.text)
    assert entry == (field, query.partition("=")[2])
    assert "<strong>15</strong> of 30 finished cases" in page.text
    assert "by efficiency" in page.text
    assert service.http.get(f"/studies/{study_id}/explore/new?{query}").status_code == 422


@pytest.mark.parametrize(("query", "parameter"), [("flag=x", "flag"), ("x=y", "x"), ("min:x=1", "min:x")])
def test_what_has_no_field_is_named_as_in_the_address(filled: tuple[Service, str], query: str, parameter: str) -> None:
    service, study_id = filled
    page = service.http.get(f"/studies/{study_id}/explore?{query}&max:excitation.frequency=24")
    assert page.status_code == 422
    assert f"<code>{parameter}</code>" in page.text
    assert "<strong>15</strong> of 30 finished cases" in page.text


def selection_spec_of(service: Service, study_id: str, query: str) -> dict[str, Any]:
    """The spec in the form of a new study of a selection."""
    text = service.http.get(f"/studies/{study_id}/explore/new?{query}").text
    return spec_of(Controls(text).values)[0]


def test_a_selection_becomes_a_new_study_of_its_cases(service: Service, spec: dict[str, Any]) -> None:
    tied = {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "2 mm"]}
    study_id = service.submit({**spec, "axes": [*AXES, tied]})
    service.fill(study_id)
    query = "max:shaft.load=200 N*mm&sort=-efficiency&limit=1"
    assert f'href="/studies/{study_id}/explore/new?where=' in service.http.get(
        f"/studies/{study_id}/explore?{query}").text  # fmt: skip
    wanted = service.get(f"/studies/{study_id}/explore", where="shaft.load <= 0.2", sort="-efficiency", limit=1000)
    made = service.submit(selection_spec_of(service, study_id, query))
    study = service.store.studies.study(made)
    assert study.cases == wanted["selected"] == 36
    assert [study.case_parameters(case) for case in range(36)] == [row["parameters"] for row in wanted["cases"]]
    assert study.base.items() >= {k: v for k, v in service.store.studies.study(study_id).base.items()
                                  if k not in study.column_paths}.items()  # fmt: skip
    refused = service.http.get(f"/studies/{study_id}/explore/new?min:shaft.load=7")
    assert refused.status_code == 422
    assert "no case is selected" in refused.text


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


def test_cases_side_by_side(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    page = service.http.get(f"/studies/{study_id}/explore/compare?case=3&case=7&case=3")
    assert page.status_code == 200
    assert re.findall(r'<th class="num"><a href="/studies/[^"]*/cases/(\d+)">', page.text) == ["3", "7"]
    first, other = (service.get(f"/studies/{study_id}/cases/{case}") for case in (3, 7))
    change = 100.0 * (other["results"]["efficiency"] - first["results"]["efficiency"]) / first["results"]["efficiency"]
    assert f"{'+' if change > 0 else ''}{number(change, 3)} %" in page.text
    assert "No finished case is chosen" in service.http.get(f"/studies/{study_id}/explore/compare").text
    for wrong in ("case=30", "case=x", "case=1e999", "case=nan", "&".join(f"case={case}" for case in range(11))):
        assert service.http.get(f"/studies/{study_id}/explore/compare?{wrong}").status_code == 422
    waiting = service.submit(
        {"axes": AXES} | {k: v for k, v in service.store.studies.spec(study_id).items() if k != "axes"}
    )
    assert "Not finished: 2." in service.http.get(f"/studies/{waiting}/explore/compare?case=2").text


def test_an_empty_database_leads_to_a_study_with_one_button(service: Service) -> None:
    page = service.http.get("/").text
    fields = re.findall(r'<input type="hidden" name="([^"]+)" value="([^"]*)">', page)
    sent = {name: html.unescape(value) for name, value in fields} | {"do": "submit"}
    answer = service.http.post("/new", data=sent, follow_redirects=False)
    assert answer.status_code == 303
    made = answer.headers["location"].removeprefix("/studies/")
    assert service.get(f"/studies/{made}")["cases"] == 512
    assert "Run an example" not in service.http.get("/").text
