"""Cases and results: pages, one case, instantaneous values, and whole studies as files."""

from __future__ import annotations

import csv
import io
import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.service import exports
from sprag_study.service.answers import results
from sprag_study.service.exports import Source, csv_pieces, json_pieces
from sprag_study.service.spec.csv_text import escape
from sprag_study.service.storage.studies.records import RowBlock
from sprag_study.worker import models
from tests.service.shapes import fits

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.worker.models import ChunkResult
    from tests.service.conftest import Service

API = "/api/v1"


def results_of(rows: ChunkResult, case: int) -> dict[str, float | None]:
    """The made-up results of one case."""
    infos = models.result_infos("vibration-drive", "1")
    values = rows.values[case].tolist()
    return {info.name: None if math.isnan(value) else value for info, value in zip(infos, values, strict=True)}


def test_cases_that_a_cancelled_study_never_ran_are_told_as_cancelled(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id, range(6))
    service.store.studies.cancel(study_id)
    record = service.store.studies.get(study_id)
    service.store.work.settle(service.store.work.take_over("test"), record.number)
    page = service.get(f"/studies/{study_id}/cases", ending="cancelled")
    fits(results.CasePage, page)
    assert [case["case"] for case in page["cases"]] == list(range(6, record.cases))
    case = service.get(f"/studies/{study_id}/cases/6")
    assert (case["ending"], set(case["results"].values())) == ("cancelled", {None})
    assert case["ending_meaning"] == "The study was cancelled before this case was run."
    assert len(service.get(f"/studies/{study_id}/cases")["cases"]) == record.cases


def test_cases_come_in_pages(service: Service) -> None:
    study_id = service.submit()
    rows = service.fill(study_id, range(6))
    seen: list[dict[str, Any]] = []
    query: dict[str, Any] = {"page_size": 4}
    while True:
        page = service.get(f"/studies/{study_id}/cases", **query)
        fits(results.CasePage, page)
        seen += page["cases"]
        if page["next_page_token"] is None:
            break
        query["page_token"] = page["next_page_token"]
    assert [case["case"] for case in seen] == list(range(6))
    for case in seen:
        assert case["results"] == results_of(rows, case["case"])
        assert case["ending"] == rows.endings[case["case"]]
    assert seen[3]["flags"] == ["windup_out_of_data"]
    assert seen[5]["parameters"] == {"excitation.frequency": 25.5, "shaft.load": 0.3}


def test_cases_can_be_chosen_by_their_ending(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    page = service.get(f"/studies/{study_id}/cases", ending="chatter", page_size=1)
    assert [case["case"] for case in page["cases"]] == [4]
    assert page["next_page_token"] is None
    refused = service.http.get(f"{API}/studies/{study_id}/cases?ending=boredom")
    assert "chatter" in refused.json()["errors"][0]["allowed"]


@pytest.mark.parametrize("token", ["x", "-1", "9" * 19, "9" * 300, "\u0661", ""])
def test_a_token_of_nothing_is_refused(service: Service, token: str) -> None:
    response = service.http.get(f"{API}/studies/{service.submit()}/cases", params={"page_token": token})
    assert response.status_code == 422
    assert response.json()["errors"][0]["parameter"] == "page_token"


def test_one_case_tells_what_its_ending_means(service: Service) -> None:
    study_id = service.submit()
    waiting = service.get(f"/studies/{study_id}/cases/3")
    fits(results.CaseDetail, waiting)
    assert waiting["ending"] == "pending"
    assert set(waiting["results"].values()) == {None}
    rows = service.fill(study_id)
    done = service.get(f"/studies/{study_id}/cases/3")
    assert done["results"] == results_of(rows, 3)
    assert done["ending_meaning"] == models.ENDING_SENTENCES["ok"]
    assert list(done["flag_meanings"]) == ["windup_out_of_data"]
    assert isinstance(done["results"]["run.steps"], int)
    assert service.get(f"/studies/{study_id}/cases/4")["ending_meaning"] == models.ENDING_SENTENCES["chatter"]


@pytest.mark.parametrize("case", ["9", "10000000", "999999999999"])
def test_a_case_beyond_the_last_is_not_found(service: Service, case: str) -> None:
    study_id = service.submit()
    for path in (f"/cases/{case}", f"/cases/{case}/trajectory"):
        response = service.http.get(f"{API}/studies/{study_id}{path}")
        assert (response.status_code, response.json()["type"]) == (404, "/problems/case-not-found")


@pytest.mark.parametrize("case", ["-1", "1.0", "x", "9" * 5000])
def test_what_is_no_number_of_a_case_is_no_address(service: Service, case: str) -> None:
    study_id = service.submit()
    assert service.http.get(f"{API}/studies/{study_id}/cases/{case}").status_code == 404


def test_results_as_json_are_the_rows(service: Service) -> None:
    study_id = service.submit()
    rows = service.fill(study_id)
    response = service.http.get(f"{API}/studies/{study_id}/results?format=json")
    body = response.json()
    assert body["study"] == study_id
    assert body["axes"][0] == {"paths": ["excitation.frequency"], "unit": "Hz", "values": 3}
    assert [row["case"] for row in body["rows"]] == list(range(9))
    for row in body["rows"]:
        fits(results.Case, row)
        assert row["results"] == results_of(rows, row["case"])
    assert [result["name"] for result in body["results"]] == list(body["rows"][0]["results"])
    assert f'filename="{study_id}.json"' in response.headers["content-disposition"]


def test_results_as_csv_read_back_exactly(service: Service) -> None:
    study_id = service.submit()
    rows = service.fill(study_id)
    response = service.http.get(f"{API}/studies/{study_id}/results", headers={"Accept": "text/csv"})
    assert response.headers["content-type"] == "text/csv; charset=utf-8"
    table = list(csv.reader(io.StringIO(response.text)))
    names = [info.name for info in models.result_infos("vibration-drive", "1")]
    assert table[0] == ["case", "excitation.frequency", "shaft.load", "ending", "flags", *names]
    study = service.store.studies.study(study_id)
    for case, row in enumerate(table[1:]):
        assert row[0] == str(case)
        assert [float(cell) for cell in row[1:3]] == list(study.case_parameters(case).values())
        assert row[3:5] == [rows.endings[case], rows.flags[case]]
        values = np.array([float(cell) if cell else math.nan for cell in row[5:]])
        np.testing.assert_array_equal(values, rows.values[case])
    assert len(table) == 10


def test_results_of_a_study_without_axes(service: Service, spec: dict[str, Any]) -> None:
    del spec["axes"]
    study_id = service.submit(spec)
    empty = service.http.get(f"{API}/studies/{study_id}/results?format=csv").text
    assert empty.startswith("case,ending,flags,shaft.speed.mean,")
    assert service.get(f"/studies/{study_id}/results")["rows"] == []
    service.fill(study_id)
    assert service.http.get(f"{API}/studies/{study_id}/results?format=csv").text.splitlines()[1].startswith("0,ok,,")
    assert service.get(f"/studies/{study_id}/results")["rows"][0]["parameters"] == {}


def test_results_have_a_tag(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    first = service.http.get(f"{API}/studies/{study_id}/results?format=csv")
    again = service.http.get(
        f"{API}/studies/{study_id}/results?format=csv", headers={"If-None-Match": first.headers["etag"]}
    )
    assert (again.status_code, again.content) == (304, b"")
    as_json = service.http.get(f"{API}/studies/{study_id}/results", headers={"If-None-Match": first.headers["etag"]})
    assert as_json.status_code == 200


def test_the_format_follows_what_is_liked_best(service: Service) -> None:
    study_id = service.submit()
    for accept, media in (
        ("text/csv;q=0.5, application/json;q=0.4", "text/csv"),
        ("text/csv;q=0.5, application/json", "application/json"),
        ("image/webp, */*", "application/json"),
        ("text/csv;q=x", "application/json"),
        ("text/csv;q=0.1, */*", "text/csv"),
        ("text/*", "text/csv"),
        ("application/json;q=0, */*;q=0.1", "text/csv"),
        ("text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8", "application/json"),
        ("", "application/json"),
    ):
        response = service.http.get(f"{API}/studies/{study_id}/results", headers={"Accept": accept})
        assert response.headers["content-type"].startswith(media), accept
    assert service.http.get(f"{API}/studies/{study_id}/results?format=exe").status_code == 422


@pytest.mark.parametrize("accept", ["application/pdf", "application/foo, image/*", "text/csv;q=0"])
def test_a_format_that_there_is_not_is_told_instead_of_another_being_sent(service: Service, accept: str) -> None:
    address = f"{API}/studies/{service.submit()}/results"
    refused = service.http.get(address, headers={"Accept": accept})
    assert (refused.status_code, refused.headers["content-type"]) == (406, "application/problem+json")
    assert refused.json()["type"] == "/problems/not-acceptable"
    assert "text/csv" in refused.json()["detail"]
    # Who names the format has chosen already.
    assert service.http.get(f"{address}?format=csv", headers={"Accept": accept}).status_code == 200


def test_rows_are_written_as_they_come(service: Service) -> None:
    study_id = service.submit()
    study = service.store.studies.study(study_id)
    infos = models.study_results(study)
    given: list[int] = []

    def blocks() -> Iterator[RowBlock]:
        for case in range(9):
            given.append(case)
            yield RowBlock(infos, np.array([case]), ["ok"], [""], np.zeros((1, len(infos))))

    for pieces in (csv_pieces, json_pieces):
        given.clear()
        written = pieces(Source(study, infos, blocks(), {}))
        next(written)
        assert given == []
        next(written)
        assert given == [0]
        assert sum(1 for _ in written) >= 8


def test_cells_that_look_like_formulas_are_text() -> None:
    for text in ("=1+1", "+1", "-1", "@x", "\tx", "\rx"):
        assert escape(text) == "'" + text
    assert escape("ok") == "ok"
    table = exports.table_csv(["a", "b", "c"], [["=cmd()"], [-1.5], [None]])
    assert table == b"a,b,c\n'=cmd(),-1.5,\n"


@pytest.fixture
def one_case(service: Service, spec: dict[str, Any]) -> str:
    """A study whose cases are quick to run."""
    spec["run"] = {"duration": "4 periods"}
    return service.submit(spec)


def trajectory(service: Service, study_id: str, query: str = "") -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/4/trajectory{query}")


def test_instantaneous_values_of_a_case(service: Service, one_case: str) -> None:
    response = trajectory(service, one_case, "?points=50&from=10&to=20%20ms")
    assert response.status_code == 200, response.text
    body = response.json()
    fits(results.Trajectory, body)
    assert body["axis"] == {"name": "times", "unit": "s"}
    assert (body["times"][0], body["times"][-1], len(body["times"])) == (0.01, 0.02, 50)
    assert body["parameters"] == {"excitation.frequency": 25.5, "shaft.load": 0.1}
    assert {len(values) for values in body["values"].values()} == {50}
    assert {len(states) for states in body["states"].values()} == {50}
    assert set(body["values"]) == set(body["variables"])
    assert body["ending"] == "ok"
    whole = trajectory(service, one_case).json()
    assert len(whole["times"]) == 1000
    assert whole["times"][-1] == 4 / 25.5


def test_instantaneous_values_as_a_table(service: Service, one_case: str) -> None:
    response = trajectory(service, one_case, "?points=3&format=csv")
    table = list(csv.reader(io.StringIO(response.text)))
    body = trajectory(service, one_case, "?points=3").json()
    assert table[0] == ["time", *body["values"], *(f"{name}.state" for name in body["states"])]
    assert [float(row[0]) for row in table[1:]] == body["times"]
    assert table[1][-1] == list(body["states"].values())[-1][0]


@pytest.mark.parametrize(
    ("query", "parameter"),
    [
        ("points=1", "points"),
        ("points=20001", "points"),
        ("from=-1", "from"),
        ("from=9", "from"),
        ("from=nan", "from"),
        ("from=2%20mm", "from"),
        ("to=9", "to"),
        ("to=0", "to"),
        ("from=0.1&to=0.1", "to"),
        ("until=1", "until"),
        ("format=xlsx", "format"),
    ],
)
def test_a_wrong_part_of_a_run_is_refused(service: Service, one_case: str, query: str, parameter: str) -> None:
    response = trajectory(service, one_case, "?" + query)
    assert response.status_code == 422
    assert response.json()["errors"][0]["parameter"] == parameter
    assert service.computer.calls == []


def test_a_part_of_a_run_may_be_told_in_periods(service: Service, one_case: str) -> None:
    body = trajectory(service, one_case, "?points=5&from=1%20period&to=3.5%20cycles").json()
    assert (body["times"][0], body["times"][-1]) == (1 / 25.5, 3.5 / 25.5)
    whole = trajectory(service, one_case, "?points=5&from=2%20periods&to=4%20periods").json()
    assert whole["times"][-1] == 4 / 25.5
    beyond = trajectory(service, one_case, "?points=5&to=4.1%20periods")
    assert beyond.status_code == 422
    assert beyond.json()["errors"][0]["parameter"] == "to"


@pytest.mark.parametrize("form", ["json", "csv"])
def test_instantaneous_values_are_written_where_they_are_computed(service: Service, one_case: str, form: str) -> None:
    made = []

    def compute(function: Any, *args: Any) -> Any:
        made.append(function(*args))
        return made[-1]

    service.computer.answer = lambda *args: compute(service.computer.calls[-1][0], *args)
    response = trajectory(service, one_case, f"?points=3&format={form}")
    assert response.content == made[0]
    assert service.computer.loads == [models.KernelShape("vibration-drive", (1, 4, 1e-9))]


def test_numbers_that_are_none_are_null(service: Service, one_case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    run = models.run_trajectory

    def broken(study: Any, case: int, start: float, end: float, points: int) -> Any:
        made = run(study, case, start, end, points)
        made.values[1:] = np.nan
        return made

    monkeypatch.setattr(models, "run_trajectory", broken)
    body = json.loads(trajectory(service, one_case, "?points=3").text, parse_constant=pytest.fail)
    assert next(iter(body["values"].values()))[1:] == [None, None]
    assert trajectory(service, one_case, "?points=3&format=csv").text.splitlines()[2].count(",,") > 3
