"""Forces in the joints of slider-cranks: against the energy of the whole, and against a rod of two masses by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice, PartChoice
from sprag_study.engine.machine_shaft.trajectory import trajectory

CRANK, ROD, OFFSET, AREA, BACK = 0.06, 0.2, 0.013, 6e-3, 1e5
SLIDER = {"crank": CRANK, "rod": ROD, "offset": OFFSET, "rod_centre": 0.07, "rod_mass": 2.5, "ram_mass": 3.0}
GAS = {
    "piston_area": AREA, "suction_pressure": 1e5, "discharge_pressure": 6e5, "back_pressure": BACK, "clearance": 0.06,
}  # fmt: skip
ANGLES = np.linspace(0.05, 2.0 * math.pi - 0.03, 29)


def columns(spec: MachineSpec, numbers: dict[str, Any]) -> dict[str, Any]:
    table = trajectory(spec, numbers, ANGLES)
    return dict(zip(table.names, table.values.T, strict=True))


def numbers(prefix: str = "", **more: Any) -> dict[str, Any]:
    own = {f"{prefix}mechanism.slider_crank.{name}": value for name, value in SLIDER.items()}
    own |= {f"{prefix}operation.gas.{name}": value for name, value in GAS.items()}
    return own | {"mean_speed": 60.0, "drive.inertia": 0.4} | {prefix + path: value for path, value in more.items()}


@pytest.mark.parametrize("weights", ["ram", "all"])
def test_the_pin_gives_the_shaft_the_torque_that_the_energy_asks_for(weights: Any) -> None:
    """r x F = M_r - (I'' acceleration + dI''/dphi omega^2/2), with a full rod, an offset and an inclined line."""
    crank = MechanismChoice("slider_crank", weights=weights)
    spec = MachineSpec(mechanism=crank, operation=OperationChoice("gas"))
    more = {"mechanism.slider_crank.rod_inertia": 0.02, "mechanism.slider_crank.inclination": 0.7}
    got = columns(spec, numbers(**more))
    arm = CRANK * (np.cos(ANGLES) * got["crank_pin.y"] - np.sin(ANGLES) * got["crank_pin.x"])
    inertial = (got["inertia"] - 0.4) * got["acceleration"] + 0.5 * got["inertia.slope"] * got["omega"] ** 2
    wanted = got["resisting_torque"] - inertial
    assert arm == pytest.approx(wanted, rel=1e-8, abs=1e-8 * np.abs(wanted).max())
    assert got["crank_pin.force"] == pytest.approx(np.hypot(got["crank_pin.x"], got["crank_pin.y"]), rel=1e-14)


def test_a_rod_of_two_masses() -> None:
    """A mass on the crank's pin, one that goes with the piston, and a rod without mass that pushes along itself."""
    crank = MechanismChoice("slider_crank", bodies="two_mass")
    got = columns(MachineSpec(mechanism=crank, operation=OperationChoice("gas")), numbers(gravity=0.0))
    share = SLIDER["rod_centre"] / ROD
    on_pin, with_ram = SLIDER["rod_mass"] * (1.0 - share), SLIDER["ram_mass"] + SLIDER["rod_mass"] * share
    step, lean = 1e-4, np.arcsin((CRANK * np.sin(ANGLES) - OFFSET) / ROD)

    def place(phi: Any) -> Any:
        return CRANK * np.cos(phi) + np.sqrt(ROD**2 - (CRANK * np.sin(phi) - OFFSET) ** 2)

    first = -CRANK * np.sin(ANGLES) - CRANK * np.cos(ANGLES) * np.tan(lean)
    second = (place(ANGLES + step) - 2.0 * place(ANGLES) + place(ANGLES - step)) / step**2
    square, acceleration = got["omega"] ** 2, got["acceleration"]
    inertia = 0.4 + on_pin * CRANK**2 + with_ram * first**2
    assert got["inertia"] == pytest.approx(inertia, rel=1e-6)
    # The force of the gas, from its torque.
    push = -got["resisting_torque"] / first
    pressed = (with_ram * (second * square + first * acceleration) + push) / np.cos(lean)
    pin_x = -on_pin * CRANK * (-np.cos(ANGLES) * square - np.sin(ANGLES) * acceleration) - pressed * np.cos(lean)
    pin_y = -on_pin * CRANK * (-np.sin(ANGLES) * square + np.cos(ANGLES) * acceleration) + pressed * np.sin(lean)
    size = np.abs(pin_x).max()
    assert got["crank_pin.x"] == pytest.approx(pin_x, rel=1e-6, abs=1e-6 * size)
    assert got["crank_pin.y"] == pytest.approx(pin_y, rel=1e-6, abs=1e-6 * size)
    assert got["guide.force"] == pytest.approx(-pressed * np.sin(lean), rel=1e-6, abs=1e-6 * size)


def test_parts_a_scaled_load_and_a_force_by_the_speed() -> None:
    """A part has its own columns; a factor on the operation acts on the force, and so does the speed."""
    crank = MechanismChoice("slider_crank")
    gas = PartChoice(crank, OperationChoice("gas"))
    two = columns(MachineSpec(parts=(gas, PartChoice())), numbers("parts.0.") | {"parts.0.crank_angle": 0.0})
    alone = columns(MachineSpec(mechanism=crank, operation=OperationChoice("gas")), numbers())
    assert two["parts.0.crank_pin.force"] == pytest.approx(alone["crank_pin.force"], rel=1e-13)
    assert "parts.1.crank_pin.force" not in two
    force = OperationChoice("force", "formula", formula="omega^2", over="stroke", during="both")
    drive = Drive("formula", formula="3 + sin(phi)")
    spec = MachineSpec(balance="scale", balance_side="operation", drive=drive, mechanism=crank, operation=force)
    plain = {path: value for path, value in numbers().items() if ".gas." not in path}
    got = columns(spec, plain)
    arm = CRANK * (np.cos(ANGLES) * got["crank_pin.y"] - np.sin(ANGLES) * got["crank_pin.x"])
    inertial = (got["inertia"] - 0.4) * got["acceleration"] + 0.5 * got["inertia.slope"] * got["omega"] ** 2
    assert arm == pytest.approx(got["resisting_torque"] - inertial, rel=1e-8, abs=1e-8 * np.abs(arm).max())
