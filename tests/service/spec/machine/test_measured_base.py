"""One measured period of the base in a spec: what it is reduced to, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from sprag_study.service.exports.inputs import inputs
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.worker.models import HARMONICS
from tests.service.spec_sample import SPEC, parsed, problems

PLACE = "/base/excitation/measured"
PERIOD = 0.04
STILL = {"/base/excitation/amplitude_x": 0, "/base/excitation/amplitude_y": 0, "/axes": []}
#: Orders 1 and 3 with amplitudes (m) and phases (rad) along x and y.
ROWS = [[1, 5e-4, 0.0, 3e-4, 0.5], [3, 1e-4, 1.0, 0.0, 0.0]]
DEGREES = np.arange(0.0, 360.0, 15.0)


def waves(angle: np.ndarray, derivative: bool = False) -> np.ndarray:
    """The motion of `ROWS` at these angles, m; or its second derivative by the time, m/s^2."""
    nu = 2.0 * math.pi / PERIOD
    motion = np.zeros((len(angle), 2))
    for order, x, alpha, y, beta in ROWS:
        factor = -((order * nu) ** 2) if derivative else 1.0
        turned = order * angle
        motion += factor * np.column_stack([x * np.cos(turned + alpha), y * np.sin(turned + beta)])
    return motion


def csv(headings: str, *columns: Iterable[float]) -> str:
    return "\n".join([headings, *(",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True))])


X, Y = waves(np.radians(DEGREES)).T * 1e3
ANGLED = csv("angle [deg],x [mm],y [mm]", DEGREES, X, Y)


def harmonics(measured: dict[str, Any]) -> dict[str, float]:
    base = parsed({**STILL, PLACE: measured}).study.base
    return {path: value for path, value in base.items() if path.startswith(HARMONICS)}


def test_a_measured_period_is_its_harmonics() -> None:
    expected = parsed({**STILL, "/base/excitation/harmonics": {"table": ROWS}}).study.base
    closed = csv("angle [deg],x [mm],y [mm]", [*DEGREES, 360], [*X, X[0]], [*Y, Y[0]])
    times = DEGREES / 360 * PERIOD * 1e3
    accelerations = waves(np.radians(DEGREES), derivative=True)
    ways: list[dict[str, Any]] = [
        {"csv": ANGLED},
        {"csv": closed},
        {"csv": csv("angle [deg],y [mm],x [mm]", DEGREES, Y, X)},
        {"csv": ANGLED.replace(",", ";").replace(".", ",")},
        {"csv": csv("time_ms,x_mm,y_mm", times, X, Y), "period": "40 ms"},
        {"csv": csv("t [ms],x [m/s^2],y [m/s^2]", times, *accelerations.T), "period": "40 ms"},
        {
            "table": [
                [*row] for row in zip(np.radians(DEGREES).tolist(), *(1e-3 * np.array([X, Y])).tolist(), strict=True)
            ]
        },
        {"table": [[f"{t} ms", f"{x} mm", f"{y} mm"] for t, x, y in zip(times, X, Y, strict=True)], "period": PERIOD},
    ]
    for way in ways:
        base = parsed({**STILL, PLACE: way}).study.base
        assert base == pytest.approx(expected, rel=1e-9, abs=1e-12), way


def test_the_reduction_is_the_study_of_its_harmonics() -> None:
    found = harmonics({"csv": ANGLED})
    names = ("order", "amplitude_x", "phase_x", "amplitude_y", "phase_y")
    rows = [[found[f"{HARMONICS}{k}.{name}"] for name in names] for k in range(2)]
    measured = parsed({**STILL, PLACE: {"csv": ANGLED}}).study
    assert parsed({**STILL, "/base/excitation/harmonics": {"table": rows}}).study.base == measured.base
    spec = {"base": {**SPEC["base"], "excitation": {"measured": {"csv": ANGLED}}}}
    origins = {one.origin for one in inputs(measured, spec) if one.path.startswith(HARMONICS)}
    assert origins == {"fitted"}


def test_a_direction_alone_is_named_by_its_heading() -> None:
    alone = harmonics({"csv": csv("angle [deg],y [mm]", DEGREES, Y)})
    assert alone == pytest.approx({
        f"{HARMONICS}0.order": 1.0, f"{HARMONICS}0.amplitude_x": 0.0, f"{HARMONICS}0.phase_x": 0.0,
        f"{HARMONICS}0.amplitude_y": 3e-4, f"{HARMONICS}0.phase_y": 0.5,
    })  # fmt: skip
    assert "3 columns" in problems({**STILL, PLACE: {"csv": csv("angle,up", DEGREES, Y)}})[f"{PLACE}/csv"].message
    turned = harmonics({"csv": csv("angle [deg],\N{CYRILLIC SMALL LETTER U} [mm],х_base [mm]", DEGREES, Y, X)})
    assert turned == harmonics({"csv": ANGLED})
    for headings in ("vertical [mm],x [mm]", "y [mm],horizontal [mm]", "x [mm],x [mm]"):
        found = problems({**STILL, PLACE: {"csv": csv(f"angle [deg],{headings}", DEGREES, X, Y)}})[f"{PLACE}/csv"]
        assert str(found.allowed) == "x and y, or one of them, behind the first column", headings


def test_what_the_harmonics_leave_is_told() -> None:
    (warning,) = parsed({**STILL, PLACE: {"csv": ANGLED, "accuracy": "20 %"}}).warnings
    # The rows reach 0.5807 mm; 0.1 mm of order 3 is left along x.
    assert "1 harmonic of order 1 stands" in warning
    assert "leaves 12 % (rms) along x, " in warning
    assert "17 % at most of its amplitude of 0.0005807 m" in warning
    given = {PLACE: {"csv": ANGLED}, "/axes": []}
    assert [warning.code for warning in parsed(given).warnings][:1] == ["reduced-motion"]
    amplitudes = {**STILL, "/base/excitation/amplitude_y": "1 mm"}
    assert "/base/excitation/amplitude_y: is added to the measured motion" in parsed({**amplitudes, **given}).warnings
    varied = {"path": "excitation.amplitude_x", "values": [0, "1 mm"]}
    assert any(text.startswith("/axes/0") and "is added to" in text
               for text in parsed({**STILL, **given, "/axes": [varied]}).warnings)  # fmt: skip
    saw = csv("angle [deg],x [mm]", DEGREES, DEGREES)
    fault = problems({**STILL, PLACE: {"csv": saw}})[f"{PLACE}/accuracy"]
    assert (fault.code, fault.value) == ("out-of-range", "1 %")
    least = str(fault.allowed).removeprefix("at least ")
    assert "11 harmonics" in fault.message
    assert len(harmonics({"csv": saw, "accuracy": least})) == 11 * 5


@pytest.mark.parametrize(
    ("given", "at", "code", "said"),
    [
        ({"csv": ANGLED, "period": "1 s"}, "period", "not-used", ""),
        ({"csv": csv("t [ms],x [mm],y [mm]", DEGREES, X, Y)}, "period", "required", "times or accelerations"),
        ({"csv": csv("angle [deg],x [m/s^2]", DEGREES, X)}, "period", "required", ""),
        ({"csv": csv("t [ms],x [mm]", DEGREES, X), "period": "200 ms"}, "csv", "invalid-table", "longer than"),
        ({"csv": csv("t [ms],x [mm]", DEGREES, X), "period": "1 s"}, "csv", "invalid-table", "not one whole period"),
        ({"csv": csv("angle [deg],x [mm]", DEGREES[:12], X[:12])}, "csv", "invalid-table", "195 deg before its end"),
        ({"csv": csv("angle [deg],x [mm]", [*DEGREES[:5], *DEGREES[4:]], [*X, 0])}, "csv", "invalid-table",
         "row 6 is at 60 deg"),
        ({"csv": csv("angle [deg],x [mm]", DEGREES[::4], X[::4])}, "csv", "invalid-table", "6 rows"),
        ({"csv": csv("angle [deg],x [mm]", [*range(7), 200], range(8))}, "csv", "invalid-table", "gap of 194 deg"),
        ({"csv": csv("angle [deg],x [mm]", DEGREES, 0 * X + 1)}, "csv", "invalid-table", "does not move"),
        ({"csv": csv("angle [deg],x [m]", DEGREES, [*X[1:], 20])}, "csv", "out-of-range", "line 25, column x"),
        ({"csv": csv("t [s],x [m/s^2]", DEGREES, 1e3 * X), "period": "360 s"}, "csv", "out-of-range", "harmonic"),
        ({"csv": csv("angle [deg],x [m/s^2],y [mm]", DEGREES, X, Y), "period": "1 s"}, "csv", "wrong-unit", "m/s^2"),
        ({"csv": csv("t [s],x [g]", DEGREES, X), "period": "360 s"}, "csv", "wrong-unit",
         'm, for example "2 mm", or m/s^2, for example "9.81 m/s^2"; g is the gram'),
        ({"csv": csv("t [Hz],x [mm]", DEGREES, X)}, "csv", "wrong-unit", "or s, for example"),
        ({"csv": ANGLED, "accuracy": 0}, "accuracy", "out-of-range", ""),
        ({"table": [[0, 0, 0]] * 7}, "table", "wrong-type", ""),
        ({"table": [[0, 0]] * 8}, "table/0", "wrong-type", "3 numbers"),
        ({"csv": ANGLED, "table": []}, "", "exactly-one", ""),
        ({"accuracy": "2 %"}, "", "exactly-one", ""),
        ({"csv": ANGLED, "angle": 1}, "angle", "unknown-field", ""),
    ],
)  # fmt: skip
def test_what_is_no_measured_period(given: object, at: str, code: str, said: str) -> None:
    faults = problems({**STILL, PLACE: given})
    place = f"{PLACE}/{at}".rstrip("/")
    assert faults[place].code == code
    assert said in faults[place].message


def test_harmonics_beside_a_measured_period_are_refused() -> None:
    faults = problems({**STILL, PLACE: {"csv": ANGLED}, "/base/excitation/harmonics": {"table": ROWS}})
    assert {place: fault.code for place, fault in faults.items()} == {PLACE: "conflict"}


@pytest.mark.parametrize("field", ["harmonics", "measured"])
def test_the_form_shows_tables_as_their_text(field: str) -> None:
    given = {
        "harmonics": {"table": [[2, "0.2 mm", "30 deg", 0, 0]]},
        "measured": {
            "table": [[f"{t} ms", x, 0] for t, x in zip(range(0, 40, 4), np.sin(np.arange(10)).tolist(), strict=True)],
            "period": "40 ms", "accuracy": "90 %",
        },
    }  # fmt: skip
    base = {**SPEC["base"], "excitation": {"frequency": "25 Hz", field: given[field]}}
    values = values_of({**SPEC, "base": base})
    assert values["/base/excitation/further"] == field
    shown, faults = spec_of(values)
    assert not faults
    headings = shown["base"]["excitation"][field]["csv"].splitlines()[0]
    assert headings.split(",")[0] == {"harmonics": "order", "measured": "time [ms]"}[field]
    change = {f"/base/excitation/{field}": given[field], **STILL}
    again = {f"/base/excitation/{field}": shown["base"]["excitation"][field], **STILL}
    assert parsed(again).study.base == pytest.approx(parsed(change).study.base, rel=1e-12)
