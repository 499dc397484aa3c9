"""The regimes of cases with many starts over HTTP and on their page."""

from __future__ import annotations

import copy
import csv
import html
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.service.client import Client
from sprag_study.service.faults import FaultError
from sprag_study.service.http.problems import ApiError
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.views import basin as basins
from sprag_study.worker import models
from sprag_study.worker.models import Basin, ChunkResult, FurtherRows
from sprag_study.worker.models.starts import motion_of
from sprag_study.worker.study import Study
from tests.service.conftest import API, PortalTransport, Service
from tests.service.figures.seen import chart_of
from tests.service.timed_spec import SPEC

SPEED = "shaft.initial_speed"


@pytest.fixture
def started(service: Service) -> str:
    """A study of two cases, the second of which has two regimes."""
    spec = copy.deepcopy(SPEC)
    spec.pop("run", None)
    spec["axes"] = [{"path": "shaft.load", "values": ["0.1 N*m", "0.2 N*m"]}]
    spec.pop("combine", None)
    study_id = service.submit({**spec, "starts": {"count": 8, "ranges": {SPEED: [1, 30]}}})
    record, study = service.store.studies.get(study_id), service.store.studies.study(study_id)
    names = [info.name for info in models.study_results(study)]
    values = np.zeros((3, len(names)))
    for name, column in {
        "shaft.speed.mean": [1.0, 2.0, 3.5], "regime": [1, 1, 1], "regime.order": [1, 1, 2],
        "regime.number": [0, 0, 1], "regime.count": [1, 2, 2], "regime.share": [1.0, 0.75, 0.25],
        "regime.start": [0, 0, 5],
    }.items():  # fmt: skip
        values[:, names.index(name)] = column
    further = FurtherRows(np.array([1]), [""], values[2:])
    (chunk,) = service.store.work.open_chunks(record.number)
    epoch = service.store.work.take_over("test")
    service.store.work.claim(epoch, [chunk])
    assert service.store.work.commit(epoch, chunk, ChunkResult(0, ["ok"] * 2, [""] * 2, values[:2], further))
    service.store.work.settle(epoch, record.number)
    return study_id


def test_a_case_lists_its_regimes(service: Service, started: str) -> None:
    one, two = (service.get(f"/studies/{started}/cases/{case}") for case in (0, 1))
    assert [row["results"]["regime.share"] for row in one["regimes"]] == [1.0]
    assert [(row["number"], row["results"]["shaft.speed.mean"]) for row in two["regimes"]] == [(0, 2.0), (1, 3.5)]
    assert two["results"] == two["regimes"][0]["results"]


def test_rows_of_all_regimes_are_exported(service: Service, started: str) -> None:
    text = service.http.get(f"{API}/studies/{started}/results", params={"format": "csv"}).text
    rows = list(csv.DictReader(text.splitlines()))
    assert [(row["case"], row["regime.number"], row["shaft.speed.mean"]) for row in rows] == [
        ("0", "0", "1.0"), ("1", "0", "2.0"), ("1", "1", "3.5"),
    ]  # fmt: skip
    (page,) = (service.get(f"/studies/{started}/cases")["cases"],)
    assert [case["case"] for case in page] == [0, 1]


@pytest.mark.parametrize("form", ["netcdf", "xlsx", "arrow", "parquet", "json", "jsonl"])
def test_every_format_takes_several_rows_of_a_case(service: Service, started: str, form: str) -> None:
    answer = service.http.get(f"{API}/studies/{started}/results", params={"format": form})
    assert answer.status_code in {200, 422}, answer.text


def test_curves_are_those_of_one_regime(service: Service, started: str) -> None:
    def curve(**params: object) -> list[float | None]:
        asked = {"x": "shaft.load", "y": "shaft.speed.mean", **params}
        y: list[float | None] = service.get(f"/studies/{started}/curves", **asked)["curves"][0]["y"]["shaft.speed.mean"]
        return y

    assert curve() == [1.0, 2.0]
    assert curve(number=1) == [None, 3.5]


def test_pictures_mark_the_other_motions(service: Service, started: str) -> None:
    asked = {"x": "shaft.load", "y": "shaft.speed.mean"}
    page = service.http.get(f"/studies/{started}", params={**asked, "units": "si"}).text
    assert chart_of(page).has("other motions of the same cases")
    assert "<title>0.2 N·m, 3.5 rad/s, other motions of the same cases, case 1</title>" in page
    assert service.http.get(f"{API}/studies/{started}/curves", params={**asked, "format": "svg"}).status_code == 200


def test_maps_of_the_motions_are_a_click_away(service: Service) -> None:
    spec = copy.deepcopy(SPEC)
    spec.pop("run", None)
    spec.pop("combine", None)
    spec["axes"] = [
        {"path": "shaft.load", "values": [0.1, 0.2]},
        {"path": "excitation.frequency", "values": [20, 25]},
    ]
    study_id = service.submit({**spec, "starts": {"count": 8, "ranges": {SPEED: [1, 30]}}})
    service.fill(study_id)
    text = html.unescape(service.http.get(f"/studies/{study_id}").text)
    for name, title in (("regime.count", "number of motions"), ("regime.share.least", "share of the rarest motion")):
        (address,) = re.findall(rf'<a href="(/studies/{study_id}\?[^"]*)">{title}</a>', text)
        map_ = service.http.get(address)
        assert map_.status_code == 200
        assert f'<option value="{name}" selected>' in map_.text


def test_other_studies_have_one_regime_a_case(service: Service) -> None:
    study_id = service.submit()
    answer = service.http.get(f"{API}/studies/{study_id}/curves", params={"number": 1})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["parameter"] == "number"


def test_a_motion_begins_at_the_start_that_is_asked_for(service: Service, started: str) -> None:
    service.computer.answer = lambda *_: b"{}"
    values = service.store.studies.study(started).run["starts"]["values"][SPEED]
    for part in ("strobes", "trajectory", "engagements"):
        answer = service.http.get(f"{API}/studies/{started}/cases/1/{part}", params={"start": 5})
        assert answer.status_code == 200, answer.text
        _, study, case, *_, start = service.computer.calls[-1]
        assert (case, start) == (1, 5)
        run, number = motion_of(study, case, start)
        assert (number, run.base[SPEED], run.base["shaft.load"]) == (0, values[4], 0.2)
    wrong = service.http.get(f"{API}/studies/{started}/cases/1/strobes", params={"start": 8})
    assert (wrong.status_code, wrong.json()["errors"][0]["allowed"]) == (422, "0 to 7")


def test_the_motion_of_a_start_is_that_of_its_case(service: Service, started: str) -> None:
    for part in ("strobes", "trajectory", "engagements", "section"):
        body = service.get(f"/studies/{started}/cases/1/{part}", start=5)
        assert (body["case"], body["parameters"]) == (1, {"shaft.load": 0.2})
        assert body != service.get(f"/studies/{started}/cases/1/{part}")
    # Its range is that of the study's axis.
    body = service.get(f"/studies/{started}/cases/1/diagram", along="shaft.load", points=2, start=5)
    assert (body["case"], body["parameter"]) == (1, [0.1, 0.2])


def test_the_page_of_a_case_lists_its_regimes(service: Service, started: str) -> None:
    page = service.http.get(f"/studies/{started}/cases/1").text
    assert "Motions to which it comes from other starts" in page
    assert '<a href="?start=5">5</a>' in page
    assert "0, shown below" in page
    other = service.http.get(f"/studies/{started}/cases/1", params={"start": "5"}).text
    assert "5, shown below" in other
    assert f"/studies/{started}/cases/1?show=strobes&amp;start=5" in other


@pytest.mark.parametrize("part", ["branch", "diagram", "section"])
def test_views_of_a_regime_follow_its_motion(service: Service, started: str, part: str) -> None:
    case = f"/studies/{started}/cases/1"
    asked = {"show": part, "start": "5", "along": "shaft.load", "from": "0.1", "to": "0.3", "points": "3"}
    page = service.http.get(case, params=asked)
    assert page.status_code == 200
    assert f"api/v1{case}/{part}?" in page.text
    assert "start=5" in page.text.partition(f"api/v1{case}/{part}?")[2].partition('"')[0]
    assert '<input type="hidden" name="start" value="5">' in page.text

    def not_here(*_: Any) -> Any:
        raise ApiError("not-computed", "It is not computed here.")

    service.computer.answer = not_here
    page = service.http.get(case, params=asked)
    assert "It is not computed here." in page.text
    assert page.status_code == 409
    _, _study, number, views, _chosen, start, *_ = service.computer.calls[-1]
    assert (number, views[0].about.name, start) == (1, part, 5)


def test_a_study_begins_at_the_end_of_a_case(service: Service, started: str, monkeypatch: pytest.MonkeyPatch) -> None:
    end = {SPEED: 12.5, "pendulums.0.initial_windup": 0.01, "pendulums.0.initial_clutch": 2.0}
    asked: list[tuple[float, int]] = []

    def run_end_state(study: Study, case: int) -> dict[str, float]:
        asked.append((study.base["shaft.load"], case))
        return end

    monkeypatch.setattr(models, "run_end_state", run_end_state)
    monkeypatch.setattr(models, "is_compiled", lambda _: True)
    spec = copy.deepcopy(SPEC)
    spec["base"]["start"] = {"study": started, "case": 1, "start": 5}
    for place in (spec["base"]["shaft"], *spec["base"]["pendulums"]):
        for name in [name for name in place if name.startswith("initial_")]:
            del place[name]
    study_id = service.submit(spec)
    assert asked == [(0.2, 0)]
    study, stored = service.store.studies.study(study_id), service.store.studies.spec(study_id)
    assert {path: study.base[path] for path in end} == end
    # The study needs the other one no longer.
    assert "start" not in stored["base"]
    assert parse_spec(stored).study == study
    for change, where in (
        ({"study": "no-such-study"}, "/base/start/study"),
        ({"case": 2}, "/base/start/case"),
        ({"start": 8}, "/base/start/start"),
        ({"many": 1}, "/base/start/many"),
    ):
        wrong = copy.deepcopy(spec)
        wrong["base"]["start"] |= change
        answer = service.http.post(f"{API}/studies", json=wrong)
        assert (answer.status_code, [fault["pointer"] for fault in answer.json()["errors"]]) == (422, [where])
    more = copy.deepcopy(spec)
    more["base"]["pendulums"] *= 2
    answer = service.http.post(f"{API}/studies", json=more)
    assert [fault["pointer"] for fault in answer.json()["errors"]] == ["/base/pendulums"]
    spec["base"]["shaft"]["initial_speed"] = 1
    answer = service.http.post(f"{API}/studies", json=spec)
    assert [fault["pointer"] for fault in answer.json()["errors"]] == ["/base/shaft/initial_speed"]


def test_the_client_has_the_motions_of_a_case(
    service: Service, started: str, portal: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(models, "run_basin", _basin)
    y = "pendulums.0.initial_angle"
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        study = client.study(started)
        one, two = study.regimes(1)
        assert (one["number"], two["results"]["regime.start"]) == (0, 5)
        grid = study.basin(1, y=y, y_range=("-10 deg", "0.2 rad"), points=2)
        assert (grid["x"], grid["numbers"], grid["y_values"][1]) == (SPEED, [[0, 1], [0, -1]], 0.2)
        curves = study.curves("shaft.load", "shaft.speed.mean", number=1)
        assert curves.data["curves"][0]["y"]["shaft.speed.mean"] == [None, 3.5]
        service.computer.answer = lambda *_: b"{}"
        values = service.store.studies.study(started).run["starts"]["values"][SPEED]
        for call in (study.strobes, study.engagements, study.section):
            call(1, start=5)
            assert 5 in service.computer.calls[-1] or service.computer.calls[-1][1].base[SPEED] == values[4]


def _basin(study: Study, case: int, paths: object, x: np.ndarray, y: np.ndarray) -> Basin:
    names = ("regime", "regime.order", "regime.share", "shaft.speed.mean")
    values = np.array([[1.0, 1.0, 0.5, 2.0], [1.0, 2.0, 0.25, 3.5]])
    return Basin(x, y, np.array([[0, 1], [0, -1]]), names, values)


def test_a_basin_is_a_grid_of_two_initial_values(
    service: Service, started: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(models, "run_basin", _basin)
    own = f"/studies/{started}/cases/1/basin"
    asked = {"y": "pendulums.0.initial_angle", "y_from": "-10 deg", "y_to": "0.2 rad", "points": 2}
    body = service.get(own, **asked)
    assert (body["x"], body["y"], body["numbers"]) == (SPEED, asked["y"], [[0, 1], [0, -1]])
    assert body["x_values"] == [1.0, 30.0]
    assert body["y_values"] == pytest.approx([-0.1745329, 0.2])
    assert [row["results"]["regime"] for row in body["regimes"]] == ["periodic", "periodic"]
    text = service.http.get(API + own, params={**asked, "format": "csv"}).text
    assert text.splitlines()[0] == f"{SPEED},{asked['y']},regime.number,shaft.speed.mean"
    slow, fast = (str(row["results"]["shaft.speed.mean"]) for row in body["regimes"])
    regimes = [tuple(line.split(",")[2:]) for line in text.splitlines()[1:]]
    assert regimes == [("0", slow), ("1", fast), ("0", slow), ("-1", "")]
    picture = service.http.get(API + own, params={**asked, "format": "svg"})
    assert picture.status_code == 200
    assert ">1: 25 %, 3.5 rad/s, order 2</text>" in picture.text
    monkeypatch.undo()
    # This one is run: all four starts come to the motion of two periods.
    page = service.http.get(f"/studies/{started}/cases/1", params={"show": "basin", **asked}).text
    assert "0: 100 %, 218.1 rpm, order 2" in page


def test_the_page_of_a_basin_keeps_its_form(service: Service, started: str) -> None:
    own = f"/studies/{started}/cases/1?show=basin"
    first = service.http.get(own)
    shown = [text in first.text for text in ('placeholder="30 rad/s"', 'role="alert"')]
    assert (first.status_code, *shown) == (200, True, False)
    wrong = {"y": "pendulums.0.initial_angle", "y_from": "12 mm", "y_to": "0.2 rad", "points": "many"}
    for faulty, sentence in ((wrong, "must be a whole number"), ({**wrong, "points": "9"}, "<code>y_from</code>")):
        page = service.http.get(own, params={"show": "basin", **faulty})
        assert page.status_code == 422
        assert sentence in page.text
        assert 'name="y_from" value="12 mm"' in page.text


def test_a_basin_has_possible_starts_only(service: Service, started: str) -> None:
    study = service.store.studies.study(started)
    state, windup = "pendulums.0.initial_clutch", "pendulums.0.initial_windup"
    base = {**study.base, state: 1.0, windup: 0.0}
    ends: basins.Ends = {"x": (None, None), "y": ("-0.005", "0")}
    taking_up = replace(study, base=base)
    assert basins.basin_query(taking_up, 1, None, windup, ends, 2).y == (-0.005, 0.0)
    with pytest.raises(FaultError) as error:
        basins.basin_query(taking_up, 1, None, windup, {**ends, "y": ("-0.006", "0")}, 2)
    assert [(fault.where, fault.allowed) for fault in error.value.faults] == [("y", "-0.005 .. 0 rad")]


@pytest.mark.parametrize(
    ("params", "name"),
    [
        ({"y": "shaft.load"}, "y"),
        ({"x": SPEED, "y": SPEED}, "y"),
        ({"y": "pendulums.0.initial_angle"}, "y_from"),
        ({"y": "pendulums.0.initial_angle", "y_from": "1 m", "y_to": "2 rad"}, "y_from"),
        ({"y": "pendulums.0.initial_angle", "y_from": "2", "y_to": "1"}, "y_to"),
        ({"x_from": "-1", "y": "pendulums.0.initial_angle", "y_from": "0", "y_to": "1"}, "x_from"),
        ({"points": 1}, "points"),
    ],
)
def test_faults_of_basins_name_their_parameter(
    service: Service, started: str, params: dict[str, object], name: str
) -> None:
    answer = service.http.get(f"{API}/studies/{started}/cases/1/basin", params=params)
    assert (answer.status_code, answer.json()["errors"][0]["parameter"]) == (422, name)
