"""A study with tolerances on the API, the pages, in files and in further studies."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.service.client.frames import grid_of
from sprag_study.service.presets import preset_text
from sprag_study.service.results.selection import held_texts
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.text import load_spec
from sprag_study.worker import models
from sprag_study.worker.models import WorkerEnding
from sprag_study.worker.spread import DRIVE, Spread, Tolerance
from sprag_study.worker.study import Axis, Study
from tests.service.spec_sample import parsed

if TYPE_CHECKING:
    from tests.service.conftest import Service

BACKLASH = "pendulums.0.backlash"


@pytest.fixture
def filled(service: Service, spec: dict[str, Any]) -> tuple[Service, str]:
    """A finished study of two loads, each with the nominal drive and four drawn ones."""
    spec["axes"] = [{"path": "shaft.load", "values": [0.1, 0.3]}]
    spec |= {"tolerances": [{"path": BACKLASH, "plus_minus": "60 %"}, {"path": "shaft.load", "plus_minus": "5 %"}]}
    study_id = service.submit(spec | {"drives": 4})
    service.fill(study_id)
    return service, study_id


def rows_of(service: Service, study_id: str) -> list[dict[str, str]]:
    text = service.http.get(f"/api/v1/studies/{study_id}/results", params={"format": "csv"}).text
    return list(csv.DictReader(io.StringIO(text)))


def test_files_have_the_drive_and_the_drawn_values(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    study = service.store.studies.study(study_id)
    columns = study.columns(range(10))
    rows = rows_of(service, study_id)
    assert [float(row[DRIVE]) for row in rows] == [0, 1, 2, 3, 4] * 2
    for path in (BACKLASH, "shaft.load"):
        assert [float(row[path]) for row in rows] == columns[path].tolist()
    for form in ("json", "jsonl", "parquet", "xlsx", "arrow"):
        assert service.http.get(f"/api/v1/studies/{study_id}/results", params={"format": form}).status_code == 200
    file = service.http.get(f"/api/v1/studies/{study_id}/results", params={"format": "netcdf"})
    with grid_of(file.content) as data:
        assert dict(data.sizes) == {"shaft.load": 2, DRIVE: 5}
        np.testing.assert_array_equal(data["shaft.load"], [0.1, 0.3])
        assert data[BACKLASH].dims == (DRIVE,)
        np.testing.assert_array_equal(data[BACKLASH], columns[BACKLASH][:5])


def test_curves_are_those_of_the_nominal_drive_unless_another_is_asked_for(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    first = service.get(f"/studies/{study_id}/curves")
    assert [curve["cases"] for curve in first["curves"]] == [[0, 5]]
    third = service.get(f"/studies/{study_id}/curves", x="shaft.load", y="shaft.speed.mean", at=f"{DRIVE}=3")
    assert [curve["cases"] for curve in third["curves"]] == [[3, 8]]
    refused = service.http.get(f"/api/v1/studies/{study_id}/curves", params={"x": BACKLASH, "y": "shaft.speed.mean"})
    assert "differs from drive to drive" in refused.text
    every = service.get(f"/studies/{study_id}/curves", x="shaft.load", y="shaft.speed.mean", by=DRIVE)
    assert len(every["curves"]) == 5


def test_the_page_of_a_running_study_shows_the_place_of_a_drawn_case(service: Service, spec: dict[str, Any]) -> None:
    frequencies = [20.0 + number for number in range(9)]
    spec["axes"] = [
        {"path": "shaft.load", "values": [0.1, 0.3]},
        {"path": "pendulums.0.mass", "values": [0.4, 0.5]},
        {"path": "excitation.frequency", "values": frequencies},
    ]
    spec |= {"tolerances": [{"path": "excitation.frequency", "plus_minus": "5 %"}], "drives": 511}
    study_id = service.submit(spec)
    chunks = service.store.work.open_chunks(service.store.studies.get(study_id).number)
    study = service.store.studies.study(study_id)
    first = next(chunk.first for chunk in chunks if chunk.first % 512)
    service.fill(study_id, range(first, first + 1))
    text = service.http.get(f"/studies/{study_id}").text
    place = study.axes[2].value(int(study.indices([first])[2][0]))
    assert f"excitation.frequency%3D{place!r}" in text


def test_a_caption_has_the_values_of_the_drive() -> None:
    items = [{"path": "excitation.frequency", "plus_minus": "5 %"}]
    study = parsed({"/axes": [{"path": "shaft.load", "values": [0.1, 0.2]}], "/tolerances": items, "/drives": 3}).study
    frequency = study.columns([2])["excitation.frequency"][0]
    assert "excitation.frequency = 25 Hz" in held_texts(study, {DRIVE: 0.0})
    assert f"excitation.frequency = {frequency:.6g} Hz" in held_texts(study, {DRIVE: 2.0})
    assert any(text.startswith("excitation.frequency = 25 Hz ± ") for text in held_texts(study, {}))  # every drive


def test_pages_show_the_drive_of_a_case_and_its_values(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    drawn = service.store.studies.study(study_id).case_parameters(7)
    case = service.get(f"/studies/{study_id}/cases/7")
    assert case["parameters"] == drawn
    text = service.http.get(f"/studies/{study_id}/cases/7").text
    assert BACKLASH in text
    own = service.http.get(f"/studies/{study_id}").text
    assert "varies from drive to drive" in own
    rows = service.http.get(f"/studies/{study_id}/rows").text
    assert set(re.findall(r'<tr data-case="(\d+)"', rows)) == {"0", "1", "2", "3", "4"}
    file = service.http.get(f"/api/v1/studies/{study_id}/results", params={"format": "json"}).json()
    assert file["given"]["tolerances"][0] == {"path": BACKLASH, "plus_minus": "60 %"}


def test_a_clone_has_the_same_cases_and_another_seed_only_the_nominal_ones(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    spec = service.store.studies.spec(study_id)
    again = service.get(f"/studies/{study_id}")["spec"]
    assert again["tolerances"] == spec["tolerances"]
    changes = {f"/{name}": value for name, value in spec.items()}
    assert service.store.reuse.count(parsed(changes).study) == 10
    assert service.store.reuse.count(parsed(changes | {"/seed": 2}).study) == 2
    wider = {"axes": [{"path": "shaft.load", "values": [0.5]}]}
    answer = service.http.post(f"/api/v1/studies/{study_id}:extend", json=wider)
    assert answer.status_code == 202, answer.text
    extended = service.store.studies.study(answer.json()["id"])
    assert (extended.cases, service.store.reuse.count(extended)) == (15, 10)


def test_the_preview_counts_all_drives(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = []
    spec |= {"tolerances": [{"path": BACKLASH, "plus_minus": "300 %"}], "drives": 63}
    answer = service.http.post("/api/v1/studies:preview", json=spec).json()
    assert (answer["cases"], answer["shape"], "tolerance-cut" in answer["warning_codes"]) == (64, [64], True)
    assert [case["parameters"][DRIVE] for case in answer["first_cases"]][:2] == [0.0, 1.0]


def test_a_drive_that_is_no_machine_is_a_failed_case_and_the_others_are_run() -> None:
    found = parsed(
        {
            "/axes": [],
            "/tolerances": [{"path": "pendulums.0.arm", "plus_minus": "30 %"}],
            "/drives": 16,
            "/base/pendulums/0/inertia": ...,
            "/derive": {"pendulums.0.inertia": "1.1 * pendulums.0.mass * pendulums.0.arm^2"},
            "/base/pendulums/0/spring_rate": ...,
        }
        | {"/derive/pendulums.0.spring_rate": "9000 N/m * (1 - ((pendulums.0.arm - 30 mm) / 3 mm)^2)"}
    )
    assert any("these drives fail" in text for text in found.warnings)
    study = found.study
    rates = study.columns(range(17))["pendulums.0.spring_rate"]
    assert 0 < (rates < 0.0).sum() < 10
    result = models.run_chunk(study, 0, 17)
    assert [ending == WorkerEnding.INVALID for ending in result.endings] == (rates < 0.0).tolist()
    assert np.isnan(result.values[rates < 0.0]).all()
    for case in (0, int(np.flatnonzero(rates >= 0.0)[-1])):
        alone = models.run_chunk(study, case, 1)
        np.testing.assert_array_equal(alone.values[0], result.values[case])


def test_the_motion_of_a_drive_has_its_drawn_values(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    study = service.store.studies.study(study_id)
    values = study.case_parameters(7)
    alone = replace(
        study, base=study.base | {path: values[path] for path in (BACKLASH, "shaft.load")}, axes=(), spread=None
    )
    own, single = (models.run_trajectory(one, case, 0.0, 0.5, 9) for one, case in ((study, 7), (alone, 0)))
    np.testing.assert_array_equal(own.values, single.values)
    np.testing.assert_array_equal(models.run_chunk(study, 7, 1).values, models.run_chunk(alone, 0, 1).values)


def test_a_machine_shaft_has_drives_too() -> None:
    spec = load_spec(preset_text("compressor")[1], "toml")
    assert isinstance(spec, dict)
    path = "mechanism.slider_crank.rod"
    spec = {name: value for name, value in spec.items() if name != "axes"}
    spec |= {"tolerances": [{"path": path, "plus_minus": "1 %"}], "drives": 3}
    study = parse_spec(spec).study
    result = models.run_chunk(study, 0, 4)
    assert set(result.endings) == {"ok"}
    assert len(np.unique(result.values, axis=0)) == 4
    assert models.run_trajectory(study, 3, 0.0, 1.0, 3).times.size == 3


def test_a_drive_with_a_clutch_of_negative_torque_is_not_run() -> None:
    study = parsed({"/axes": []}).study
    path = "clutch.coefficients.1"
    spread = Spread([Tolerance(path, (path,), "scale")], [[1.1], [-0.5]])
    study = Study(study.model, "", study.base, study.run, (Axis((DRIVE,), [0.0, 1.0, 2.0]),), spread=spread)
    assert models.run_chunk(study, 0, 3).endings == ["ok", "ok", WorkerEnding.INVALID]
    assert models.run_chunk(study, 2, 1).endings == [WorkerEnding.INVALID]
