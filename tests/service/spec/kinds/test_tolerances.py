"""The tolerances of a spec: what they change, how drives are drawn, and what is refused."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.longer import longer_spec
from sprag_study.worker.models.parameters import in_range, parameter_of
from sprag_study.worker.spread import DRIVE, Spread
from sprag_study.worker.study import Study, without_drives
from tests.service.spec_sample import changed, parsed, problems, schema

LOADS = [{"path": "shaft.load", "values": [0.05, 0.1, 0.2]}]
BACKLASH = "pendulums.0.backlash"


def with_tolerances(*items: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Changes of the sample spec."""
    fields = {"/axes": LOADS, "/tolerances": list(items), "/drives": 64}
    return fields | {f"/{name.replace('__', '/')}": value for name, value in more.items()}


def study_of(*items: dict[str, Any], **more: Any) -> Study:
    return parsed(with_tolerances(*items, **more)).study


def spread_of(*items: dict[str, Any], **more: Any) -> Spread:
    spread = study_of(*items, **more).spread
    assert spread is not None
    return spread


def test_each_place_of_a_grid_is_run_with_the_nominal_drive_and_every_drawn_one() -> None:
    spec = changed(
        with_tolerances({"path": BACKLASH, "plus_minus": "60 %"}, {"path": "shaft.load", "plus_minus": "5 %"})
    )
    schema().validate(spec)
    study = parse_spec(spec).study
    assert study.shape == (3, 65)
    assert study.axes[-1].paths == (DRIVE,)
    assert study.drives == 64
    columns = study.columns(range(study.cases))
    table = {path: column.reshape(3, 65) for path, column in columns.items()}
    assert (table[BACKLASH][:, 0] == 0.005).all()
    assert table["shaft.load"][:, 0].tolist() == [0.05, 0.1, 0.2]
    np.testing.assert_array_equal(table[BACKLASH][0], table[BACKLASH][2])
    np.testing.assert_allclose(table["shaft.load"][0] / 0.05, table["shaft.load"][2] / 0.2, rtol=1e-12)
    assert table[BACKLASH][0, 1:].std() == pytest.approx(0.001, rel=0.03)
    assert parsed({"/axes": LOADS}).study == without_drives(study)


@pytest.mark.parametrize(
    ("text", "low", "high"),
    [("+5/-2 %", 0.098, 0.105), ("+5 N*mm/-0", 0.1, 0.105), ("0/-20 N*mm", 0.08, 0.1), ("+0,04/+0,01 N*m", 0.11, 0.14)],
)
def test_two_deviations_are_the_limits_as_on_a_drawing(text: str, low: float, high: float) -> None:
    item = {"path": "shaft.load", "plus_minus": text}
    spec = changed(with_tolerances({**item, "distribution": "uniform"}, axes=[]))
    schema().validate(spec)
    nominal, *drawn = parse_spec(spec).study.columns(range(65))["shaft.load"].tolist()
    assert nominal == 0.1
    assert low <= min(drawn) < low + 0.03 * (high - low)
    assert high >= max(drawn) > high - 0.03 * (high - low)
    normal = study_of(item, axes=[]).columns(range(1, 65))["shaft.load"]
    assert normal.mean() == pytest.approx((low + high) / 2.0, rel=2e-3)
    assert normal.std() == pytest.approx((high - low) / 6.0, rel=0.05)


def test_a_study_without_axes_has_one_place() -> None:
    study = study_of({"path": "shaft.load", "plus_minus": "5 %"}, axes=[])
    assert study.shape == (65,)


@pytest.mark.parametrize(
    "axes",
    [
        [{"points": "shaft.load [N*m],excitation.frequency [Hz]\n0.1,25\n0.2,26\n"}],
        [{"sample": "sobol", "count": 2, "seed": 3, "ranges": [{"path": "shaft.load", "from": 0.1, "to": 0.2}]}],
        [{"path": "shaft.load", "values": [0.1, 0.2, 0.3]}, {"path": "excitation.frequency", "values": [25, 26, 27]}],
    ],
)
def test_listed_cases_are_each_run_with_every_drive(axes: list[dict[str, Any]]) -> None:
    more: dict[str, Any] = {"combine": "zip"} if len(axes) == 2 else {}
    study = study_of({"path": "shaft.load", "plus_minus": "5 %"}, axes=axes, **more)
    places = parsed({"/axes": axes, **{f"/{name}": value for name, value in more.items()}}).study
    assert study.combine == "zip"
    assert study.cases == 65 * places.cases
    assert without_drives(study) == places
    loads = study.columns(range(study.cases))["shaft.load"].reshape(-1, 65)
    np.testing.assert_allclose(loads / loads[:, :1], np.tile(loads[0] / loads[0, 0], (places.cases, 1)), rtol=1e-12)


def test_excluded_places_are_left_out_with_all_their_drives() -> None:
    study = study_of({"path": "shaft.load", "plus_minus": "5 %"}, exclude=[{"shaft.load": {"above": 0.15}}])
    assert study.cases == 2 * 65


def test_every_pendulum_has_its_own_draw_unless_it_is_shared() -> None:
    spec = changed(with_tolerances({"path": "pendulums.*.mass", "plus_minus": "5 %"}))
    spec["base"]["pendulums"] = [spec["base"]["pendulums"][0]] * 2
    own = parse_spec(spec).study.spread
    assert own is not None
    assert own.names == ("pendulums.0.mass", "pendulums.1.mass")
    assert abs(np.corrcoef(own.array.T)[0, 1]) < 0.2
    spec["tolerances"][0]["shared"] = True
    shared = parse_spec(spec).study.spread
    assert shared is not None
    assert shared.names == ("pendulums.*.mass",)
    assert shared.paths == ("pendulums.0.mass", "pendulums.1.mass")


def test_tied_amplitudes_share_a_draw_by_a_list_of_paths() -> None:
    paths = ["excitation.amplitude_x", "excitation.amplitude_y"]
    spread = spread_of({"path": paths, "plus_minus": "0.2 mm", "shared": True})
    assert spread.array.shape == (64, 1)
    assert spread.tolerances[0].change == "offset"
    assert np.abs(spread.array).max() < 3e-4


def test_draws_follow_from_seed_and_method_only() -> None:
    item = {"path": BACKLASH, "plus_minus": "10 %"}
    first = spread_of(item)
    assert spread_of(item) == first
    others = [spread_of(item, seed=2), spread_of(item, draws="random"), spread_of(item, draws="latin_hypercube")]
    assert len({other.array.tobytes() for other in (first, *others)}) == 4
    assert first.about == {"seed": 1, "draws": "sobol", "correlations": []}


@pytest.mark.parametrize("draws", ["sobol", "random"])
def test_more_drives_keep_the_first_ones(draws: str) -> None:
    paths = (BACKLASH, "pendulums.0.mass", "shaft.inertia")
    items = [{"path": path, "plus_minus": "20 %"} for path in paths]
    pairs = [{"between": list(pair), "coefficient": 0.4} for pair in (paths[:2], paths[1:])]
    few, many = (spread_of(*items, drives=drives, draws=draws, correlations=pairs) for drives in (50, 333))
    np.testing.assert_array_equal(many.array[:50], few.array)


def test_another_process_draws_the_same_bits() -> None:
    changes = with_tolerances(
        {"path": BACKLASH, "plus_minus": "60 %"}, {"path": "pendulums.0.mass", "plus_minus": "5 %"},
        correlations=[{"between": [BACKLASH, "pendulums.0.mass"], "coefficient": 0.5}],
    )  # fmt: skip
    code = f"from tests.service.spec_sample import parsed\nprint(parsed({changes!r}).study.physics_hash('engine'))"
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == parsed(changes).study.physics_hash("engine")


def test_measured_values_are_drawn_as_they_are() -> None:
    spread = spread_of({"path": BACKLASH, "values": ["0.2 deg", "4 mrad", "5 mrad", "0.006 rad"]}, drives=400)
    values, counts = np.unique(spread.array, return_counts=True)
    assert values.tolist() == [pytest.approx(0.2 * np.pi / 180), 0.004, 0.005, 0.006]
    assert counts.min() >= 98
    assert spread.tolerances[0].change == "value"


def test_correlated_parameters_have_the_given_correlation() -> None:
    spread = spread_of(
        {"path": BACKLASH, "plus_minus": "10 %"}, {"path": "pendulums.0.mass", "plus_minus": "5 %"},
        {"path": "shaft.inertia", "plus_minus": "5 %"}, drives=4096,
        correlations=[{"between": [BACKLASH, "pendulums.0.mass"], "coefficient": -0.6}],
    )  # fmt: skip
    correlation = np.corrcoef(spread.array.T)
    assert correlation[0, 1] == pytest.approx(-0.6, abs=0.01)
    assert np.abs(correlation[2, :2]).max() < 0.01


def test_no_drawn_value_leaves_the_range_of_its_parameter_and_the_cut_is_reported() -> None:
    changes = with_tolerances({"path": BACKLASH, "plus_minus": "300 %"}, drives=1024)
    found = parsed(changes)
    values = found.study.columns(range(found.study.cases))[BACKLASH]
    assert values.min() > 0.0
    # Conditioned, not moved to the bound: no value occurs twice.
    assert np.unique(values).size == 1025
    assert any("0.16 of the distribution lies outside" in text for text in found.warnings)
    assert not parsed(with_tolerances({"path": BACKLASH, "plus_minus": "60 %"})).warnings


@pytest.mark.parametrize(
    ("item", "axes"),
    [
        ({"path": BACKLASH, "plus_minus": 1000}, []),
        ({"path": "shaft.load", "plus_minus": 1e9, "distribution": "lognormal"}, []),
        ({"path": BACKLASH, "plus_minus": 1e-308, "distribution": "lognormal"}, []),
        ({"path": "shaft.load", "plus_minus": "1000 %", "distribution": "uniform"}, []),
        ({"path": "pendulums.0.initial_angle", "plus_minus": "5 %"}, [-0.2, 0.0, 0.1]),
        ({"path": "clutch.windup_limit", "plus_minus": "5 %", "distribution": "triangular"}, [0.1, 0.2]),
    ],
)
def test_extreme_tolerances_stay_in_range_too(item: dict[str, Any], axes: list[float]) -> None:
    varied = [{"path": item["path"], "values": axes}] if axes else []
    study = study_of(item, axes=varied)
    entry = parameter_of(study, item["path"])
    assert entry is not None
    assert in_range(study.columns(range(study.cases))[item["path"]], entry).all()


def test_a_zero_on_an_axis_stays_zero_with_a_share() -> None:
    axes = [{"path": "shaft.load", "values": [0.0, 0.1]}]
    study = study_of({"path": "shaft.load", "plus_minus": "5 %"}, axes=axes)
    loads = study.columns(range(study.cases))["shaft.load"].reshape(2, 65)
    assert (loads[0] == 0.0).all()
    assert np.unique(loads[1]).size == 65


def test_derived_parameters_follow_the_drawn_values() -> None:
    study = study_of(
        {"path": "pendulums.0.mass", "plus_minus": "5 %"}, base__pendulums__0__inertia=...,
        derive={"pendulums.0.inertia": "2 * pendulums.0.mass * pendulums.0.arm^2"},
    )  # fmt: skip
    columns = study.columns(range(study.cases))
    np.testing.assert_allclose(columns["pendulums.0.inertia"], 2 * columns["pendulums.0.mass"] * 0.03**2, rtol=1e-14)


def test_further_places_have_the_same_drives() -> None:
    spec = changed(with_tolerances({"path": BACKLASH, "plus_minus": "10 %"}))
    study = parse_spec(spec).study
    longer = parse_extended(spec, study, {"axes": [{"path": "shaft.load", "values": [0.3]}]}).study
    assert longer.shape == (4, 65)
    assert longer.spread == study.spread
    listed = parse_extended(spec, study, {"cases": [{"path": "excitation.frequency", "values": [30]}]}).study
    assert listed.cases == 4 * 65
    assert listed.spread == study.spread


def test_a_longer_run_of_some_cases_has_their_drawn_values() -> None:
    spec = changed(
        with_tolerances({"path": BACKLASH, "plus_minus": "10 %"}, {"path": "shaft.load", "plus_minus": "5 %"})
    )
    study = parse_spec(spec).study
    cases = np.array([0, 7, 66])
    longer = parse_spec(longer_spec(spec, study, cases)).study
    assert longer.spread is None
    for path in (BACKLASH, "shaft.load"):
        np.testing.assert_array_equal(longer.columns(range(3))[path], study.columns(cases)[path])


LOAD = "shaft.load"
FIVE = {"plus_minus": "5 %"}
REFUSED: list[tuple[dict[str, Any], str, str]] = [
    ({"path": "pendulums.0.initial_angle", **FIVE}, "plus_minus", "out-of-range"),
    ({"path": BACKLASH, "plus_minus": "0 %"}, "plus_minus", "out-of-range"),
    ({"path": BACKLASH, "plus_minus": "1e-300 %"}, "plus_minus", "out-of-range"),
    ({"path": BACKLASH, "plus_minus": "-1 deg"}, "plus_minus", "out-of-range"),
    ({"path": BACKLASH, "plus_minus": 1e308}, "plus_minus", "out-of-range"),
    ({"path": BACKLASH, "plus_minus": "1 mm"}, "plus_minus", "wrong-unit"),
    ({"path": BACKLASH}, "plus_minus", "required"),
    ({"path": LOAD, "plus_minus": "+5 %/+5 %"}, "plus_minus", "out-of-range"),
    ({"path": LOAD, "plus_minus": "+5 %/-5000 %"}, "plus_minus", "out-of-range"),
    ({"path": LOAD, "plus_minus": "+5 %/-1 N*mm"}, "plus_minus", "wrong-unit"),
    ({"path": LOAD, "plus_minus": "+1 N*mm/-1 mm"}, "plus_minus", "wrong-unit"),
    ({"path": LOAD, "plus_minus": "+0.01/-0.02"}, "plus_minus", "missing-unit"),
    ({"path": LOAD, "plus_minus": "+5 %/-2 %", "distribution": "lognormal"}, "distribution", "conflict"),
    ({"path": "pendulums.1.backlash", **FIVE}, "path", "invalid-path"),
    ({"path": DRIVE, **FIVE}, "path", "invalid-path"),
    ({**FIVE}, "path", "required"),
    ({"path": 3, **FIVE}, "path", "wrong-type"),
    ({"path": BACKLASH, "distribution": "gauss", **FIVE}, "distribution", "invalid-choice"),
    ({"path": BACKLASH, "values": [0.004], **FIVE}, "plus_minus", "conflict"),
    ({"path": BACKLASH, "values": [-0.004]}, "values/0", "out-of-range"),
    ({"path": LOAD, "values": [0.1]}, "values", "conflict"),
    ({"path": [LOAD, BACKLASH], "plus_minus": "0.1 N*m", "shared": True}, "plus_minus", "wrong-unit"),
]


@pytest.mark.parametrize(("item", "field", "code"), REFUSED)
def test_what_is_refused_of_a_tolerance_names_its_place(item: dict[str, Any], field: str, code: str) -> None:
    found = problems(with_tolerances(item))
    assert {where: fault.code for where, fault in found.items()}[f"/tolerances/0/{field}"] == code


def between(*paths: str, coefficient: float = 0.5) -> dict[str, Any]:
    return {"correlations": [{"between": list(paths), "coefficient": coefficient}]}


@pytest.mark.parametrize(
    ("more", "pointer", "code"),
    [
        ({"drives": 0}, "/drives", "out-of-range"),
        ({"drives": 100_000, "axes": [{"path": LOAD, "linspace": [0, 1, 101]}]}, "/drives", "too-many"),
        ({"drives": 100_000, "axes": [{"points": "shaft.load\n0.1\n0.2\n0.3\n0.4\n0.5\n"}]}, "/drives", "too-many"),
        ({"seed": -1}, "/seed", "out-of-range"),
        ({"draws": "halton"}, "/draws", "invalid-choice"),
        (between(BACKLASH, "shaft.inertia"), "/correlations/0/between", "invalid-path"),
        (between(BACKLASH), "/correlations/0/between", "wrong-type"),
        (between(BACKLASH, BACKLASH), "/correlations/0/between", "repeated"),
        (between(BACKLASH, LOAD, coefficient=2.0), "/correlations/0/coefficient", "out-of-range"),
        (between(BACKLASH, LOAD, coefficient=1.0), "/correlations/0/coefficient", "conflict"),
        (between(BACKLASH, LOAD, coefficient=-1.0), "/correlations/0/coefficient", "conflict"),
        (
            {"axes": [{"path": LOAD, "adaptive": [0, 1]}], "refine": {"results": ["efficiency"]}},
            "/tolerances",
            "conflict",
        ),
    ],
)
def test_what_is_refused_of_the_drives_names_its_place(more: dict[str, Any], pointer: str, code: str) -> None:
    found = problems(with_tolerances({"path": BACKLASH, **FIVE}, {"path": LOAD, **FIVE}, **more))
    assert found[pointer].code == code


def test_fields_of_drives_need_tolerances() -> None:
    assert problems({"/drives": 5})["/drives"].code == "not-used"
    assert problems({"/tolerances": []})["/tolerances"].code == "wrong-type"


def test_a_parameter_has_one_tolerance() -> None:
    changes = with_tolerances({"path": "pendulums.*.mass", **FIVE}, {"path": "pendulums.0.mass", **FIVE})
    assert problems(changes)["/tolerances/1/path"].code == "repeated"


def test_three_correlations_that_contradict_each_other_are_refused() -> None:
    paths = [BACKLASH, "shaft.load", "shaft.inertia"]
    pairs = [(0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)]
    changes = with_tolerances(
        *({"path": path, "plus_minus": "5 %"} for path in paths),
        correlations=[{"between": [paths[a], paths[b]], "coefficient": c} for a, b, c in pairs],
    )
    assert "positive definite" in problems(changes)["/correlations"].message


def test_a_derived_parameter_has_no_tolerance_of_its_own() -> None:
    changes = with_tolerances(
        {"path": "pendulums.0.inertia", "plus_minus": "5 %"}, base__pendulums__0__inertia=...,
        derive={"pendulums.0.inertia": "2 * pendulums.0.mass * pendulums.0.arm^2"},
    )  # fmt: skip
    assert problems(changes)["/tolerances/0/path"].code == "conflict"
