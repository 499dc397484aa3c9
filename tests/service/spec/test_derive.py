"""Derived parameters of a spec: their values in every kind of study, and what is refused."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.spec.document import SpecError, load_spec, parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.longer import longer_spec
from sprag_study.worker.models import machine_shaft
from sprag_study.worker.study import Study
from tests.service.spec_sample import changed, parsed, problems

FORMULA = "1.1 * pendulums.0.mass * pendulums.0.arm^2 + 2e-4 kg*m^2"
INERTIA = "pendulums.0.inertia"
MASS, ARM = "pendulums.0.mass", "pendulums.0.arm"


def derived(changes: dict[str, Any]) -> Study:
    """The sample with a derived inertia and further changes."""
    return parsed({"/base/pendulums/0/inertia": ..., "/derive": {INERTIA: FORMULA}, **changes}).study


def inertia(columns: Any) -> Any:
    """The formula by hand."""
    return 1.1 * columns[MASS] * columns[ARM] ** 2 + 2e-4


AXES: dict[str, dict[str, Any]] = {
    "grid": {
        "/axes": [{"path": MASS, "values": ["400 g", "500 g", "0.6 kg"]},
                  {"path": ARM, "linspace": ["20 mm", "30 mm", 3]}]
    },
    "zip": {
        "/axes": [{"path": MASS, "values": [0.4, 0.5]}, {"path": ARM, "values": ["20 mm", "25 mm"]}],
        "/combine": "zip",
    },
    "sample": {
        "/axes": [{
            "sample": "sobol", "count": 8, "seed": 1,
            "ranges": [{"path": MASS, "from": 0.3, "to": 0.6}, {"path": ARM, "from": 0.02, "to": 0.03}],
        }]
    },
    "points": {"/axes": [{"points": f"{MASS} [g],{ARM}\n400,0.02\n500,0.03\n"}]},
    "exclude": {
        "/axes": [{"path": MASS, "values": [0.4, 0.5, 0.6]}, {"path": ARM, "values": [0.02, 0.03]}],
        "/exclude": [{INERTIA: {"above": "6.5e-4 kg*m^2"}}],
    },
    "union": {
        "/axes": [{"path": MASS, "values": [0.4, 0.6]}, {"path": ARM, "values": [0.02, 0.025]}], "/combine": "union",
    },
}  # fmt: skip


@pytest.mark.parametrize("kind", AXES)
def test_every_case_of_every_kind_of_study_has_the_value_of_the_formula(kind: str) -> None:
    study = derived(AXES[kind])
    columns: dict[str, Any] = {**study.base, **study.columns(range(study.cases))}
    np.testing.assert_allclose(columns[INERTIA], np.broadcast_to(inertia(columns), study.cases), rtol=1e-15)
    assert study.base[INERTIA] == pytest.approx(1.1 * 0.5 * 0.03**2 + 2e-4, rel=1e-15)
    assert INERTIA not in study.axis_paths
    assert study.cases == {"grid": 9, "zip": 2, "sample": 8, "points": 2, "exclude": 4, "union": 4}[kind]
    assert Study.from_text(study.to_text()) == study


def test_json_and_toml_give_the_same_study() -> None:
    toml = """
        sprag = 1
        model = "machine-shaft"
        [base]
        mean_speed = "10 rad/s"
        balance = "scale"
        drive.torque = "3 N*m"
        operation = { quantity = "torque", value = "2 N*m" }
        [derive]
        "drive.inertia" = "0.5 * 4 kg * (10 cm)^2 * (1 + drive.torque / 3 N*m)"
    """
    study = parse_spec(load_spec(toml, "toml")).study
    assert study.base["drive.inertia"] == pytest.approx(0.04, rel=1e-15)
    as_json: dict[str, Any] = {
        "sprag": 1,
        "model": "machine-shaft",
        "base": {
            "mean_speed": 10, "balance": "scale", "drive": {"torque": 3.0},
            "operation": {"quantity": "torque", "value": 2.0},
        },
        "derive": {"drive.inertia": "0.5 * 4 kg * (10 cm)^2 * (1 + drive.torque / 3 N*m)"},
    }  # fmt: skip
    assert parse_spec(as_json).study == study


def test_a_derived_parameter_may_be_used_by_another() -> None:
    derive = {"shaft.inertia": "2 * pendulums.0.inertia", INERTIA: FORMULA}
    study = derived({"/base/shaft/inertia": ..., "/derive": derive, "/axes": [{"path": MASS, "values": [0.4, 0.5]}]})
    columns = study.columns([0, 1])
    np.testing.assert_array_equal(columns["shaft.inertia"], 2.0 * columns[INERTIA])
    assert list(study.derive) == sorted(derive)


def test_a_star_stands_for_every_pendulum() -> None:
    one = changed({})["base"]["pendulums"][0] | {"inertia": None}
    two = [one, {**one, "mass": 0.4}]
    study = derived({
        "/base/pendulums": two,
        "/derive": {"pendulums.*.inertia": "1.2*pendulums.*.mass*pendulums.*.arm^2 + 1e-5*shaft.inertia"},
        "/axes": [{"path": "pendulums.1.arm", "values": [0.02, 0.03]}],
    })  # fmt: skip
    columns = study.columns([0, 1])
    np.testing.assert_allclose(columns["pendulums.0.inertia"], 1.2 * 0.5 * 0.03**2 + 2e-8, rtol=1e-15)
    expected = 1.2 * 0.4 * np.array([0.02, 0.03]) ** 2 + 2e-8
    np.testing.assert_allclose(columns["pendulums.1.inertia"], expected, rtol=1e-15)


def test_a_clutch_law_and_a_frequency_may_be_derived() -> None:
    changes = {
        "/base/clutch/coefficients": [0, 200, None, 20000],
        "/base/excitation/frequency": ...,
        "/derive": {
            "clutch.coefficients.2": "-clutch.coefficients.1 / (0.1 rad)",
            "excitation.frequency": "1500 rpm / 1 rev * (1 + gravity / (98.0665 m/s^2))",
        },
        "/axes": [{"path": "gravity", "values": [0.0, 9.80665]}],
    }
    study = parsed(changes).study
    np.testing.assert_allclose(study.columns([0, 1])["excitation.frequency"], [25.0, 27.5], rtol=1e-12)
    assert study.base["clutch.coefficients.2"] == pytest.approx(-2000.0)
    # A law that is negative in some case is refused where it is derived.
    negative = {"clutch.coefficients.2": "-clutch.coefficients.1 / (0.1 rad) * clutch.coefficients.3 / 100 N*m/rad^3"}
    axes = [{"path": "clutch.coefficients.3", "values": [100.0, 1e4]}]
    found = problems({**changes, "/derive": negative, "/base/excitation/frequency": 25, "/axes": axes})
    assert found["/derive"].code == "no-clutch-law"
    # So is a run that is longer than it may be at a derived frequency.
    assert problems({**changes, "/run": {"duration": "40000 s"}})["/run/duration"].code == "out-of-range"


@pytest.mark.parametrize(
    ("formula", "code"),
    [
        ("1.1 * pendulums.0.mass", "wrong-unit"),
        ("pendulums.0.mass * pendulums.0.arm^2 + 0.1", "wrong-unit"),
        ("pendulums.0.mas * pendulums.0.arm^2", "invalid-path"),
        ("pendulums.1.mass * pendulums.0.arm^2", "invalid-path"),
        ("pendulums.*.mass * pendulums.0.arm^2", "invalid-path"),
        ("phi * 1 kg*m^2", "invalid-path"),
        ("pendulums.0.inertia + 1 kg*m^2", "circular"),
        ("clutch.windup_limit * 1 kg*m^2", "required"),
        ("1.1 * (pendulums.0.mass", "invalid-formula"),
        ("", "invalid-formula"),
        ("__import__('os')", "invalid-path"),
        ("1 kg*m^2" + " + 1 kg*m^2" * 200, "too-long"),
        ("+".join(["1 kg*m^2"] * 180) + "-" + "+".join(["gravity*1"] * 10), "wrong-unit"),
        ("(" * 41 + "1 kg*m^2" + ")" * 41, "invalid-formula"),
        ("2 kg*m^2 / 0", "out-of-range"),
        ("-1 kg*m^2", "out-of-range"),
        ("2 furlong * pendulums.0.mass", "wrong-unit"),
        (0.5, "wrong-type"),
    ],
)
def test_a_formula_that_cannot_be_used_is_refused(formula: object, code: str) -> None:
    found = problems({"/base/pendulums/0/inertia": ..., "/derive": {INERTIA: formula}})
    assert found[f"/derive/{INERTIA}"].code == code


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"/base/pendulums/0/inertia": 1e-3}, f"/derive/{INERTIA}", "conflict"),
        ({"/axes": [{"path": INERTIA, "values": [1e-3, 2e-3]}]}, "/axes/0/path", "conflict"),
        ({"/axes": [{"points": f"{INERTIA}\n1e-3\n2e-3\n"}]}, "/axes/0/points", "conflict"),
        ({"/derive": {INERTIA: FORMULA, "pendulums.*.inertia": FORMULA}}, "/derive/pendulums.*.inertia", "repeated"),
        ({"/derive": {"pendulums.*.*": FORMULA, INERTIA: FORMULA}}, "/derive/pendulums.*.*", "invalid-path"),
        ({"/derive": {"shaft.*.mass": "1 kg", INERTIA: FORMULA}}, "/derive/shaft.*.mass", "invalid-path"),
        ({"/derive": {"pendulums.1.mass": "1 kg", INERTIA: FORMULA}}, "/derive/pendulums.1.mass", "invalid-path"),
        ({"/derive": {"shaft.mass": "1 kg", INERTIA: FORMULA}}, "/derive/shaft.mass", "invalid-path"),
        ({"/derive": {"pendulums.0": "1 kg", INERTIA: FORMULA}}, "/derive/pendulums.0", "conflict"),
        ({"/derive": [FORMULA], "/base/pendulums/0/inertia": 1}, "/derive", "wrong-type"),
    ],
)
def test_a_path_that_cannot_be_derived_is_refused(changes: dict[str, Any], pointer: str, code: str) -> None:
    found = problems({"/base/pendulums/0/inertia": ..., "/derive": {INERTIA: FORMULA}, **changes})
    assert found.keys() == {pointer}
    assert found[pointer].code == code


def test_a_star_that_stands_for_nothing_is_explained() -> None:
    found = problems({"/derive": {"pendulum.*.mass": "1 kg"}})
    assert "did you mean 'pendulums'?" in str(found["/derive/pendulum.*.mass"])
    found = problems({"/base/shaft/inertia": ..., "/derive": {"shaft.inertia": "pendulums.*.inertia"}})
    assert "`*` in a formula needs one in its path" in str(found["/derive/shaft.inertia"])


def test_a_derived_path_in_the_base_and_on_an_axis_has_both_faults() -> None:
    changes = {"/derive": {INERTIA: FORMULA}, "/axes": [{"path": INERTIA, "values": [1e-3, 2e-3]}]}
    found = problems({"/base/pendulums/0/inertia": 1e-3, **changes})
    assert {pointer: fault.code for pointer, fault in found.items()} == {
        f"/derive/{INERTIA}": "conflict",
        "/axes/0/path": "conflict",
    }


def test_faults_of_the_base_are_told_as_they_are_without_formulas() -> None:
    own = {"/base/pendulums/0/inertia": ..., "/derive": {INERTIA: FORMULA, "shaft.inertia": "1 kg*m^2"}}
    found = problems({**own, "/base/shaft": ..., "/base/pendulums/0/mass": "-1 g"})
    assert {pointer: fault.code for pointer, fault in found.items()} == {"/base/pendulums/0/mass": "out-of-range"}
    assert found["/base/pendulums/0/mass"].value == "-1 g"
    found = problems({**own, "/base/shaft": ..., "/base/pendulums": ...})
    assert (found["/base/pendulums"].code, found.keys() & {"/base/shaft", "/derive/shaft.inertia"}) == (
        "required",
        set(),
    )


def test_a_circle_is_told() -> None:
    derive = {"shaft.inertia": "2 * pendulums.0.inertia", INERTIA: "shaft.inertia / 2 + 1 kg*m^2"}
    spec = changed({"/base/pendulums/0/inertia": ..., "/base/shaft/inertia": ..., "/derive": derive})
    with pytest.raises(SpecError, match=r"(\S+) -> \S+ -> \1"):
        parse_spec(spec)


def test_a_value_out_of_range_in_some_case_is_refused() -> None:
    changes = {
        "/base/shaft/load": ...,
        "/derive": {"shaft.load": "gravity * pendulums.0.mass * pendulums.0.arm - 0.1 N*m"},
        "/axes": [
            {"path": MASS, "linspace": [0.1, 1.0, 100]},
            {"path": "excitation.frequency", "values": [20, 25, 30]},
        ],
    }
    fault = problems(changes)["/derive/shaft.load"]
    expected = int(np.sum(9.80665 * np.linspace(0.1, 1.0, 100) * 0.03 - 0.1 < 0.0))
    assert fault.code == "out-of-range"
    assert f"in {3 * expected} of 300 cases" in fault.message
    assert fault.unit == "N*m"
    changes["/axes"][0]["linspace"][0] = 0.4  # type: ignore[index]
    assert parsed(changes).study.cases == 300


def test_the_range_is_checked_in_a_million_cases() -> None:
    one = {"path": MASS, "linspace": [0.1, 1.0, 1000]}
    other = {"path": ARM, "linspace": ["1 mm", "30 mm", 1000]}
    changes = {"/base/pendulums/0/inertia": ..., "/axes": [one, other]}
    assert parsed({**changes, "/derive": {INERTIA: FORMULA}}).study.cases == 1_000_000
    wrong = problems({**changes, "/derive": {INERTIA: f"{FORMULA} - 2.1e-4 kg*m^2"}})[f"/derive/{INERTIA}"]
    columns = {MASS: np.linspace(0.1, 1.0, 1000)[:, None], ARM: np.linspace(1e-3, 0.03, 1000)[None, :]}
    count = int(np.sum(inertia(columns) - 2.1e-4 <= 0.0))
    assert f"in {count:,} of 1,000,000 cases" in wrong.message


def test_warnings_see_the_values_of_the_cases() -> None:
    spec = {"/base/pendulums/0/inertia": ..., "/axes": [{"path": MASS, "values": [0.5, 1.0]}]}
    told = parsed({**spec, "/derive": {INERTIA: "0.9 * pendulums.0.mass * pendulums.0.arm^2"}}).warnings
    assert any("J < M l^2" in warning and "2 of 2 cases" in warning for warning in told)
    assert not any("J < M l^2" in warning for warning in parsed({**spec, "/derive": {INERTIA: FORMULA}}).warnings)


@pytest.mark.parametrize(
    ("formula", "angular"),
    [
        ("sqrt(pendulums.0.spring_rate / pendulums.0.mass)", True),
        ("1 / (pendulums.0.mass / pendulums.0.spring_rate)^0.5", True),
        ("sqrt(9.81 m/s^2 / (1 m))", True),
        ("sqrt(pendulums.0.spring_rate / pendulums.0.mass) / (2*pi)", False),
        ("sqrt(pendulums.0.spring_rate / pendulums.0.mass) * 1 Hz*s", False),
        ("25 Hz * sqrt(4)", False),
        ("1 / (40 ms)", False),
    ],
)
def test_a_natural_frequency_without_pi_is_asked_about(formula: str, angular: bool) -> None:
    """The root of a stiffness over a mass is in rad/s: 30 N/m and 0.5 kg are 1.23 Hz, not 7.75."""
    made = parsed({"/base/excitation/frequency": ..., "/axes": [], "/derive": {"excitation.frequency": formula}})
    told = [str(warning) for warning in made.warnings if warning.code == "angular-frequency"]
    assert len(told) == angular
    assert all(text.startswith("/derive (excitation.frequency): a root of this kind") for text in told)


def test_studies_without_formulas_stay_as_they_are() -> None:
    plain, empty = parsed({}).study, parsed({"/derive": {}}).study
    assert plain == empty
    assert "derive" not in plain.to_json()
    assert plain.physics_hash("1") == empty.physics_hash("1") != derived({}).physics_hash("1")


def test_a_study_is_extended_and_run_for_longer_with_its_formulas() -> None:
    spec = changed(
        {
            "/base/pendulums/0/inertia": ...,
            "/derive": {INERTIA: FORMULA},
            "/axes": [{"path": MASS, "values": [0.4, 0.5]}],
        }
    )
    study = parse_spec(spec).study
    more = parse_extended(spec, study, {"axes": [{"path": ARM, "values": [0.02]}]}).study
    columns = more.columns(range(more.cases))
    np.testing.assert_allclose(columns[INERTIA], inertia(columns), rtol=1e-15)
    cases = parse_extended(spec, study, {"cases": [{"path": ARM, "values": [0.02]}]}).study
    assert cases.case_parameters(2)[INERTIA] == pytest.approx(1.1 * 0.5 * 0.02**2 + 2e-4)
    longer = parse_spec(longer_spec(spec, study, np.array([1]))).study
    assert longer.case_parameters(0) == study.case_parameters(1)
    with pytest.raises(SpecError, match="derived"):
        parse_extended(spec, study, {"axes": [{"path": INERTIA, "values": [1e-3]}]})


def test_constants_and_numbers_of_a_machine_shaft_may_be_derived() -> None:
    spec: dict[str, Any] = {
        "sprag": 1,
        "model": "machine-shaft",
        "base": {
            "mean_speed": 10,
            "balance": "scale",
            "drive": {"inertia": 0.5, "torque": 3.0},
            "constants": {"r": 0.1},
            "operation": {"quantity": "torque", "formula": "a + area * sin(phi)"},
        },
        "derive": {
            "constants.area": "pi * constants.r^2",
            "constants.a": "2 + constants.area",
            "wanted_irregularity": "0.01 * (drive.inertia / 1 kg*m^2)^(1/2)",
        },
        "axes": [{"path": "constants.r", "values": [0.1, 0.2]}, {"path": "drive.inertia", "values": [0.25, 4.0]}],
    }
    study = parse_spec(spec).study
    columns = study.columns(range(4))
    np.testing.assert_allclose(columns["constants.area"], np.pi * np.array([0.01, 0.01, 0.04, 0.04]), rtol=1e-14)
    np.testing.assert_allclose(columns["wanted_irregularity"], [0.005, 0.02, 0.005, 0.02], rtol=1e-14)
    assert study.structure is not None
    assert machine_shaft.base_results(study.structure, study.base)["omega.mean"] == pytest.approx(10.0)
    # The machine is checked with the values of the formulas.
    wrong = copy.deepcopy(spec)
    wrong["base"]["balance"] = "refuse"
    with pytest.raises(SpecError, match="work over a cycle is not zero"):
        parse_spec(wrong)


def test_a_quantity_is_the_same_number_as_elsewhere() -> None:
    study = derived({"/derive": {INERTIA: "pendulums.0.mass * 1.1 mm^2 * 1 + 3.3 kg*cm^2"}})
    area, offset = parse_quantity("1.1 mm^2", "m^2"), parse_quantity("3.3 kg*cm^2", "kg*m^2")
    assert study.base[INERTIA] == 0.5 * area * 1 + offset


def test_a_study_that_chooses_its_cases_derives_them_too() -> None:
    adaptive = {"path": MASS, "adaptive": [0.3, 0.6]}
    changes = {"/axes": [{"path": "shaft.load", "values": [0.1, 0.2]}, adaptive], "/combine": ...}
    refined = {"/run": {}, "/refine": {"results": ["shaft.speed.mean"], "error": "1 %"}, **changes}
    study = derived(refined)
    columns = study.columns(range(study.cases))
    np.testing.assert_allclose(columns[INERTIA], 1.1 * columns[MASS] * 0.03**2 + 2e-4, rtol=1e-15)
    # The formula is tried over the whole range, not only at the cases of the first round.
    valley = "1e3 m^2/kg * (pendulums.0.mass - 0.45123 kg)^2 - 1e-5 kg*m^2"
    fault = problems({"/base/pendulums/0/inertia": ..., "/derive": {INERTIA: valley}, **refined})
    assert fault[f"/derive/{INERTIA}"].code == "out-of-range"
    goal = {
        "vary": [{"path": MASS, "from": 0.3, "to": 0.6}],
        "best": [{"result": "efficiency", "max": True}],
        "seed": 1,
    }
    at = [{INERTIA: 1e-3}]
    spec = {"/axes": ..., "/combine": ..., "/run": {}, "/base/pendulums/0/inertia": ..., "/derive": {INERTIA: FORMULA}}
    found = problems({**spec, "/goal": {**goal, "at": at}})
    assert found[f"/goal/at/0/{INERTIA}"].code == "conflict"
    found = problems({**spec, "/goal": {**goal, "vary": [{"path": INERTIA, "from": 1e-3, "to": 2e-3}]}})
    assert {fault.code for fault in found.values()} == {"conflict"}
