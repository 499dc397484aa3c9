"""Quantities on every front: rows, files, curves, maps, yields, searches and refinements have them as any result.

What they must be is computed here from the results of the model, by numpy.
"""

from __future__ import annotations

import csv
import io
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.interpolate import PchipInterpolator
from starlette.datastructures import QueryParams

from sprag_study.service.client import Client
from sprag_study.service.http.web.comparison.chosen import comparison
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.rounds import Rounds
from tests.service.conftest import PortalTransport
from tests.service.rounds import run_round
from tests.service.searching import search_of, spec_of

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal
    from numpy.typing import NDArray

    from sprag_study.worker.study import Study
    from tests.service.conftest import Service

QUANTITIES: dict[str, Any] = {
    "specific": "power.useful.mean / pendulums.0.mass",
    "cost": {"formula": "12 + 30 * shaft.load / (1 N*m)"},
    "worth": {"formula": "specific / (1 W/kg) / cost", "unit": "%"},
}


def by_hand(masses: NDArray[np.float64], loads: NDArray[np.float64], power: NDArray[np.float64]) -> dict[str, Any]:
    """The quantities of rows."""
    specific, cost = power / masses, 12.0 + 30.0 * loads
    return {"specific": specific, "cost": cost, "worth": specific / cost}


@pytest.fixture
def filled(service: Service, spec: dict[str, Any]) -> tuple[Service, str, dict[str, NDArray[np.float64]]]:
    """A finished study of six cases with made-up results, the fifth of which failed, and its quantities by hand."""
    spec["axes"] = [
        {"path": "pendulums.0.mass", "values": [0.4, 0.5]},
        {"path": "shaft.load", "values": [0.1, 0.2, 0.3]},
    ]
    study_id = service.submit({**spec, "quantities": QUANTITIES})
    rows = service.fill(study_id)
    names = [info.name for info in models.model_results(service.store.studies.study(study_id))]
    power = rows.values[:, names.index("power.useful.mean")]
    assert np.flatnonzero(np.isnan(power)).tolist() == [4]
    return service, study_id, by_hand(np.repeat([0.4, 0.5], 3), np.tile([0.1, 0.2, 0.3], 2), power)


def test_rows_and_files_have_them_as_columns(filled: Any) -> None:
    service, study_id, expected = filled
    page = service.get(f"/studies/{study_id}/cases")["cases"]
    columns = service.store.rows.columns(study_id, list(expected)).values
    chosen = service.store.rows.for_cases(study_id, [5, 0, 4], ["cost", "specific"])
    assert list(chosen.values) == ["cost", "specific"]
    text = service.http.get(f"/api/v1/studies/{study_id}/results", params={"format": "csv"}).text
    rows = list(csv.DictReader(io.StringIO(text)))
    parquet = service.http.get(f"/api/v1/studies/{study_id}/results", params={"format": "parquet"}).content
    table = pq.read_table(io.BytesIO(parquet))
    for name, values in expected.items():
        known = [None if np.isnan(value) else pytest.approx(value, rel=1e-15) for value in values.tolist()]
        assert [row["results"][name] for row in page] == known
        np.testing.assert_allclose(columns[name], values, rtol=1e-15)
        assert [float(row[name]) if row[name] else None for row in rows] == known
        assert [None if value != value else value for value in table[name].to_pylist()] == known
        if name in chosen.values:
            np.testing.assert_allclose(chosen.values[name], values[[5, 0, 4]], rtol=1e-15)
    with pytest.raises(KeyError, match="costs"):
        service.store.rows.for_cases(study_id, [0], ["costs"])


def test_curves_maps_answers_and_conditions_take_them(filled: Any, portal: BlockingPortal) -> None:
    service, study_id, expected = filled
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        study = client.study(study_id)
        curves = study.curves(y=["specific", "cost"], by="pendulums.0.mass").data
        assert {name: info["unit"] for name, info in curves["results"].items()} == {"specific": "W/kg", "cost": "1"}
        drawn = np.array([curve["y"]["specific"] for curve in curves["curves"]], dtype=float)
        np.testing.assert_allclose(drawn.reshape(-1), expected["specific"])
        assert np.shape(study.map("shaft.load", "pendulums.0.mass", "worth")["z"]["values"]) == (2, 3)
        answers = {item["name"]: item for item in study.answers()["overall"]}
        kept = np.delete(expected["specific"], 4)
        assert answers["largest_specific"]["value"] == pytest.approx(kept.max())
        assert answers["smallest_specific"]["value"] == pytest.approx(kept.min())
        explored = study.explore(["cost >= 18"], sort="-specific", show=["cost", "specific"])["cases"]
        wanted = [case for case in np.argsort(-expected["specific"]) if expected["cost"][case] >= 18.0 and case != 4]
        assert [row["case"] for row in explored if row["ending"] == "ok"] == wanted
        effects = study.sensitivity("cost")["results"][0]["effects"]
        np.testing.assert_allclose(effects[1]["means"], [15.0, 18.0, 21.0])


def test_pages_and_the_report_show_them(filled: Any) -> None:
    service, study_id, _ = filled
    for page in ("", "/cases/0", "/rows"):
        assert "specific" in service.http.get(f"/studies/{study_id}{page}").text
    rows = service.http.get(f"/studies/{study_id}/rows", params={"sort": "specific"}).text
    assert re.search(r'aria-sort="ascending"><a [^>]*>Specific</a>', rows)
    report = service.http.get(f"/api/v1/studies/{study_id}/report", params={"names": "codes"}).text
    assert "<td>specific" in report or "specific</" in report
    assert f'value="{QUANTITIES["specific"]}"' in service.http.get(f"/new?clone={study_id}").text


def test_studies_with_other_quantities_reuse_the_rows(filled: Any, spec: dict[str, Any]) -> None:
    service, study_id, expected = filled
    further = {"axes": [{"path": "shaft.load", "values": [0.4]}]}
    other = service.http.post(f"/api/v1/studies/{study_id}:extend", json=further)
    assert other.status_code == 202, other.text
    store, found = service.store, service.store.studies.study(other.json()["id"])
    assert [one.name for one in found.quantities] == list(expected)
    axes = service.get(f"/studies/{study_id}")["spec"]["axes"]
    for quantities in ({}, {"quantities": {"another": "2 * torque.max"}}):
        number = store.studies.get(service.submit({**spec, "axes": axes, **quantities})).number
        study = store.work.study_of(number)
        known = [store.reuse.known(study, chunk) for chunk in store.work.open_chunks(number)]
        assert [item is not None and item.missing.size for item in known] == [0, 0, 0]


def test_quantities_of_one_name_and_different_dimensions_are_not_compared(
    service: Service, spec: dict[str, Any]
) -> None:
    spec["axes"] = [{"path": "shaft.load", "values": [0.1, 0.2]}]
    asked = ({"margin": "torque.max", "price": "1 + gravity / (1 m/s^2)"}, {"margin": "shaft.speed.mean", "price": "2"})
    ids = [service.submit({**spec, "quantities": quantities}) for quantities in asked]
    found = comparison(service.store, QueryParams(), [service.store.studies.get(study_id) for study_id in ids])
    names = [info.name for info in found.results]
    assert "price" in names
    assert "margin" not in names


def batch_rows(study: Study, cases: range) -> ChunkResult:
    """Rows whose useful power is that of the load at 10 rad/s."""
    columns = {**study.base, **study.columns(cases)}
    return rows_with(study, cases, "power.useful.mean", 10.0 * np.asarray(columns["shaft.load"]))


def rows_with(study: Study, cases: range, name: str, column: NDArray[np.float64]) -> ChunkResult:
    """Rows of zeros but for one result."""
    infos = models.model_results(study)
    values = np.zeros((len(cases), len(infos)))
    values[:, [info.name for info in infos].index(name)] = column
    return ChunkResult(cases.start, [models.OK] * len(cases), [""] * len(cases), values)


def test_a_yield_has_conditions_on_them(service: Service, spec: dict[str, Any], portal: BlockingPortal) -> None:
    spec["axes"] = [{"path": "shaft.load", "values": [0.1]}]
    spec |= {"tolerances": [{"path": "pendulums.0.mass", "plus_minus": "20 %"}], "drives": 64, "quantities": QUANTITIES}
    study_id = service.submit(spec)
    number, epoch = service.store.studies.get(study_id).number, service.store.work.take_over("test")
    run_round(service.store, number, epoch, batch_rows)
    service.store.work.settle(epoch, number)
    study = service.store.studies.study(study_id)
    columns = study.columns(range(study.cases))
    drawn = 1.0 / columns["pendulums.0.mass"][columns["drive"] > 0]
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        found = client.study(study_id).yields(["specific >= 2.1 W/kg"]).data
        assert found["lines"][0]["all"]["reached"] == int((drawn >= 2.1).sum())
        ribbon = client.study(study_id).ribbon(y="specific").data
    assert ribbon["lines"][0]["results"]["specific"]["nominal"] == [pytest.approx(1.0 / 0.5)]


GOAL: dict[str, Any] = {
    "best": [{"result": "price"}],
    "subject_to": [{"result": "margin", "at_least": "1 rad/s"}, {"result": "shaft.speed.mean", "at_most": "10 rad/s"}],
    "population": 12,
    "generations": 12,
}
PRICES: dict[str, Any] = {
    "price": "excitation.frequency / (1 Hz) + 2000 * shaft.inertia / (1 kg*m^2)",
    "margin": "shaft.speed.mean - 5 rad/s - shaft.load / (0.3 N*m) * 1 rad/s",
}


def test_a_goal_and_its_limits_are_quantities(service: Service) -> None:
    """At the heavier load of 0.3 N*m the margin is that of the speed over 6 rad/s."""
    study_id = search_of(service, {**spec_of(**GOAL), "quantities": PRICES})
    front = service.get(f"/studies/{study_id}/front", limit=500)
    known = [design["design"] for design in front["designs"]]  # all but those that served derivatives
    study = service.store.studies.study(study_id)
    columns = study.columns(range(study.cases))
    price = columns["excitation.frequency"] + 2000.0 * columns["shaft.inertia"]
    speed = 4000.0 * columns["excitation.amplitude_x"]
    failed = (columns["excitation.frequency"] > 35.0) & (columns["shaft.inertia"] < 0.0015)
    meets = ((speed - 5.0 - columns["shaft.load"] / 0.3 >= 1.0) & (speed <= 10.0) & ~failed).reshape(-1, 2).all(axis=1)
    assert front["counts"]["feasible"] == np.count_nonzero(meets[known]) > 0
    best = front["designs"][0]
    assert best["goals"]["price"] == pytest.approx(price[::2][meets].min()) == pytest.approx(18.0, abs=0.2)
    assert [infos["unit"] for infos in front["subject_to"]] == ["rad/s", "rad/s"]


def test_a_quantity_is_refined(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = [{"path": "shaft.load", "adaptive": [0, "1 N*m"]}]
    spec["quantities"] = {"square": "(shaft.speed.mean / (1 rad/s))^2"}
    study_id = service.submit({**spec, "refine": {"results": ["square"], "error": "0.1 %"}})
    store = service.store
    number, epoch, planner = store.studies.get(study_id).number, store.work.take_over("test"), Rounds(store.work)

    def rows(study: Study, cases: range) -> ChunkResult:
        return rows_with(study, cases, "shaft.speed.mean", np.exp(3.0 * study.columns(cases)["shaft.load"]))

    for _ in range(20):
        run_round(store, number, epoch, rows)
        if planner.advance(epoch, number, store.studies.study(study_id)) is None:
            break
    (curve,) = service.get(f"/studies/{study_id}/curves", x="shaft.load", y="square")["curves"]
    load = np.array(curve["x"])
    np.testing.assert_allclose(curve["y"]["square"], np.exp(6.0 * load), rtol=1e-12)
    between = np.linspace(0.0, 1.0, 1001)
    drawn = PchipInterpolator(load, curve["y"]["square"])(between)
    np.testing.assert_allclose(drawn, np.exp(6.0 * between), atol=2e-3 * np.exp(6.0))
    assert load.size < 200
