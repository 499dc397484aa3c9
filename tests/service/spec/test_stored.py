"""Specs that were accepted before are read as they were read then, wherever they are read again."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.vibration_drive.cases import default_of
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.stored import accepted
from sprag_study.worker.axis import Axis
from tests.service.conftest import API, Service
from tests.service.spec.machine.test_shaft import changed as press
from tests.service.spec_sample import changed

HEAD = "gravity [mm/s^2];excitation.frequency [rpm]\n"
#: A table of points, and what it was read as when points were decimal whatever stood beside them.
OLD = changed({"/axes": [{"points": HEAD + "20.000;1500,5\n25.000;1600,5\n"}], "/exclude": []})
THEN = changed({"/axes": [{"points": HEAD + "20;1500.5\n25;1600.5\n"}], "/exclude": []})
NOW = changed({"/axes": [{"points": HEAD + "20000;1500.5\n25000;1600.5\n"}], "/exclude": []})


def gravity(spec: dict[str, Any]) -> list[float]:
    study = parse_spec(spec).study
    return [float(value) for value in study.columns(range(study.cases))["gravity"]]


def test_a_stored_study_says_how_its_points_were_read() -> None:
    assert gravity(OLD) == gravity(NOW) == [20.0, 25.0]
    assert gravity(accepted(OLD, parse_spec(THEN).study)) == pytest.approx([0.020, 0.025])
    assert gravity(accepted(OLD, parse_spec(NOW).study)) == [20.0, 25.0]
    assert accepted(OLD, parse_spec(NOW).study) == OLD
    assert accepted(OLD) == OLD
    named = accepted({**OLD, "name": "run 20.000"}, parse_spec(THEN).study)
    assert named["name"] == "run 20.000"
    other = changed({"/base/pendulums/0/mass": "7 kg"})  # a schedule that was changed since
    assert accepted(OLD, parse_spec(other).study) == OLD


@pytest.mark.parametrize(
    ("pointer", "old", "then"),
    [
        ("/base/operation",
         {"quantity": "torque", "csv": "angle [deg];torque [N*m]\n0;1.000\n90;3,5\n300;1.000\n"},
         {"quantity": "torque", "csv": "angle [deg];torque [N*m]\n0;1\n90;3.5\n300;1\n"}),
        ("/base/operation",
         {"quantity": "torque", "table": [["0 deg", "1.000 N*m"], ["90 deg", "3,5 N*m"], ["300 deg", "1.000 N*m"]]},
         {"quantity": "torque", "table": [["0 deg", "1 N*m"], ["90 deg", "3.5 N*m"], ["300 deg", "1 N*m"]]}),
    ],
)  # fmt: skip
def test_tables_of_machines_and_lists(pointer: str, old: dict[str, Any], then: dict[str, Any]) -> None:
    ends: dict[str, Any] = {"/base/drive/inertia": 1e6, "/axes": []}
    spec, meant = (press({pointer: value, **ends}) for value in (old, then))
    study = parse_spec(meant).study
    again = parse_spec(accepted(spec, study)).study
    assert again.structure == study.structure
    assert parse_spec(spec).study.structure != study.structure


def test_a_study_that_chooses_its_own_cases() -> None:
    """It has more cases than its spec by now."""
    refine = {"results": ["shaft.speed.mean"], "error": 0.01}

    def spec_from(low: str, high: str) -> dict[str, Any]:
        axis = {"path": "gravity", "adaptive": [low, high]}
        return changed({"/axes": [axis], "/combine": ...}) | {"refine": refine}

    study = parse_spec(spec_from("20 mm/s^2", "25000.5 mm/s^2")).study
    (axis,) = study.axes
    grown = replace(study, axes=(Axis(axis.paths, np.append(axis.array, axis.array.mean())),))
    assert parse_spec(accepted(spec_from("20.000 mm/s^2", "25000,5 mm/s^2"), grown)).study.axes == study.axes


@pytest.fixture
def stored(service: Service) -> str:
    """A study that an earlier version accepted, with its spec as it was sent."""
    made = service.store.studies.create(OLD, parse_spec(THEN).study)
    service.fill(made.id)
    return made.id


def values_of(service: Service, study_id: str) -> list[float]:
    study = service.store.studies.study(study_id)
    return sorted(float(value) for value in study.columns(range(study.cases))["gravity"])


def test_it_is_extended_cloned_selected_and_scheduled_as_it_was(service: Service, stored: str) -> None:
    further = {"cases": [{"points": HEAD + "30;1500.5\n"}]}
    extended = service.http.post(f"{API}/studies/{stored}:extend", json=further).json()["id"]
    assert values_of(service, extended) == pytest.approx([0.020, 0.025, 0.030])
    page = service.http.get(f"/new?clone={stored}").text
    assert "20.0000" in page
    assert "20.000;" not in page
    form = {"when": "cron", "cron": "0 22 * * *", "priority": "0", "zone": "UTC", "source": f"study {stored}"}
    assert service.http.post("/nights/new", data=form).status_code == 303
    (schedule,) = service.store.schedules.all()
    assert gravity(schedule.fields.spec) == pytest.approx([0.020, 0.025])


@pytest.mark.parametrize("values", [["100 200 N*mm", "300 400 N*mm", "0.5 N*m"], "100 200; 300 400; 500 N*mm"])
def test_blanks_in_a_list_separated_thousands(values: Any) -> None:
    spec = changed({"/axes": [{"path": "shaft.load", "values": values}]})
    with pytest.raises(SpecError, match="could be one value or several"):
        parse_spec(spec)
    then = accepted(spec)
    assert parse_spec(then).study.axes[0].array.tolist() == pytest.approx([100.2, 300.4, 0.5])
    assert accepted(then) == then


def test_a_stribeck_load_without_its_speed_had_that_of_the_engine() -> None:
    before = changed({"/axes": [{"path": "shaft.stribeck_load", "values": [0, "0.1 N*m"]}]})
    with pytest.raises(SpecError, match="/base/shaft/stribeck_speed"):
        parse_spec(before)
    study = parse_spec(accepted(before)).study
    assert study.base["shaft.stribeck_speed"] == default_of("shaft.stribeck_speed")
