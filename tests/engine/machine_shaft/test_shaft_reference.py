"""Published and independently computed machines (tests/data/reference/machine_shaft.json).

The reference was computed on a grid of 0.05 degrees without splitting it at jumps: its angles are good to half a step
of it, and what depends on a jump to about 1e-4. Where a number has a closed form, that is compared too.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MeanSpeed, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.engine.machine_shaft.trajectory import trajectory
from tests.engine.machine_shaft.machines import PRESS, PRESS_NUMBERS, RPM, one

DATA = Path(__file__).resolve().parents[2] / "data" / "reference" / "machine_shaft.json"
CASES: dict[str, Any] = {case["name"]: case for case in json.loads(DATA.read_text(encoding="utf-8"))}
HALF_A_STEP = math.radians(0.0251)


def test_khurmi_16_11() -> None:
    case = CASES["Khurmi 16.11"]
    spec = MachineSpec(
        balance="refuse",
        drive=Drive("formula", formula="20000 + 9500*sin(2*phi) - 5700*cos(2*phi)"),
        operation=OperationChoice("torque", "constant"),
    )
    numbers = {
        "mean_speed": case["mean_speed_rpm"] * RPM,
        "operation.value": 20000.0,
        "wanted_irregularity": case["wanted_irregularity"],
        # The acceleration is that with the inertia the book gives.
        "drive.inertia": case["published"]["required_inertia"],
    }
    got = one(spec, numbers)
    assert got["power.mean"] == pytest.approx(1e3 * case["power_kw"], rel=1e-5)
    assert got["energy.fluctuation"] == pytest.approx(case["energy_fluctuation_j"], rel=1e-6)
    assert got["energy.fluctuation"] == pytest.approx(math.hypot(9500.0, 5700.0), rel=1e-12)
    assert got["required_inertia"] == pytest.approx(case["required_inertia"], abs=0.05)
    assert got["omega.angle_at_min"] == pytest.approx(math.radians(case["angle_at_min_speed_deg"]), abs=HALF_A_STEP)
    assert got["omega.angle_at_max"] == pytest.approx(math.radians(case["angle_at_max_speed_deg"]), abs=HALF_A_STEP)
    assert got["omega.angle_at_min"] == pytest.approx(0.5 * math.atan(0.6), abs=1e-9)
    table = trajectory(spec, numbers, [math.radians(45.0)])
    acceleration = table.values[0, table.names.index("acceleration")]
    assert acceleration == pytest.approx(case["acceleration_at_45deg"], abs=5e-5)
    with_required = one(spec, numbers | {"drive.inertia": got["required_inertia"]})
    assert with_required["irregularity"] == pytest.approx(case["wanted_irregularity"], rel=1e-11)


@pytest.mark.parametrize("way", ["table", "formula"])
def test_khurmi_16_6(way: str) -> None:
    case = CASES["Khurmi 16.6"]
    pi = math.pi
    rows = ((0.0, 750.0), (pi, 3000.0), (3 * pi, 3000.0), (4 * pi, 750.0), (6 * pi, 750.0))
    formula = "750 + 2250*max(0, min(phi/pi, 1, 4 - phi/pi))"
    operation = (
        OperationChoice("torque", "table", table=Table(rows, "linear"))
        if way == "table"
        else OperationChoice("torque", "formula", formula=formula)
    )
    spec = MachineSpec(cycle=3, operation=operation)
    numbers = {
        "mean_speed": case["mean_speed_rpm"] * RPM,
        "drive.inertia": case["flywheel_mass"] * case["radius_of_gyration"] ** 2,
    }
    got = one(spec, numbers)
    assert got["power.mean"] == pytest.approx(1e3 * case["power_kw"], abs=0.5)
    assert got["irregularity"] == pytest.approx(case["irregularity"], abs=5e-6)
    assert got["energy.fluctuation"] == pytest.approx(case["energy_fluctuation_j"], abs=0.05)
    assert got["energy.fluctuation"] == pytest.approx(2250.0 * pi * 1.25, rel=1e-11)


@pytest.mark.parametrize("kind", ["midrange", "angle", "time"])
def test_own_press(kind: MeanSpeed) -> None:
    case = CASES["own press"]
    got = one(replace(PRESS, mean_speed_is=kind), PRESS_NUMBERS)
    assert got["work.resistance"] == pytest.approx(case["resisting_work_j"], rel=1e-5)
    assert got["drive_torque.mean"] == pytest.approx(case["drive_torque_nm"], rel=1e-5)
    assert got["irregularity"] == pytest.approx(case["irregularity"][kind], abs=3.5e-5)
    assert got["omega.start"] == pytest.approx(case["omega_0"][kind], abs=2.5e-4)
    assert got["omega.mean"] == pytest.approx(120 * RPM, rel=1e-14)
    if kind == "midrange":
        assert got["omega.max"] == pytest.approx(case["omega_max"], abs=5e-4)
        assert got["omega.min"] == pytest.approx(case["omega_min"], abs=5e-4)
        assert got["least_mean_speed"] == pytest.approx(case["least_feasible_mean_speed"], abs=5e-4)


def test_own_press_in_closed_form() -> None:
    # Force times the way from 120 to 180 degrees.
    way = -0.05 + math.sqrt(0.16 - 0.0075) - 0.3
    got = one(PRESS, PRESS_NUMBERS)
    assert got["work.resistance"] == pytest.approx(-20e3 * way, rel=1e-12)
    assert got["drive_torque.mean"] == pytest.approx(20e3 * way / (2.0 * math.pi), rel=1e-12)


@pytest.mark.parametrize(("index", "name"), [(0, "first"), (1, "second")])
def test_own_press_squares(index: int, name: str) -> None:
    case = CASES["own press"]
    got = one(replace(PRESS, phi_c=index), PRESS_NUMBERS)
    assert got["phi_c"] == pytest.approx(math.radians(case["phi_c_deg"][index]), abs=math.radians(0.01))
    for square in ("s3", "s4"):
        low, high = case[f"{square}_range_at_{name}"]
        assert got[f"{square}.min"] == pytest.approx(low, abs=0.06)
        assert got[f"{square}.max"] == pytest.approx(high, abs=0.06)
    # The default is the first angle at which the energy rises through its mean.
    assert (one(PRESS, PRESS_NUMBERS)["phi_c"] == got["phi_c"]) is (index == 1)
