"""Machine shafts through the service: rows, curves, maps, tables over the angle and faults, by HTTP and by command."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.engine.machine_shaft.trajectory import trajectory
from sprag_study.service.answers import results, studies
from sprag_study.service.jobs.local import run_here
from sprag_study.service.spec.document import format_of, load_spec, parse_spec
from sprag_study.service.storage.store import Store
from sprag_study.worker import models
from sprag_study.worker.executors.inline import InlineExecutor
from tests.service.rounds import computed
from tests.service.shapes import fits
from tests.service.spec.machine.test_shaft import PRESS, changed

if TYPE_CHECKING:
    from tests.service.conftest import Service

#: The press of the reference values, without units: what the engine is called with here knows nothing of specs.
NUMBERS = {
    "mechanism.slider_crank.crank": 0.1,
    "mechanism.slider_crank.rod": 0.4,
    "mechanism.slider_crank.rod_centre": 0.16,
    "mechanism.slider_crank.rod_mass": 6.0,
    "mechanism.slider_crank.rod_inertia": 0.12,
    "mechanism.slider_crank.ram_mass": 20.0,
    "mechanism.slider_crank.inclination": -math.pi / 2.0,
    "operation.steps.0.from": 2.0943951023931957,  # 2 pi/3, correctly rounded
    "operation.steps.0.to": math.pi,
    "operation.steps.0.value": 20e3,
    "wanted_irregularity": 0.1,
}
STRUCTURE = MachineSpec.from_json(
    {
        "mechanism": {"kind": "slider_crank"},
        "operation": {"quantity": "force", "form": "steps", "steps": 1},
    }
)
RESULTS = [info.name for info in models.result_infos("machine-shaft", "")]


@pytest.fixture
def filled(service: Service) -> tuple[Service, str]:
    """A service with the press, its rows computed and committed as a dispatcher does."""
    return service, computed(service, PRESS)


def engine_rows(study_id_study: Any) -> np.ndarray[Any, Any]:
    """Results of all cases straight from the engine."""
    columns = study_id_study.columns(range(study_id_study.cases))
    return simulate(STRUCTURE, NUMBERS | columns, cases=study_id_study.cases).values


def test_rows_are_the_engines(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    block = service.store.rows.block(study_id)
    np.testing.assert_array_equal(block.values, engine_rows(service.store.studies.study(study_id)))
    page = service.get(f"/studies/{study_id}/cases", page_size=52)
    fits(results.CasePage, page)
    row = page["cases"][30]
    assert row["ending"] == "ok"
    assert isinstance(row["results"]["phi_c.count"], int)
    assert page["cases"][0]["ending"] == "inertia_insufficient"
    assert page["cases"][0]["results"]["omega.max"] is None
    case = service.get(f"/studies/{study_id}/cases/0")
    assert "least feasible mean speed" in case["ending_meaning"]
    assert case["results"]["least_mean_speed"] > case["parameters"]["mean_speed"]


def test_curves_and_maps(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    rows = engine_rows(service.store.studies.study(study_id)).reshape(4, 13, -1)
    curves = service.get(
        f"/studies/{study_id}/curves", x="drive.inertia", y=["irregularity", "omega.min"], at="mean_speed=120 rpm"
    )
    fits(results.Curves, curves)
    assert curves["x"]["unit"] == "kg*m^2"
    assert curves["curves"][0]["y"]["irregularity"] == rows[2, :, RESULTS.index("irregularity")].tolist()
    assert curves["curves"][0]["endings"] == ["ok"] * 13
    drawn = service.get(f"/studies/{study_id}/map", x="drive.inertia", y="mean_speed", z="s4.amplitude")
    assert np.array(drawn["z"]["values"], dtype=float) == pytest.approx(
        rows[:, :, RESULTS.index("s4.amplitude")], rel=0, abs=0, nan_ok=True
    )
    picture = service.http.get(
        f"/api/v1/studies/{study_id}/curves?x=drive.inertia&y=irregularity&by=mean_speed&format=svg"
    )
    assert picture.status_code == 200
    for page in ("", "/rows", "/cases/30", "?z=irregularity"):
        assert service.http.get(f"/studies/{study_id}{page}").status_code == 200


def test_trajectories_are_tables_over_the_angle(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    study = service.store.studies.study(study_id)
    case = study.case_number((2, 6))
    own = NUMBERS | study.case_parameters(case)
    table = service.get(f"/studies/{study_id}/cases/{case}/trajectory", points=73)
    fits(results.AngleTable, table)
    assert table["axis"] == {"name": "angles", "unit": "rad"}
    assert table["angles"] == np.linspace(0.0, 2.0 * math.pi, 73).tolist()
    expected = trajectory(STRUCTURE, own, table["angles"])
    assert {name: entry["unit"] for name, entry in table["variables"].items()} == dict(
        zip(expected.names, expected.units, strict=True)
    )
    for column, name in enumerate(expected.names):
        assert table["values"][name] == expected.values[:, column].tolist()
    squares = np.array([table["values"][f"s{k}"] for k in range(1, 5)]).sum(axis=0)
    assert squares == pytest.approx(np.array(table["values"]["omega"]) ** 2, rel=1e-12)
    assert len(table["phi_c"]) == service.get(f"/studies/{study_id}/cases/{case}")["results"]["phi_c.count"]
    part = service.get(
        f"/studies/{study_id}/cases/{case}/trajectory", **{"from": "90 deg", "to": "0.5 cycles"}, points=2
    )
    assert part["angles"] == pytest.approx([math.pi / 2.0, math.pi], rel=1e-15)
    text = service.http.get(f"/api/v1/studies/{study_id}/cases/{case}/trajectory?points=2&format=csv").text
    assert text.startswith("angle,time,omega,acceleration,")
    beyond = service.http.get(f"/api/v1/studies/{study_id}/cases/{case}/trajectory?to=400%20deg")
    assert beyond.status_code == 422
    assert [item["code"] for item in beyond.json()["errors"]] == ["out-of-range"]
    assert service.get(f"/studies/{study_id}/cases/0/trajectory")["ending"] == "inertia_insufficient"


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"/base/mean_speed": "40 rpm"}, "/base/mean_speed", "inertia-insufficient"),
        (
            {"/base/drive/torque": 50, "/base/balance": "refuse"},
            "/base/balance",
            "unbalanced-work",
        ),
        ({"/base/mechanism/slider_crank/rod": "90 mm"}, "/base/mechanism/slider_crank", "cannot-assemble"),
        (
            {"/base/drive/torque": {"table": [[0, 1], ["360 deg", 2]]}},
            "/base/drive/torque/table",
            "invalid-table",
        ),
        ({"/base/drive/inertia": -1}, "/base/drive/inertia", "out-of-range"),
    ],
)
def test_faults_by_http_and_by_command(
    service: Service, sprag: Callable[..., Any], tmp_path: Path, changes: Any, pointer: str, code: str
) -> None:
    for address in ("studies", "studies:preview"):
        answer = service.http.post(f"/api/v1/{address}", json=changed(changes))
        assert answer.status_code == 422
        assert answer.headers["content-type"] == "application/problem+json"
        (error,) = answer.json()["errors"]
        assert (error["pointer"], error["code"]) == (pointer, code)
    path = tmp_path / "press.json"
    path.write_text(json.dumps(changed(changes)))
    assert f"  {pointer}: {error['message']}" in sprag("check", path).err
    done = sprag("check", path, "--json")
    assert (done.code, [(item["pointer"], item["code"]) for item in done.data["problems"]]) == (2, [(pointer, code)])


def test_run_and_preview(service: Service, examples: Path) -> None:
    parsed = parse_spec(load_spec((examples / "press.toml").read_bytes(), format_of("press.toml")))
    with run_here(parsed.spec, parsed.study, processes=1, executor=InlineExecutor()) as done:
        np.testing.assert_array_equal(done.store.rows.block(done.record.id).values, engine_rows(parsed.study))
        assert (done.record.ok, done.record.cases) == (49, 52)
    preview = service.http.post("/api/v1/studies:preview", json=PRESS).json()
    fits(studies.Preview, preview)
    assert (preview["cases"], preview["shape"], preview["results"]) == (52, [4, 13], len(RESULTS))
    assert 0.0 < preview["estimated_seconds"] < 5.0 + models.estimate_compile_seconds(parsed.study)


def test_rows_of_another_structure_are_not_reused(tmp_path: Path) -> None:
    plain = {"/base/mechanism": {"formula": "3*sin(phi)^2"}, "/base/operation": ..., "/axes/0/values": [10, 20]}
    other = plain | {"/base/mechanism": {"formula": "2*sin(phi)^2"}}
    with Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}") as store:
        first, second = (parse_spec(changed(spec)) for spec in (plain, other))
        record = store.studies.create(first.spec, first.study)
        epoch = store.work.take_over("test")
        for chunk in store.work.claim(epoch, store.work.open_chunks(record.number)):
            store.work.commit(epoch, chunk, models.run_chunk(first.study, chunk.first, chunk.count))
        assert store.reuse.count(first.study) == first.study.cases
        assert store.reuse.count(second.study) == 0


def test_rows_as_a_file(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    text = service.http.get(f"/api/v1/studies/{study_id}/results?format=csv").text
    rows = list(csv.DictReader(io.StringIO(text)))
    assert list(rows[0])[:4] == ["case", "mean_speed", "drive.inertia", "ending"]
    assert list(rows[0])[5:] == RESULTS
    assert rows[0]["omega.max"] == ""


def test_work_that_is_a_formula_of_the_time_is_estimated_and_accepted(service: Service) -> None:
    """Like that of docs/guide-machine-shaft.md."""
    operation = {"quantity": "torque", "formula": "if(t > 0.1, if(t < 0.25, 200, 0), 0)"}
    spec = changed({"/base/operation": operation, "/axes": [{"path": "drive.inertia", "values": [900, 1200]}]})
    assert service.http.post("/api/v1/studies:preview", json=spec).json()["cases"] > 0
    service.submit(spec)
