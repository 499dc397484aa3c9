"""Machines of one's own in the laboratory's address: plain numbers of a spec, wherever they come from."""

from __future__ import annotations

import copy
from functools import partial
from urllib.parse import parse_qsl, urlsplit

import pytest

from sprag.service.http.problems import ApiError
from sprag.service.http.views import preset_of
from sprag.service.http.web.form.own_machine import (
    case_address,
    case_page,
    laboratory_address,
    own_spec,
    single_machine,
)
from sprag.service.http.web.laboratory.setting import setting
from sprag.service.spec.document import parse_spec
from sprag.service.spec.report import SpecError
from sprag.worker.limits import MAX_ADDRESS_BYTES

shaft_setting, drive_setting = partial(setting, "machine-shaft"), partial(setting, "vibration-drive")
DRIVE = preset_of("one_pendulum")["spec"]
INERTIA = "pendulums.0.inertia"


def _given(address: str) -> dict[str, str]:
    return dict(parse_qsl(urlsplit(address).query))


def test_a_drive_with_a_formula_a_measured_clutch_and_an_axis_is_one_drive_of_numbers() -> None:
    spec = copy.deepcopy(DRIVE)
    del spec["base"]["excitation"]["amplitude_x"]
    del spec["base"]["pendulums"][0]["inertia"]
    spec["derive"] = {INERTIA: "2 * pendulums.0.mass * pendulums.0.arm^2"}
    rows = [["1 deg", "4 N*m"], ["2 deg", "8 N*m"], ["3 deg", "12 N*m"]]
    spec["base"]["clutch"] = {"data": rows, "accuracy": "0.05 N*m"}
    chosen = drive_setting(_given(laboratory_address(spec)))
    study = parse_spec(spec).study
    assert chosen.study.base[INERTIA] == pytest.approx(2 * 0.5 * 0.03**2)
    # Of four amplitudes the third, which only the axis gives; the frequency is that of the base.
    assert chosen.study.base["excitation.amplitude_x"] == 2e-3
    assert chosen.study.base["excitation.frequency"] == 25.0
    law = [path for path in study.base if path.startswith("clutch.")]
    assert {path: chosen.study.base[path] for path in law} == {path: study.base[path] for path in law}
    # A slider of the fitted stiffness moves it.
    moved = drive_setting(_given(laboratory_address(spec)) | {"clutch.coefficients.1": "300"})
    assert (moved.faults, moved.study.base["clutch.coefficients.1"]) == ({}, 300.0)


def test_a_case_is_in_the_address_with_its_values_its_state_and_its_page() -> None:
    study = parse_spec(DRIVE).study
    address = case_address(DRIVE, study, 100, "st_1/100/2", {"shaft.initial_speed": 3.25})
    chosen = drive_setting(_given(address))
    assert address.startswith("/laboratory/drive?machine=own&")
    assert {path: chosen.study.base[path] for path in study.axis_paths} == study.case_parameters(100)
    assert chosen.state == {"shaft.initial_speed": "3.25"}
    assert chosen.case == "/studies/st_1/cases/100?start=2"
    assert chosen.study.run["at_most"] == study.run["at_most"]


def test_a_case_of_drawn_drives_is_the_drawn_one() -> None:
    spec = copy.deepcopy(DRIVE) | {
        "axes": [], "tolerances": [{"path": "shaft.inertia", "plus_minus": "10 %"}], "drives": 4, "seed": 1,
    }  # fmt: skip
    study = parse_spec(spec).study
    drawn = [drive_setting(_given(case_address(spec, study, case, "", {}))).study for case in (0, 1)]
    assert drawn[0].base["shaft.inertia"] == 2e-3
    assert drawn[1].base["shaft.inertia"] == study.case_parameters(1)["shaft.inertia"] != 2e-3


def test_a_machine_shaft_goes_to_its_own_page() -> None:
    spec = preset_of("press")["spec"]
    address = laboratory_address(spec)
    assert address.startswith("/laboratory?machine=own&")
    assert shaft_setting(_given(address)).study.base == parse_spec(single_machine(spec)).study.base


def test_a_text_that_is_too_long_is_refused() -> None:
    with pytest.raises(ApiError, match=f"at most {MAX_ADDRESS_BYTES} characters in an address; got "):
        own_spec({"base": "{}", "title": "x" * MAX_ADDRESS_BYTES}, "vibration-drive")


@pytest.mark.parametrize(("rows", "allowed"), [(2000, True), (4900, False)])
def test_a_table_of_a_machine_fits_the_address_or_is_refused(rows: int, allowed: bool) -> None:
    spec = copy.deepcopy(preset_of("press")["spec"])
    text = "angle [deg],force [kN]\n" + "\n".join(f"{360 * k / rows:.8g},{k % 20}" for k in range(rows))
    spec["base"]["operation"] = {"quantity": "force", "csv": text, "interpolation": "linear"}
    if allowed:
        address = laboratory_address(spec)
        assert 12_000 < len(address) <= MAX_ADDRESS_BYTES
        assert own_spec(_given(address), "machine-shaft")["base"]["operation"]["csv"] == text
    else:
        with pytest.raises(SpecError, match="too long for the address"):
            laboratory_address(spec)


@pytest.mark.parametrize("mark", ["", "//evil.example/5", "st_1", "st_1/x", "st_1/5/", "https:st/1"])
def test_a_mark_that_is_no_case_has_no_page(mark: str) -> None:
    assert case_page(mark) == ""
