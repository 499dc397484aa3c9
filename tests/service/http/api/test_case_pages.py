"""Lists of cases: sorted over all rows, chosen by ranges and kinds, page by page, by programs and on the page."""

from __future__ import annotations

import re
from itertools import groupby
from typing import Any

import numpy as np
import pytest

from sprag_study.service.client import Client
from sprag_study.worker.models import REGIME_SENTENCES
from tests.service.conftest import API, PortalTransport, Service
from tests.service.spec_sample import changed

Rows = list[dict[str, Any]]
SPEED, COUNT = "shaft.speed.mean", "overtakings"


@pytest.fixture
def study_id(service: Service) -> str:
    made = service.submit()
    service.fill(made)
    return made


def every(service: Service, study_id: str, size: int = 3, **query: Any) -> Rows:
    """All pages of so many cases."""
    found: Rows = []
    token: dict[str, str] = {}
    while True:
        page = service.get(f"/studies/{study_id}/cases", page_size=size, **query, **token)
        assert len(page["cases"]) <= size
        found += page["cases"]
        if page["next_page_token"] is None:
            return found
        assert len(page["cases"]) == size
        token = {"page_token": page["next_page_token"]}


def test_cases_are_sorted_by_any_quantity_through_all_pages(service: Service, study_id: str) -> None:
    rows = every(service, study_id)
    assert len(rows) > 8
    for name in rows[0]["results"]:
        if isinstance(rows[0]["results"][name], str):
            continue
        known = [row for row in rows if row["results"][name] is not None]
        rest = [row for row in rows if row["results"][name] is None]
        upwards = sorted(known, key=lambda row: row["results"][name])
        downwards = sorted(known, key=lambda row: -row["results"][name])
        assert every(service, study_id, sort=name) == upwards + rest, name
        assert every(service, study_id, sort=f"-{name}") == downwards + rest, name
    for path in rows[0]["parameters"]:
        expected = sorted(rows, key=lambda row: -row["parameters"][path])
        assert every(service, study_id, sort=f"-{path}") == expected
    assert every(service, study_id, sort="-case") == rows[::-1]
    assert every(service, study_id, sort="ending") == sorted(rows, key=lambda row: row["ending"])
    flagged = every(service, study_id, sort="flags")
    assert flagged[0]["flags"] == []
    assert {tuple(row["flags"]) for row in flagged} == {tuple(row["flags"]) for row in rows}
    groups = [flags for flags, _ in groupby(row["flags"] for row in flagged)]
    assert len(groups) == len({*map(tuple, groups)}) > 1, "cases of the same flags are together"
    assert [flags for flags, _ in groupby(row["flags"] for row in every(service, study_id, sort="-flags"))] == (
        groups[::-1]
    )


def test_cases_are_sorted_by_their_regimes(service: Service) -> None:
    loads = [0.1 * place for place in range(1, 9)]
    study_id = service.submit(
        changed({"/run": {"until": "settled"}, "/axes": [{"path": "shaft.load", "values": loads}]})
    )
    service.fill(study_id)
    rows = every(service, study_id)
    assert len({row["results"]["regime"] for row in rows} - {None}) > 1
    order = {name: place for place, name in enumerate(REGIME_SENTENCES)} | {None: len(REGIME_SENTENCES)}
    assert every(service, study_id, sort="regime") == sorted(rows, key=lambda row: order[row["results"]["regime"]])


def test_ranges_kinds_and_values_choose_them(service: Service, study_id: str) -> None:
    rows = every(service, study_id)
    speeds = sorted(row["results"][SPEED] for row in rows if row["results"][SPEED] is not None)
    middle = speeds[len(speeds) // 2]
    load = rows[0]["parameters"]["shaft.load"]
    asked = {"where": [f"{SPEED} >= {middle!r}", f"shaft.load <= {load!r} N*m"], "ending": "ok", "sort": f"-{SPEED}"}
    expected = [
        row
        for row in rows
        if (row["results"][SPEED] or -np.inf) >= middle
        and row["parameters"]["shaft.load"] <= load
        and row["ending"] == "ok"
    ]
    assert 0 < len(expected) < len(rows)
    assert every(service, study_id, **asked) == sorted(expected, key=lambda row: -row["results"][SPEED])
    held = [row for row in rows if row["parameters"]["shaft.load"] == load]
    assert every(service, study_id, at=f"shaft.load={load!r} N*m") == held
    flag = next(name for row in rows for name in row["flags"])
    assert every(service, study_id, flag=flag, sort="case") == [row for row in rows if flag in row["flags"]]
    assert every(service, study_id, flag=flag, sort="-case") == [row for row in rows[::-1] if flag in row["flags"]]


@pytest.mark.parametrize(
    ("query", "parameter"),
    [
        ({"sort": "beauty"}, "sort"),
        ({"sort": "-"}, "sort"),
        ({"sort": "regime"}, "sort"),
        ({"where": "beauty > 3"}, "where"),
        ({"where": "efficiency"}, "where"),
        ({"at": "shaft.load=17"}, "at"),
        ({"at": "shaft.load"}, "at"),
        ({"ending": "boredom"}, "ending"),
        ({"regime": "boredom"}, "regime"),
        ({"flag": "boredom", "sort": "-case"}, "flag"),
        ({"page_token": "x"}, "page_token"),
        ({"page_token": "3", "sort": "-case"}, "page_token"),
    ],
)
def test_what_cannot_be_chosen_names_the_parameter(
    service: Service, study_id: str, query: dict[str, str], parameter: str
) -> None:
    answer = service.http.get(f"{API}/studies/{study_id}/cases", params=query)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["parameter"] == parameter
    if parameter != "page_token" and query != {"at": "shaft.load"}:
        page = service.http.get(f"/studies/{study_id}/rows", params=query)
        assert page.status_code == 422
        assert f"<code>{parameter}</code>" in page.text


@pytest.mark.parametrize("address", ["/cases?sort=", "/explore?sort=", "/explore?sort=-", "/explore?flag=", "?tag="])
def test_what_is_empty_is_not_ignored(service: Service, study_id: str, address: str) -> None:
    place = f"{API}/studies" if address == "?tag=" else f"{API}/studies/{study_id}"
    answer = service.http.get(place + address)
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["parameter"] == address.partition("?")[2].partition("=")[0]
    if error["parameter"] == "sort":
        assert error["allowed"].startswith("case, ending, flags, ")


def test_a_token_belongs_to_its_order(service: Service, study_id: str) -> None:
    token = service.get(f"/studies/{study_id}/cases", page_size=2, sort=SPEED)["next_page_token"]
    for sort in (f"-{SPEED}", "case", COUNT):
        answer = service.http.get(f"{API}/studies/{study_id}/cases", params={"page_token": token, "sort": sort})
        assert answer.status_code == 422, sort


def test_more_cases_that_finish_do_not_move_the_next_page(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id, range(6))
    first = service.get(f"/studies/{study_id}/cases", page_size=2, sort=f"-{SPEED}")
    service.fill(study_id)
    rows = every(service, study_id, sort=f"-{SPEED}")
    rest = service.get(
        f"/studies/{study_id}/cases", page_size=100, sort=f"-{SPEED}", page_token=first["next_page_token"]
    )["cases"]
    last = first["cases"][-1]["results"][SPEED]
    assert rest == [row for row in rows if row["results"][SPEED] is None or row["results"][SPEED] < last]


def test_the_client_asks_the_same(service: Service, study_id: str) -> None:
    transport = service.http._transport
    assert isinstance(transport, PortalTransport)
    with Client("http://127.0.0.1", transport=transport) as client:
        load = 0.1
        study = client.study(study_id)
        found = list(study.cases(sort=f"-{SPEED}", where=f"{SPEED} >= 0", at={"shaft.load": load}))
        assert found
        assert found == every(service, study_id, sort=f"-{SPEED}", where=f"{SPEED} >= 0", at=f"shaft.load={load}")


def test_the_page_has_the_same_cases_in_the_same_order(service: Service, study_id: str) -> None:
    asked = {"sort": f"-{SPEED}", "where": f"{SPEED} >= 0"}
    moved = service.http.get(f"/studies/{study_id}/cases", params=asked)
    assert moved.status_code == 308
    text = service.http.get(moved.headers["location"]).text
    wanted = [row["case"] for row in every(service, study_id, **asked)]
    assert [int(case) for case in re.findall(r'<tr data-case="(\d+)"', text)] == wanted
    assert f'<b role="status">{len(wanted)} of 9 cases</b>' in text
    assert f'name="where" value="{SPEED} &gt;= 0' in text
