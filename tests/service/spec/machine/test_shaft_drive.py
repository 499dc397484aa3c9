"""Drive trains in specs: stages with their numbers, on axes, and everything wrong with its place."""

from __future__ import annotations

import math
from typing import Any

import jsonschema
import pytest

from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.worker import models
from tests.service.spec.machine.test_shaft import KLOSS, LINEAR, changed, problems

STAGES: list[dict[str, Any]] = [
    {"kind": "belt", "ratio": 3, "inertia": "50 kg*cm^2", "mass": "2 kg", "radius": "60 mm", "efficiency": 0.95},
    {"kind": "gear", "ratio": 4.5, "output_inertia": "0.3 kg*m^2"},
    {"kind": "screw_nut", "lead": "10 mm", "mass": "80 kg"},
]


def test_stages_are_structure_and_numbers() -> None:
    axis = {"path": "drive.stages.1.ratio", "values": [4, 5, 6]}
    spec = changed({"/base/drive": {"stages": STAGES}, "/axes": [axis]})
    parsed = parse_spec(spec)
    assert parsed.warnings == ()
    study = parsed.study
    assert study.structure is not None
    assert study.structure["drive"]["stages"] == ["belt", "gear", "screw_nut"]
    assert study.base["drive.inertia"] == 0.0
    assert study.base["drive.stages.0.inertia"] == 5e-3
    assert study.base["drive.stages.0.radius"] == 0.06
    assert study.base["drive.stages.2.lead"] == 0.01
    assert study.base["drive.stages.1.efficiency"] == 1.0
    assert study.case_parameters(2)["drive.stages.1.ratio"] == 6.0
    jsonschema.Draft202012Validator(spec_schema()).validate(spec)
    chosen = {choice.path: choice.text for choice in part_of("machine-shaft").choices(study, spec)}
    assert chosen["drive.stages"] == "belt, gear, screw_nut"


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"/base/drive/stages": []}, "/base/drive/stages", "wrong-type"),
        ({"/base/drive/stages": [{"ratio": 3}]}, "/base/drive/stages/0/kind", "required"),
        ({"/base/drive/stages": [{"kind": "gears"}]}, "/base/drive/stages/0/kind", "invalid-choice"),
        ({"/base/drive/stages": [{"kind": "gear"}]}, "/base/drive/stages/0/ratio", "required"),
        (
            {"/base/drive/stages": [{"kind": "rack", "radius": 1, "ratio": 2}]},
            "/base/drive/stages/0/ratio",
            "unknown-field",
        ),
        ({"/base/drive/stages": [{"kind": "gear", "ratio": 0}]}, "/base/drive/stages/0/ratio", "out-of-range"),
        (
            {"/base/drive/stages": [{"kind": "gear", "ratio": 2, "efficiency": 1.1}]},
            "/base/drive/stages/0/efficiency",
            "out-of-range",
        ),
        (
            {"/base/drive/stages": [{"kind": "belt", "ratio": 2, "mass": 1}]},
            "/base/drive/stages/0/radius",
            "conflict",
        ),
        ({"/base/drive": {}}, "/base/drive/inertia", "required"),
    ],
)
def test_wrong_stages(changes: dict[str, Any], pointer: str, code: str) -> None:
    assert problems(changes | {"/axes": []})[pointer].code == code


def test_an_axis_names_a_stage_that_is_there() -> None:
    axis = {"path": "drive.stages.3.ratio", "values": [4, 5]}
    found = problems({"/base/drive": {"stages": STAGES}, "/axes": [axis]})
    assert "there is no stage 3: stages are numbered from 0 to 2" in found["/axes/0/path"].message


def test_a_flywheel_is_given_by_its_dimensions() -> None:
    wheel = {"kind": "rim", "diameter": "1.2 m", "mass": "400 kg", "density": "7.2 g/cm^3", "allowed_stress": "40 MPa"}
    spec = changed({"/base/drive": {"flywheel": wheel}, "/axes": []})
    study = parse_spec(spec).study
    assert study.structure is not None
    assert study.structure["drive"]["flywheel"] == "rim"
    assert study.base["drive.flywheel.allowed_stress"] == 4e7
    assert study.base["drive.flywheel.density"] == pytest.approx(7200.0, rel=1e-15)
    jsonschema.Draft202012Validator(spec_schema()).validate(spec)
    chosen = {choice.path: choice.text for choice in part_of("machine-shaft").choices(study, spec)}
    assert chosen["drive.flywheel.kind"] == "rim"
    found = problems({"/base/drive": {"flywheel": {"kind": "plate", "mass": 3}}, "/axes": []})
    assert found["/base/drive/flywheel/kind"].code == "invalid-choice"
    assert "/base/drive/flywheel/diameter" in problems({"/base/drive": {"flywheel": {"kind": "disc"}}, "/axes": []})


def test_a_ring_has_a_width_and_a_thickness_instead_of_a_mass() -> None:
    ring = {"kind": "ring", "diameter": "0.8 m", "width": "90 mm", "thickness": "45 mm", "density": "7.25 g/cm^3"}
    spec = changed({"/base/drive": {"flywheel": ring}, "/axes": []})
    jsonschema.Draft202012Validator(spec_schema()).validate(spec)
    study = parse_spec(spec).study
    assert study.base["drive.flywheel.thickness"] == 0.045
    assert "drive.flywheel.mass" not in study.base
    for wheel, place, code in (
        (ring | {"mass": 3}, "mass", "unknown-field"),
        ({"kind": "rim", "diameter": 1, "mass": 3, "width": 1}, "width", "unknown-field"),
        ({"kind": "ring", "diameter": 1, "width": 0.1}, "thickness", "required"),
        (ring | {"thickness": "900 mm"}, "thickness", "conflict"),
    ):
        found = problems({"/base/drive": {"flywheel": wheel}, "/axes": []})
        assert found[f"/base/drive/flywheel/{place}"].code == code


def test_a_flywheel_sits_on_a_shaft_of_the_train() -> None:
    wheel = {"kind": "rim", "diameter": "0.8 m", "mass": "40 kg"}
    for shaft, kept in ((..., None), (0, 0), (2, 2), (3, None)):
        own = wheel if shaft is ... else wheel | {"shaft": shaft}
        spec = changed({"/base/drive": {"stages": STAGES, "flywheel": own}, "/axes": []})
        jsonschema.Draft202012Validator(spec_schema()).validate(spec)
        study = parse_spec(spec).study
        assert study.structure is not None
        assert study.structure["drive"].get("flywheel_shaft") == kept
        chosen = {choice.path: choice.text for choice in part_of("machine-shaft").choices(study, spec)}
        assert chosen.get("drive.flywheel.shaft") == (None if kept is None else str(kept))
    for shaft, code in ((4, "out-of-range"), (-1, "out-of-range"), ("main", "wrong-type")):
        found = problems({"/base/drive": {"stages": STAGES, "flywheel": wheel | {"shaft": shaft}}, "/axes": []})
        assert found["/base/drive/flywheel/shaft"].code == code


def test_the_side_that_is_balanced() -> None:
    given = {"/base/balance": ..., "/base/drive/torque": 100, "/base/balance_side": "operation", "/axes": []}
    parsed = parse_spec(changed(given))
    assert parsed.warnings == ()
    assert parsed.study.structure is not None
    assert (parsed.study.structure["balance"], parsed.study.structure["balance_side"]) == ("scale", "operation")
    jsonschema.Draft202012Validator(spec_schema()).validate(changed(given))
    alone = parse_spec(changed(given | {"/base/operation": ...})).study.structure
    assert alone is not None
    assert alone["balance"] == "constant"
    replaced = parse_spec(changed(given | {"/base/balance": "constant"})).warnings
    assert [warning.code for warning in replaced] == ["replaced-value"]
    del given["/base/drive/torque"]
    assert problems(given)["/base/drive/torque"].code == "required"
    motor = {"kind": "linear", "no_load_speed": "130 rpm", "stall_torque": "3 kN*m"}
    found = problems(given | {"/base/drive": {"inertia": 15, "motor": motor}, "/base/mean_speed": ...})
    assert found["/base/balance_side"].code == "conflict"
    given["/base/drive/torque"] = 100
    both = given | {"/base/operation": ..., "/base/balance": "scale"}
    assert problems(both)["/base/operation"].code == "required"
    wrong = given | {"/base/operation/steps/0/value": "-20 kN"}
    assert "the operation drives instead of resisting" in problems(wrong)["/base/balance"].message


def motor_spec(motor: dict[str, Any], **fields: Any) -> dict[str, Any]:
    """A torque of 40 N*m against a motor."""
    load = {"quantity": "torque", "value": "40 N*m"}
    base = {"drive": {"inertia": 8.0, "motor": motor}, "operation": load}
    return {"sprag": 1, "model": "machine-shaft", "name": "hoist", "base": base, **fields}


def test_a_rated_torque_gives_the_motor_a_thermal_margin() -> None:
    plain, rated = (parse_spec(motor_spec(KLOSS | own)).study for own in ({}, {"rated_torque": "100 N*m"}))
    assert dict(rated.base) == dict(plain.base) | {"drive.motor.rated_torque": 100.0}
    shown = [models.presentation_of(study).main for study in (plain, rated)]
    assert ["motor.torque.margin" in main for main in shown] == [False, True]
    assert all("motor.torque.rms" in main for main in shown)
    names = [info.name for info in models.study_results(rated)]
    row = dict(zip(names, models.run_chunk(rated, 0, 1).values[0].tolist(), strict=True))
    assert row["motor.torque.rms"] == pytest.approx(40.0, rel=1e-9)
    assert row["motor.torque.margin"] == pytest.approx(2.5, rel=1e-9)
    before = dict(zip(names, models.run_chunk(plain, 0, 1).values[0].tolist(), strict=True))
    assert [name for name in names if not (before[name] == row[name] or math.isnan(row[name]))] == [
        "motor.torque.margin"
    ]


def test_the_margin_is_a_limit_a_quantity_and_a_refined_result() -> None:
    goal = {
        "vary": [{"path": "drive.motor.rated_torque", "from": "10 N*m", "to": "90 N*m"}],
        "best": [{"result": "motor.torque.rms"}], "subject_to": [{"result": "motor.torque.margin", "at_least": 1.1}],
    }  # fmt: skip
    plan = parse_spec(motor_spec(KLOSS, goal=goal)).study.plan
    assert plan is not None
    assert plan["subject_to"][0]["result"] == "motor.torque.margin"
    axis = {"path": "drive.motor.rated_torque", "linspace": ["20 N*m", "90 N*m", 3]}
    reserve = {"formula": "drive.motor.rated_torque - motor.torque.rms", "unit": "N*m"}
    study = parse_spec(motor_spec(KLOSS, axes=[axis], quantities={"reserve": reserve})).study
    assert "motor.torque.margin" in models.presentation_of(study).main
    names = [info.name for info in models.study_results(study)]
    assert "reserve" in names
    margins = models.run_chunk(study, 0, 3).values[:, names.index("motor.torque.margin")]
    assert margins == pytest.approx([0.5, 1.375, 2.25])
    load = {"path": "operation.scale", "adaptive": [0.5, 2]}
    refined = motor_spec(KLOSS | {"rated_torque": 60}, axes=[load], refine={"results": ["motor.torque.margin"]})
    refined_plan = parse_spec(refined).study.plan
    assert refined_plan is not None
    assert "motor.torque.margin" in str(refined_plan["results"])


def test_a_rated_torque_that_the_motor_never_gives_is_warned_of() -> None:
    table = {"kind": "table", "csv": "speed [rpm],torque [N*m]\n0,60\n140,50\n150,0\n"}
    for motor, most in ((KLOSS, "900"), (LINEAR, "3000"), (table, "60")):
        (warning,) = parse_spec(motor_spec(motor | {"rated_torque": "3.2 kN*m"})).warnings
        assert warning.code == "implausible-value"
        said = f"3200 N*m is more than the largest torque of this motor, {most} N*m"
        assert warning == f"/base/drive/motor/rated_torque: {said}"
    axis = {"path": "drive.motor.rated_torque", "values": ["20 N*m", "1000 N*m"]}
    (warning,) = parse_spec(motor_spec(KLOSS, axes=[axis])).warnings
    assert warning.startswith("/axes/0 (drive.motor.rated_torque): 1000 N*m is more than the largest torque")
    assert warning.endswith("900 N*m (in 1 of 2 cases)")


def test_a_rated_torque_belongs_to_a_motor() -> None:
    assert problems({"/base/drive/rated_torque": 5})["/base/drive/rated_torque"].code == "unknown-field"
    with pytest.raises(SpecError, match="/base/drive/motor/rated_torque: is out of range"):
        parse_spec(motor_spec(KLOSS | {"rated_torque": 0}))


COUPLED: dict[str, Any] = {
    "mean_speed": "10 rad/s", "operation": {"quantity": "torque", "formula": "40 + 25*cos(3*phi)"},
    "drive": {"inertia": "20 kg*m^2", "stages": [
        {"kind": "coupling", "stiffness": "3 kN*m/rad", "relative_damping": 0.5, "inertia": "1 kg*m^2"},
    ]},
}  # fmt: skip


def coupled(stage: dict[str, Any], **fields: Any) -> dict[str, Any]:
    """A machine behind a coupling with other numbers."""
    (coupling,) = COUPLED["drive"]["stages"]
    drive = COUPLED["drive"] | {"stages": [coupling | stage]}
    return {"sprag": 1, "model": "machine-shaft", "name": "mixer", "base": COUPLED | {"drive": drive}, **fields}


def test_couplings_have_results_and_warnings() -> None:
    axis = {"path": "drive.stages.0.stiffness", "values": ["2 kN*m/rad", "3 kN*m/rad"]}
    parsed = parse_spec(coupled({}, axes=[axis]))
    assert parsed.warnings == ()
    names = [info.name for info in models.study_results(parsed.study)]
    frequencies = models.run_chunk(parsed.study, 0, 2).values[:, names.index("torsion.natural_frequency")]
    assert frequencies == pytest.approx([math.sqrt(stiff * (1.0 + 1.0 / 20.0)) for stiff in (2e3, 3e3)])
    shown = models.presentation_of(parsed.study)
    assert shown.main[:3] == ("irregularity", "torsion.dynamic_factor", "torsion.margin")
    assert {"dynamic_factor", "resonance_margin"} <= {answer.name for answer in shown.answers}
    loaded = parse_spec(coupled({}, run={"loads": True})).study
    names = [info.name for info in models.study_results(loaded)]
    row = dict(zip(names, models.run_chunk(loaded, 0, 1).values[0].tolist(), strict=True))
    assert row["couplings.0.torque.amplitude"] == row["torsion.torque.amplitude"]
    resonant = parse_spec(coupled({"stiffness": "860 N*m/rad", "relative_damping": 0.1})).warnings
    assert "was it in percent?" in parse_spec(coupled({"relative_damping": 50})).warnings[0]
    assert [warning.code for warning in resonant] == ["near-resonance", "torque-reverses"]
    assert "harmonic 3 of the cycle, 30 rad/s, is within 0.17 % of a torsional natural frequency" in resonant[0]


@pytest.mark.parametrize(
    ("stage", "place", "said"),
    [
        ({"stiffness": 0}, "stiffness", "is out of range"),
        ({"relative_damping": -0.1}, "relative_damping", "is out of range"),
        ({"inertia": 0}, "inertia", "nothing else turns before this coupling"),
        ({"ratio": 2}, "ratio", "is not a field of a stage of the kind coupling"),
    ],
)
def test_a_coupling_that_is_none_is_refused(stage: dict[str, Any], place: str, said: str) -> None:
    with pytest.raises(SpecError, match=f"/base/drive/stages/0/{place}: .*{said}"):
        parse_spec(coupled(stage))
