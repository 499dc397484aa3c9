"""Curves and answers of listed cases are of one machine each: compared with rows that are selected by hand."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.service.faults import SelectionError
from sprag_study.service.results.choice import Address, characteristic, curve_query, held
from sprag_study.service.results.curve_cases import draw, select
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.results.defaults import completed, main_query, no_curves
from sprag_study.service.results.key_answers import answers_query, find_answers
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.studies.records import CaseColumns

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag_study.service.results.key_answers import StudyAnswers
    from sprag_study.worker.study import Study

EXAMPLES = Path(__file__).parents[3] / "examples"
LOAD, FREQUENCY = "shaft.load", "excitation.frequency"


def results_of(study: Study, cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
    """Rows whose power tells the whole machine: each column counts, so that no mixture passes for one of them."""
    every = study.columns(cases)
    load = every.get(LOAD, np.zeros(len(cases)))
    other = sum((np.asarray(column) for path, column in every.items() if path != LOAD), np.zeros(len(cases)))
    values = {"shaft.speed.mean": other * (2.0 - load), "power.useful.mean": other * load * (2.0 - load)}
    empty = np.full(len(cases), np.nan)
    return CaseColumns(cases, ["ok"] * len(cases), {name: values.get(name, empty) for name in names}, [""] * len(cases))


def answers(study: Study) -> StudyAnswers:
    fetch = partial(results_of, study)
    return find_answers(study, answers_query(study), None, fetch)


def points(paths: Sequence[str], rows: Sequence[Sequence[object]]) -> dict[str, Any]:
    """The axis of a table as it is pasted."""
    return {"points": "\n".join(";".join(map(str, row)) for row in [paths, *rows])}


def table(spec: dict[str, Any], form: str) -> Study:
    """Loads of 20 and 25 Hz and a point, written in each form of listed cases."""
    loads, frequencies = [0.0, 0.2, 0.4, 0.6], ["20 Hz", "25 Hz"]
    rows = [[load, frequency] for frequency in frequencies for load in loads] + [[0.5, "22 Hz"]]
    axes: list[dict[str, Any]] = [{"path": FREQUENCY, "values": frequencies}, {"path": LOAD, "values": loads}]
    columns = [[row[0] for row in rows], [row[1] for row in rows]]
    point = {"combine": "zip", "axes": [{"path": FREQUENCY, "values": ["22 Hz"]}, {"path": LOAD, "values": [0.5]}]}
    parts: dict[str, dict[str, Any]] = {
        "points": {"axes": [points([LOAD, FREQUENCY], rows)]},
        "zip": {
            "combine": "zip",
            "axes": [{"path": LOAD, "values": columns[0]}, {"path": FREQUENCY, "values": columns[1]}],
        },
        "union": {"combine": "union", "axes": [{"combine": "grid", "axes": axes}, point]},
        # One frequency is written in another unit, so that it differs in its last digits.
        "units": {"axes": [points([LOAD, FREQUENCY], [
            (load, "1200 rpm" if (load, frequency) == (0.4, "20 Hz") else frequency) for load, frequency in rows
        ])]},
    }  # fmt: skip
    return parse_spec({**spec, "combine": "grid", **parts[form]}).study


@pytest.mark.parametrize("form", ["points", "zip", "union", "units"])
def test_answers_of_a_table_are_of_one_machine_each(spec: dict[str, Any], form: str) -> None:
    study = table(spec, form)
    columns = study.columns(range(study.cases))
    every = answers(study)
    assert [one.line.by[FREQUENCY] for one in every.curves] == pytest.approx([20.0, 22.0, 25.0])
    assert [len(one.line.cases) for one in every.curves] == [4, 1, 4]
    for one in every.curves:
        own = np.flatnonzero(np.isclose(columns[FREQUENCY], one.line.by[FREQUENCY], rtol=1e-6))
        assert sorted(one.line.cases.tolist()) == own.tolist()
        assert list(one.line.x) == sorted(columns[LOAD][own])
        rows = results_of(study, own, ["power.useful.mean", "shaft.speed.mean"])
        best = int(np.argmax(rows.values["power.useful.mean"]))
        power = next(item for item in one.answers if item.answer.name == "largest_power")
        assert (power.value, power.case) == (rows.values["power.useful.mean"][best], own[best])
        no_load = next(item for item in one.answers if item.answer.name == "no_load_speed")
        at_zero = own[columns[LOAD][own] == 0.0]
        assert no_load.case == (at_zero[0] if at_zero.size else None)
        if no_load.value is not None:
            assert no_load.value == pytest.approx(2.0 * one.line.by[FREQUENCY])
        assert {item.case for item in one.working_point if item.case is not None} <= set(own.tolist())


def test_a_curve_whose_machine_is_not_named_is_asked_for(spec: dict[str, Any]) -> None:
    """Of many machines some are drawn first; a request that names none gets the question."""
    rows = [[load, f"{20 + k} Hz"] for k in range(12) for load in (0.0, 0.3, 0.6)]
    study = parse_spec({**spec, "axes": [points([LOAD, FREQUENCY], rows)]}).study
    with pytest.raises(SelectionError, match=f"of which {FREQUENCY} should the curve be") as caught:
        select(study, completed(study, LOAD, (), (), ()))
    (fault,) = caught.value.faults
    assert (fault.code, fault.where, fault.unit) == ("not-fixed", "at", "Hz")
    main = main_query(study)
    assert main is not None
    assert (main.x, main.by, len(main.of)) == (LOAD, (FREQUENCY,), 6)
    assert {len(one.line.cases) for one in answers(study).curves} == {3}
    # What a page is not asked for, it holds at a value that it shows.
    page = curve_query(study, Address(f"x={LOAD}"))
    assert page is not None
    (line,) = select(study, page).lines
    assert [path for path, _ in page.at] == [FREQUENCY]
    assert {study.case_parameters(case)[FREQUENCY] for case in line.cases.tolist()} == {line.at[FREQUENCY]}


def test_freewheels_of_a_catalogue_are_not_mixed(spec: dict[str, Any]) -> None:
    """Three freewheels that differ in two columns, by four loads; then each with one load only."""
    wheels, loads = [(1.0, 100.0), (2.0, 80.0), (4.0, 140.0)], [0.0, 0.1, 0.2, 0.3]
    paths = [LOAD, "pendulums.0.backlash", "pendulums.0.mass"]
    rows = [[load, f"{1e-3 * backlash} rad", mass] for backlash, mass in wheels for load in loads]
    study = parse_spec({**spec, "axes": [points(paths, rows)]}).study
    curves = answers(study).curves
    assert [(round(1e3 * one.line.by[paths[1]]), one.line.by[paths[2]]) for one in curves] == wheels
    assert [one.line.cases.tolist() for one in curves] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11]]
    alone = parse_spec({**spec, "axes": [points(paths, [rows[1], rows[6], rows[11]])]}).study
    assert [one.line.cases.tolist() for one in answers(alone).curves] == [[0], [1], [2]]
    for one in answers(alone).curves:
        assert not any(item.interpolated for item in one.working_point)


def test_cases_that_lie_on_no_curve_have_none(spec: dict[str, Any]) -> None:
    """A sample of machines: its extremes are those of all cases, and each has the parameters of its case."""
    sample = {"paths": [LOAD, FREQUENCY], "low": [0, "20 Hz"], "high": [1, "30 Hz"]}
    axes = [{"sample": "sobol", "count": 16, "ranges": [
        {"path": path, "from": low, "to": high} for path, low, high in zip(*sample.values(), strict=True)
    ]}]  # fmt: skip
    study = parse_spec({**spec, "axes": axes}).study
    assert main_query(study) is None
    assert characteristic(study) is None
    assert answers(study).curves == ()
    assert no_curves(study).startswith("No two cases of this study differ in one parameter only")
    with pytest.raises(SelectionError, match="so there is no curve"):
        completed(study, None, (), (), ())
    with pytest.raises(SelectionError, match="should the curve be"):
        select(study, CurveQuery(LOAD, ("shaft.speed.mean",)))
    # Each is a curve of its own where it is named.
    named = select(study, CurveQuery(LOAD, ("shaft.speed.mean",), (FREQUENCY,)))
    assert sorted(line.cases.size for line in named.lines) == [1] * 16


def test_held_columns_have_values_that_occur_together(spec: dict[str, Any]) -> None:
    """Masses and frequencies of a table: what a comparison holds is one of its machines."""
    rng = np.random.default_rng(5)
    pairs = [(f"{20 + k} Hz", float(mass)) for k, mass in enumerate(rng.permutation(12) + 1)]
    rows = [[load, frequency, mass] for frequency, mass in pairs for load in (0.0, 0.4)]
    paths = [LOAD, FREQUENCY, "pendulums.0.mass"]
    study = parse_spec({**spec, "axes": [points(paths, rows)]}).study
    at = held(study, [], (LOAD,))
    (line,) = select(study, CurveQuery(LOAD, ("shaft.speed.mean",), at=at)).lines
    assert (line.cases.size, set(line.at)) == (2, set(paths[1:]))
    main = main_query(study)
    assert main is not None
    drawn = draw(select(study, replace(main, y=("shaft.speed.mean",))), partial(results_of, study))
    for curve in drawn.curves:
        machines = {tuple(study.case_parameters(case)[path] for path in paths[1:]) for case in curve.line.cases}
        assert len(machines) == 1


def test_a_machine_shaft_of_two_columns() -> None:
    """Points of a machine shaft: the inertia and the speed of three shafts by two constants."""
    press = tomllib.loads((EXAMPLES / "press.toml").read_text("utf-8"))
    paths = ["drive.inertia", "mean_speed"]
    rows = [[inertia, speed] for speed in (10, 12) for inertia in (1, 2, 4)] + [[3, 11]]
    study = parse_spec({**press, "axes": [points(paths, rows)]}).study
    query = main_query(study)
    assert query is not None
    lines = select(study, query).lines
    assert sorted(case for line in lines for case in line.cases.tolist()) == list(range(7))
    (other,) = {*paths} - {query.x}
    for line in lines:
        assert {study.case_parameters(case)[other] for case in line.cases.tolist()} == {line.by[other]}


def test_a_value_that_no_case_has_is_refused_with_each_value_once(spec: dict[str, Any]) -> None:
    study = table(spec, "points")
    query = CurveQuery(LOAD, ("shaft.speed.mean",), (), ((FREQUENCY, "23 Hz"),))
    with pytest.raises(SelectionError) as refused:
        select(study, query)
    assert refused.value.faults[0].allowed == "20.0, 22.0, 25.0"
