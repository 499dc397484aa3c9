"""A whole spec: what comes out, what is refused as a whole, and that every problem is told at once."""

from __future__ import annotations

import copy
import json
import pickle
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sprag_study.service.spec.document import SpecError, format_of, load_spec, parse_spec
from sprag_study.worker.limits import MAX_PROBLEMS
from sprag_study.worker.study import Study
from tests.service.spec_sample import SPEC, changed, parsed, problems


def test_the_documented_example() -> None:
    sample = copy.deepcopy(SPEC)
    result = parse_spec(sample)
    study = result.study
    assert (study.model, study.name, study.combine) == ("vibration-drive", "Feeder motor: speed against load", "grid")
    assert study.shape == (16, 4, 3)
    assert study.run == {
        "duration": [60.0, "periods"],
        "window": [[40.0, "periods"], [60.0, "periods"]],
        "tolerance": 1e-9,
        "reset": "contact",
    }
    assert study.base == {
        "clutch.coefficients.0": 0.0,
        "clutch.coefficients.1": 200.0,
        "clutch.coefficients.2": 0.0,
        "clutch.coefficients.3": 20000.0,
        "excitation.amplitude_x": 0.002,
        "excitation.amplitude_y": 0.002,
        "excitation.frequency": 25.0,
        "excitation.phase": 0.0,
        "gravity": 9.80665,
        "pendulums.0.arm": 0.03,
        "pendulums.0.backlash": 0.005,
        "pendulums.0.damping": 0.01,
        "pendulums.0.inertia": 0.001,
        "pendulums.0.initial_angle": 0.0,
        "pendulums.0.initial_speed": 0.0,
        "pendulums.0.mass": 0.5,
        "pendulums.0.spring_arm": 0.05,
        "pendulums.0.spring_rate": 9000.0,
        "shaft.inertia": 0.002,
        "shaft.initial_speed": 0.0,
        "shaft.load": 0.1,
    }
    assert study.case_parameters(47 + 12 + 2) == {
        "excitation.frequency": pytest.approx(16 + 5 * 19 / 15),
        "excitation.amplitude_x": 0.001,
        "excitation.amplitude_y": 0.001,
        "shaft.load": 0.1,
    }
    assert result.warnings == ()
    assert result.fits == {}
    assert result.spec == sample == SPEC


def test_defaults() -> None:
    explicit = parsed({"/base/gravity": 9.80665, "/name": "untitled"}).study
    taken_away = {
        "/name": ...,
        "/run/tolerance": ...,
        "/run/reset": ...,
        "/combine": ...,
        "/base/excitation/phase": ...,
    }
    assert parsed(taken_away).study == explicit
    assert parsed({"/run": ...}).study.run == {
        "until": "settled", "at_most": 1000, "settled": 1e-8, "max_period": 32, "tolerance": 1e-9, "reset": "contact",
    }  # fmt: skip
    assert parsed({"/axes": ...}).study.cases == 1


def test_units_do_not_change_the_physics() -> None:
    same = {
        "/base/excitation/frequency": "1500 rpm",
        "/base/pendulums/0/spring_rate": "9 N/mm",
        "/base/pendulums/0/damping": "10 N*mm*s",
        "/base/pendulums/0/arm": "3 cm",
        "/base/shaft/load": 0.1,
        "/base/clutch/coefficients/3": "2e4 N*m/rad^3",
        "/axes/1/linspace": ["1 mm", "0.3 cm", 4],
        "/axes/0/linspace": ["960 rpm", "2100 rpm", 16],
        "/name": "the same",
    }
    assert parsed(same).study.physics_hash("1") == parsed({}).study.physics_hash("1")


@pytest.mark.parametrize("data", [None, [], "spec", 1, True, [{"sprag": 1}]])
def test_a_spec_is_an_object(data: object) -> None:
    with pytest.raises(SpecError) as caught:
        parse_spec(data)
    assert [problem.where for problem in caught.value.faults] == [""]


@pytest.mark.parametrize("version", [2, 0, "1", 1.0, True, None, ...])
def test_the_version_is_one(version: object) -> None:
    assert problems({"/sprag": version})["/sprag"].allowed == "1"


@pytest.mark.parametrize("model", ["vibration_drive", "machine_shaft", "", 3, None, ["vibration-drive"], ...])
def test_the_models_are_listed(model: object) -> None:
    problem = problems({"/model": model})["/model"]
    assert "'vibration-drive'" in str(problem.allowed)
    if model == "vibration_drive":
        assert (problem.code, "'vibration-drive'" in problem.message) == ("unknown-name", True)


@pytest.mark.parametrize("name", ["", "   ", "a" * 201, "two\nlines", "\u0000", 3, None])
def test_names(name: object) -> None:
    assert list(problems({"/name": name})) == ["/name"]


@pytest.mark.parametrize(
    ("pointer", "hint"),
    [
        ("/bas", "base"),
        ("/base/shaft/laod", "load"),
        ("/base/excitation/frequence", "frequency"),
        ("/base/pendulums/0/springrate", "spring_rate"),
        ("/base/clutch/coefficient", "coefficients"),
        ("/run/windows", "window"),
        ("/run/max_steps", None),
        ("/axes/2/value", "values"),
    ],
)
def test_unknown_fields_are_named(pointer: str, hint: str | None) -> None:
    found = problems({pointer: 3})
    assert list(found) == [pointer]
    assert found[pointer].code == "unknown-field"
    assert f"'{hint}'" in found[pointer].message or hint is None
    assert found[pointer].value == 3


def test_every_problem_is_told_at_once() -> None:
    found = problems(
        {
            "/sprag": 2,
            "/extra": {},
            "/base/excitation/frequency": "-25 Hz",
            "/base/pendulums/0/inertia": -1,
            "/base/pendulums/0/mass": "0.5 m",
            "/base/shaft/load": float("nan"),
            "/base/clutch/coefficients/1": True,
            "/run/tolerance": 1,
            "/axes/0/linspace": [1, 2],
            "/axes/1/path/1": "excitation.amplitude_z",
            "/axes/2/values": [],
            "/combine": "gird",
        }
    )
    assert set(found) == {
        "/sprag", "/extra", "/base/excitation/frequency", "/base/pendulums/0/inertia", "/base/pendulums/0/mass",
        "/base/shaft/load", "/base/clutch/coefficients/1", "/run/tolerance", "/axes/0/linspace", "/axes/1/path/1",
        "/axes/2/values", "/combine",
    }  # fmt: skip
    inertia = found["/base/pendulums/0/inertia"]
    assert (inertia.value, inertia.unit) == (-1, "kg*m^2")
    assert inertia.allowed == "> 0 kg*m^2 and <= 1e+06 kg*m^2"
    assert str(inertia) == (
        "/base/pendulums/0/inertia: is out of range (got -1; allowed: > 0 kg*m^2 and <= 1e+06 kg*m^2)"
    )
    json.dumps([problem.value for problem in found.values()], allow_nan=False)


def test_problems_are_counted_no_further_than_anyone_reads() -> None:
    found = problems({"/axes/2/values": ["1 nothing"] * 100_000})
    assert len(found) == MAX_PROBLEMS + 1
    assert found[""].code == "too-many-faults"


def test_values_in_messages_are_short_and_plain() -> None:
    value = {"long": ["x" * 1000] * 1000, "number": 10**5000, "nan": float("nan"), "deep": [[[[1]]]]}
    shown = problems({"/base/shaft/load": value})["/base/shaft/load"].value
    assert len(json.dumps(shown, allow_nan=False)) < 1000


def test_errors_travel_between_processes() -> None:
    with pytest.raises(SpecError) as caught:
        parse_spec({})
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.faults == caught.value.faults
    assert str(again) == str(caught.value)


@pytest.mark.parametrize(
    ("name", "cases"), [("one_pendulum.json", 512), ("two_pendulums.toml", None), ("measured_clutch.json", None)]
)
def test_the_examples(examples: Path, name: str, cases: int | None) -> None:
    result = parse_spec(load_spec((examples / name).read_bytes(), format_of(name)))
    assert result.warnings == ()
    assert cases in {None, result.study.cases}
    assert Study.from_json(json.loads(json.dumps(result.study.to_json()))) == result.study
    if name == "one_pendulum.json":
        assert result.study.shape == (16, 4, 8)
    if name == "measured_clutch.json":
        (fit,) = result.fits.values()
        assert fit.max_residual <= fit.accuracy == pytest.approx(0.05)


json_data = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=6)
    | st.sampled_from(["25 Hz", "shaft.load", "2 mm", "grid", 0, -1, 10**400]),
    lambda inner: st.lists(inner, max_size=4)
    | st.dictionaries(st.sampled_from(["path", "values", "linspace", "range", "coefficients", "data", "x"]), inner),
    max_leaves=10,
)  # fmt: skip


@given(
    st.dictionaries(
        st.sampled_from(
            [
                *(
                    "/base",
                    "/run",
                    "/axes",
                    "/combine",
                    "/base/pendulums",
                    "/base/clutch",
                    "/base/excitation",
                    "/axes/0",
                ),
                *("/base/shaft/load", "/run/window", "/axes/2/values", "/axes/0/linspace", "/axes/1/path"),
            ]
        ),
        json_data,
        max_size=1,
    )
)
def test_any_data_is_a_study_or_refused(changes: dict[str, Any]) -> None:
    try:
        result = parse_spec(changed(changes))
    except SpecError as error:
        json.dumps([problem.value for problem in error.faults], allow_nan=False)
    else:
        assert result.study.cases >= 1
