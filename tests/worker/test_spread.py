"""Drives of a study with tolerances: nominal and drawn values, numbering, order, reuse."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.derived import distinct_values, involved
from sprag_study.worker.order import order_of
from sprag_study.worker.reuse import kin_hash, shared_cases, span, taken
from sprag_study.worker.spread import DRIVE, Spread, Tolerance
from sprag_study.worker.study import Axis, Combine, Study, without_drives

BASE = {"a": 2.0, "b": 0.5, "c": 1.0, "d": 3.0, "load": 0.0}
DRAWS = np.array([[1.1, 0.01, 7.0], [0.9, -0.02, 8.0], [1.05, 0.0, 7.0]])
SPREAD = Spread(
    [
        Tolerance("load", ("load",), "scale"),
        Tolerance("b", ("b", "d"), "offset"),
        Tolerance("c", ("c",), "value", {"distribution": "values"}),
    ],
    DRAWS,
    {"seed": 1, "draws": "sobol", "correlations": []},
)


def study(spread: Spread = SPREAD, derive: dict[str, str] | None = None, combine: Combine = "grid") -> Study:
    loads, drives = np.array([0.0, 0.2, 0.4]), np.arange(spread.drives + 1.0)
    if combine == "zip":
        loads, drives = np.repeat(loads, drives.size), np.tile(drives, loads.size)
    axes = (Axis(("load",), loads), Axis((DRIVE,), drives))
    return Study("toy", "s", dict(BASE), {}, axes, combine, derive=derive or {}, spread=spread)


@pytest.mark.parametrize("combine", ["grid", "zip"])
def test_drive_0_is_nominal_and_the_others_share_their_draws_at_every_place(combine: Combine) -> None:
    own = study(derive={"a": "b + c"}, combine=combine)
    columns = own.columns(range(own.cases))
    loads, drives = np.repeat([0.0, 0.2, 0.4], 4), np.tile([0, 1, 2, 3], 3)
    np.testing.assert_array_equal(columns[DRIVE], drives)
    np.testing.assert_array_equal(columns["load"], loads * np.array([1.0, *DRAWS[:, 0]])[drives])
    np.testing.assert_array_equal(columns["b"], 0.5 + np.array([0.0, *DRAWS[:, 1]])[drives])
    np.testing.assert_array_equal(columns["d"], 3.0 + np.array([0.0, *DRAWS[:, 1]])[drives])
    np.testing.assert_array_equal(columns["c"], np.array([1.0, *DRAWS[:, 2]])[drives])
    np.testing.assert_array_equal(columns["a"], columns["b"] + columns["c"])
    assert set(own.column_paths) == set(columns)
    assert own.cases_at({DRIVE: 0.0}).tolist() == [0, 4, 8]
    assert own.cases_at({DRIVE: 2.0, "load": 0.2}).tolist() == [6]
    some = [7, 0, 10]
    for path, column in own.columns(some).items():
        np.testing.assert_array_equal(column, columns[path][some])


@pytest.mark.parametrize("combine", ["grid", "zip"])
def test_a_drawn_drive_has_the_key_of_its_parameters(combine: Combine) -> None:
    """As a point of a table, and alone, it has the key that it has in its batch."""
    own = study(derive={"a": "b + c"}, combine=combine)
    columns = {path: column for path, column in own.columns(range(own.cases)).items() if path != DRIVE}
    points = Study("toy", "", dict(BASE), {}, tuple(Axis((path,), column) for path, column in columns.items()), "zip")
    keys = case_keys(own, "kin").tolist()
    assert case_keys(points, "kin").tolist() == keys
    assert case_keys(own, "kin", 5).tolist() == keys[5:]
    alone = Study("toy", "", BASE | {path: float(column[6]) for path, column in columns.items()}, {})
    assert case_keys(alone, "kin").tolist() == [keys[6]]


def test_the_stored_text_gives_an_equal_study_also_with_many_draws() -> None:
    rng = np.random.default_rng(1)
    for spread in (SPREAD, Spread(SPREAD.tolerances, rng.normal(1.0, 0.1, (700, 3)), SPREAD.about)):
        own = study(spread)
        again = Study.from_text(own.to_text())
        assert again == own
        assert Study.from_json(json.loads(json.dumps(own.to_json()))) == own
        assert again.physics_hash("1") == own.physics_hash("1")


def test_the_hash_covers_the_draws_and_a_study_without_tolerances_has_no_trace_of_them() -> None:
    other = Spread(SPREAD.tolerances, DRAWS + np.array([[0.0, 0.0, 0.0], [0.0, 1e-16, 0.0], [0.0, 0.0, 1e-15]]))
    assert study(other).physics_hash("1") != study(Spread(SPREAD.tolerances, DRAWS)).physics_hash("1")
    plain = without_drives(study())
    assert "spread" not in plain.to_json()
    assert plain == Study("toy", "s", dict(BASE), {}, (Axis(("load",), [0.0, 0.2, 0.4]),))
    assert without_drives(study(combine="zip")).axes == plain.axes


@pytest.mark.parametrize(
    ("axes", "spread"),
    [
        ((Axis((DRIVE,), [0.0, 1.0]),), None),
        ((Axis(("load",), [0.0, 1.0]),), SPREAD),
        ((Axis((DRIVE,), [0.0, 4.0]),), SPREAD),
        ((Axis((DRIVE,), [0.0, 0.5]),), SPREAD),
        ((Axis((DRIVE,), [0.0, 1.0]),), Spread([Tolerance("x", ("x",), "scale")], [[1.0]])),
    ],
)
def test_inconsistent_drives_are_refused(axes: tuple[Axis, ...], spread: Spread | None) -> None:
    with pytest.raises(ValueError, match=r"drive|toleran"):
        Study("toy", "s", dict(BASE), {}, axes, spread=spread)


@pytest.mark.parametrize(
    ("tolerances", "draws"),
    [
        ([], []),
        ([Tolerance("a", ("a",), "scale")], [[np.nan]]),
        ([Tolerance("a", ("a",), "scale")], [[1.0, 2.0]]),
        ([Tolerance("a", ("a",), "scale"), Tolerance("b", ("a",), "scale")], [[1.0, 2.0]]),
    ],
)
def test_a_spread_needs_one_finite_draw_of_each_tolerance(
    tolerances: list[Tolerance], draws: list[list[float]]
) -> None:
    with pytest.raises(ValueError, match=r"draw|toleranc"):
        Spread(tolerances, draws)


@pytest.mark.parametrize("combine", ["grid", "zip"])
def test_coarse_to_fine_is_the_nominal_drive_first_and_then_all_places_of_ever_more_drives(combine: Combine) -> None:
    drives = 20
    many = Spread([Tolerance("b", ("b",), "scale")], np.linspace(0.9, 1.1, drives)[:, None])
    own = study(many, combine=combine)
    order = order_of(own)
    cases = order.cases(np.arange(own.cases))
    assert sorted(cases.tolist()) == list(range(own.cases))
    np.testing.assert_array_equal(order.positions(cases), np.arange(own.cases))
    columns = own.columns(cases)
    ends = list(order.passes)
    # Two passes of the nominal drive over the three loads, then 1, 2, 4, 8, 16, 20 drives at every load.
    assert ends == [2, 3, *(3 * (1 + count) for count in (1, 2, 4, 8, 16, 20))]
    assert (columns[DRIVE][:3] == 0).all()
    for end, count in zip(ends[2:], (1, 2, 4, 8, 16, 20), strict=True):
        done = {(load, drive) for load, drive in zip(columns["load"][:end], columns[DRIVE][:end], strict=True)}
        assert done == {(load, float(drive)) for load in (0.0, 0.2, 0.4) for drive in range(count + 1)}


def by_hand(one: Study, other: Study) -> list[tuple[int, int]]:
    """Pairs of cases with equal parameters, the first of each."""
    paths = sorted({*one.base} - {DRIVE})

    def rows(own: Study) -> list[tuple[float, ...]]:
        columns = own.columns(range(own.cases))
        full = [columns.get(path, np.full(own.cases, own.base[path])) for path in paths]
        return list(zip(*(column.tolist() for column in full), strict=True))

    first: dict[tuple[float, ...], int] = {}
    for case, row in enumerate(rows(other)):
        first.setdefault(row, case)
    return [(case, first[row]) for case, row in enumerate(rows(one)) if row in first]


def test_cases_are_shared_by_their_values_and_not_by_the_numbers_of_their_drives() -> None:
    own = study(derive={"a": "b + c"})
    mixed = Spread(SPREAD.tolerances, DRAWS[[2, 1, 0]], SPREAD.about)
    fewer = Spread(SPREAD.tolerances, DRAWS[:1])
    only_b = Spread([SPREAD.tolerances[1]], [[0.01], [0.5]])
    others = [
        study(mixed, derive={"a": "b + c"}),
        study(fewer, derive={"a": "b + c"}),
        study(mixed, derive={"a": "b + c"}, combine="zip"),
        study(only_b, derive={"a": "b + c"}),
        study(derive={"a": "b * c + 1"}),
        without_drives(own),
        taken(own, np.array([11, 5, 6], dtype=np.int64)),
    ]
    for other in others:
        assert kin_hash(own, "1") == kin_hash(other, "1")
        for new, old in ((own, other), (other, own)):
            ours, theirs = shared_cases(new, old)
            # A drive that scales the load 0 differs from the nominal one elsewhere, so no pair is ambiguous.
            assert list(zip(ours.tolist(), theirs.tolist(), strict=True)) == by_hand(new, old)
    assert len(by_hand(own, others[0])) == own.cases
    assert len(by_hand(own, others[5])) == 3


def test_the_span_of_a_study_covers_its_drives() -> None:
    own = study(derive={"a": "b + c"})
    columns = own.columns(range(own.cases))
    expected = {path: columns.get(path, np.array([BASE[path]])) for path in sorted(BASE)}
    np.testing.assert_array_equal(
        span(own), [[v.min() for v in expected.values()], [v.max() for v in expected.values()]]
    )
    for path in BASE:
        np.testing.assert_array_equal(distinct_values(own, path), np.unique(expected[path]))


def test_only_the_axes_are_involved_on_which_a_value_depends() -> None:
    own = study(derive={"a": "b + 1"})
    assert [axis.paths for axis in involved(own, ["a"]).axes] == [(DRIVE,)]
    assert [axis.paths for axis in involved(own, ["load"]).axes] == [("load",), (DRIVE,)]
    limited = replace(
        own,
        axes=(Axis(("limit",), [0.1, 0.2]), *own.axes),
        spread=Spread([Tolerance("limit = b", ("limit", "b"), "scale")], DRAWS[:, :1]),
    )
    part = involved(limited, ["a"])
    # The limit has no value in the base.
    assert part.spread is not None
    assert part.spread.paths == ("b",)
    np.testing.assert_array_equal(part.columns([2])["a"], 0.5 * 0.9 + 1)
    free = replace(own, spread=Spread([SPREAD.tolerances[2]], DRAWS[:, 2:]))
    assert involved(free, ["a"]).axes == ()
    assert [axis.paths for axis in involved(free, ["load"]).axes] == [("load",)]
