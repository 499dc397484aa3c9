"""Samples, points, groups, unions and exclusions: which cases a spec comes to."""

from __future__ import annotations

import copy
import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.draws.unit import LEVELS, unit_sample
from sprag_study.service.spec.measured import MeasuredDataError, parse_measured
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.worker import models
from sprag_study.worker.study import Study
from tests.service.spec_sample import SPEC, changed, parsed, problems

LOAD = {"path": "shaft.load", "values": [0.1, 0.2, 0.3]}
FREQUENCY = {"path": "excitation.frequency", "values": ["20 Hz", "30 Hz"]}
TIED = {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "3 mm"]}


def study_of(axes: list[Any], **more: Any) -> Study:
    return parsed({"/axes": axes, **{f"/{key}": value for key, value in more.items()}}).study


def rows(study: Study, *paths: str) -> list[tuple[float, ...]]:
    columns = study.columns(range(study.cases))
    return list(zip(*(columns[path].tolist() for path in paths), strict=True))


def test_plain_studies_are_what_they_were() -> None:
    """The hashes of two studies, as version 0.1 of the program stored them."""
    grid = parse_spec(SPEC).study
    assert (grid.combine, grid.cases) == ("grid", 192)
    assert grid.physics_hash("1") == GRID_HASH
    zipped = study_of([LOAD, {**FREQUENCY, "values": [20, 25, 30]}], combine="zip")
    assert zipped.physics_hash("1") == ZIP_HASH


GRID_HASH = "fa1f24c452b18f99fcf7ee44974dec31fa5db685d82064f811b5f20a702af509"
ZIP_HASH = "850b3fff36f3cdd79c526b0c8143dfd973f87bf1cddbe4c2f21b082afcd73541"


def test_a_union_runs_the_axes_one_after_the_other_and_no_case_twice() -> None:
    study = study_of([{**LOAD, "values": [0.1, 0.2]}, {**FREQUENCY, "values": [25, 30]}], combine="union")
    # The base has 0.1 N*m and 25 Hz: that case stands in both.
    assert rows(study, "shaft.load", "excitation.frequency") == [(0.1, 25.0), (0.2, 25.0), (0.1, 30.0)]


def test_a_union_of_groups_keeps_the_numbers_of_the_first() -> None:
    groups = [{"axes": [LOAD, FREQUENCY]}, {"combine": "zip", "axes": [{**LOAD, "values": [0.2, 0.9]}, FREQUENCY]}]
    study = study_of(groups, combine="union")
    found = rows(study, "shaft.load", "excitation.frequency")
    assert found[:6] == list(itertools.product([0.1, 0.2, 0.3], [20.0, 30.0]))
    assert found[6:] == [(0.9, 30.0)]


def test_tied_paths_stay_tied() -> None:
    study = study_of([TIED, LOAD], combine="union")
    assert [axis.paths for axis in study.axes] == [
        ("excitation.amplitude_x", "excitation.amplitude_y"),
        ("shaft.load",),
    ]


def test_a_sample_meets_an_axis_in_a_grid() -> None:
    sample = {
        "sample": "latin_hypercube",
        "count": 8,
        "seed": 3,
        "ranges": [
            {"path": "excitation.frequency", "from": "16 Hz", "to": "32 Hz"},
            {"path": "pendulums.0.spring_rate", "from": 1e3, "to": 1e5, "scale": "log"},
        ],
    }
    study = study_of([sample, LOAD])
    assert study.cases == 24
    found = rows(study, "excitation.frequency", "pendulums.0.spring_rate", "shaft.load")
    assert [row[2] for row in found] == [0.1, 0.2, 0.3] * 8
    # One point in each eighth of each range, on its scale: that is what a Latin hypercube is.
    eighths = sorted(math.floor((row[0] - 16.0) / 2.0) for row in found[::3])
    decades = sorted(math.floor(8 * math.log10(row[1] / 1e3) / 2.0) for row in found[::3])
    assert eighths == decades == list(range(8))
    again = study_of([sample, LOAD])
    assert again == study
    other = study_of([{**sample, "seed": 4}, LOAD])
    assert other.physics_hash("1") != study.physics_hash("1")


def test_a_sobol_sequence_is_scipys() -> None:
    expected = qmc.Sobol(3, rng=np.random.default_rng(11)).random(16)
    np.testing.assert_array_equal(unit_sample("sobol", 16, 11, 3), expected)


def test_trajectories_share_no_point_and_have_one_step_for_each_range() -> None:
    for count, seed, dimensions in ((1000, 0, 2), (20, 1, 12)):
        unit = unit_sample("morris", count, seed, dimensions)
        assert len(np.unique(unit, axis=0)) == len(unit) == count * (dimensions + 1)
        steps = np.diff(unit.reshape(count, dimensions + 1, dimensions), axis=1)
        moved = np.abs(steps) > 0.0
        assert (moved.sum(axis=1) == 1).all()
        assert (moved.sum(axis=2) == 1).all()
        np.testing.assert_allclose(np.abs(steps[moved]), LEVELS / 2.0 / (LEVELS - 1.0))


def test_samples_for_screening_and_pairs_have_their_cases_and_faults() -> None:
    spans = [{"path": "shaft.load", "from": 0, "to": 1}, {"path": "excitation.frequency", "from": 16, "to": 30}]
    assert study_of([{"sample": "morris", "count": 5, "ranges": spans}]).cases == 15
    pairs = {"sample": "saltelli", "count": 4, "second_order": True}
    three = [*spans, {"path": "pendulums.0.arm", "from": "20 mm", "to": "30 mm"}]
    assert study_of([{**pairs, "ranges": three}]).cases == 32
    assert problems({"/axes": [{**pairs, "ranges": spans}]})["/axes/0/ranges"].code == "out-of-range"
    found = problems({"/axes": [{"sample": "morris", "count": 1001, "second_order": True, "ranges": spans[:1]}]})
    assert {place: fault.code for place, fault in found.items()} == {
        "/axes/0/count": "out-of-range",
        "/axes/0/ranges": "out-of-range",
        "/axes/0/second_order": "conflict",
    }


def test_the_design_for_indices_has_its_blocks() -> None:
    unit = unit_sample("saltelli", 4, 0, 3).reshape(4, 5, 3)
    first, last = unit[:, 0], unit[:, 4]
    for index in range(3):
        expected = first.copy()
        expected[:, index] = last[:, index]
        np.testing.assert_array_equal(unit[:, 1 + index], expected)


def test_points_have_units_in_their_header_or_their_cells() -> None:
    text = "\ufeffexcitation.frequency [rpm],shaft.load [N*m]\n1500,0.1\n1800, 250 N*mm\n\n"
    study = study_of([{"points": text}])
    assert rows(study, "excitation.frequency", "shaft.load") == [(25.0, 0.1), (30.0, 0.25)]


@pytest.mark.parametrize("sign", [";", "\t"])
def test_points_may_be_parted_as_spreadsheets_do(sign: str) -> None:
    text = "\ufeffexcitation.frequency [rpm],shaft.load [N*m]\r\n1500,0.1\r\n1800, 250 N*mm\r\n".replace(",", sign)
    study = study_of([{"points": text}])
    assert rows(study, "excitation.frequency", "shaft.load") == [(25.0, 0.1), (30.0, 0.25)]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_of_points_end_as_on_any_system_and_blank_ones_do_not_count(end: str) -> None:
    text = end.join(["excitation.frequency [rpm],shaft.load", "1500,0.1", " , ", ",", "  ", "1800,0.25", ""])
    study = study_of([{"points": text}])
    assert rows(study, "excitation.frequency", "shaft.load") == [(25.0, 0.1), (30.0, 0.25)]


@pytest.mark.parametrize("cell", ["\u0661\u0662", "\uff11\uff12"], ids=["arabic", "wide"])
def test_what_only_python_takes_for_a_number_is_none(cell: str) -> None:
    (problem,) = problems({"/axes": [{"points": f"excitation.frequency,shaft.load\n20,0.1\n{cell},0.2\n"}]}).values()
    assert (problem.where, problem.code) == ("/axes/0/points", "not-a-number")
    assert problem.message.startswith("line 3, column excitation.frequency: ")
    assert problem.value == cell
    with pytest.raises(MeasuredDataError, match="number"):
        parse_measured(f"angle_rad,torque_Nm\n0.1,2\n{cell},3\n")


@pytest.mark.parametrize(
    ("exclude", "left"),
    [
        ([{"shaft.load": {"above": 0.2}}], {(0.1, 20), (0.1, 30), (0.2, 20), (0.2, 30)}),
        ([{"shaft.load": {"at_least": "200 N*mm"}}], {(0.1, 20), (0.1, 30)}),
        ([{"shaft.load": {"above": 0.1, "below": 0.3}}], {(0.1, 20), (0.1, 30), (0.3, 20), (0.3, 30)}),
        ([{"shaft.load": {"is": [0.1, 0.3]}, "excitation.frequency": {"at_most": 20}}],
         {(0.2, 20), (0.1, 30), (0.2, 30), (0.3, 30)}),
        ([{"shaft.load": {"is": 0.1}}, {"excitation.frequency": {"is": "1800 rpm"}}], {(0.2, 20), (0.3, 20)}),
        ([{"pendulums.0.mass": {"below": 0.1}, "shaft.load": {"is": 0.1}}], None),
        ([], None),
    ],
)  # fmt: skip
def test_cases_are_left_out(exclude: list[Any], left: set[tuple[float, float]] | None) -> None:
    study = study_of([LOAD, FREQUENCY], exclude=exclude)
    everything = set(itertools.product([0.1, 0.2, 0.3], [20.0, 30.0]))
    assert set(rows(study, "shaft.load", "excitation.frequency")) == (everything if left is None else left)


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"/combine": "product"}, "/combine", "invalid-choice"),
        ({"/axes": [{"sample": "random", "count": 4, "ranges": []}]}, "/axes/0/ranges", "wrong-type"),
        ({"/axes": [{"sample": "sobol", "count": 6, "ranges": [{"path": "shaft.load", "from": 0, "to": 1}]}]},
         "/axes/0/count", "out-of-range"),
        ({"/axes": [{"sample": "sobol", "count": 4, "ranges": [{"path": "shaft.load", "from": -1, "to": 1}]}]},
         "/axes/0/ranges/0/from", "out-of-range"),
        ({"/axes": [{"sample": "sobol", "count": 4,
                     "ranges": [{"path": "shaft.load", "from": 0, "to": 1, "scale": "log"}]}]},
         "/axes/0/ranges/0", "invalid-range"),
        ({"/axes": [{"sample": "sobol", "count": 4, "ranges": [{"path": "shaft.load", "from": 1, "to": 1}]}]},
         "/axes/0/ranges/0/to", "invalid-range"),
        ({"/axes": [{"points": "shaft.load\n-1\n"}]}, "/axes/0/points",
         "out-of-range"),
        ({"/axes": [{"points": "gravity\n\nshaft.load [N*mm]\n"}]}, "/axes/0/points", "not-a-number"),
        ({"/axes": [{"points": "shaft.load [N*mm]\n\n-3\n"}]}, "/axes/0/points",
         "out-of-range"),
        ({"/axes": [{"points": "shaft.load,gravity\n1,\n"}]}, "/axes/0/points", "empty"),
        ({"/axes": [{"points": "shaft.load\n1_000\n"}]}, "/axes/0/points", "wrong-unit"),
        ({"/axes": [{"points": "shaft.load,shaft.lode\n1,2\n"}]}, "/axes/0/points", "invalid-path"),
        ({"/axes": [{"points": "shaft.load\n1,2\n"}]}, "/axes/0/points", "unequal-lengths"),
        ({"/axes": [{"points": "shaft.load\n"}]}, "/axes/0/points", "out-of-range"),
        ({"/axes": [{"points": 7}]}, "/axes/0/points", "wrong-type"),
        ({"/axes": [{"points": "shaft.load\n1\n1\n"}]}, "/axes/0/points", "repeated"),
        ({"/axes": [{"points": "shaft.load\n3\n1\n\n2\n1\n"}]}, "/axes/0/points",
         "repeated"),
        ({"/axes": [{"points": "shaft.load\n1\n1\n"}], "/exclude": []}, "/axes/0/points", "repeated"),
        ({"/axes": [{"points": "shaft.load\n1\n1\n"}, FREQUENCY]}, "/axes",
         "repeated"),
        ({"/axes": [{"points": "shaft.load;excitation.frequency\n0,1.5;20\n"}]}, "/axes/0/points", "not-a-number"),
        ({"/axes": [{"axes": [LOAD]}, {"axes": [LOAD]}]}, "/axes/1/path", "repeated"),
        ({"/axes": [{"axes": [{"axes": [LOAD]}]}]}, "/axes/0/axes/0", "conflict"),
        ({"/axes": [{"axes": [LOAD, FREQUENCY], "combine": "zip"}]}, "/axes/0/axes", "unequal-lengths"),
        ({"/exclude": [{"shaft.load": {}}]}, "/exclude/0/shaft.load", "required"),
        ({"/exclude": [{"shaft.load": {"over": 1}}]}, "/exclude/0/shaft.load/over", "unknown-field"),
        ({"/exclude": [{"shaft.lode": {"above": 1}}]}, "/exclude/0/shaft.lode", "invalid-path"),
        ({"/exclude": [{"shaft.load": {"at_least": 0}}]}, "/exclude", "empty"),
        ({"/exclude": {"shaft.load": {"above": 1}}}, "/exclude", "wrong-type"),
        ({"/combine": "union", "/axes": []}, "/axes", "wrong-type"),
        ({"/axes": [{"axes": [{**LOAD, "values": [0.1, 0.1]}]}]}, "/axes/0/axes/0/values/1", "repeated"),
        ({"/axes": [{"sample": "saltelli", "count": 2**19, "ranges": [{"path": "shaft.load", "from": 0, "to": 1}]}]},
         "/axes", "too-many"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(changes: dict[str, Any], pointer: str, code: str) -> None:
    found = problems(changes)
    assert pointer in found, found
    assert found[pointer].code == code


def test_a_broken_base_brings_no_second_problem() -> None:
    found = problems({"/base/shaft/load": "x", "/combine": "union", "/axes": [LOAD, FREQUENCY]})
    assert list(found) == ["/base/shaft/load"]


def test_the_schema_knows_every_form() -> None:
    import jsonschema

    validator = jsonschema.Draft202012Validator(spec_schema())
    sample = {"sample": "saltelli", "count": 4, "ranges": [{"path": "shaft.load", "from": 0, "to": "1 N*m"}]}
    for axes in ([sample], [{"points": "shaft.load\n1\n"}], [{"combine": "zip", "axes": [LOAD, sample]}]):
        validator.validate(
            changed({"/axes": axes, "/combine": "union", "/exclude": [{"shaft.load": {"is": [1, "2 N*m"]}}]})
        )
    for axes in (
        [{**sample, "count": 0}],
        [{"points": []}],
        [{"combine": "zip", "axes": []}],
        [{**sample, "extra": 1}],
    ):
        assert list(validator.iter_errors(changed({"/axes": axes})))
    assert list(validator.iter_errors(changed({"/exclude": [{"shaft.load": {}}]})))


def test_kernels_take_compiled_studies() -> None:
    study = study_of([LOAD, FREQUENCY], exclude=[{"shaft.load": {"is": 0.2}}])
    task = models.chunk_task(study, 1, 2)
    assert (task.columns["shaft.load"].tolist(), task.columns["excitation.frequency"].tolist()) == (
        [0.1, 0.3],
        [30.0, 20.0],
    )  # type: ignore[union-attr]


def eight(columns: int) -> dict[str, Any]:
    """A drive of eight pendulums, and points that vary that many of their parameters."""
    spec = copy.deepcopy(SPEC)
    pendulum = spec["base"]["pendulums"][0]
    spec["base"]["pendulums"] = [copy.deepcopy(pendulum) for _ in range(8)]
    names = [name for name, value in pendulum.items() if not isinstance(value, dict)]
    paths = [f"pendulums.{index}.{name}" for index in range(8) for name in names][:columns]
    rows = [",".join(str(0.1 + 0.01 * case) for _ in paths) for case in range(3)]
    spec["axes"] = [{"points": "\n".join([",".join(paths), *rows])}]
    return spec


def test_points_may_have_a_column_for_every_parameter_of_eight_pendulums() -> None:
    study = parse_spec(eight(1000)).study
    assert (len(study.axes) > 60, study.cases) == (True, 3)
    assert study.case_parameters(2)["pendulums.7.mass"] == pytest.approx(0.12)


def test_more_columns_than_the_limit_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sprag_study.service.spec.axes.points.MAX_COLUMNS", 20)
    with pytest.raises(SpecError) as columns:
        parse_spec(eight(21))
    assert [(fault.where, fault.code) for fault in columns.value.faults] == [("/axes/0/points", "out-of-range")]
    monkeypatch.setattr("sprag_study.service.spec.axes.points.MAX_COLUMNS", 256)
    monkeypatch.setattr("sprag_study.service.spec.axes.design.MAX_COLUMNS", 20)
    with pytest.raises(SpecError) as parameters:
        parse_spec(eight(21))
    assert [(fault.where, fault.code) for fault in parameters.value.faults] == [("/axes", "too-many")]
