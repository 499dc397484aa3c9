"""Cases that two studies share, against a plain comparison of every case with every other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from sprag_study.worker import models
from sprag_study.worker.case_keys import case_keys
from sprag_study.worker.models.formulas import evaluate
from sprag_study.worker.reuse import Wanted, kin_hash, shared_cases, span, taken
from sprag_study.worker.study import Axis, Study
from tests.worker.fakes import BASE, RUN

PATHS = ("shaft.load", "excitation.frequency", "excitation.amplitude_x", "excitation.amplitude_y")
NUMBERS = (0.1, 2e-3, 3e-3, 25.0, 30.0)


@st.composite
def studies(draw: st.DrawFn) -> Study:
    """A small grid or zip over some of four paths, some of them tied, one perhaps derived; values often meet."""
    combine = draw(st.sampled_from(["grid", "zip"]))
    paths = draw(st.permutations(PATHS))
    cuts = sorted(draw(st.sets(st.integers(1, 4), max_size=3)))
    groups = [tuple(paths[a:b]) for a, b in zip([0, *cuts[:-1]], cuts, strict=True)] if cuts else []
    length = draw(st.integers(1, 4))
    axes = []
    for group in groups:
        values = draw(st.lists(st.sampled_from(NUMBERS), min_size=length, max_size=length, unique=combine == "grid"))
        axes.append(Axis(group, tuple(values)))
    study = Study("vibration-drive", "", dict(BASE), dict(RUN), tuple(axes), combine)  # type: ignore[arg-type]
    left = [path for path in PATHS if path not in study.axis_paths]
    if left and draw(st.booleans()):
        derive = {left[0]: draw(st.sampled_from([other for other in PATHS if other != left[0]]))}
        if draw(st.booleans()):
            derive = {path: f"0 * {other} + 25" for path, other in derive.items()}
        at_base = {path: float(column[0]) for path, column in evaluate(derive, BASE, {}, 1).items()}
        study = replace(study, base=BASE | at_base, derive=derive)
    # A zip that repeats a case is refused by the spec.
    columns = replace(study, derive={}).columns(range(study.cases))
    rows = set(map(tuple, np.stack([*columns.values()], 1).tolist())) if axes else {()}
    return study if len(rows) == study.cases else replace(study, axes=(), combine="grid")


def parameters(study: Study, case: int) -> dict[str, float]:
    return {**study.base, **study.case_parameters(case)}


@given(studies(), studies())
@settings(max_examples=100, deadline=None)
def test_the_cases_found_are_those_with_equal_parameters(new: Study, old: Study) -> None:
    expected = {
        (ours, theirs)
        for ours in range(new.cases)
        for theirs in range(old.cases)
        if parameters(new, ours) == parameters(old, theirs)
    }
    ours, theirs = shared_cases(new, old)
    assert set(zip(ours.tolist(), theirs.tolist(), strict=True)) == expected
    assert ours.tolist() == sorted(ours.tolist())


@given(studies(), studies())
@settings(max_examples=100, deadline=None)
def test_cases_have_equal_keys_where_their_parameters_are_equal(new: Study, old: Study) -> None:
    ours, theirs = case_keys(new, "kin").tolist(), case_keys(old, "kin").tolist()
    for one, key in enumerate(ours):
        for other, other_key in enumerate(theirs):
            assert (key == other_key) == (parameters(new, one) == parameters(old, other))
    assert not {*ours}.intersection(case_keys(old, "another kin").tolist())


def test_zero_has_one_key() -> None:
    zero, negative = (replace(Study("m", "", {"a": value, "b": 1.0}, {}), name=str(value)) for value in (0.0, -0.0))
    swapped = Study("m", "", {"a": 1.0, "b": 0.0}, {})
    assert case_keys(zero, "kin") == case_keys(negative, "kin") != case_keys(swapped, "kin")


@given(studies(), st.lists(studies(), min_size=1, max_size=4))
@settings(max_examples=60, deadline=None)
def test_no_study_is_ruled_out_that_has_a_case(new: Study, others: list[Study]) -> None:
    wanted = Wanted(new)
    may = wanted.may_share(np.stack([span(other) for other in others]))
    for other, possible in zip(others, may.tolist(), strict=True):
        ours = {tuple(sorted(parameters(new, case).items())) for case in range(new.cases)}
        shares = any(tuple(sorted(parameters(other, case).items())) in ours for case in range(other.cases))
        assert possible or not shares
        if (
            not (new.derive or other.derive)
            and other.cases == 1
            and new.combine == "grid"
            and all(len(axis.paths) == 1 for axis in new.axes)
        ):
            assert possible == shares
        found, _ = shared_cases(wanted, other)
        assert bool(found.size) == shares


@given(studies(), st.data())
@settings(max_examples=100, deadline=None)
def test_a_study_of_chosen_cases_has_their_parameters(study: Study, data: st.DataObject) -> None:
    if not study.axes:
        return
    cases = data.draw(st.lists(st.integers(0, study.cases - 1), min_size=1, unique=True))
    part = taken(study, np.array(cases))
    assert [parameters(part, index) for index in range(part.cases)] == [parameters(study, case) for case in cases]
    assert models.shape_of(part) == models.shape_of(study)


def test_large_grids_share_what_they_share() -> None:
    def grid(loads: range) -> Study:
        axes = (
            Axis(("shaft.load",), tuple(load / 7.0 for load in loads)),
            Axis(("excitation.frequency",), tuple(map(float, range(10, 410)))),
        )
        return Study("vibration-drive", "", dict(BASE), dict(RUN), axes)

    ours, theirs = shared_cases(grid(range(500, 1500)), grid(range(1000)))
    assert ours.size == 500 * 400
    np.testing.assert_array_equal(theirs, ours + 500 * 400)


def test_many_zipped_columns_do_not_overflow() -> None:
    random = np.random.default_rng(1)
    paths = [path for path in BASE if path not in PATHS]
    axes = tuple(Axis((path,), tuple(random.uniform(1.0, 2.0, 5000).tolist())) for path in (*PATHS, *paths))
    study = Study("vibration-drive", "", dict(BASE), dict(RUN), axes, "zip")
    order = random.permutation(5000)
    shuffled = taken(study, order)
    ours, theirs = shared_cases(shuffled, study)
    np.testing.assert_array_equal(ours, np.arange(5000))
    np.testing.assert_array_equal(theirs, order)


def test_it_is_values_that_are_shared_and_not_formulas() -> None:
    formula = {"shaft.load": "excitation.frequency / 100"}
    frequencies = Axis(("excitation.frequency",), np.linspace(10.0, 20.0, 11))
    base = BASE | {"shaft.load": BASE["excitation.frequency"] / 100}
    derived = Study("vibration-drive", "", base, dict(RUN), (frequencies,), derive=formula)
    loads = Axis(("shaft.load",), [0.1, 0.15, 0.3])
    grid = Study("vibration-drive", "", dict(BASE), dict(RUN), (frequencies, loads))
    assert kin_hash(grid, "1") == kin_hash(derived, "1")
    ours, theirs = shared_cases(derived, grid)
    assert (ours.tolist(), theirs.tolist()) == ([0, 5], [0, 16])
    other = replace(derived, derive={"shaft.load": "excitation.frequency / 50"})
    assert not shared_cases(derived, other)[0].size
    assert shared_cases(other, derived)[0].size == 0
    scaled = replace(derived, derive={"shaft.load": "0.02 * excitation.frequency / 2"})
    equal = scaled.columns(range(11))["shaft.load"] == derived.columns(range(11))["shaft.load"]
    np.testing.assert_array_equal(shared_cases(derived, scaled)[0], np.flatnonzero(equal))


def test_kin_depends_on_run_engine_and_parameters_but_not_on_values() -> None:
    study = Study("vibration-drive", "a", dict(BASE), dict(RUN))
    same = replace(study, name="b", base={**BASE, "shaft.load": 7.0}, axes=(Axis(("shaft.load",), (1.0, 2.0)),))
    assert kin_hash(study, "1") == kin_hash(same, "1")
    others = [
        kin_hash(study, "2"),
        kin_hash(replace(study, run={**RUN, "tolerance": 1e-8}), "1"),
        kin_hash(replace(study, base={**BASE, "pendulums.1.mass": 1.0}), "1"),
    ]
    assert len({kin_hash(study, "1"), *others}) == 4
