"""Certified problems of nonlinear regression (NIST/ITL StRD) through the planner of calibrations."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.answer import answer
from tests.worker.planning.calibrating import calibrated, plan_of

Floats = NDArray[np.float64]
DATA = json.loads((Path(__file__).resolve().parents[2] / "data" / "nist_nonlinear.json").read_text(encoding="utf-8"))
#: Correct decimal digits; scipy 1.16 reaches 4 to 9 from the second start of NIST at its default tolerances.
DIGITS = 6.5


def _growth(b: Floats, x: Floats) -> Floats:
    return b[0] * (1.0 - np.exp(-b[1] * x))


FORMS = {
    "Misra1a": _growth,
    "BoxBOD": _growth,
    "MGH17": lambda b, x: b[0] + b[1] * np.exp(-x * b[3]) + b[2] * np.exp(-x * b[4]),
    "Thurber": lambda b, x: (
        (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1.0 + b[4] * x + b[5] * x**2 + b[6] * x**3)
    ),
    "MGH09": lambda b, x: b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3]),
    "Rat43": lambda b, x: b[0] / (1.0 + np.exp(b[1] - b[2] * x)) ** (1.0 / b[3]),
    "Eckerle4": lambda b, x: b[0] / b[1] * np.exp(-0.5 * ((x - b[2]) / b[1]) ** 2),
}
#: Ranges go from that part of the smaller of the two starts of NIST to as many times the larger one. The peak of
#: Eckerle4 is a hundredth as wide as its range.
WIDER = {name: 1.5 if name == "Eckerle4" else 4.0 for name in FORMS}


@pytest.mark.parametrize("name", FORMS)
def test_certified_values_are_reached(name: str) -> None:
    problem, certified = DATA[name], np.array(DATA[name]["certified"])
    starts = np.array([problem["start_1"], problem["start_2"]])
    low, high = np.abs(starts).min(axis=0) / WIDER[name], np.abs(starts).max(axis=0) * WIDER[name]
    ends = np.sort(np.sign(starts[0]) * np.array([low, high]), axis=0).T
    assert all((ends[:, 0] < certified) & (certified < ends[:, 1]))

    def form(parameters: Floats, at: Floats) -> dict[str, Floats]:
        with np.errstate(all="ignore"):
            return {"y": FORMS[name](parameters.T, at[:, 0])}

    x, y = np.array(problem["x"]), np.array(problem["y"])
    planner, _ = calibrated(plan_of([(a, b) for a, b in ends.tolist()], x, {"y": y}, refits=0), form)
    found = answer(planner.plan, planner.space, planner.state)
    assert found is not None
    digits = -np.log10(np.abs(found.values / certified - 1.0))
    assert digits.min() > DIGITS
    assert np.square(found.modelled - y).sum() == pytest.approx(problem["sum_of_squares"], rel=1e-9)
