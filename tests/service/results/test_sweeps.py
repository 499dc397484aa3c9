"""Curves of sweeps: directions in words, jumps with their intervals, what up and down differ in; in every format."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import httpx
import pandas as pd
import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.cli.shown import held_text
from sprag_study.service.client import AsyncClient, Client
from sprag_study.service.client.frames import Curves, grid_of, table_of
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.svg import svg
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.jobs.local import run_here
from sprag_study.service.jobs.start_from import with_start
from sprag_study.service.results.curve_cases import stored_curves
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.results.defaults import main_query
from sprag_study.service.results.sweeps import hysteresis
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.narrow import narrowed_spec
from sprag_study.worker import models
from sprag_study.worker.models.starts import motion_of
from sprag_study.worker.study import Study
from tests.service.conftest import API, PortalTransport, Service
from tests.service.figures.seen import seen
from tests.service.http.web.fields import field_of
from tests.service.spec_sample import changed
from tests.service.swept_study import DOWN, SPEC, UP, swept_study

QUERY = {"x": "excitation.frequency", "y": "shaft.speed.mean"}


@pytest.fixture
def study_id(service: Service) -> str:
    return swept_study(service)


def test_curves_have_both_directions_and_their_jumps(service: Service, study_id: str) -> None:
    curves = service.get(f"/studies/{study_id}/curves", **QUERY, at="shaft.load=0.1")["curves"]
    assert [curve["by"] for curve in curves] == [{"sweep": "up"}, {"sweep": "down"}]
    assert [curve["y"]["shaft.speed.mean"] for curve in curves] == [UP, DOWN]
    assert [curve["jumps"] for curve in curves] == [
        [{"low": 18.0, "high": 19.0, "why": "order", "results": []}],
        [{"low": 16.0, "high": 17.0, "why": "orbit", "results": []}],
    ]
    down = service.get(f"/studies/{study_id}/curves", **QUERY, at=["shaft.load=0.1", "sweep=down"])["curves"]
    assert [curve["y"] for curve in down] == [curves[1]["y"]]
    for given in ("2", "sideways"):
        refused = service.http.get(f"{API}/studies/{study_id}/curves", params={**QUERY, "at": f"sweep={given}"})
        assert [error["allowed"] for error in refused.json()["errors"]] == ["up, down"]


def test_csv_and_maps_have_them_too(service: Service, study_id: str) -> None:
    text = service.http.get(
        f"{API}/studies/{study_id}/curves", params={**QUERY, "at": "shaft.load=0.1", "format": "csv"}
    ).text
    rows = list(csv.DictReader(io.StringIO(text)))
    assert [row["sweep"] for row in rows] == ["up"] * 5 + ["down"] * 5
    assert [row["jump"] for row in rows] == ["0", "0", "1", "0", "0", "1", "0", "0", "0", "0"]
    maps = {"x": "excitation.frequency", "y": "shaft.load", "z": "shaft.speed.mean"}
    up = service.get(f"/studies/{study_id}/map", **maps)
    assert (up["at"], up["z"]["values"]) == ({"sweep": "up"}, [UP, UP])
    assert service.get(f"/studies/{study_id}/map", **maps, at="sweep=down")["z"]["values"] == [DOWN, DOWN]


def test_answers_and_files_have_directions_in_words(service: Service, study_id: str) -> None:
    def file(form: str) -> bytes:
        return service.http.get(f"{API}/studies/{study_id}/results", params={"format": form}).content

    both = ["up", "down"]
    cases = [service.get(f"/studies/{study_id}/cases/{case}") for case in (0, 1)]
    assert [case["parameters"]["sweep"] for case in cases] == both
    assert [row["parameters"]["sweep"] for row in service.get(f"/studies/{study_id}/cases")["cases"][:2]] == both
    assert [row["parameters"]["sweep"] for row in json.loads(file("json"))["rows"][:2]] == both
    assert [json.loads(line)["sweep"] for line in file("jsonl").splitlines()[:2]] == both
    assert table_of(file("parquet"))["sweep"].tolist() == both * 10
    assert pd.read_excel(io.BytesIO(file("xlsx")), header=1)["sweep"].tolist() == both * 10
    sweep = grid_of(file("netcdf"))["sweep"]
    assert (sweep.values.tolist(), sweep.attrs["flag_meanings"]) == ([0.0, 1.0], "up down")
    drawn = service.get(f"/studies/{study_id}/curves", **QUERY, at="shaft.load=0.1")
    grid = Curves(drawn).to_xarray()
    assert grid["shaft.speed.mean"].sel(sweep="down").values.tolist() == DOWN
    assert held_text(drawn["curves"][1]["by"], drawn["units"]) == "sweep = down"


def test_a_figure_tells_directions_by_dashes_and_loads_by_colours(service: Service, study_id: str) -> None:
    study = service.store.studies.study(study_id)
    query = main_query(study)
    assert query is not None
    assert (query.x, query.by) == ("excitation.frequency", ("shaft.load", "sweep"))

    drawn = stored_curves(service.store, study_id, query)
    figure = curves_figure([("", drawn)])
    (panel,) = figure.panels
    assert [(line.name, line.style) for line in panel.lines] == [
        ("0.1, up", 0), ("0.1, down", 1), ("0.2, up", 0), ("0.2, down", 1),
    ]  # fmt: skip
    colours = [line.colour for line in panel.lines]
    assert colours[0] == colours[1] != colours[2] == colours[3]
    assert [[part.tolist() for part in line.stretches or ()] for line in panel.lines[:2]] == [
        [[0, 1, 2], [3, 4]],
        [[0], [1, 2, 3, 4]],
    ]
    assert [(band.low, band.high) for band in panel.bands[:2]] == [(18.0, 19.0), (16.0, 17.0)]
    told = hysteresis(drawn)
    assert told == figure.below
    assert "up and down differ at 17 to 18 Hz, by up to 71 % of the range of shaft.speed.mean (at 17 Hz); " in told
    assert told.endswith("; 4 jumps, each within 1 Hz.")
    assert [curve.dash for curve in seen(svg(figure)).panels[0].curves[:2]] == [None, "7 4"]
    alone = stored_curves(
        service.store,
        study_id,
        CurveQuery(query.x, query.y, (), (("shaft.load", "0.1"), ("sweep", "up"))),
    )
    assert hysteresis(alone) == "Along the sweep 1 jump, within 1 Hz."


def test_pictures_pages_and_files_of_a_sweep(service: Service, study_id: str) -> None:
    picture = service.http.get(
        f"{API}/studies/{study_id}/curves", params={**QUERY, "by": "shaft.load", "format": "svg"}
    )
    assert picture.status_code == 200
    assert '<td class="num">up</td><td class="num">down</td>' in service.http.get(f"/studies/{study_id}").text
    report = service.http.get(f"{API}/studies/{study_id}/report?appendix=axes").text
    assert '<td class="number">up</td><td class="number">down</td>' in report
    for page in ("", "/rows", "/cases/0", "?x=excitation.frequency&y=shaft.speed.mean&at=sweep%3Ddown"):
        found = service.http.get(f"/studies/{study_id}{page}")
        assert found.status_code == 200, page
    sheet = service.http.get(f"/studies/{study_id}", params=QUERY)
    assert "Hysteresis: up and down differ at 17 to 18 Hz" in sheet.text
    rows = list(csv.DictReader(io.StringIO(service.http.get(f"{API}/studies/{study_id}/results?format=csv").text)))
    assert [row["sweep"] for row in rows[:4]] == ["up", "down", "up", "down"]
    assert [row["flags"] for row in rows if row["flags"]] == ["jumped"] * 4


def test_the_example_of_the_guide_says_what_the_guide_says() -> None:
    def told_by(spec: dict[str, Any]) -> tuple[Study, Any, str]:
        study = parse_spec(spec).study
        with run_here(spec, study, processes=0) as run:
            query = main_query(study)
            assert query is not None
            cases = run.store.rows.cases_of_kind(run.record.id, flag="jumped")
            return study, cases, hysteresis(stored_curves(run.store, run.record.id, query))

    text = (Path(__file__).resolve().parents[3] / "docs" / "sweeps.md").read_text(encoding="utf-8")
    spec = json.loads(text.partition("```json")[2].partition("```")[0])
    study, cases, told = told_by(spec)
    assert f"> {told}\n" in text
    assert f"> {told_by(narrowed_spec(spec, study, cases, 16, {}))[2]}\n" in text


def test_jumps_are_narrowed_over_http_by_clients_a_command_and_a_button(
    service: Service, study_id: str, portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch, sprag: Any
) -> None:
    made = service.http.post(f"{API}/studies/{study_id}:narrow", params={"steps": 4})
    assert made.status_code == 202, made.text
    new = service.store.studies.study(made.json()["id"])
    assert (new.sweep, new.shape) == ("excitation.frequency", (11, 2, 2))
    assert new.axes[0].values == (16.0, 16.25, 16.5, 16.75, 17.0, 18.0, 18.25, 18.5, 18.75, 19.0, 20.0)
    assert new.name.endswith(", narrowed")

    async def narrowed() -> str:
        async with AsyncClient("http://localhost", transport=httpx.ASGITransport(service.app)) as client:
            return (await (await client.study(study_id)).narrow(4, {"shaft.load": 0.1, "sweep": "up"})).id

    transport = PortalTransport(service.app, portal)
    with Client("http://localhost", transport=transport) as client:
        ids = [client.study(study_id).narrow(4, at={"shaft.load": "0.1 N*m", "sweep": "up"}).id, portal.call(narrowed)]
    monkeypatch.setattr(
        "sprag_study.service.cli.extend.connection", lambda *_: Client("http://localhost", transport=transport)
    )
    done = sprag("study", "narrow", study_id, "--steps", 4, "--at", "shaft.load=0.1", "--at", "sweep=up", "--json")
    assert done.code == 0, done.err
    for one in map(service.store.studies.study, [*ids, done.data["id"]]):
        assert [axis.values for axis in one.axes] == [
            (16.0, 17.0, 18.0, 18.25, 18.5, 18.75, 19.0, 20.0), (0.1,), (0.0,),
        ]  # fmt: skip
    assert "Narrow these jumps</button> 140 cases" in service.http.get(f"/studies/{study_id}").text
    shown = [service.http.post(f"/studies/{study_id}/narrow").headers["location"] for _ in range(2)]
    assert shown[0] == shown[1]
    assert service.store.studies.study(shown[0].rpartition("/")[2]).cases == 140


def test_what_has_no_jumps_to_narrow_is_refused(service: Service, study_id: str) -> None:
    def refused(study: str, **query: Any) -> tuple[int, str]:
        answer = service.http.post(f"{API}/studies/{study}:narrow", params=query)
        return answer.status_code, answer.json()["detail"]

    grid = service.submit(changed({"/run": {"until": "settled"}}))
    assert refused(grid) == (409, "The study is not a sweep: it has no jumps to narrow.")
    assert refused(service.submit({**SPEC, "name": "not run"})) == (409, "Only 0 of 20 cases have been run.")
    for query in ({"steps": 1}, {"steps": 1025}, {"at": "excitation.frequency=16 Hz"}, {"at": "shaft.load=0.3"}):
        assert refused(study_id, **query)[0] == 422, query
    assert "Narrow these jumps" not in service.http.get(f"/studies/{grid}").text


def test_the_form_keeps_a_sweep() -> None:
    values = values_of(SPEC)
    assert values["/axes/0/sweep"] == "both"
    spec, _ = spec_of(values)
    assert [axis.get("sweep") for axis in spec["axes"]] == ["both", None]
    assert field_of("/axes/0/sweep", values) == "/axes/0/sweep"


def test_a_case_of_a_sweep_is_gone_on_from_in_its_sweep(
    service: Service, study_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = service.store.studies.study(study_id)
    assert motion_of(study, 3, 0) == (study, 3)
    asked: list[tuple[Study, int]] = []

    def run_end_state(study: Study, case: int) -> dict[str, float]:
        asked.append((study, case))
        return {"shaft.initial_speed": 2.5}

    monkeypatch.setattr(models, "run_end_state", run_end_state)
    monkeypatch.setattr(models, "is_compiled", lambda _: True)
    spec = changed({"/run": {"until": "settled"}, "/axes": [], "/base/start": {"study": study_id, "case": 3}})
    spec["base"]["shaft"].pop("initial_speed", None)
    assert with_start(service.store, spec)["base"]["shaft"]["initial_speed"] == 2.5
    assert asked == [(study, 3)]
