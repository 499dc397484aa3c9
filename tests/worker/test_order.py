"""The order of cases, coarse to fine: against sets and products that are written out."""

from __future__ import annotations

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sprag_study.worker.order import coverage, levels, levels_of, order_of
from sprag_study.worker.study import Axis, Study


def study_of(*axes: list[float], combine: str = "grid") -> Study:
    paths = [f"shaft.path_{index}" for index in range(len(axes))]
    made = tuple(Axis((path,), tuple(map(float, values))) for path, values in zip(paths, axes, strict=True))
    return Study("vibration-drive", "", dict.fromkeys(paths, 0.0), {}, made, combine)  # type: ignore[arg-type]


def values(count: int) -> st.SearchStrategy[list[float]]:
    return st.lists(st.integers(-1000, 1000).map(float), min_size=1, max_size=count, unique=True)


grids = st.lists(values(9), min_size=1, max_size=4).map(lambda axes: study_of(*axes))


def test_the_passes_of_seventeen_values_are_every_sixteenth_eighth_and_so_on() -> None:
    found = levels(17)
    for level, step in enumerate((16, 8, 4, 2, 1)):
        assert np.flatnonzero(found <= level).tolist() == list(range(0, 17, step))


@given(count=st.integers(1, 3000))
def test_every_pass_has_both_ends_and_gaps_that_differ_by_one_at_most(count: int) -> None:
    found = levels(count)
    assert found.min() == 0
    assert found[0] == found[-1] == 0
    for level in range(int(found.max()) + 1):
        gaps = np.diff(np.flatnonzero(found <= level))
        assert gaps.size == min(2**level, count - 1)
        assert gaps.size == 0 or gaps.max() - gaps.min() <= 1


@given(study=grids)
def test_positions_and_cases_are_one_to_one(study: Study) -> None:
    order, every = order_of(study), np.arange(study.cases)
    cases = order.cases(every)
    assert sorted(cases.tolist()) == every.tolist()
    assert (order.positions(cases) == every).all()
    # Chunk by chunk it is the same as at once.
    assert [order.cases(np.arange(at, min(at + 7, study.cases))).tolist() for at in range(0, study.cases, 7)] == [
        cases[at : at + 7].tolist() for at in range(0, study.cases, 7)
    ]


@given(study=grids)
def test_every_pass_is_the_complete_grid_of_fewer_values_ends_included(study: Study) -> None:
    order = order_of(study)
    assert order.passes[-1] == study.cases
    assert list(order.passes) == sorted(set(order.passes))
    for size in order.passes:
        done = order.cases(np.arange(size))
        columns = list(study.columns(done).values())
        kept = [sorted(set(column.tolist())) for column in columns]
        assert set(zip(*(column.tolist() for column in columns), strict=True)) == set(itertools.product(*kept))
        assert coverage(order, size).values == tuple(map(len, kept))
        for axis, chosen in zip(study.axes, kept, strict=True):
            assert {min(axis.values), max(axis.values)} <= set(chosen)


@given(study=grids, data=st.data())
def test_between_two_passes_nothing_of_a_later_one_is_run(study: Study, data: st.DataObject) -> None:
    order = order_of(study)
    done = data.draw(st.integers(0, study.cases))
    prefix = set(order.cases(np.arange(done)).tolist())
    whole = coverage(order, done).complete
    reached = order.passes[min(whole, len(order.passes) - 1)]
    assert prefix <= set(order.cases(np.arange(reached)).tolist())
    assert whole == 0 or set(order.cases(np.arange(order.passes[whole - 1])).tolist()) <= prefix


@settings(max_examples=50)
@given(first=values(30), data=st.data())
def test_cases_written_out_are_run_once_each_and_a_line_coarse_to_fine(first: list[float], data: st.DataObject) -> None:
    second = data.draw(st.lists(st.integers(-5, 5).map(float), min_size=len(first), max_size=len(first)))
    study = study_of(first, second, combine="zip")
    order, every = order_of(study), np.arange(study.cases)
    assert sorted(order.cases(every).tolist()) == every.tolist()
    assert (order.cases(order.positions(every)) == every).all()
    line = order_of(study_of(first, first, combine="zip"))
    for size in line.passes:
        chosen = np.sort(np.argsort(np.argsort(first))[line.cases(np.arange(size))])
        assert np.ptp(np.diff(chosen)) <= 1 if size > 2 else chosen.tolist() == sorted({0, len(first) - 1})


def test_a_grid_with_gaps_that_is_written_out_goes_like_the_grid() -> None:
    whole = study_of([0.0, 1.0, 2.0, 3.0, 4.0], [10.0, 20.0, 30.0])
    kept = [case for case in range(whole.cases) if case not in {0, 7, 14}]
    columns = whole.columns(kept)
    listed = order_of(study_of(*(column.tolist() for column in columns.values()), combine="zip"))
    for size, full in zip(listed.passes, order_of(whole).passes, strict=True):
        grid = set(order_of(whole).cases(np.arange(full)).tolist())
        assert {kept[case] for case in listed.cases(np.arange(size)).tolist()} == grid & set(kept)


def test_equal_numbers_of_a_list_have_one_level_and_a_study_without_axes_one_case() -> None:
    assert levels_of(np.array([3.0, 1.0, 3.0, 2.0])).tolist() == [0, 0, 0, 1]
    alone = order_of(study_of())
    assert (alone.passes, alone.cases(np.arange(1)).tolist(), alone.positions(np.arange(1)).tolist()) == (
        (1,),
        [0],
        [0],
    )


def test_a_chunk_of_the_largest_grid_is_arithmetic() -> None:
    side = [float(value) for value in range(215)]
    study = study_of(side, side, side)
    order = order_of(study)
    positions = np.array([0, 1, 7, 8, 26, 27, study.cases // 2, study.cases - 1])
    assert order.passes[:2] == (8, 27)
    assert (order.positions(order.cases(positions)) == positions).all()
    assert {order.cases(np.arange(8))[k] for k in range(8)} == {
        (a * 215 + b) * 215 + c for a, b, c in itertools.product((0, 214), repeat=3)
    }
