"""Pages of searches, calibrations, drives, sensitivities and single cases: read in the chosen units and by captions."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.reading.wording import number
from sprag_study.worker.models.vocabulary import caption
from tests.service.calibrating import calibration
from tests.service.conftest import Service
from tests.service.searching import search

EXAMPLE = Path(__file__).resolve().parents[4] / "service" / "presets" / "tolerances.json"
RPM = 60.0 / (2.0 * 3.141592653589793)


def cells(page: str) -> list[str]:
    """Every cell of the tables of a page."""
    return [re.sub("<[^>]*>", "", cell).strip() for cell in re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", page, re.DOTALL)]


def test_designs_are_in_the_chosen_units(service: Service) -> None:
    study_id = search(service)
    page = service.http.get(f"/studies/{study_id}/rows?units=frequency%3Drpm").text
    design = service.get(f"/studies/{study_id}/front")["designs"][0]
    path = next(path for path in design["variables"] if path.endswith("frequency"))
    shown = cells(page)
    assert "Excitation frequencyrpm" in shown
    assert number(60.0 * design["variables"][path], 4) in shown
    assert "units=frequency%3Drpm" in page


def test_a_calibration_is_in_the_chosen_units(service: Service) -> None:
    study_id = calibration(service)
    page = service.http.get(f"/studies/{study_id}/matters?units=inertia%3Dkg*cm^2,speed%3Drpm,torque%3DN*mm").text
    found = service.get(f"/studies/{study_id}/calibration")
    inertia = next(one for one in found["parameters"] if one["unit"] == "kg*m^2")
    shown = cells(page)
    assert caption("vibration-drive", "shaft.inertia") in shown
    assert f"{number(inertia['value'] * 1e4)} kg·cm²" in shown
    point = found["points"][0]
    assert number(point["measured"] * RPM) in shown
    assert number(point["at"]["shaft.load"] * 1e3) in shown


def test_sensitivities_are_in_the_chosen_units(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit(spec)
    service.fill(study_id)
    mean = service.get(f"/studies/{study_id}/sensitivity", y="shaft.speed.mean")["results"][0]["mean"]
    page = service.http.get(f"/studies/{study_id}/matters?y=shaft.speed.mean&units=rpm").text
    assert f"mean {number(mean * RPM)} rpm" in page


def test_drives_are_in_the_chosen_units(service: Service) -> None:
    study_id = service.submit({**json.loads(EXAMPLE.read_text()), "drives": 6})
    service.fill(study_id)
    page = service.http.get(
        f"/studies/{study_id}/matters?ask=tolerances&units=torque%3DN*mm,speed%3Drpm,angle%3Ddeg"
    ).text
    assert "Load torque (N·mm)" in page
    shown = cells(page)
    assert "Mean shaft speed (rpm)" in shown
    assert not any(re.fullmatch(r"[a-z]+(\.[a-z_0-9]+)+", cell) for cell in shown)


@pytest.mark.parametrize("part", ["branch", "diagram", "basin"])
def test_forms_of_a_case_have_captions_and_figures_the_chosen_units(
    service: Service, spec: dict[str, Any], part: str
) -> None:
    spec = {**spec, "axes": [{"path": "shaft.load", "linspace": [0.05, 0.2, 4]}], "run": {"until": "settled"}}
    study_id = service.submit(spec)
    query = "x=pendulums.0.initial_angle&x_from=0&x_to=1&y=pendulums.0.initial_speed&y_from=0&y_to=1"
    page = service.http.get(
        f"/studies/{study_id}/cases/0?show={part}&units=torque%3DN*mm&{query if part == 'basin' else 'points=4'}"
    )
    assert page.status_code == 200
    options = re.findall(r'<option value="([\w.]+)"[^>]*>([^<]*)</option>', page.text)
    assert options
    assert all(label and label != name for name, label in options)
    assert "(N·mm)" in page.text
