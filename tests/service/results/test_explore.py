"""Selections, order and histograms of all cases, against what pandas finds in the same rows."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest

from sprag_study.service.faults import SelectionError
from sprag_study.service.figures.explore import explore_figure
from sprag_study.service.http.web.rows.lines import HEIGHT, TOP, lines_of
from sprag_study.service.results.explore import ExploreQuery, explore, explored_json, histogram, plan_of
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.rows.columns import RowColumns
from sprag_study.worker import models
from sprag_study.worker.study import Axis

if TYPE_CHECKING:
    from sprag_study.service.results.explore import Explored
    from sprag_study.worker.study import Study

AXES = [
    {"path": "shaft.load", "linspace": [0.0, 1.0, 11]},
    {"path": "excitation.frequency", "linspace": ["20 Hz", "30 Hz", 21]},
]
KINDS = (("ok", ""), ("ok", "windup_out_of_data"), ("chatter", ""))


@pytest.fixture
def study(spec: dict[str, Any]) -> Study:
    """Eleven loads at 21 frequencies."""
    return parse_spec({**spec, "axes": AXES, "run": {"until": "settled"}}).study


@pytest.fixture
def rows(study: Study) -> RowColumns:
    """Rows with equal values, gaps and every kind."""
    random = np.random.default_rng(3)
    cases = np.flatnonzero(random.random(study.cases) < 0.9).astype(np.int64)
    kind = random.integers(0, 3, cases.size).astype(np.int32)
    efficiency = np.round(random.random(cases.size), 2)
    efficiency[kind == 2] = np.nan
    regime = np.where(kind == 2, np.nan, random.integers(0, 2, cases.size))
    return RowColumns(cases, KINDS, kind, {"efficiency": efficiency, "regime": regime})


def frame(study: Study, rows: RowColumns) -> pd.DataFrame:
    kinds = [KINDS[kind] for kind in rows.kind]
    table = pd.DataFrame({"case": rows.cases, **study.columns(rows.cases), **rows.values})
    return table.assign(ending=[ending for ending, _ in kinds], flags=[flags for _, flags in kinds])


def found(study: Study, rows: RowColumns, *where: str, **query: Any) -> Explored:
    show = query.pop("show", ("efficiency", "shaft.load"))
    return explore(study, plan_of(study, ExploreQuery(where, show=show, **query)), rows)


def first(explored: Explored) -> list[int]:
    return explored.rows.cases[explored.order].tolist()


@pytest.mark.parametrize("sort", ["efficiency", "-efficiency", "case", "-case", "-excitation.frequency"])
@pytest.mark.parametrize("limit", [1, 7, 150, 1000])
def test_the_first_rows_are_those_of_pandas(study: Study, rows: RowColumns, sort: str, limit: int) -> None:
    shown = found(study, rows, "shaft.load <= 500 N*mm", "efficiency >= 0.25", sort=sort, limit=limit)
    table = frame(study, rows)
    chosen = table[(table["shaft.load"] <= 0.5) & (table["efficiency"] >= 0.25)]
    name, descending = sort.removeprefix("-"), sort.startswith("-")
    expected = chosen.sort_values(name, ascending=not descending, kind="stable")["case"].tolist()
    assert (shown.count, first(shown)) == (len(chosen), expected[:limit])


def test_cases_without_the_number_come_last(study: Study, rows: RowColumns) -> None:
    for sort in ("efficiency", "-efficiency"):
        shown = found(study, rows, sort=sort, limit=1000)
        own = shown.values["efficiency"][shown.order]
        missing = int(np.isnan(own).sum())
        assert missing > 5
        assert np.isnan(own[-missing:]).all()
        assert not np.isnan(own[:-missing]).any()


def test_the_rank_of_an_ending_stays_when_others_appear(study: Study, rows: RowColumns) -> None:
    """Tokens of pages have it, and a study that runs gets further endings."""
    fewer = replace(rows, kinds=KINDS[:2], kind=np.zeros_like(rows.kind))
    every, one = (set(found(study, each, sort="ending").keys.tolist()) for each in (rows, fewer))
    assert len(every) == 2
    assert one == {max(every)}  # "ok" comes after "chatter", also where no case ended so
    assert first(found(study, rows, sort="ending")) == first(found(study, rows, sort="ending", ending="chatter"))


def test_kinds_are_kept(study: Study, rows: RowColumns) -> None:
    table = frame(study, rows)
    info = models.regime_info(models.study_results(study))
    assert info is not None
    for query, kept in (
        ({"ending": "chatter"}, table["ending"] == "chatter"),
        ({"flag": "windup_out_of_data"}, table["flags"] == "windup_out_of_data"),
        ({"regime": info.categories[1]}, table["regime"] == 1.0),
    ):
        shown = found(study, rows, limit=1000, **query)
        assert first(shown) == table["case"][kept].tolist()
        assert shown.count > 3


def test_histograms_count_every_case_once(study: Study, rows: RowColumns) -> None:
    shown = found(study, rows, "shaft.load >= 0.35")
    drawn = histogram(shown.values["efficiency"], shown.selected, 10)
    assert drawn is not None
    known = rows.values["efficiency"][np.isfinite(rows.values["efficiency"])]
    counts = pd.cut(known, drawn["edges"], include_lowest=True, right=False).value_counts()
    assert sum(drawn["all"]) == known.size
    assert drawn["all"][:-1] == counts.tolist()[:-1]
    assert sum(drawn["selected"]) == int((shown.selected & np.isfinite(shown.values["efficiency"])).sum())
    assert histogram(np.full(3, np.nan), np.ones(3, dtype=bool)) is None
    alone = histogram(np.full(3, 2.0), np.array([True, False, True]))
    assert alone is not None
    assert (sum(alone["all"]), sum(alone["selected"])) == (3, 2)


@pytest.mark.parametrize("value", [0.0, 5e-324, 4.0 * np.pi, -1e18, 1e300])
def test_values_that_differ_by_rounding_are_one(value: float) -> None:
    values = value + np.spacing(value) * np.arange(3.0)
    drawn = histogram(values, np.array([True, False, True]))
    assert drawn is not None
    assert (sum(drawn["all"]), sum(drawn["selected"])) == (3, 2)
    assert np.all(np.diff(drawn["edges"]) > 0.0)


def test_points_of_the_picture_are_the_cases(study: Study, rows: RowColumns) -> None:
    shown = found(study, rows, "efficiency >= 0.5", sort="-efficiency", limit=5)
    figure = explore_figure(shown, "shaft.load", "efficiency")
    lines = {line.name: line for line in figure.panels[0].lines}
    top = lines["first in the table"]
    assert top.cases is not None
    assert sorted(top.cases.tolist()) == sorted(first(shown))
    assert sum(line.x.size for line in lines.values()) == int(np.isfinite(rows.values["efficiency"]).sum())
    with pytest.raises(SelectionError):
        explore_figure(shown, "torque.mean", "")


@pytest.mark.parametrize(
    ("query", "parameter", "code"),
    [
        (ExploreQuery(where=("shaft.load",)), "where", "invalid-text"),
        (ExploreQuery(where=("shaft.lod <= 1",)), "where", "unknown-name"),
        (ExploreQuery(where=("shaft.load <= 1 mm",)), "where", "wrong-unit"),
        (ExploreQuery(where=("pendulums.0.mass <= 1",)), "where", "unknown-name"),
        (ExploreQuery(where=("shaft.load <= 1",) * 41), "where", "too-many"),
        (ExploreQuery(ending="fine"), "ending", "invalid-choice"),
        (ExploreQuery(regime="calm"), "regime", "invalid-choice"),
        (ExploreQuery(flag="red"), "flag", "invalid-choice"),
        (ExploreQuery(sort="-regimes"), "sort", "unknown-name"),
        (ExploreQuery(show=("regime",)), "show", "unknown-name"),
    ],
)
def test_what_is_wrong_is_named(study: Study, query: ExploreQuery, parameter: str, code: str) -> None:
    with pytest.raises(SelectionError) as caught:
        plan_of(study, query)
    (fault,) = caught.value.faults
    assert (fault.where, fault.code) == (parameter, code)
    assert fault.allowed or fault.unit


def test_a_study_without_rows_has_no_cases(study: Study) -> None:
    nothing = {"efficiency": np.empty(0), "regime": np.empty(0)}
    empty = RowColumns(np.empty(0, np.int64), (), np.empty(0, np.int32), nothing)
    shown = found(study, empty, "efficiency >= 0.5", sort="-efficiency")
    assert (shown.known, shown.count, first(shown)) == (0, 0, [])
    assert explore_figure(shown).note


def test_lines_have_every_row_or_say_how_many_are_left_out(study: Study, rows: RowColumns) -> None:
    names = ("shaft.load", "efficiency")
    explored = found(study, rows, "shaft.load <= 0.5", sort="-efficiency", limit=5, show=names)
    shades = np.ones(rows.cases.size, dtype=np.int64)
    plot = lines_of(explored, (), (), shades, outside=True)
    assert plot is not None
    drawn = [case for case, _, _ in plot.lines]
    assert sorted(drawn) == rows.cases.tolist()
    assert {case for case, shade, _ in plot.lines if shade} == set(rows.cases[explored.selected].tolist())
    assert (drawn[-1], plot.left_out) == (first(explored)[0], 0)
    load = next(axis for axis in plot.axes if axis.name == "shaft.load")
    assert (load.ends[0], load.ends[2], load.range) == (0.0, 1.0, (TOP + HEIGHT, TOP + HEIGHT / 2))
    assert lines_of(found(study, rows, show=names[:1]), (), (), shades, outside=True) is None
    # Of many rows some evenly have lines, the first ones of the table among them.
    wide = replace(study, axes=(Axis(("shaft.load",), tuple(np.linspace(0.0, 1.0, 5_000).tolist())),))
    cases = np.arange(5_000)
    values = {"efficiency": cases % 7 / 7.0, "regime": np.ones(5_000)}
    many = RowColumns(cases, (("ok", ""),), np.zeros(5_000, dtype=np.int32), values)
    explored = found(wide, many, limit=10, show=names)
    plot = lines_of(explored, (), (), np.ones(5_000, dtype=np.int64), outside=False)
    assert plot is not None
    shown = {case for case, _, _ in plot.lines}
    assert plot.left_out == 5_000 - len(shown) > 3_000
    assert {*first(explored)} <= shown
    assert max(shown) > 4_900


def test_an_axis_of_several_parameters_is_asked_about_by_any_of_them(spec: dict[str, Any]) -> None:
    tied = {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "2 mm", "3 mm"]}
    study, second = parse_spec({**spec, "axes": [tied]}).study, "excitation.amplitude_y"
    rows = RowColumns(np.arange(3), KINDS[:1], np.zeros(3, dtype=np.int32), {})
    explored = found(study, rows, f"{second} >= 2 mm", sort=f"-{second}", show=(second,))
    assert first(explored) == [2, 1]
    assert [item["unit"] for item in explored_json("st_1", explored)["quantities"]] == ["m"]
