"""Worked examples of textbooks: engines by their turning moment, presses by their work, rims, an indicator diagram.

R. S. Khurmi, J. K. Gupta, *Theory of Machines*, chapter 16 (turning moment diagrams and flywheel), and, for air
compressors, R. K. Rajput, *A Textbook of Internal Combustion Engines*, chapter 20, N. M. Bhatt, J. R. Mehta, *Elements
of Mechanical Engineering*, chapter 8, and A. V. Arasu, *Thermal Engineering*, chapter 5. The numbers in the assertions
are the published answers, to their digits.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice, PartChoice
from sprag_study.engine.machine_shaft.tables import Table
from tests.engine.machine_shaft.machines import RPM, one


def by_areas(areas: tuple[float, ...], energy: float, rpm: float, **numbers: float) -> dict[str, float]:
    """Results of an engine whose diagram is given by its areas about the mean, each worth ``energy`` in J."""
    width = 2.0 * math.pi / len(areas)
    numbers |= {"mean_speed": rpm * RPM}
    for k, area in enumerate(areas):
        numbers |= {
            f"operation.steps.{k}.from": k * width, f"operation.steps.{k}.to": (k + 1) * width,
            f"operation.steps.{k}.value": -area * energy / width,
        }  # fmt: skip
    steps = OperationChoice("torque", "steps", steps=len(areas))
    wheel = Drive(flywheel="rim") if "drive.flywheel.mass" in numbers else Drive()
    return one(MachineSpec(drive=wheel, operation=steps), numbers)


def by_formula(drive: str, load: str, rpm: float, inertia: float) -> dict[str, float]:
    """Results of an engine and its machine with torques in N*m as formulas."""
    operation = OperationChoice("torque", "formula", formula=load)
    spec = MachineSpec(balance="refuse", drive=Drive("formula", formula=drive), operation=operation)
    return one(spec, {"mean_speed": rpm * RPM, "drive.inertia": inertia})


def press(work: float, period: float, part: float, **numbers: float) -> dict[str, float]:
    """Results of a press whose main shaft turns once in ``period`` (s) and works during a part of the turn."""
    numbers |= {"mean_speed": 2.0 * math.pi / period, "operation.steps.0.from": 0.0}
    end = 2.0 * math.pi * part
    numbers |= {"operation.steps.0.to": end, "operation.steps.0.value": work / end}
    return one(MachineSpec(operation=OperationChoice("torque", "steps", steps=1)), {"drive.inertia": 1e6} | numbers)


def test_petrol_engine_by_its_areas() -> None:
    """Example 16.4: 36 kg at 150 mm, 1800 rpm, 1 mm = 5 N*m and 1 deg, the diagram twice a revolution: C_s = 0.3 %."""
    areas = (295.0, -685.0, 40.0, -340.0, 960.0, -270.0)
    got = by_areas(areas * 2, 5.0 * math.radians(1.0), 1800, **{"drive.inertia": 36 * 0.15**2})
    assert got["energy.fluctuation"] == pytest.approx(86, abs=0.5)
    assert got["irregularity"] == pytest.approx(0.003, abs=5e-5)


def test_multi_cylinder_engine_by_its_areas() -> None:
    """Example 16.5: 600 rpm within 1.5 % of the mean, 1 mm = 600 N*m and 3 deg: 183 kg at a radius of 0.5 m."""
    areas = (52.0, -124.0, 92.0, -140.0, 85.0, -72.0, 107.0)
    got = by_areas(areas, 600 * math.radians(3.0), 600, **{"drive.inertia": 50.0, "wanted_irregularity": 0.03})
    assert got["energy.fluctuation"] == pytest.approx(5404, abs=1.0)
    assert got["required_inertia"] / 0.5**2 == pytest.approx(183, abs=0.6)
    assert got["required_inertia.energy"] == pytest.approx(got["required_inertia"], rel=1e-10)


def test_rim_of_a_multi_cylinder_engine() -> None:
    """Example 16.16: 600 rpm within 1 %, 1 mm = 250 N*m and 3 deg: 32.7 kg*m^2; at 6 MPa and 7250 kg/m^3 28.8 m/s."""
    areas = (160.0, -172.0, 168.0, -191.0, 197.0, -162.0)
    speed = math.sqrt(6e6 / 7250)
    rim = {
        "drive.flywheel.diameter": 2.0 * speed / (600 * RPM), "drive.flywheel.mass": 150.0,
        "drive.flywheel.density": 7250.0, "drive.flywheel.allowed_stress": 6e6, "wanted_irregularity": 0.02,
    }  # fmt: skip
    got = by_areas(areas, 250 * math.radians(3.0), 600, **rim)
    assert got["required_inertia"] == pytest.approx(32.7, abs=0.05)
    assert rim["drive.flywheel.diameter"] == pytest.approx(0.92, abs=0.005)
    # The mean speed gives the allowed stress; the largest one, half the irregularity above it, a margin below 1.
    assert got["flywheel.speed"] / (1.0 + 0.5 * got["irregularity"]) == pytest.approx(28.8, abs=0.05)
    assert got["flywheel.margin"] * (1.0 + 0.5 * got["irregularity"]) == pytest.approx(1.0, rel=1e-9)
    assert got["flywheel.required_mass"] * rim["drive.flywheel.diameter"] ** 2 / 4 == pytest.approx(32.7, abs=0.05)


def test_engine_and_machine_with_different_orders() -> None:
    """Example 16.12: 5000 + 600 sin 2 phi against 5000 + 500 sin phi, 500 kg at 0.4 m, 150 rpm: 1204 N*m, 6.1 %.

    The published least acceleration is -12.2 rad/s^2; that of 3.46 rad/s^2 is a lower maximum, at 35 deg.
    """
    got = by_formula("5000 + 600*sin(2*phi)", "5000 + 500*sin(phi)", 150, 500 * 0.4**2)
    assert got["energy.fluctuation"] == pytest.approx(1204, abs=1.0)
    assert got["irregularity"] == pytest.approx(0.061, abs=5e-4)
    assert -got["acceleration.min"] == pytest.approx(12.2, abs=0.05)


def test_three_crank_engine() -> None:
    """Example 16.13: 5000 + 1500 sin 3 phi, 1000 kg*m^2, 300 rpm: 157.1 kW, 0.1 %; 0.168 % with 600 sin phi."""
    even = by_formula("5000 + 1500*sin(3*phi)", "5000", 300, 1000.0)
    assert even["power.mean"] == pytest.approx(157.1e3, abs=50.0)
    assert even["energy.fluctuation"] == pytest.approx(1000.0, rel=1e-10)
    assert even["irregularity"] == pytest.approx(0.001, abs=2e-5)
    wavy = by_formula("5000 + 1500*sin(3*phi)", "5000 + 600*sin(phi)", 300, 1000.0)
    assert wavy["irregularity"] == pytest.approx(0.00168, abs=1e-5)


def test_gas_engine_of_two_triangles() -> None:
    """Example 16.9: 20 kW, 300 rpm, four strokes, expansion three times the compression: 255.2 kg*m^2 for 2 %."""
    peak = 4000.0 * 2.0 / math.pi
    rows = ((180, 0), (270, peak), (360, 0), (450, -3.0 * peak), (540, 0))
    table = Table(tuple((math.radians(angle), torque) for angle, torque in ((0, 0), *rows, (720, 0))), "linear")
    spec = MachineSpec(cycle=2, operation=OperationChoice("torque", "table", table=table))
    got = one(spec, {"mean_speed": 300 * RPM, "drive.inertia": 300.0, "wanted_irregularity": 0.04})
    assert -got["power.mean"] == pytest.approx(20e3, rel=1e-12)
    assert got["required_inertia"] == pytest.approx(255.2, rel=1e-3)


def test_gas_engine_of_four_triangles() -> None:
    """Example 16.10: areas of 0.45, 1.7, 6.8, 0.65 thousandths m^2 at 3 MN*m/m^2, 200 rpm, radius 1.2 m: 1381 kg."""
    rows: list[tuple[float, float]] = [(0.0, 0.0)]
    for stroke, area in enumerate((0.45, 1.7, -6.8, 0.65)):
        rows += [((stroke + 0.5) * math.pi, area * 3e3 * 2.0 / math.pi), ((stroke + 1) * math.pi, 0.0)]
    operation = OperationChoice("torque", "table", table=Table(tuple(rows), "linear"))
    numbers = {"mean_speed": 200 * RPM, "drive.inertia": 2000.0, "wanted_irregularity": 0.02}
    got = one(MachineSpec(cycle=2, operation=operation), numbers)
    assert got["work.resistance"] == pytest.approx(12e3, rel=1e-12)
    assert got["required_inertia"] / 1.2**2 == pytest.approx(1381, rel=5e-3)


def test_press_of_720_holes_an_hour() -> None:
    """Example 16.19: 15 kN*m in 2 s of every 5 s, from 225 to 200 rpm, radius 0.5 m: 3 kW, 618 kg."""
    got = press(15e3, 5.0, 0.4, wanted_irregularity=25.0 / 212.5)
    assert got["power.mean"] == pytest.approx(3e3, rel=1e-10)
    geared = (212.5 / 12.0) ** 2
    assert got["required_inertia"] / geared / 0.5**2 == pytest.approx(618, abs=1.0)


def test_press_of_38_mm_holes() -> None:
    """Example 16.20: 7 N*m/mm^2 through 32 mm every 10 s, stroke 100 mm, 25 m/s within 3 %: 2.674 kW, 1198 kg."""
    got = press(7.0 * math.pi * 38 * 32, 10.0, 32.0 / 200.0, wanted_irregularity=0.03)
    assert got["power.mean"] == pytest.approx(2674, abs=1.0)
    assert got["required_inertia"] * (2.0 * math.pi / 10.0 / 25.0) ** 2 == pytest.approx(1198, abs=1.0)


def test_riveting_machine() -> None:
    """Example 16.21: 3 kW, 10 kN*m in 1 s, 150 kg at 0.6 m: 18 rivets a minute, from 300 to 257.6 rpm."""
    period, geared = 10e3 / 3e3, 278.8 * RPM / (2.0 * math.pi / (10e3 / 3e3))
    got = press(10e3, period, 1.0 / period, **{"drive.inertia": 150 * 0.6**2 * geared**2})
    assert 60.0 / period == pytest.approx(18)
    assert got["omega.max"] * geared / RPM == pytest.approx(300, abs=0.1)
    assert got["omega.min"] * geared / RPM == pytest.approx(257.6, abs=0.1)


def compressor(swept: float, rpm: float, pressures: tuple[float, float], n: float, ends: int = 1) -> dict[str, Any]:
    """Numbers of a compressor without clearance that sweeps ``swept`` m^3 at each of its ``ends``."""
    crank = 0.05
    own: dict[str, Any] = {
        "mechanism.slider_crank.crank": crank, "mechanism.slider_crank.rod": 0.2,
        "operation.gas.piston_area": swept / (2.0 * crank), "operation.gas.suction_pressure": pressures[0],
        "operation.gas.discharge_pressure": pressures[1], "operation.gas.clearance": 0.0, "operation.gas.exponent": n,
    }  # fmt: skip
    shaft = {"mean_speed": rpm * RPM, "drive.inertia": 100.0}
    if ends == 1:
        return shaft | own
    angles = {f"parts.{k}.crank_angle": math.pi * k for k in range(ends)}
    return shaft | angles | {f"parts.{k}.{path}": value for k in range(ends) for path, value in own.items()}


def test_air_compressor() -> None:
    """Rajput 20.1 and 20.2: 1 m^3 of air a minute from 1.013 to 7 bar, n = 1.35, 300 rpm: 4.24 kW in the cylinder.

    With the mechanical efficiency 0.85 and that of the transmission, 0.9, the motor gives 5.54 kW.
    """
    spec = MachineSpec(mechanism=MechanismChoice("slider_crank"), operation=OperationChoice("gas"))
    numbers = compressor(1.0 / 300.0, 300.0, (1.013e5, 7e5), 1.35)
    assert one(spec, numbers)["power.mean"] == pytest.approx(4240, abs=5.0)
    driven = replace(spec, drive=Drive(stages=("belt",)))
    losses = {"drive.stages.0.ratio": 4.0, "drive.stages.0.efficiency": 0.9, "operation.efficiency": 0.85}
    assert one(driven, numbers | losses)["motor.power.mean"] == pytest.approx(5540, abs=5.0)


def test_air_compressor_with_losses() -> None:
    """Bhatt and Mehta 8.3: 0.2 m by 0.24 m, 300 rpm, 1 to 8 atm, n = 1.35: 10.5 kW; with 0.96 and 0.85, 12.91 kW."""
    # The book takes 22/7 for pi.
    spec = MachineSpec(mechanism=MechanismChoice("slider_crank"), operation=OperationChoice("gas"))
    numbers = compressor(0.25 * 22.0 / 7.0 * 0.2**2 * 0.24, 300.0, (1.01325e5, 8 * 1.01325e5), 1.35)
    assert one(spec, numbers)["power.mean"] == pytest.approx(10.5e3, abs=50.0)
    driven = replace(spec, drive=Drive(stages=("gear",)))
    losses = {"drive.stages.0.ratio": 3.0, "drive.stages.0.efficiency": 0.96, "operation.efficiency": 0.85}
    assert one(driven, numbers | losses)["motor.power.mean"] == pytest.approx(12.91e3, abs=5.0)


@pytest.mark.parametrize("back", [0.0, 1.013e5, 2.4e5])
def test_an_efficiency_of_the_work_does_not_depend_on_what_circulates(back: float) -> None:
    """The books divide the indicated power by the efficiency: 5.54 and 12.91 kW, whatever presses on the piston's back.

    With clearance too, against the work of the cycle in closed form.
    """
    gas = OperationChoice("gas", efficiency_is="work")
    spec = MachineSpec(mechanism=MechanismChoice("slider_crank"), operation=gas)
    numbers = compressor(1.0 / 300.0, 300.0, (1.013e5, 7e5), 1.35) | {"operation.gas.back_pressure": back}
    driven = replace(spec, drive=Drive(stages=("belt",)))
    losses = {"drive.stages.0.ratio": 4.0, "operation.efficiency": 0.85}
    got = one(driven, numbers | losses | {"drive.stages.0.efficiency": 0.9})
    assert got["motor.power.mean"] == pytest.approx(5540, abs=5.0)
    numbers = compressor(0.25 * 22.0 / 7.0 * 0.2**2 * 0.24, 300.0, (1.01325e5, 8 * 1.01325e5), 1.35)
    numbers |= {"operation.gas.back_pressure": back}
    got = one(driven, numbers | losses | {"drive.stages.0.efficiency": 0.96})
    assert got["motor.power.mean"] == pytest.approx(12.91e3, abs=5.0)
    clearance, ratio, n, swept = 0.06, 6.5, 1.3, 0.01
    drawn = swept * (1.0 + clearance - clearance * ratio ** (1.0 / n))
    work = n / (n - 1.0) * 1e5 * drawn * (ratio ** ((n - 1.0) / n) - 1.0)
    numbers = compressor(swept, 400.0, (1e5, ratio * 1e5), n) | {"operation.gas.clearance": clearance}
    numbers |= {"operation.gas.back_pressure": back, "operation.efficiency": 0.8}
    assert one(spec, numbers)["work.resistance"] == pytest.approx(-work / 0.8, rel=1e-11)
    by_power = one(replace(spec, operation=OperationChoice("gas")), numbers)["work.resistance"]
    assert by_power < -work / 0.8 * 1.001  # charged on what circulates


def test_an_engine_gives_the_share_of_its_work_evenly() -> None:
    """Four strokes as triangles of a table: a constant torque is lost, half of the parts at half of the angle."""
    rows = tuple((0.5 * math.pi * k, value) for k, value in enumerate((0.0, -90.0, 0.0, 40.0, 0.0)))
    table = Table(rows, "linear")
    spec = MachineSpec(operation=OperationChoice("torque", "table", table=table, efficiency_is="work"))
    numbers = {"mean_speed": 30.0, "drive.inertia": 2.0, "operation.scale": 1.5, "operation.efficiency": 0.7}
    work = 1.5 * 0.5 * math.pi * (90.0 - 40.0)
    got, free = one(spec, numbers), one(spec, numbers | {"operation.efficiency": 1.0})
    assert got["work.resistance"] == pytest.approx(0.7 * work, rel=1e-12)
    assert got["energy.fluctuation"] == pytest.approx(free["energy.fluctuation"], rel=1e-12)
    assert got["torque.harmonics.1"] == pytest.approx(free["torque.harmonics.1"], rel=1e-12)
    turned = MachineSpec(parts=(PartChoice(operation=spec.operation), PartChoice()))
    parts = {f"parts.0.{path}": value for path, value in numbers.items() if path.startswith("operation")}
    shaft = {path: value for path, value in numbers.items() if not path.startswith("operation")}
    found = one(turned, shaft | parts | {"parts.0.crank_angle": 1.0})
    assert found["work.resistance"] == pytest.approx(got["work.resistance"], rel=1e-12)


def test_double_acting_compressor() -> None:
    """Arasu 5.2: 37 kW, 100 rpm, piston speed 151.5 m/min, 0.98 to 5.8 bar, n = 1.2: stroke 0.7575 m, bore 0.303 m.

    Both ends are parts of their own, half a turn apart.
    """
    numbers = compressor(0.25 * math.pi * 0.303**2 * 0.7575, 100.0, (0.98e5, 5.8e5), 1.2, ends=2)
    both = (PartChoice(MechanismChoice("slider_crank"), OperationChoice("gas")),) * 2
    found = one(MachineSpec(parts=both), numbers)
    # The book takes 3.147 for pi, 0.17 % more, and rounds the bore.
    assert found["power.mean"] == pytest.approx(37e3, rel=3e-3)
    single = one(
        MachineSpec(parts=both[:1]), {path: v for path, v in numbers.items() if not path.startswith("parts.1")}
    )
    assert found["power.mean"] == pytest.approx(2.0 * single["power.mean"], rel=1e-12)


@pytest.mark.parametrize("back", [0.0, 1e5])
def test_two_ends_with_clearance_take_their_indicated_work_over_the_efficiency(back: float) -> None:
    """Two ends, clearance 6 %, 1 to 6.5 bar, n = 1.3, efficiency 0.8, against the closed form of the work."""
    clearance, ratio, n, swept = 0.06, 6.5, 1.3, 0.01
    drawn = swept * (1.0 + clearance - clearance * ratio ** (1.0 / n))
    work = 2.0 * n / (n - 1.0) * 1e5 * drawn * (ratio ** ((n - 1.0) / n) - 1.0)
    numbers = compressor(swept, 400.0, (1e5, ratio * 1e5), n, ends=2)
    own = {"gas.clearance": clearance, "gas.back_pressure": back, "efficiency": 0.8}
    numbers |= {f"parts.{k}.operation.{name}": value for k in range(2) for name, value in own.items()}
    end = PartChoice(MechanismChoice("slider_crank"), OperationChoice("gas", efficiency_is="work"))
    assert one(MachineSpec(parts=(end, end)), numbers)["work.resistance"] == pytest.approx(-work / 0.8, rel=1e-11)
