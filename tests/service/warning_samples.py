"""Warnings as engine, worker and service give them, of every code."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from sprag_study.service.http.api import examples
from sprag_study.service.results.unaffected import unaffected
from sprag_study.service.schedules.deadline import finish_warnings
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.measured import parse_measured
from sprag_study.service.storage.rows import reuse
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from tests.service import refined_study, swept_study
from tests.service.results.test_sensitivity import fetching
from tests.service.spec.kinds import test_goal
from tests.service.spec.kinds.test_tolerances import with_tolerances
from tests.service.spec.machine.test_shaft import GAS, LINEAR
from tests.service.spec.machine.test_shaft import changed as press
from tests.service.spec_sample import parsed

_STEP = {"quantity": "force", "over": "stroke", "steps": [{"from": 0.2, "to": 0.8, "value": 100}]}
_TURN = {"quantity": "torque", "steps": [{"from": 1, "to": 2, "value": 100}]}
_MOTOR = {"/base/drive/motor": LINEAR, "/base/balance": ..., "/base/mean_speed": ..., "/axes": []}
_SADDLE = {
    "balance": "motor", "operation": {"quantity": "torque", "value": 52},
    "drive": {"inertia": 3, "motor": {"kind": "table", "interpolation": "linear", "table": [
        [0, 90], [10, 70], [25, 40], [100, 115], [140, 43], [157, 0],
    ]}},
}  # fmt: skip
_UNSTABLE = {
    "mean_speed": "12 rad/s", "drive": {"inertia": "2 kg*m^2"},
    "operation": {"quantity": "torque", "formula": "100/omega*(1 + 0.5*sin(phi))"},
}  # fmt: skip
_COUPLED = {
    "mean_speed": "10 rad/s", "drive": {
        "inertia": "20 kg*m^2", "stages": [{
            "kind": "coupling", "stiffness": "870 N*m/rad", "relative_damping": 0.1, "inertia": "1 kg*m^2",
        }],
    },
    "operation": {"quantity": "torque", "formula": "4 + 25*cos(3*phi)"},
}  # fmt: skip
_WHEEL = {"/base/drive/flywheel": {"kind": "rim", "diameter": "1 m", "mass": "50 kg", "poisson_ratio": 0.3}}


def of_drives() -> Iterator[str]:
    """Warnings about vibration drives."""
    load: dict[str, Any] = {"path": "shaft.load", "values": ["20.000 N*mm", "30.000 N*mm"]}
    up = {"/base/excitation/amplitude_x": 0, "/base/excitation/amplitude_y": 0.002}
    weak = [{"path": "pendulums.0.spring_rate", "values": [40, 60]}, {"path": "gravity", "values": [0, 5, 9.81]}]
    many = [{"path": f"pendulums.0.{name}", "linspace": [0.01, 1, 700]} for name in ("spring_rate", "spring_arm")]
    derived = {"pendulums.0.inertia": "1e-4 kg*m^2/rad * (pendulums.0.backlash - 0.003 rad) * 1000"}
    natural = {"excitation.frequency": "sqrt(pendulums.0.spring_rate / pendulums.0.mass)"}
    for changes in (
        {"/axes": [load]},
        {"/axes": [], "/base/excitation/frequency": ..., "/derive": natural},
        {"/axes": [], "/base/clutch": {"data": [["1.000 deg", 2.0], ["2.000 deg", 5.0]], "accuracy": 0.1}},
        {"/axes": weak},
        {"/axes": many},
        {"/axes": [{"path": "excitation.amplitude_x", "values": [1.6, 0.001]}]},
        {"/axes": [], "/base/pendulums/0/inertia": "4e-4 kg*m^2", "/base/pendulums/0/spring_rate": 40},
        {"/axes": [], "/base/clutch": {"coefficients": [0.5, 200]}},
        {
            "/axes": [],
            "/base/excitation/measured": {
                "csv": "angle [deg],x [mm]\n" + "".join(f"{45 * row},{abs(row - 4)}\n" for row in range(8)),
                "accuracy": "20 %",
            },
        },
        {"/axes": [], "/base/clutch": {"coefficients": [0, 200, -1000], "windup_limit": "0.15 rad"}},
        {"/axes": [{"path": "shaft.load", "linspace": [0, 1, 40_000]}], "/run": {}, "/starts": _starts(32)},
        {"/axes": [{"path": "shaft.load", "values": [1, 2, 0.5]}]},
        {"/axes": [{"path": "shaft.load", "values": [2, 1, 1.5]}]},
        {"/axes": [], "/base/excitation/amplitude_x": 0, "/base/excitation/amplitude_y": 0},
        {"/axes": [], "/base/excitation/frequency": "0.05 Hz"},
        {"/axes": [], "/run": {"at_most": "900 periods"}},
        {"/axes": [], "/run": {"duration": "0.05 s"}},
        {"/axes": [], "/run": {"duration": "60 periods", "window": ["1 s", "1.02 s"]}},
        {"/axes": [], **up},
        {"/axes": [{"path": "pendulums.0.initial_angle", "values": [0, 0.001, 0.002]}], **up},
        with_tolerances({"path": "pendulums.0.backlash", "plus_minus": "300 %"}, drives=1024),
        with_tolerances({"path": "pendulums.0.backlash", "plus_minus": "80 %"}, derive=derived)
        | {"/base/pendulums/0/inertia": ...},
    ):
        yield from parsed(changes).warnings
    table = "excitation.frequency [Hz],shaft.load [N*m]\n20,20.000\n25,30.000\n"
    yield from parsed({"/axes": [{"points": table}]}).warnings
    _, report = test_goal.read({"subject_to": [{"result": "shaft.speed.mean", "is": "8 rad/s", "within": "150 %"}]})
    yield from report.warnings


def _starts(count: int) -> dict[str, Any]:
    return {"count": count, "ranges": {"shaft.initial_speed": [0, 10]}}


def of_shafts() -> Iterator[str]:
    """Warnings about machine shafts."""
    gas = {"gas": GAS | {"clearance": 0.25}}
    half = {"quantity": "torque", "table": [[0, 10], ["90 deg", 20], ["180 deg", 10]]}
    for changes in (
        {"/base/drive/torque": 50},
        {"/base/drive/torque": 100, "/base/balance": "constant", "/base/balance_side": "operation"},
        {"/axes/1": {"path": "mechanism.slider_crank.rod", "values": [0.4, 400]}},
        {"/base/phi_c": 7},
        _MOTOR,
        _WHEEL | {"/base/operation": {"quantity": "torque", "sense": "fixed", "value": "3 N*m"}, "/axes": []},
        {"/base/mechanism": ..., "/base/operation": ..., "/axes": []},
        {"/base/operation": gas, "/axes": _axis("gas.discharge_pressure", ["7 bar", "9 bar", "10 bar"])},
        {"/base/operation": gas, "/axes": _axis("gas.suction_pressure", ["1 bar", "8 bar"])},
        {"/base/operation": _STEP, "/axes": _axis("steps.0.from", [0.5, 0.9])},
        {"/base/operation": _TURN, "/axes": _axis("steps.0.to", [0.5, 2, 3])},
        {"/base/operation": half, "/axes": []},
    ):
        yield from parse_spec(press(changes)).warnings
    whole = press({"/axes": []})
    base = whole["base"]
    base["parts"] = [{name: base.pop(name) for name in ("mechanism", "operation")}, {"crank_angle": "90 deg"}]
    yield from parse_spec(whole).warnings
    for base in (_UNSTABLE, _SADDLE, _COUPLED):
        yield from parse_spec({"sprag": 1, "model": "machine-shaft", "base": base, "axes": []}).warnings


def _axis(name: str, values: list[Any]) -> list[dict[str, Any]]:
    return [{"path": f"operation.{name}", "values": values}]


def of_data() -> Iterator[str]:
    """Warnings about measured clutches and laws."""
    for text in ("1,2\n3,4\n", "angle_rad,torque\n1,2\n3,4\n", "angle,torque_Nm\n0.01,2\n0.02,4\n",
                 "angle_deg,torque_Nmm\n1.000,20.000\n2.000,30.000\n"):  # fmt: skip
        yield from parse_measured(text).warnings
    degrees = np.arange(0.25, 3.1, 0.25)
    data = np.column_stack((np.radians(degrees), 3.5 * degrees + 0.1 * degrees**3))
    yield from models.fit_clutch(data, 0.05, angles_include_backlash=True, backlash=math.radians(0.1)).warnings
    windup = np.linspace(0.0, 0.06, 13)
    data = np.vstack(([[0.0, 0.0], [0.003, 1e-7]], np.column_stack((windup + 0.005, 200.0 * windup))))
    yield from models.fit_clutch(data, 1e-6, angles_include_backlash=True, backlash=0.005).warnings
    yield from models.check_law([0.0, 1.0, -2.0, 1.1], 1.0).warnings
    yield from models.check_law([0.0, 1.0, -0.1, 0.003], math.inf).warnings


def of_work() -> Iterator[str]:
    """Warnings about time, effects and origins."""
    study = parse_spec(examples.SPEC).study
    swept = parse_spec(swept_study.SPEC).study
    for one in (study, swept):
        yield from Chunking(0, 2, timeout=1e-9).warnings(one)
    yield from finish_warnings(study, 7200.0, 3600.0)
    yield from finish_warnings(study, 200_000.0, 90.0)
    yield from finish_warnings(parse_spec(refined_study.SPEC).study, 7200.0, 3600.0)
    for axis in ({"values": [1, 2]}, {"linspace": [0, 1, 40]}):
        axes = [{"path": "shaft.load", **axis}, {"path": "excitation.frequency", "linspace": [16, 30, 300]}]
        of_axes = parsed({"/axes": axes}).study
        yield from unaffected(of_axes, fetching(of_axes, lambda p: np.sqrt(p["excitation.frequency"])))
    yield reuse._MIXED


def every() -> list[str]:
    """Every sentence once."""
    return list(dict.fromkeys([*of_drives(), *of_shafts(), *of_data(), *of_work()]))
