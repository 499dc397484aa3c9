"""The page of rows: conditions, order, table, the chosen row, files, and addresses of earlier pages."""

from __future__ import annotations

import csv
import html
import io
import json
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sprag_study.service.http.web.form.spec import spec_of
from sprag_study.service.http.web.rows import pages
from sprag_study.service.http.web.rows.asked import rounded_to
from sprag_study.service.http.web.rows.view import rows_view
from sprag_study.service.reading.reader import Choice
from sprag_study.service.reading.wording import number
from sprag_study.service.results.fronts import Designs, designs_of
from tests.service.conftest import API, Service
from tests.service.http.web.controls import Controls
from tests.service.searching import search

AXES = [
    {"path": "excitation.frequency", "linspace": ["20 Hz", "30 Hz", 6]},
    {"path": "shaft.load", "values": [0, 0.1, 0.2, 0.4, 0.8]},
]
UKRAINIAN = {"Accept-Language": "uk", "Accept": "text/html"}


@pytest.fixture
def filled(service: Service, spec: dict[str, Any]) -> tuple[Service, str]:
    """A finished study of thirty cases with made-up rows."""
    study_id = service.submit({**spec, "axes": AXES})
    service.fill(study_id)
    return service, study_id


@pytest.fixture(autouse=True)
def typed(service: Service) -> None:
    """Units as in the spec."""
    service.http.cookies.set("sprag_units", "typed")


def read(service: Service, address: str, status: int = 200, **headers: str) -> str:
    """The text of a page."""
    answer = service.http.get(address, headers={"Accept": "text/html", **headers})
    assert answer.status_code == status, answer.text
    return answer.text


def cases(text: str) -> list[int]:
    """The rows of the table."""
    return [int(case) for case in re.findall(r'<tr data-case="(\d+)"', text)]


def counted(text: str) -> str:
    """How many rows are within the conditions."""
    (found,) = re.findall(r'<b role="status">([^<]*)</b>', text)
    return str(found)


def chips(text: str) -> dict[str, str]:
    """The conditions and the addresses without them."""
    found = re.findall(r'<a class="chip on" href="([^"]*)"[^>]*>(.*?) ×</a>', text)
    return {re.sub(r"\s+", " ", re.sub("<[^>]*>", "", words)).strip(): html.unescape(link) for link, words in found}


def best(service: Service, study_id: str, name: str, most: float) -> list[int]:
    """Cases with a load of at most ``most``, the largest result first."""
    study, block = service.store.studies.study(study_id), service.store.rows.block(study_id)
    values = block.values[:, [info.name for info in block.infos].index(name)]
    load = study.columns(block.cases)["shaft.load"]
    places = [place for place in np.argsort(-values, kind="stable").tolist() if load[place] <= most]
    return block.cases[places].tolist()


def test_the_rows_of_a_grid_are_in_order_of_its_main_result(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    text = read(service, f"/studies/{study_id}/rows")
    assert counted(text) == "30 of 30 cases"
    assert cases(text) == best(service, study_id, "shaft.speed.mean", 9.0)[:25]
    assert 'aria-sort="descending"' in text
    further = read(service, f"/studies/{study_id}/rows?skip=25")
    assert cases(further) == best(service, study_id, "shaft.speed.mean", 9.0)[25:]
    assert "26 to 30 of 30" in further


def test_every_choice_is_in_the_address(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    text = read(service, f"/studies/{study_id}/rows?max:shaft.load=300 N*mm&sort=-efficiency&limit=4")
    assert counted(text) == "18 of 30 cases"
    assert cases(text) == best(service, study_id, "efficiency", 0.3)[:4]
    assert list(chips(text)) == ["load torque ≤ 0.3 N·m"]
    assert "12 by load torque alone" in text
    same = read(service, f"/studies/{study_id}/rows?where=shaft.load <= 0.3&sort=-efficiency&limit=4")
    assert (cases(same), counted(same)) == (cases(text), counted(text))
    without = chips(text)["load torque ≤ 0.3 N·m"]
    assert counted(read(service, f"/studies/{study_id}/rows{without}")) == "30 of 30 cases"
    shown = read(service, f"/studies/{study_id}/rows?show=torque.mean&show=shaft.load")
    assert "Columns: 2 of" in shown


def test_a_condition_of_the_form_is_typed_in_any_unit_and_takes_the_place_of_the_one_before(
    filled: tuple[Service, str],
) -> None:
    service, study_id = filled
    own = f"/studies/{study_id}/rows"
    sent = {
        "where": ["shaft.load <= 0.1 N*m", "efficiency >= 0"],
        "of": "shaft.load",
        "least": "100",
        "most": "200 N*mm",
    }
    answer = service.http.get(own, params=sent, follow_redirects=False)
    assert answer.status_code == 303
    text = read(service, answer.headers["location"])
    assert set(chips(text)) == {"efficiency ≥ 0", "load torque 0.1 to 0.2 N·m"}
    # What a page prints can be typed back, in both languages.
    for headers in ({}, UKRAINIAN):
        page = read(service, own, **headers)
        values = re.findall(r'<td class="num goal">([^<]*)</td>', page)
        told = service.http.get(
            own, params={"of": "shaft.speed.mean", "least": values[3]}, headers=headers, follow_redirects=False
        )
        assert told.status_code == 303, values[3]
    wrong = read(service, f"{own}?of=shaft.load&most=abc&where=excitation.frequency <= 24", 422)
    assert re.findall(r'<span class="wrong" id="wrong:([^"]+)">[^<]', wrong) == ["most"]
    assert 'name="most" value="abc"' in wrong
    assert "<p>at most: " in wrong
    assert counted(wrong) == "15 of 30 cases"


def test_a_form_leads_to_its_address_without_a_look_at_the_rows(
    filled: tuple[Service, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    service, study_id = filled
    monkeypatch.setattr(pages, "rows_view", None)
    for query in ("of=shaft.load&most=0.3", "case=3&do=without"):
        answer = service.http.get(f"/studies/{study_id}/rows?{query}", follow_redirects=False)
        assert answer.status_code == 303


def test_the_page_says_which_condition_leaves_nothing(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    query = "where=shaft.load >= 0.8&where=shaft.speed.mean >= 1e30 rad/s"
    text = read(service, f"/studies/{study_id}/rows?{query}")
    assert counted(text) == "0 of 30 cases"
    assert "mean shaft speed ≥ 1·10³⁰ rad/s leaves none of 30." in text
    assert "load torque ≥ 0.8 N·m leaves" not in text
    both = read(service, f"/studies/{study_id}/rows?where=shaft.load >= 0.8&where=shaft.load <= 0.8&"
                "where=excitation.frequency <= 20 Hz&where=power.useful.mean <= -1e30 W&ending=ok")  # fmt: skip
    assert "mean useful power ≤ −1·10³⁰ W leaves none of 30." in both


@pytest.mark.parametrize(
    ("query", "parameter"),
    [("limit=-1", "limit"), ("limit=1e999", "limit"), ("flag=x", "flag"), ("x=y", "x"), ("min:x=1", "min:x"),
     ("sort=nothing", "sort"), ("case=30", "case"), ("skip=-2", "skip")],
)  # fmt: skip
def test_what_cannot_be_asked_is_told_and_the_rest_is_shown(
    filled: tuple[Service, str], query: str, parameter: str
) -> None:
    service, study_id = filled
    text = read(service, f"/studies/{study_id}/rows?{query}&max:excitation.frequency=24", 422)
    assert f"<code>{parameter}</code>" in text
    assert counted(text) == "15 of 30 cases"


def test_the_chosen_row_stands_beside_the_base(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    text = read(service, f"/studies/{study_id}/rows?row=7&sort=case")
    pane = text.partition('id="pane"')[2].partition("</aside>")[0]
    row = service.get(f"/studies/{study_id}/cases/7")
    assert "No. 8 of 30" in pane
    assert number(row["results"]["shaft.speed.mean"], 3) in pane
    base = service.store.studies.study(study_id).base
    assert f"was {number(base['shaft.load'], 4)}" in pane
    for link in (f"/studies/{study_id}/cases/7", f"/new?clone={study_id}&amp;case=7"):
        assert f'href="{link}"' in pane
    assert "row=6" in pane
    assert "row=8" in pane
    outside = read(service, f"/studies/{study_id}/rows?row=7&where=shaft.load <= 0&sort=case")
    assert "Not among these rows" in outside


def test_ticked_rows_are_side_by_side_left_out_saved_or_run_longer(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    own = f"/studies/{study_id}/rows"
    text = read(service, f"{own}?case=3&case=7&case=3")
    assert re.findall(r'<th class="num"><a href="/studies/[^"]*/cases/(\d+)">', text) == ["3", "7"]
    first, other = (service.get(f"/studies/{study_id}/cases/{case}") for case in (3, 7))
    change = 100.0 * (other["results"]["efficiency"] - first["results"]["efficiency"]) / first["results"]["efficiency"]
    assert f"{'+' if change > 0 else ''}{number(change, 3)} %" in text
    read(service, f"{own}?{'&'.join(f'case={case}' for case in range(11))}", 422)
    left = service.http.get(f"{own}?case=3&case=7&do=without", follow_redirects=False).headers["location"]
    page = read(service, left)
    assert counted(page) == "28 of 30 cases"
    assert list(chips(page)) == ["without 2 rows"]
    rows = list(csv.DictReader(io.StringIO(read(service, f"{own}/file?case=3&case=7&format=csv"))))
    assert sorted(int(row["case"]) for row in rows) == [3, 7]
    longer = service.http.post(f"{own}/longer", data={"case": ["3", "7"]}, follow_redirects=False)
    made = service.store.studies.study(longer.headers["location"].removeprefix("/studies/"))
    study = service.store.studies.study(study_id)
    assert [made.case_parameters(case)["shaft.load"] for case in range(2)] == [
        study.case_parameters(case)["shaft.load"] for case in (3, 7)
    ]
    for wrong in ("30", "²", "9" * 5000):
        assert service.http.post(f"{own}/longer", data={"case": ["3", wrong]}).status_code == 422
    waiting = service.submit({**service.store.studies.spec(study_id), "axes": AXES})
    assert "Not finished: 2." in read(service, f"/studies/{waiting}/rows?case=2")


def test_files_have_the_rows_of_the_page(filled: tuple[Service, str], monkeypatch: pytest.MonkeyPatch) -> None:
    service, study_id = filled
    text = read(service, f"/studies/{study_id}/rows?where=shaft.load <= 0.3&sort=-efficiency")
    links = [html.unescape(link) for link in re.findall(r'href="([^"]+/rows/file[^"]+)"', text)]
    rows = list(csv.DictReader(io.StringIO(read(service, links[0]))))
    assert [int(row["case"]) for row in rows] == best(service, study_id, "efficiency", 0.3)
    told = json.loads(read(service, links[1]))
    assert [row["case"] for row in told["cases"]] == best(service, study_id, "efficiency", 0.3)
    monkeypatch.setattr(pages, "MAX_SELECTED", 10)
    assert ">The first 10 rows as" in read(service, f"/studies/{study_id}/rows")


def test_rows_become_a_new_study(service: Service, spec: dict[str, Any]) -> None:
    tied = {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "2 mm"]}
    study_id = service.submit({**spec, "axes": [*AXES, tied]})
    service.fill(study_id)
    text = read(service, f"/studies/{study_id}/rows?max:shaft.load=200 N*mm&sort=-efficiency&limit=1")
    (link,) = re.findall(r'href="([^"]+/rows/new[^"]+)"', text)
    wanted = service.get(f"/studies/{study_id}/explore", where="shaft.load <= 0.2", sort="-efficiency", limit=1000)
    made = service.submit(spec_of(Controls(read(service, html.unescape(link))).values)[0])
    study = service.store.studies.study(made)
    assert study.cases == wanted["selected"] == 36
    assert [study.case_parameters(case) for case in range(36)] == [row["parameters"] for row in wanted["cases"]]
    refused = read(service, f"/studies/{study_id}/rows/new?min:shaft.load=7", 422)
    assert "no case is selected" in refused


def test_earlier_addresses_lead_here_with_their_choices(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    own = f"/studies/{study_id}"
    for before, after in (
        ("explore?max:shaft.load=0.3&sort=-efficiency", "18 of 30 cases"),
        ("cases?ending=ok&at:shaft.load=0.1&col=torque.mean", "6 of 30 cases"),
        ("cases?where=shaft.load <= 0.3&after=7", "18 of 30 cases"),
        ("explore", "30 of 30 cases"),
    ):
        answer = service.http.get(f"{own}/{before}", follow_redirects=False)
        assert answer.status_code == 308
        assert counted(read(service, answer.headers["location"])) == after, before
    for before, after in (("compare?case=3&case=7", "2 cases side by side"), ("new?where=shaft.load <= 0.3", "<form")):
        moved = service.http.get(f"{own}/explore/{before}", follow_redirects=False)
        assert moved.status_code == 308
        assert after in read(service, moved.headers["location"])


def test_kinds_of_rows_are_conditions_too(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit({**spec, "axes": AXES})
    service.fill(study_id)
    text = read(service, f"/studies/{study_id}/rows?ending=chatter")
    failed = [row["case"] for row in service.get(f"/studies/{study_id}/cases")["cases"] if row["ending"] == "chatter"]
    assert (sorted(cases(text)), list(chips(text))) == (failed, ["chatter"])
    assert f"{30 - len(failed)} by chatter alone" in text
    none = read(service, f"/studies/{study_id}/rows?ending=diverged")
    assert "diverged leaves none of 30." in none


def test_a_search_has_its_designs_within_its_limits_the_best_first(service: Service) -> None:
    study_id = search(service)
    text = read(service, f"/studies/{study_id}/rows")
    found = service.get(f"/studies/{study_id}/front")
    feasible = [item["cases"][0] for item in found["designs"] if item["feasible"]]
    assert cases(text) == feasible[:25]
    assert counted(text) == f"{len(feasible)} of {found['counts']['known']} designs"
    assert list(chips(text)) == ["mean shaft speed 6.4 to 9.6 rad/s"]
    link = f"/new?clone={study_id}&amp;case={feasible[0]}&amp;along=shaft.load"
    assert f'href="{link}"' in text
    every = read(service, f"/studies/{study_id}/rows{chips(text)['mean shaft speed 6.4 to 9.6 rad/s']}&limit=100")
    assert sorted(cases(every)) == sorted(item["cases"][0] for item in found["designs"])
    goals = [item["goals"]["efficiency"] for item in found["designs"] if item["feasible"]]
    column = next(iter(re.findall(rf'<tr data-case="{feasible[0]}".*?</tr>', text, re.DOTALL)))
    assert number(goals[0], 4) in column
    assert service.http.get(f"/studies/{study_id}/rows/search.svg").text.startswith("<?xml")
    moved = service.http.get(f"/studies/{study_id}/front?exact=1", follow_redirects=False)
    assert counted(read(service, moved.headers["location"])).startswith(f"{found['counts']['exact']} of")


def test_a_search_of_one_goal_is_in_its_order_and_what_is_over_the_limits_fails(service: Service) -> None:
    study_id = search(service, best=[{"result": "efficiency", "max": True}],
                      subject_to=[{"result": "shaft.speed.mean", "at_least": "1e6 rad/s"}])  # fmt: skip
    text = read(service, f"/studies/{study_id}/rows")
    assert " rad/s leaves none of " in text
    every = read(service, f"/studies/{study_id}/rows?where=")
    found = service.get(f"/studies/{study_id}/front")["designs"]
    goals = {item["cases"][0]: item["goals"]["efficiency"] for item in found}
    shown = [goals[case] for case in cases(every) if goals[case] is not None]
    assert shown == sorted(shown, reverse=True)


def test_a_search_without_any_result_has_a_page(service: Service) -> None:
    study_id = search(service, rounds=0)
    text = read(service, f"/studies/{study_id}/rows")
    assert "No design has its results yet." in text
    assert "No row is chosen." in text


def test_designs_are_ranked_once_for_all_that_shows_them(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    ranked: list[bool] = []

    def rank(*args: Any, exact: bool) -> Designs:
        ranked.append(exact)
        return designs_of(*args, exact=exact)

    monkeypatch.setattr("sprag_study.service.views.library.designs_of", rank)
    study_id = search(service, rounds=1)
    for page in ("/rows", "/rows?sort=rank", "/rows/search.svg", "/rows/file"):
        assert service.http.get(f"/studies/{study_id}{page}").status_code == 200
    assert service.http.get(f"{API}/studies/{study_id}/front").status_code == 200
    assert ranked == [False]


def test_a_batch_has_its_weakest_drives_first(service: Service) -> None:
    preset = json.loads((Path(__file__).parents[4] / "service/presets/tolerances.json").read_text("utf-8"))
    study_id = service.submit({**preset, "drives": 8})
    service.fill(study_id)
    text = read(service, f"/studies/{study_id}/rows")
    assert 'aria-sort="ascending"' in text


def test_many_rows_are_read_by_another_process(filled: tuple[Service, str], monkeypatch: pytest.MonkeyPatch) -> None:
    service, study_id = filled
    text = read(service, f"/studies/{study_id}/rows")
    service.checker.calls.clear()
    monkeypatch.setattr("sprag_study.service.http.web.rows.pages.FEW", 10)
    assert read(service, f"/studies/{study_id}/rows") == text
    assert [function.__name__ for function, *_ in service.checker.calls] == ["rows_view"]
    made = rows_view(*service.checker.calls[0][1:])
    assert pickle.loads(pickle.dumps(made)) == made
    assert isinstance(service.checker.calls[0][-1], Choice)


def test_numbers_that_differ_by_rounding_are_the_same(
    filled: tuple[Service, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    service, study_id = filled
    values = [0.3, 0.3 * (1.0 + 1e-12), 0.303]
    monkeypatch.setattr(pages, "lines_of", lambda _study, _rows: [("torque.mean", "N*m", values)])
    text = read(service, f"/studies/{study_id}/rows?case=3&case=7&case=8")
    assert re.findall(r'<br><span class="soft">([^<]*)</span>', text) == ["the same", "+1 %"]


def test_points_have_what_rows_are_sorted_by_upwards(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    text = read(service, f"/studies/{study_id}/rows?plot=points&show=shaft.speed.mean&show=shaft.load")
    chosen = {
        name: re.findall(r'<option value="([^"]*)" selected', part)
        for name, part in re.findall(r'<select name="([xy])">(.*?)</select>', text)
    }
    assert chosen == {"x": ["shaft.load"], "y": ["shaft.speed.mean"]}


@pytest.mark.parametrize(
    ("language", "told"),
    [("en", "Mean shaft speed is in 'kg'"), ("uk", "Середня швидкість вала")],
)
def test_a_wrong_condition_names_the_result_as_the_page_does(
    filled: tuple[Service, str], language: str, told: str
) -> None:
    service, study_id = filled
    address = f"/studies/{study_id}/rows?where=shaft.speed.mean%3E%3D1+kg"
    page = html.unescape(read(service, address, 422, **{"Accept-Language": language}))
    assert told in page.partition('role="alert"')[2].partition("</div>")[0]


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [("322 rpm", "321.5 rpm", "322.5 rpm"), ("321.8", "321.75", "321.85"), ("3 N*m", "2.995 N*m", "3.005 N*m"),
     ("−0,5", "-0.5005", "-0.4995"), ("2·10⁻³ s", "0.001995 s", "0.002005 s"), ("much", "much", "much")],
)  # fmt: skip
def test_a_result_that_equals_a_printed_number_is_one_that_is_printed_so(text: str, low: str, high: str) -> None:
    assert rounded_to(text) == (low, high)


def test_a_printed_result_is_a_condition_that_keeps_its_row(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    row = next(iter(service.get(f"/studies/{study_id}/explore", limit=1, sort="-shaft.speed.mean")["cases"]))
    value = {**row["parameters"], **row["results"]}["shaft.speed.mean"]
    printed = f"{value:.4g} rad/s"
    asked = {"of": "shaft.speed.mean", "least": printed, "most": printed}
    page = service.http.get(f"/studies/{study_id}/rows", params=asked, follow_redirects=True).text
    assert f"cases/{row['case']}" in page
