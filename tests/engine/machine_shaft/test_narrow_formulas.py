"""Narrow features of formulas: the result is right, or the case says that it is not known; never silently wrong."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import erf

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from tests.engine.machine_shaft.machines import NAMES, one, results_of

Floats = NDArray[np.float64]

_RNG = np.random.default_rng(20)
WIDTHS = 10.0 ** np.linspace(0.0, -6.0, 61)
PLACES = _RNG.uniform(0.0, 2.0 * math.pi, 61)


def _work(area: Callable[[Floats], Floats]) -> Floats:
    """Work of 10 N*m and of a peak with 100 J, of whose one side ``area`` (over 100 J) lies within a distance."""
    return 20.0 * math.pi + 100.0 * (area((2.0 * math.pi - PLACES) / WIDTHS) + area(PLACES / WIDTHS))


def _triangle(distance: Floats) -> Floats:
    inside = np.minimum(distance, 1.0)
    return inside - 0.5 * inside**2


PEAKS = [
    ("10 + 100/w*exp(-((phi-a)/w)^2)", _work(lambda d: 0.5 * math.sqrt(math.pi) * np.asarray(erf(d)))),
    ("10 + 100/w*max(0, 1 - abs(phi-a)/w)", _work(_triangle)),
    ("10 + 100/w/(1 + ((phi-a)/w)^2)", _work(np.arctan)),
    ("10 + 100/w/cosh((phi-a)/w)^2", _work(np.tanh)),
]


def _torque(formula: str) -> MachineSpec:
    return MachineSpec(operation=OperationChoice("torque", "formula", formula=formula), constants=("w", "a"))


NUMBERS: dict[str, Any] = {"mean_speed": 100.0, "drive.inertia": 5.0, "constants.w": WIDTHS, "constants.a": PLACES}


@pytest.mark.parametrize(("formula", "work"), PEAKS)
def test_peaks_of_any_width_do_their_work(formula: str, work: Floats) -> None:
    results = results_of(_torque(formula), NUMBERS, cases=61)
    np.testing.assert_allclose(-results["work.resistance"], work, rtol=1e-9)


def test_peaks_of_any_width_change_the_energy_at_once() -> None:
    """Beside a peak the drive has lifted the energy all through the cycle, and it falls within the peak."""
    results = results_of(_torque("10 + 100/w*exp(-((phi-a)/w)^2)"), NUMBERS, cases=61)
    narrow = WIDTHS < 1e-3
    np.testing.assert_allclose(results["energy.fluctuation"][narrow], 100.0 * math.sqrt(math.pi), rtol=0.02)


def test_pulses_of_any_width_are_right_or_refused() -> None:
    batch = simulate(_torque("10 + 100*if(abs(phi-a) < w, 1/w, 0)"), NUMBERS, cases=61)
    known = batch.endings == ENDINGS.index(Ending.OK)
    assert set(batch.endings[~known]) <= {ENDINGS.index(Ending.QUADRATURE_NOT_REACHED)}
    assert known[WIDTHS > 1e-5].all()
    work = _work(lambda d: np.minimum(d, 1.0))
    np.testing.assert_allclose(-batch.values[known, NAMES.index("work.resistance")], work[known], rtol=1e-8)


def test_triangles_of_a_tenth_of_a_degree() -> None:
    spec = MachineSpec(
        operation=OperationChoice("torque", "formula", formula="10 + 1e5*max(0, 1 - abs(phi-a)/(0.1*deg))"),
        constants=("a",),
    )
    places = np.radians(np.arange(8) * 41.3 + 10.0)
    results = results_of(spec, {"mean_speed": 100.0, "drive.inertia": 5.0, "constants.a": places}, cases=8)
    work = 20.0 * math.pi + 1e5 * math.radians(0.1)
    np.testing.assert_allclose(-results["work.resistance"], work, rtol=1e-10)


def test_a_peak_of_the_drive_has_its_share_of_the_work() -> None:
    spec = MachineSpec(
        drive=Drive("formula", formula="5 + 10/1e-4*exp(-((phi-1.2345)/1e-4)^2)"), balance="scale",
        operation=OperationChoice("torque"),
    )  # fmt: skip
    result = one(spec, {"mean_speed": 50.0, "drive.inertia": 5.0, "operation.value": 20.0})
    given = 10.0 * math.sqrt(math.pi) + 10.0 * math.pi
    assert result["drive_torque.max"] == pytest.approx((5.0 + 1e5) * 40.0 * math.pi / given, rel=1e-8)


def test_a_peak_over_the_stroke_does_its_work() -> None:
    """The work of a force is its integral over the way, whatever the mechanism."""
    spec = MachineSpec(
        mechanism=MechanismChoice("slider_crank"),
        operation=OperationChoice("force", "formula", "stroke", formula="100 + 2000/w*exp(-((x-0.37)/w)^2)"),
        constants=("w",),
    )
    numbers = {
        "mean_speed": 50.0, "drive.inertia": 5.0, "mechanism.slider_crank.crank": 0.1,
        "mechanism.slider_crank.rod": 0.35, "constants.w": 10.0 ** np.linspace(-1.5, -5.0, 8),
    }  # fmt: skip
    results = results_of(spec, numbers, cases=8)
    np.testing.assert_allclose(-results["work.resistance"], 0.2 * (100.0 + 2000.0 * math.sqrt(math.pi)), rtol=1e-8)


@pytest.mark.parametrize("width", [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
def test_a_narrow_rise_of_the_inertia_is_seen_or_refused(width: float) -> None:
    spec = MachineSpec(mechanism=MechanismChoice("formula", formula="1 + 3*exp(-((phi-a)/w)^2)"), constants=("w", "a"))
    numbers = {"mean_speed": 50.0, "drive.inertia": 1.0, "constants.w": width, "constants.a": 2.3456}
    batch = simulate(spec, numbers, cases=1)
    if width < 1e-4 and ENDINGS[batch.endings[0]] is Ending.QUADRATURE_NOT_REACHED:
        # The rounding of the angle alone changes such an inertia by more than its precision.
        return
    result = one(spec, numbers)
    assert result["inertia.max"] == pytest.approx(5.0, rel=1e-9)
    q = math.sqrt(2.0 / 5.0)
    assert result["irregularity"] == pytest.approx(2.0 * (1.0 - q) / (1.0 + q), rel=1e-8)


@pytest.mark.parametrize("formula", ["10 + sin(1e9*phi)", "10 + exp(-((phi-1)/1e-17)^2)*1e19", "1/(phi-1)^2"])
def test_what_cannot_be_known_is_refused(formula: str) -> None:
    batch = simulate(
        MachineSpec(operation=OperationChoice("torque", "formula", formula=formula)),
        {"mean_speed": 100.0, "drive.inertia": 5.0}, cases=1,
    )  # fmt: skip
    assert ENDINGS[batch.endings[0]] is Ending.QUADRATURE_NOT_REACHED


def test_a_case_does_not_depend_on_its_neighbours() -> None:
    spec, few = _torque(PEAKS[0][0]), slice(20, 28)
    together = simulate(spec, {**NUMBERS, "constants.w": WIDTHS[few], "constants.a": PLACES[few]}, cases=8)
    for k in range(8):
        alone = simulate(spec, {**NUMBERS, "constants.w": WIDTHS[20 + k], "constants.a": PLACES[20 + k]}, cases=1)
        np.testing.assert_array_equal(alone.values[0], together.values[k])
