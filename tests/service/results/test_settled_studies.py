"""Settled studies from the spec to every answer: the regime of a case is a result like the others, told by its name."""

from __future__ import annotations

import csv
import io
import re
from functools import partial
from typing import Any

import httpx
import numpy as np
import pyarrow.parquet as pq
import pytest
import xarray as xr
from anyio.from_thread import BlockingPortal

from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.service.client import AsyncClient, Client
from sprag_study.service.results.regimes import motion_sentence
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult, regime_info
from tests.service.conftest import API, PortalTransport, Service
from tests.service.results.conftest import Linked
from tests.service.results.settled import REGIMES, flagged, rows_of
from tests.service.spec_sample import changed


def file(service: Service, study_id: str, form: str, part: str = "results") -> httpx.Response:
    response = service.http.get(f"{API}/studies/{study_id}/{part}", params={"format": form})
    assert response.status_code == 200, response.text
    return response


def test_the_regime_of_a_case_is_told_by_its_name(service: Service, study_id: str) -> None:
    cases = service.get(f"/studies/{study_id}/cases")["cases"]
    assert [case["results"]["regime"] for case in cases] == REGIMES
    assert cases[3]["flags"] == ["unsettled"]
    assert isinstance(cases[0]["results"]["regime.order"], int)
    assert set(cases[2]["results"].values()) == {None}


def test_files_have_the_name_of_the_regime_or_its_number(service: Service, study_id: str) -> None:
    rows = list(csv.DictReader(io.StringIO(file(service, study_id, "csv").text)))
    assert [row["regime"] or None for row in rows] == REGIMES
    table = pq.read_table(io.BytesIO(file(service, study_id, "parquet").content))
    assert table["regime"].to_pylist() == REGIMES
    grid = xr.load_dataset(io.BytesIO(file(service, study_id, "netcdf").content), engine="h5netcdf")
    names = grid["regime"].attrs["flag_meanings"].split()
    assert names == [regime.name.lower() for regime in Regime]
    assert grid["regime"].attrs["flag_values"].tolist() == list(range(len(names)))
    assert [names[code] for code in grid["regime"].values] == [name or "none" for name in REGIMES]
    assert file(service, study_id, "json").json()["rows"][1]["results"]["regime"] == "irregular"
    assert file(service, study_id, "xlsx").content.startswith(b"PK")


def test_curves_have_the_regime_of_every_point(service: Service, study_id: str) -> None:
    curves = f"/studies/{study_id}/curves"
    (curve,) = service.get(curves, x="shaft.load", y="shaft.speed.mean")["curves"]
    assert curve["regime"] == REGIMES
    orders = [service.get(f"/studies/{study_id}/cases/{case}")["results"]["regime.order"] for case in curve["cases"]]
    assert curve["order"] == orders
    text = service.http.get(API + curves, params={"x": "shaft.load", "y": "shaft.speed.mean", "format": "csv"}).text
    rows = list(csv.DictReader(io.StringIO(text)))
    assert [row["regime"] or None for row in rows] == REGIMES
    assert [row["regime.order"] for row in rows] == ["" if order is None else str(order) for order in orders]
    response = service.http.get(API + curves, params={"x": "shaft.load", "y": "regime"})
    assert response.status_code == 422
    assert "category" in response.text


def test_a_grid_of_curves_has_regime_and_order_of_every_point(
    service: Service, study_id: str, portal: BlockingPortal
) -> None:
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        study = client.study(study_id)
        curves, rows = study.curves("shaft.load", "shaft.speed.mean"), study.grid()
    grid = curves.to_xarray()
    for name, stored in (("regime", "regime"), ("order", "regime.order"), ("ending", "ending")):
        np.testing.assert_array_equal(grid[name].values, rows[stored].values)
        assert grid[name].dtype == rows[stored].dtype
        assert grid[name].attrs["long_name"] == rows[stored].attrs["long_name"]
    for name in ("flag_values", "flag_meanings"):
        assert list(grid["regime"].attrs[name]) == list(rows["regime"].attrs[name])
    curves.data["curves"][0]["regime"] = ["unheard-of", *REGIMES[1:]]
    with pytest.raises(ValueError, match="regime 'unheard-of' is unknown"):
        curves.to_xarray()


@pytest.mark.usefixtures("terminal")
def test_the_command_shows_the_regime_of_every_point_of_a_curve(
    service: Service, study_id: str, linked: Linked, sprag: Any
) -> None:
    linked("remote")
    done = sprag("show", study_id, "curves", "--x", "shaft.load", "--y", "shaft.speed.mean")
    assert done.code == 0, done.err
    lines = [line.split() for line in done.out.splitlines()]
    head = next(place for place, line in enumerate(lines) if line[:1] == ["shaft.load"])
    assert lines[head] == ["shaft.load", "[N*m]", "shaft.speed.mean", "[rad/s]", "regime", "ending"]
    shown = {line[0]: line[1:] for line in lines[head + 1 :] if len(line) > 1 and line[0][:1].isdigit()}
    (curve,) = service.get(f"/studies/{study_id}/curves", x="shaft.load", y="shaft.speed.mean")["curves"]
    assert [line[1:] for line in shown.values()] == [["periodic"], ["irregular"], ["-", "chatter"], ["unsettled"]]
    assert [float(load) for load in shown] == curve["x"]


def test_maps_have_the_order_of_every_point(service: Service) -> None:
    axes = [{"path": "excitation.frequency", "values": [20, 25]}, {"path": "shaft.load", "values": [0.2, 0.7]}]
    two = service.submit(changed({"/run": {"until": "settled"}, "/axes": axes}))
    query = {"x": "shaft.load", "y": "excitation.frequency", "z": "shaft.speed.mean"}
    found = service.get(f"/studies/{two}/map", **query)
    assert found["order"] == found["regime"] == [[None, None], [None, None]]
    text = service.http.get(f"{API}/studies/{two}/map", params={**query, "format": "csv"}).text
    rows = list(csv.DictReader(io.StringIO(text)))
    head = ["excitation.frequency", "shaft.load", "case", "shaft.speed.mean", "regime", "regime.order"]
    assert list(rows[0]) == [*head, "flags", "ending"]
    assert [(row["excitation.frequency"], row["shaft.load"], row["case"], row["ending"]) for row in rows] == [
        ("20.0", "0.2", "0", "pending"), ("20.0", "0.7", "1", "pending"),
        ("25.0", "0.2", "2", "pending"), ("25.0", "0.7", "3", "pending"),
    ]  # fmt: skip
    former = service.http.get(f"/studies/{two}/map", params={**query, "z": "regime.order"}, follow_redirects=False)
    assert former.headers["location"].endswith("?x=shaft.load&up=excitation.frequency&z=regime.order")


def test_transient_studies_have_no_regime(service: Service) -> None:
    timed = service.submit(changed({"/run": {"duration": "60 periods"}}))
    study = service.store.studies.study(timed)
    assert regime_info(models.study_results(study)) is None
    assert study.run == {"duration": [60.0, "periods"], "window": None, "tolerance": 1e-9, "reset": "contact"}


def test_the_motion_of_a_settled_case_lasts_as_long_as_its_search_may(service: Service, study_id: str) -> None:
    study = service.store.studies.study(study_id)
    assert models.extent(study, 1).end == pytest.approx(1000.0 / 25.0)


def test_a_study_tells_how_many_cases_have_which_regime(service: Service, study_id: str) -> None:
    assert service.get(f"/studies/{study_id}")["regimes"] == {"periodic": 1, "irregular": 1, "unsettled": 1}
    page = service.http.get(f"/studies/{study_id}").text
    assert "Settled motions" in page
    assert "<strong>1 of 4</strong> cases certified" in page
    links = (f'<a href="/studies/{study_id}/rows?regime={kind}">1 {kind}</a>' for kind in ("irregular", "unsettled"))
    assert ", ".join(links) in page
    timed = service.submit(changed({"/run": {"duration": "60 periods"}}))
    assert service.get(f"/studies/{timed}")["regimes"] == {}
    assert "Settled motions" not in service.http.get(f"/studies/{timed}").text


def test_kinds_are_counted_once_for_each_revision(service: Service, study_id: str) -> None:
    counted = service.store.rows.kinds(study_id)
    assert service.store.rows.kinds(study_id) is counted
    record, epoch = service.store.studies.get(study_id), service.store.work.take_over("again")
    service.store.studies.retry(study_id)
    assert service.store.studies.get(study_id).revision > record.revision
    chunks = service.store.work.claim(epoch, service.store.work.open_chunks(record.number))
    assert chunks
    whole = rows_of(service.store.studies.study(study_id))
    column = [info.name for info in models.study_results(service.store.studies.study(study_id))].index("regime")
    whole.values[2, column] = Regime.HELD
    for chunk in chunks:
        part = slice(chunk.first, chunk.first + chunk.count)
        result = ChunkResult(chunk.first, ["ok"] * chunk.count, whole.flags[part], whole.values[part])
        assert service.store.work.commit(epoch, chunk, result)
    assert service.store.rows.kinds(study_id).regimes.get("held") == 1


def test_cases_are_filtered_by_regime(service: Service, study_id: str) -> None:
    cases, rows = (f"/studies/{study_id}/{name}" for name in ("cases", "rows"))
    assert [case["case"] for case in service.get(cases, regime="irregular")["cases"]] == [1]
    assert service.get(cases, regime="held")["cases"] == []
    assert service.get(cases, regime="irregular", ending="chatter")["cases"] == []
    assert service.http.get(API + cases, params={"regime": "odd"}).status_code == 422
    for sort in ("case", "-shaft.load"):
        page = service.http.get(rows, params={"regime": "unsettled", "sort": sort}).text
        assert re.findall(r'<tr data-case="(\d+)"', page) == ["3"]
    timed = service.submit(changed({"/run": {"duration": "60 periods"}}))
    service.fill(timed)
    assert service.get(f"/studies/{timed}/cases", regime="periodic")["cases"] == []
    assert 'name="regime"' not in service.http.get(f"/studies/{timed}/rows").text


def test_cases_are_filtered_by_flag_and_flags_are_counted(service: Service, study_id: str) -> None:
    timed = flagged(service, {"duration": "60 periods"})
    cases, rows = (f"/studies/{timed}/{name}" for name in ("cases", "rows"))
    assert [case["case"] for case in service.get(cases, flag="not_settled")["cases"]] == [1, 2]
    assert [case["case"] for case in service.get(cases, flag="windup_out_of_data")["cases"]] == [2]
    assert service.get(f"/studies/{timed}")["flags"] == {"not_settled": 2, "windup_out_of_data": 1}
    for sort in ("case", "-shaft.load"):
        page = service.http.get(rows, params={"flag": "windup_out_of_data", "sort": sort}).text
        assert re.findall(r'<tr data-case="(\d+)"', page) == ["2"]
    assert service.http.get(rows, params={"flag": "settled"}).status_code == 422
    (error,) = service.http.get(API + cases, params={"flag": "settled"}).json()["errors"]
    assert error["parameter"] == "flag"
    assert "not_settled" in error["allowed"]
    page = service.http.get(f"/studies/{timed}").text
    assert f"{rows}?flag=not_settled" in page
    both = {"flag": "unsettled", "regime": "unsettled"}
    assert [case["case"] for case in service.get(f"/studies/{study_id}/cases", **both)["cases"]] == [3]
    assert service.get(f"/studies/{study_id}/cases", flag="unsettled", regime="irregular")["cases"] == []


def test_clients_and_command_list_cases_by_ending_regime_and_flag(
    service: Service, study_id: str, portal: BlockingPortal, linked: Linked, sprag: Any
) -> None:
    kinds: tuple[tuple[dict[str, str], list[int]], ...] = (
        ({}, [0, 1, 2, 3]), ({"regime": "irregular"}, [1]), ({"flag": "unsettled"}, [3]), ({"ending": "chatter"}, [2]),
        ({"regime": "held"}, []), ({"regime": "irregular", "flag": "unsettled"}, []),
    )  # fmt: skip

    async def listed(**kind: str) -> list[Any]:
        async with AsyncClient("http://localhost", transport=httpx.ASGITransport(service.app)) as client:
            return [case async for case in (await client.study(study_id)).cases(**kind)]

    linked("remote")
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        for kind, numbers in kinds:
            found = list(client.study(study_id).cases(**kind))
            assert [case["case"] for case in found] == numbers
            assert portal.call(partial(listed, **kind)) == found
            options = [text for name, value in kind.items() for text in (f"--{name}", value)]
            done = [sprag("show", study_id, "cases", *options, *more) for more in (["--json"], [])]
            assert [ended.code for ended in done] == [0, 0], done[0].err
            assert done[0].data["cases"] == found
    table = sprag("show", study_id, "cases", "--regime", "periodic", "--result", "efficiency", "--limit", 1)
    assert table.code == 0
    assert all(text in table.out for text in ("shaft.load", "regime", "periodic", "efficiency"))
    assert "--result" in sprag("show", study_id, "cases", "--result", "beauty").err


def test_sensitivity_leaves_out_unsettled_cases_and_tells_of_regimes(service: Service, study_id: str) -> None:
    (found,) = service.get(f"/studies/{study_id}/sensitivity", y="shaft.speed.mean")["results"]
    assert (found["cases"], found["missing"]) == (2, 2)
    assert "1 unsettled case is left out" in found["notes"][0]
    assert "1 periodic, 1 irregular" in found["notes"][1]


def test_the_page_of_a_case_tells_its_motion(service: Service, study_id: str) -> None:
    pages = [service.http.get(f"/studies/{study_id}/cases/{case}").text for case in range(4)]
    assert motion_sentence("periodic", 1) in pages[0]
    assert 'title="regime.settled_after">Periods until settled' in pages[0]
    assert models.REGIME_SENTENCES["irregular"] not in pages[0]
    for page, flag in ((pages[1], "irregular"), (pages[3], "unsettled")):
        assert page.count(f'<p class="warning"><span class="flag">{flag}</span>') == 1
        assert motion_sentence("periodic", 1).partition(" after ")[0] not in page
    assert re.search(r">± [\d.]+", pages[1])


def test_the_report_counts_the_regimes(service: Service, study_id: str) -> None:
    report = service.http.get(f"{API}/studies/{study_id}/report", params={"format": "html", "appendix": "all"}).text
    assert "1 periodic, 1 irregular, 1 unsettled" in report
    assert "1 unsettled case is left out" in report.partition('aria-label="Appendix"')[0]
