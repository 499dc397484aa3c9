"""Quantities of a spec: what formulas they take, the units that follow, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.longer import longer_spec
from sprag_study.worker import models
from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.reuse import kin_hash
from sprag_study.worker.study import Study
from tests.service.spec_sample import changed, parsed, problems, schema

SPECIFIC = "power.useful.mean / pendulums.0.mass"


def asking(quantities: dict[str, Any], **changes: Any) -> Study:
    """The sample with quantities and further changes."""
    return parsed({"/quantities": quantities, **changes}).study


@pytest.mark.parametrize(
    ("formula", "unit", "expected"),
    [
        (SPECIFIC, None, "W/kg"),
        (SPECIFIC, "m^2/s^3", "m^2/s^3"),
        (SPECIFIC, "kW/kg", "m^2/s^3"),
        ("12 + 30 * shaft.inertia / (1 kg*m^2)", None, "1"),
        ("power.useful.mean / power.input.mean", None, "1"),
        ("power.useful.mean / power.input.mean", "%", "%"),
        ("torque.max * shaft.speed.mean", None, "W"),
        ("torque.max * shaft.speed.mean", "kW", "W"),
        ("power.useful.mean / excitation.frequency", None, "J"),
        ("2 * torque.max", None, "N*m"),
        ("torque.max * 1 rad", "kJ", "J"),
        ("shaft.speed.mean", None, "rad/s"),
        ("shaft.speed.mean", "rpm", "rad/s"),
        ("shaft.speed.mean / 1 rev", None, "1/s"),
        ("shaft.speed.mean / 1 rev", "Hz", "Hz"),
        ("2 * excitation.frequency", None, "Hz"),
        ("shaft.speed.mean * pendulums.0.arm", None, "m/s"),
        ("pendulums.0.mass * pendulums.0.arm^2", None, "kg*m^2"),
        ("atan2(pendulums.0.arm, 20 mm)", None, "rad"),
        ("run.events + 1", None, "1"),
        ("0", None, "1"),
    ],
)
def test_the_unit_follows_from_the_formula(formula: str, unit: str | None, expected: str) -> None:
    given = formula if unit is None else {"formula": formula, "unit": unit}
    study = asking({"asked": given})
    (info,) = models.study_results(study)[len(models.model_results(study)) :]
    assert (info.name, info.description) == ("asked", formula)
    assert study.quantities[0].unit == expected
    assert isinstance(info.unit, models.Share) == (expected == "%")
    assert Study.from_text(study.to_text()) == study


@pytest.mark.parametrize(
    ("quantities", "place", "code"),
    [
        ({"asked": "torque.max + shaft.speed.mean"}, "/quantities/asked", "wrong-unit"),
        (
            {"asked": {"formula": "torque.max + shaft.speed.mean", "unit": "N*m"}},
            "/quantities/asked/formula",
            "wrong-unit",
        ),
        ({"asked": {"formula": "torque.max", "unit": "kg"}}, "/quantities/asked/unit", "wrong-unit"),
        ({"asked": {"formula": "torque.max", "unit": "Nmm2x"}}, "/quantities/asked/unit", "wrong-unit"),
        ({"asked": {"formula": "torque.max", "unit": 3}}, "/quantities/asked/unit", "wrong-type"),
        ({"asked": {"formula": "shaft.speed.mean", "unit": "Hz"}}, "/quantities/asked/unit", "wrong-unit"),
        ({"asked": "sqrt(pendulums.0.mass)"}, "/quantities/asked", "wrong-unit"),
        ({"asked": "torque.most"}, "/quantities/asked", "invalid-path"),
        ({"asked": "2 *"}, "/quantities/asked", "invalid-formula"),
        ({"asked": 3}, "/quantities/asked", "wrong-type"),
        ({"asked": {"unit": "W"}}, "/quantities/asked/formula", "required"),
        ({"asked": {"formula": "1", "about": ""}}, "/quantities/asked/about", "unknown-field"),
        ({"efficiency": "1"}, "/quantities/efficiency", "conflict"),
        ({"torque_max": "1"}, "/quantities/torque_max", "conflict"),
        ({"gravity": "1"}, "/quantities/gravity", "conflict"),
        ({"shaft_load": "1"}, "/quantities/shaft_load", "conflict"),
        ({"drive": "1"}, "/quantities/drive", "conflict"),
        ({"max": "1"}, "/quantities/max", "conflict"),
        ({"kg": "1"}, "/quantities/kg", "conflict"),
        ({"Cost": "1"}, "/quantities/Cost", "invalid-text"),
        ({"cost\n": "1"}, "/quantities/cost\n", "invalid-text"),
        ({"a.b": "1"}, "/quantities/a.b", "invalid-text"),
        ({"first": "other", "other": "1 + first"}, "/quantities/first", "circular"),
        ({f"q{number}": "1" for number in range(51)}, "/quantities", "too-many"),
        ([], "/quantities", "wrong-type"),
    ],
)
def test_what_is_refused_names_the_field(quantities: Any, place: str, code: str) -> None:
    assert problems({"/quantities": quantities})[place].code == code


def test_a_category_and_a_parameter_without_a_value_are_named() -> None:
    settled = {"/run": {"until": "settled"}}
    fault = problems({"/quantities": {"asked": "regime"}, **settled})["/quantities/asked"]
    assert (fault.code, str(fault.message)) == ("not-numeric", "uses 'regime', which is a category")


def test_formulas_use_parameters_results_and_each_other_in_any_order() -> None:
    study = asking(
        {"twice": "2 * specific", "specific": SPECIFIC, "cost": "1 + shaft.load / (1 N*m)"},
        **{"/axes": [{"path": "shaft.load", "values": [0.1, 0.2, 0.3]}]},
    )
    infos = models.model_results(study)
    values = np.zeros((3, len(infos)))
    place = [info.name for info in infos].index("power.useful.mean")
    values[:, place] = [3.0, np.nan, 5.0]
    found = models.with_quantities(study, infos, range(3), values)
    mass = study.base["pendulums.0.mass"]
    np.testing.assert_allclose(
        found[:, -3:], [[6 / mass, 3 / mass, 1.1], [np.nan, np.nan, 1.2], [10 / mass, 5 / mass, 1.3]]
    )
    np.testing.assert_array_equal(found[:, :-3], values)


def test_a_missing_result_gives_a_missing_value_whatever_the_formula_makes_of_it() -> None:
    study = asking(
        {"hidden": "if(torque.max > 1 N*m, 1, 0)", "zero": "torque.max^0", "pole": "1 / run.events", "of": "hidden + 1"}
    )
    infos = models.model_results(study)
    found = models.with_quantities(study, infos, range(1), np.full((1, len(infos)), np.nan))
    assert np.isnan(found[0, -4:]).all()
    there = models.with_quantities(study, infos, range(1), np.zeros((1, len(infos))))
    np.testing.assert_array_equal(there[0, -4:], [0.0, 1.0, np.nan, 1.0])  # one over zero events is no number


def test_rows_of_a_study_do_not_depend_on_its_quantities() -> None:
    plain, asked = parsed({}).study, asking({"specific": SPECIFIC})
    kin = kin_hash(plain, "7")
    assert kin == kin_hash(asked, "7")
    np.testing.assert_array_equal(case_keys(plain, kin), case_keys(asked, kin))
    assert "quantities" not in plain.to_json()


def test_studies_that_follow_from_another_keep_them() -> None:
    spec = changed({"/quantities": {"specific": SPECIFIC}})
    schema().validate(spec)
    study = parsed({"/quantities": {"specific": SPECIFIC}}).study
    extended = parse_extended(spec, study, {"axes": [{"path": "shaft.load", "values": [0.7]}]}).study
    assert extended.quantities == study.quantities
    assert longer_spec(spec, study, np.array([0]))["quantities"] == {"specific": SPECIFIC}
