"""Studies that search for designs whose drives differ: spec, rounds without an engine, answers and pages."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.stats import binom, binomtest

from sprag_study.service.cli import console, shown
from sprag_study.service.results.fronts import designs_of
from sprag_study.service.spec.design import design_spec
from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.worker.rounds import Rounds
from sprag_study.worker.spread import DRIVE
from sprag_study.worker.study import Study
from tests.service.rounds import run_round
from tests.service.searching import rows_of, spec_of
from tests.service.spec_sample import schema

if TYPE_CHECKING:
    from tests.service.conftest import Service

SPEED = {"result": "shaft.speed.mean", "quantile": "25 %", "at_least": "6 rad/s"}
YIELD = {"yield": [{"result": "shaft.speed.mean", "at_least": "6 rad/s"}], "at_least": "75 %"}
MEAN = {"result": "shaft.speed.mean", "statistic": "mean", "deviations": -1, "at_least": "5 rad/s"}
DRIVES = 8


def robust(**fields: Any) -> dict[str, Any]:
    """A search for the best efficiency of a quarter of the drives; the amplitude, with a tolerance, sets the speed."""
    spec = spec_of(
        **{
            "best": [{"result": "efficiency", "max": True, "quantile": "25 %"}],
            "subject_to": [SPEED, YIELD, MEAN],
            **fields,
        }
    )
    amplitudes = ["excitation.amplitude_x", "excitation.amplitude_y"]
    tolerances = [
        {"path": amplitudes, "plus_minus": "30 %", "shared": True},
        {"path": "shaft.load", "plus_minus": "10 %"},
    ]
    return {**spec, "tolerances": tolerances, "drives": DRIVES}


#: Fresh drives of the best design.
FRESH = 30


def test_each_design_is_run_with_every_drive_at_every_operating_point() -> None:
    spec = robust()
    schema().validate(spec)
    study = parse_spec(spec).study
    assert study.plan is not None
    assert (study.plan["drives"], study.plan["best"]) == (8, [{"result": "efficiency", "quantile": 0.25, "max": True}])
    assert study.cases == 8 * 2 * (DRIVES + 1)
    columns = study.columns(range(study.cases))
    np.testing.assert_array_equal(columns[DRIVE], np.tile(np.arange(DRIVES + 1.0), 16))
    loads = columns["shaft.load"].reshape(8, 2, DRIVES + 1)
    assert (loads[:, :, 0] == [0.2, 0.3]).all()
    np.testing.assert_allclose(loads / loads[:, :, :1], np.broadcast_to(loads[0, 0] / 0.2, loads.shape), rtol=1e-12)
    without = {name: value for name, value in spec.items() if name not in {"tolerances", "drives"}}
    without["goal"] = {**spec["goal"], "best": [{"result": "efficiency", "max": True}], "subject_to": []}
    plain = parse_spec(without).study
    assert plain.plan is not None
    assert "drives" not in plain.plan


@pytest.fixture
def ended(service: Service) -> tuple[Service, str]:
    """Such a study after all its rounds."""
    study_id = service.submit(robust(fresh_drives=FRESH))
    store = service.store
    number, epoch, planner = store.studies.get(study_id).number, store.work.take_over("test"), Rounds(store.work)
    for _ in range(9):
        run_round(store, number, epoch, rows_of)
        if planner.advance(epoch, number, store.studies.study(study_id)) is None:
            break
    return service, study_id


def test_the_designs_have_their_quantiles_and_yields(ended: tuple[Service, str]) -> None:
    service, study_id = ended
    found = service.get(f"/studies/{study_id}/front")
    speed, share, mean = (limit["result"] for limit in found["subject_to"])
    assert mean == "shaft.speed.mean (mean of the drives - 1 sigma)"
    assert speed == "shaft.speed.mean (25 % quantile)"
    assert share == "yield (shaft.speed.mean at least 6)"
    assert found["best"][0]["result"] == "efficiency (25 % quantile)"
    assert found["counts"]["known"] == 16
    study = service.store.studies.study(study_id)
    assert study.cases == 16 * 2 * (DRIVES + 1) + 2 * FRESH
    columns = study.columns(range(study.cases))
    for design in found["designs"]:
        first = design["cases"][0]
        assert design["cases"] == [first, first + DRIVES + 1]
        if design["failed"]:
            continue
        speeds = 4000.0 * columns["excitation.amplitude_x"][first + 1 : first + 1 + DRIVES]
        assert design["results"][speed] == [pytest.approx(np.sort(speeds)[1])] * 2
        assert design["results"][share] == [pytest.approx((speeds >= 6.0).mean())] * 2
        least = speeds.mean() - speeds.std(ddof=1)
        assert design["results"][mean] == [pytest.approx(least)] * 2
        assert design["feasible"] == bool(np.sort(speeds)[1] >= 6.0 and (speeds >= 6.0).mean() >= 0.75 and least >= 5.0)
    table = service.http.get(f"/api/v1/studies/{study_id}/front", params={"format": "csv"})
    assert "efficiency (25 % quantile)" in table.text
    for page in ("", "/rows", "/cases/0", "/document"):
        assert service.http.get(f"/studies/{study_id}{page}").status_code == 200


def test_the_best_design_has_fresh_drives_and_their_intervals(
    ended: tuple[Service, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    service, study_id = ended
    report = service.get(f"/studies/{study_id}/front")
    (fresh,), best = report["fresh"], report["designs"][0]
    study = service.store.studies.study(study_id)
    assert (fresh["design"], fresh["drives"]) == (best["design"], FRESH)
    cases = range(fresh["first_case"], fresh["first_case"] + 2 * FRESH)
    columns = study.columns(cases)
    np.testing.assert_array_equal(columns[DRIVE], np.tile(DRIVES + 1.0 + np.arange(FRESH), 2))
    assert cases.stop == study.cases
    # Independent draws of a normal distribution of 3 x its deviation, of which no drive of the search is one.
    factors = columns["excitation.amplitude_x"][:FRESH] / best["variables"]["excitation.amplitude_x"]
    assert abs(factors.mean() - 1.0) < 4.0 * 0.1 / FRESH**0.5
    assert study.spread is not None
    assert len(np.unique(study.spread.array[:, 0])) == DRIVES + FRESH
    speeds = np.sort(4000.0 * columns["excitation.amplitude_x"][:FRESH])
    name, share, mean = (limit["result"] for limit in report["subject_to"])
    assert fresh["results"][mean]["values"] == [pytest.approx(speeds.mean() - speeds.std(ddof=1))] * 2
    own = fresh["results"][name]
    assert own["values"] == [pytest.approx(speeds[7])] * 2  # number ceil(0.25 x 30) from the lowest
    # Ranks whose binomial probability is at least 95 % (scipy).
    first, last = speeds.searchsorted([own["low"][0] - 1e-9, own["high"][0] - 1e-9])
    assert binom.cdf(last, FRESH, 0.25) - binom.cdf(first, FRESH, 0.25) >= 0.95
    reached = int((speeds >= 6.0).sum())
    wilson = binomtest(reached, FRESH).proportion_ci(0.95, "wilson")
    yields = fresh["results"][share]
    assert yields["values"] == [pytest.approx(reached / FRESH)] * 2
    assert (yields["low"][0], yields["high"][0]) == pytest.approx((wilson.low, wilson.high))
    assert fresh["feasible"] == bool(speeds[7] >= 6.0 and reached >= 0.75 * FRESH)
    assert fresh["goals"]["efficiency (25 % quantile)"] == pytest.approx(
        best["goals"]["efficiency (25 % quantile)"], 0.1
    )
    text = service.http.get(f"/api/v1/studies/{study_id}/front", params={"format": "csv"}).text
    header, *lines = csv.reader(io.StringIO(text))
    at = header.index(f"fresh.{share}.1.low")
    assert [line[at] != "" for line in lines] == [True] + [False] * 15
    assert float(lines[0][at]) == pytest.approx(wilson.low)
    assert lines[0][header.index("fresh.drives")] == str(FRESH)
    for module in (console, shown):
        monkeypatch.setattr(module, "piped", lambda: False)
    shown.show_designs(report)
    before, _, table = capsys.readouterr().out.partition("30 drives that the search has not seen")
    assert "16 designs" in before
    assert len([line for line in table.splitlines() if "rad/s" in line]) >= 4  # two limits at two points
    for page in ("", "/document"):
        assert "With 30 drives that the search has not seen" in service.http.get(f"/studies/{study_id}{page}").text


def test_a_search_says_how_many_fresh_drives_it_has() -> None:
    usual, without = parse_spec(robust()).study, parse_spec(robust(fresh_drives=0)).study
    assert usual.spread is not None
    assert usual.plan is not None
    assert without.plan is not None
    assert (usual.plan["fresh"], usual.spread.fresh, len(usual.spread.array)) == (500, 500, DRIVES + 500)
    assert Study.from_text(usual.to_text()) == usual
    assert "fresh" not in without.to_text()
    assert without.spread is not None
    np.testing.assert_array_equal(without.spread.array, usual.spread.array[:DRIVES])
    assert {key: value for key, value in usual.plan.items() if key != "fresh"} == without.plan
    more = parse_spec(robust() | {"drives": 2 * DRIVES}).study
    assert more.spread is not None
    np.testing.assert_array_equal(more.spread.array[-500:], usual.spread.array[-500:])


def test_a_design_is_studied_further_with_the_same_drives(ended: tuple[Service, str]) -> None:
    service, study_id = ended
    spec, study = service.store.studies.spec(study_id), service.store.studies.study(study_id)
    own = parse_spec(design_spec(spec, study, 0)).study
    assert own.shape == (DRIVES + 1,)
    assert own.spread is not None
    assert study.spread is not None
    np.testing.assert_array_equal(own.spread.array, study.spread.array[:DRIVES])
    drawn = parse_spec(design_spec(spec, study, 3)).study
    assert drawn.spread is None
    assert drawn.base["shaft.load"] == study.case_parameters(3)["shaft.load"]


def test_designs_of_unfinished_rounds_are_pending(service: Service) -> None:
    study_id = service.submit(robust())
    study = service.store.studies.study(study_id)

    def fetch(cases: Any, names: Any) -> Any:
        return service.store.rows.for_cases(study_id, cases, names)

    assert designs_of(study, [], fetch).pending == 8


@pytest.mark.parametrize(
    ("fields", "pointer", "code"),
    [
        ({"goal": {"subject_to": [], "best": [{"result": "efficiency"}]}}, "/tolerances", "not-used"),
        ({"tolerances": ...}, "/drives", "not-used"),
        ({"tolerances": ..., "drives": ...}, "/goal/best/0/quantile", "conflict"),
        ({"goal": {"best": [{"result": "efficiency", "quantile": "120 %"}]}}, "/goal/best/0/quantile", "out-of-range"),
        ({"goal": {"best": [{"yield": [], "max": True}]}}, "/goal/best/0/yield", "wrong-type"),
        ({"goal": {"best": [{"yield": YIELD["yield"], "max": False}]}}, "/goal/best/0/max", "conflict"),
        ({"goal": {"subject_to": [{**SPEED, "yield": YIELD["yield"]}]}}, "/goal/subject_to/0/result", "conflict"),
        ({"goal": {"subject_to": [{"yield": YIELD["yield"]}]}}, "/goal/subject_to/0/at_least", "not-a-number"),
        ({"goal": {"subject_to": [{"yield": [SPEED], "at_least": 0.9}]}}, "/goal/subject_to/0/yield/0/quantile",
         "unknown-field"),
        ({"goal": {"subject_to": [{"result": "efficiency", "is": 0.2, "quantile": "5 %"}]}},
         "/goal/subject_to/0/quantile", "conflict"),
        ({"goal": {"population": 100, "generations": 60}}, "/goal/generations", "too-many"),
        ({"goal": {"subject_to": [{**MEAN, "quantile": "5 %"}]}}, "/goal/subject_to/0/quantile", "conflict"),
        ({"goal": {"subject_to": [{**SPEED, "deviations": 3}]}}, "/goal/subject_to/0/deviations", "not-used"),
        ({"goal": {"subject_to": [{**MEAN, "statistic": "deviation"}]}}, "/goal/subject_to/0/deviations", "conflict"),
        ({"goal": {"subject_to": [{**MEAN, "statistic": "median"}]}}, "/goal/subject_to/0/statistic", "invalid-choice"),
        ({"goal": {"subject_to": [{**MEAN, "deviations": "three"}]}}, "/goal/subject_to/0/deviations", "wrong-type"),
        ({"goal": {"subject_to": [{"yield": [MEAN], "at_least": 0.9}]}}, "/goal/subject_to/0/yield/0/statistic",
         "unknown-field"),
        ({"goal": {"subject_to": [{**YIELD, "statistic": "mean"}]}}, "/goal/subject_to/0/statistic", "conflict"),
        ({"goal": {"best": [{"result": "efficiency", "statistic": "mean"}]}, "drives": 1}, "/goal/best/0/statistic",
         "conflict"),
        ({"tolerances": ..., "drives": ..., "goal": {"best": [{"result": "efficiency", "statistic": "mean"}]}},
         "/goal/best/0/statistic", "conflict"),
        ({"goal": {"fresh_drives": -1}}, "/goal/fresh_drives", "out-of-range"),
        ({"goal": {"fresh_drives": 20_000, "at": [{"shaft.load": load / 100} for load in range(1, 5)]}},
         "/goal/fresh_drives", "too-many"),
        ({"tolerances": ..., "drives": ..., "goal": {"fresh_drives": 10}}, "/goal/fresh_drives", "conflict"),
    ],
)  # fmt: skip
def test_what_is_refused_names_its_place(fields: dict[str, Any], pointer: str, code: str) -> None:
    spec = robust()
    changes = {**fields, "goal": {**spec["goal"], **fields.get("goal", {})}}
    spec = {name: value for name, value in {**spec, **changes}.items() if value is not ...}
    with pytest.raises(SpecError) as caught:
        parse_spec(spec)
    assert {fault.where: fault.code for fault in caught.value.faults}[pointer] == code
