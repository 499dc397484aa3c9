"""Single machines: of a spec with formulas, measured clutches and axes, and in addresses of a new study."""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form import live
from sprag_study.service.http.web.form.live import drawn_machine
from sprag_study.service.http.web.form.own_machine import single_machine
from sprag_study.service.http.web.form.sent import settle
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.spec.document import parse_spec
from tests.service.http.web.controls import Controls

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.service.conftest import Service

DRIVE = preset_of("one_pendulum")["spec"]
INERTIA = "pendulums.0.inertia"


def test_a_drive_with_a_formula_a_measured_clutch_and_an_axis_is_one_drive_of_numbers() -> None:
    spec = copy.deepcopy(DRIVE)
    del spec["base"]["excitation"]["amplitude_x"]
    del spec["base"]["pendulums"][0]["inertia"]
    spec["derive"] = {INERTIA: "2 * pendulums.0.mass * pendulums.0.arm^2"}
    rows = [["1 deg", "4 N*m"], ["2 deg", "8 N*m"], ["3 deg", "12 N*m"]]
    spec["base"]["clutch"] = {"data": rows, "accuracy": "0.05 N*m"}
    chosen, study = parse_spec(single_machine(spec)).study, parse_spec(spec).study
    assert chosen.base[INERTIA] == pytest.approx(2 * 0.5 * 0.03**2)
    # Of four amplitudes the third, which only the axis gives; the frequency is that of the base.
    assert chosen.base["excitation.amplitude_x"] == 2e-3
    assert chosen.base["excitation.frequency"] == 25.0
    law = [path for path in study.base if path.startswith("clutch.")]
    assert {path: chosen.base[path] for path in law} == {path: study.base[path] for path in law}


def test_what_is_drawn_is_the_machine_as_it_stands_in_the_form() -> None:
    drawn = drawn_machine(values_of(DRIVE) | {"/base/shaft/load": "0.25 N*m"})
    assert drawn is not None
    assert (drawn[0].base["shaft.load"], drawn[0].cases) == (0.25, 1)
    assert drawn_machine(values_of(DRIVE) | {"/base/shaft/load": "0.25 mm"}) is None


def test_a_drive_without_settled_motion_is_not_drawn() -> None:
    """A load that swings with the angle of the shaft; where it does not, the run of the form is settled."""
    values = values_of({**DRIVE, "run": {"duration": "40 periods"}})
    assert drawn_machine(values | {"/base/shaft/cyclic_load": "0"}) is not None
    assert drawn_machine(values | {"/base/shaft/cyclic_load": "0.5"}) is None


def _sent(service: Service, address: str) -> dict[str, str]:
    answer = service.http.get(address, follow_redirects=True)
    assert answer.status_code == 200, answer.text
    return Controls(answer.text).values


def test_addresses_of_laboratories_lead_to_a_new_study_with_what_they_held(service: Service) -> None:
    answer = service.http.get("/laboratory/drive?machine=two_pendulums&shaft.load=0.2", follow_redirects=False)
    assert answer.status_code == 308
    assert answer.headers["location"].startswith("/new?model=vibration-drive&")
    shown = _sent(service, "/laboratory/drive?machine=two_pendulums&shaft.load=0.2&clutch.coefficients.1=300&held=x")
    assert (shown["model"], shown["pendulums"], shown["/base/shaft/load"]) == ("vibration-drive", "2", "0.2")
    assert shown["/base/clutch/coefficients"] == "0; 300; 0; 20000"
    own = json.dumps(preset_of("press")["spec"]["base"])
    shown = _sent(service, f"/laboratory?machine=own&base={own}&title=Mine&drive.inertia=20")
    assert (shown["/name"], shown["/base/drive/inertia"]) == ("Mine", "20")
    study = _sent(service, "/laboratory/study?along=inertia&machine=press")
    assert study["/axes/0/path"] == "drive.inertia"
    for part in ("figure", "picture.svg", "questions", "form"):
        assert service.http.get(f"/laboratory/{part}", follow_redirects=False).status_code == 308
    assert service.http.get("/laboratory/perpetual-motion").status_code == 404
    assert service.http.get("/new?machine=nothing").status_code == 404
    assert service.http.get("/new?base=1").status_code == 422


def test_a_case_is_a_new_study_in_the_motion_that_it_comes_to(service: Service) -> None:
    study_id = service.submit(DRIVE)
    service.fill(study_id)
    shown = _sent(service, f"/studies/{study_id}/cases/100/laboratory")
    settle(shown)  # numbers with the units beside them
    study = service.store.studies.study(study_id)
    base = parse_spec(spec_of(shown)[0]).study.base
    assert {path: base[path] for path in study.axis_paths} == pytest.approx(study.case_parameters(100))
    assert base["pendulums.0.initial_angle"] != 0.0
    assert shown["from"] == study_id


def test_machines_are_computed_ahead_on_a_free_core(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: 4)

    def ahead(average: Callable[[], tuple[float, float, float]]) -> list[bool]:
        monkeypatch.setattr("psutil.getloadavg", average)
        return [live._has_time(passed) for passed in (1.0, 21.0, 599.0, 601.0)]

    def hidden() -> tuple[float, float, float]:
        raise OSError("no such file")

    assert ahead(lambda: (3.9, 5.0, 5.0)) == [False, True, True, True]
    assert ahead(lambda: (4.1, 0.0, 0.0)) == [False, False, False, True]
    assert ahead(hidden) == [False, True, True, True]
