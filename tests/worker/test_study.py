"""Numbering of cases, columns, selection and the hash of a study."""

from __future__ import annotations

import itertools
import json
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sprag_study.worker.derived import distinct_values, involved
from sprag_study.worker.limits import MAX_AXES, MAX_CASES
from sprag_study.worker.study import Axis, Study

RUN = {
    "duration": [60.0, "periods"],
    "window": [[40.0, "periods"], [60.0, "periods"]],
    "tolerance": 1e-9,
    "reset": "contact",
}
BASE = {"a": 1.0, "b": 2.0, "c": 3.0, "d": 4.0}


def study(*axes: Axis, combine: str = "grid", **changes: object) -> Study:
    given = {"model": "m", "name": "n", "base": BASE, "run": RUN, "axes": axes, "combine": combine} | changes
    return Study(**given)  # type: ignore[arg-type]


def told_apart(items: list[float]) -> bool:
    """Whether no two values are taken for one (`sprag_study.worker.study.SAME_VALUE`)."""
    return not any(math.isclose(a, b, rel_tol=2e-9) for a, b in itertools.pairwise(sorted(items)))


values = st.lists(st.floats(-1e6, 1e6).map(lambda x: x + 0.0), min_size=1, max_size=5, unique=True).filter(told_apart)


@st.composite
def grids(draw: st.DrawFn) -> Study:
    lists = draw(st.lists(values, max_size=4))
    return study(*(Axis((f"x{i}", f"tied{i}"), tuple(items)) for i, items in enumerate(lists)))


@st.composite
def zips(draw: st.DrawFn) -> Study:
    length = draw(st.integers(1, 6))
    column = st.lists(st.sampled_from([0.0, 1.0, -2.5, 1e-3]), min_size=length, max_size=length)
    lists = draw(st.lists(column, min_size=1, max_size=4))
    return study(*(Axis((f"x{i}",), tuple(items)) for i, items in enumerate(lists)), combine="zip")


def rows(of: Study) -> list[tuple[float, ...]]:
    """Every case's axis values, without the code under test."""
    lists = [axis.values for axis in of.axes]
    return list(itertools.product(*lists)) if of.combine == "grid" else list(zip(*lists, strict=True))


@given(st.one_of(grids(), zips()))
def test_cases_follow_itertools(of: Study) -> None:
    expected = rows(of)
    assert of.cases == len(expected)
    columns = of.columns(range(of.cases))
    for index, axis in enumerate(of.axes):
        for path in axis.paths:
            assert columns[path].tolist() == [row[index] for row in expected]
    for case, row in enumerate(expected):
        parameters = of.case_parameters(case)
        assert list(parameters) == list(of.axis_paths)
        assert [parameters[axis.paths[0]] for axis in of.axes] == list(row)
    assert list(of.values_with(range(of.cases))) == [of.case_parameters(case) for case in range(of.cases)]


@given(st.one_of(grids(), zips()), st.data())
def test_any_slice_of_columns_equals_the_whole(of: Study, data: st.DataObject) -> None:
    cases = data.draw(st.lists(st.integers(0, of.cases - 1), max_size=8))
    whole = of.columns(range(of.cases))
    for path, column in of.columns(cases).items():
        assert column.tolist() == whole[path][cases].tolist()
    first = data.draw(st.integers(0, of.cases - 1))
    for path, column in of.columns(range(first, of.cases)).items():
        assert column.tolist() == whole[path][first:].tolist()


@given(st.one_of(grids(), zips()), st.data())
def test_cases_at_finds_what_a_scan_finds(of: Study, data: st.DataObject) -> None:
    chosen = data.draw(st.lists(st.sampled_from(range(len(of.axes))), unique=True)) if of.axes else []
    fixed = {of.axes[i].paths[-1]: data.draw(st.sampled_from(of.axes[i].values)) for i in chosen}
    expected = [
        case
        for case in range(of.cases)
        if all(np.isclose(of.case_parameters(case)[path], value, rtol=1e-9, atol=0) for path, value in fixed.items())
    ]
    found = of.cases_at(fixed)
    assert found.dtype == np.int64
    assert found.tolist() == expected


@given(grids(), st.data())
def test_case_number_inverts_indices(of: Study, data: st.DataObject) -> None:
    case = data.draw(st.integers(0, of.cases - 1))
    indices = [int(index[0]) for index in of.indices([case])]
    assert of.case_number(indices) == case


@given(st.one_of(grids(), zips()))
def test_json_and_pickle_give_an_equal_study(of: Study) -> None:
    assert Study.from_json(json.loads(json.dumps(of.to_json()))) == of
    assert Study.from_json(json.loads(json.dumps(of.to_json()))).physics_hash("1") == of.physics_hash("1")
    of.columns([0])  # fills the caches, which must not travel
    assert pickle.loads(pickle.dumps(of)) == of


@given(st.one_of(grids(), zips()))
def test_the_stored_text_gives_an_equal_study(of: Study) -> None:
    assert Study.from_text(of.to_text()) == of


def test_a_long_axis_is_stored_packed_and_read_in_either_form() -> None:
    of = study(Axis(("a",), np.linspace(0.0, 1.0, 100_000) / 7.0), Axis(("b",), (1.0, 2.0)))
    assert len(of.to_text()) < 1_100_000  # 2 MB as decimals
    for text in (of.to_text(), json.dumps(of.to_json())):  # the second as it was stored before
        assert Study.from_text(text) == of
        assert Study.from_text(text).physics_hash("1") == of.physics_hash("1")


def test_first_axis_varies_slowest() -> None:
    of = study(Axis(("a",), (1.0, 2.0)), Axis(("b", "c"), (10.0, 20.0, 30.0)))
    assert of.shape == (2, 3)
    assert of.columns(range(6))["a"].tolist() == [1, 1, 1, 2, 2, 2]
    assert of.columns(range(6))["c"].tolist() == [10, 20, 30, 10, 20, 30]
    assert of.case_parameters(4) == {"a": 2.0, "b": 20.0, "c": 20.0}
    assert of.axis_of("c") == 1
    assert of.axis_of("d") is None


def test_without_axes_there_is_one_case() -> None:
    of = study()
    assert (of.cases, of.shape, of.columns(range(1)), of.case_parameters(0)) == (1, (), {}, {})
    assert of.cases_at({"a": 1.0}).tolist() == [0]


def test_cases_at_looks_at_the_base_too() -> None:
    of = study(Axis(("a", "b"), (0.1 + 0.2, 0.7)))
    assert of.cases_at({"a": 0.3}).tolist() == [0]
    assert of.cases_at({"a": 0.3, "b": 0.3}).tolist() == [0]
    assert of.cases_at({"a": 0.3, "b": 0.7}).tolist() == []
    assert of.cases_at({"c": 3.0}).tolist() == [0, 1]
    assert of.cases_at({"c": 3.1}).tolist() == []
    assert of.cases_at({"a": float("nan")}).tolist() == []
    with pytest.raises(KeyError):
        of.cases_at({"nothing": 1.0})


def test_a_zip_may_repeat_values() -> None:
    of = study(Axis(("a",), (1.0, 1.0, 2.0)), Axis(("b",), (5.0, 6.0, 5.0)), combine="zip")
    assert of.cases_at({"a": 1.0}).tolist() == [0, 1]
    assert of.cases_at({"a": 1.0, "b": 5.0}).tolist() == [0]


@pytest.mark.parametrize("cases", [[-1], [6], range(5, 7)])
def test_a_case_that_does_not_exist(cases: list[int]) -> None:
    of = study(Axis(("a",), (1.0, 2.0)), Axis(("b",), (1.0, 2.0, 3.0)))
    with pytest.raises(IndexError, match=r"0 \.\. 5"):
        of.columns(cases)


@pytest.mark.parametrize("indices", [(0,), (2, 0), (0, -1)])
def test_a_position_that_does_not_exist(indices: tuple[int, ...]) -> None:
    with pytest.raises(IndexError):
        study(Axis(("a",), (1.0, 2.0)), Axis(("b",), (1.0, 2.0, 3.0))).case_number(indices)


def test_the_hash_is_of_the_physics() -> None:
    axis = Axis(("a",), (1.0, 2.0))
    hashed = study(axis).physics_hash("1")
    assert len(hashed) == 64
    assert study(axis, name="another").physics_hash("1") == hashed
    assert study(axis, base=dict(reversed(BASE.items()))).physics_hash("1") == hashed
    others = [
        study(axis).physics_hash("2"),
        study(axis, base=BASE | {"a": 1.0000000000000002}).physics_hash("1"),
        study(axis, run=RUN | {"tolerance": 1e-10}).physics_hash("1"),
        study(axis, combine="zip").physics_hash("1"),
        study(Axis(("b",), (1.0, 2.0))).physics_hash("1"),
        study(Axis(("a",), (2.0, 1.0))).physics_hash("1"),
    ]
    assert len({hashed, *others}) == 1 + len(others)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Axis((), (1.0,)),
        lambda: Axis(("a",), ()),
        lambda: Axis(("a",), (float("inf"),)),
        lambda: study(combine="product"),
        lambda: study(Axis(("a",), (1.0,)), Axis(("b", "a"), (1.0,))),
        lambda: study(Axis(("a",), (1.0,)), Axis(("b",), (1.0, 2.0)), combine="zip"),
        lambda: study(*(Axis((f"p{i}",), (1.0,)) for i in range(MAX_AXES + 1))),
        lambda: study(*(Axis((f"p{i}",), tuple(map(float, range(1000)))) for i in range(3))),
    ],
)
def test_contradictions_are_refused(make: object) -> None:
    with pytest.raises(ValueError, match=r".+"):
        make()  # type: ignore[operator]


def test_a_million_cases_cost_no_rows() -> None:
    side = tuple(map(float, range(1000)))
    of = study(Axis(("a",), side), Axis(("b",), side), Axis(("c",), side[:10]))
    assert of.cases == MAX_CASES
    assert of.case_parameters(of.cases - 1) == {"a": 999.0, "b": 999.0, "c": 9.0}
    assert of.cases_at({"a": 3.0, "c": 1.0})[:2].tolist() == [30001, 30011]


def test_derived_values_follow_from_those_of_the_case() -> None:
    made = study(
        Axis(("a",), (1.0, 2.0, 3.0)), Axis(("b",), (5.0, 6.0)), base={**BASE, "c": 5.0},
        derive={"c": "d + a^2", "d": "2*b"},
    )  # fmt: skip
    a, b = np.repeat([1.0, 2.0, 3.0], 2), np.tile([5.0, 6.0], 3)
    columns = made.columns(range(6))
    assert made.column_paths == ("a", "b", "c", "d")
    np.testing.assert_array_equal(columns["c"], 2.0 * b + a**2)
    np.testing.assert_array_equal(columns["d"], 2.0 * b)
    assert made.case_parameters(4) == {"a": 3.0, "b": 5.0, "c": 19.0, "d": 10.0}
    assert made.cases_at({"d": 12.0}).tolist() == [1, 3, 5]
    assert made.cases_at({"d": 12.0, "a": 2.0}).tolist() == [3]
    assert made.cases_at({"d": 11.0}).tolist() == []
    assert Study.from_json(json.loads(json.dumps(made.to_json()))) == made == Study.from_text(made.to_text())
    assert distinct_values(made, "c").tolist() == [11.0, 13.0, 14.0, 16.0, 19.0, 21.0]
    assert distinct_values(made, "d").tolist() == [10.0, 12.0]
    assert involved(made, ["d"]).axis_paths == ("b",)


def test_a_formula_is_part_of_the_hash_and_none_leaves_it_as_it_was() -> None:
    plain = study(Axis(("a",), (1.0, 2.0)))
    hashes = {made.physics_hash("1") for made in (plain, study(*plain.axes, derive={"b": "2*a"}))}
    assert len(hashes) == 2
    assert "derive" not in plain.to_json()


@pytest.mark.parametrize("derive", [{"a": "2*b"}, {"x": "2*b"}])
def test_a_path_on_an_axis_or_none_at_all_is_not_derived(derive: dict[str, str]) -> None:
    with pytest.raises(ValueError, match="derived path"):
        study(Axis(("a",), (1.0, 2.0)), derive=derive)
