"""One rule of what counts: a motion that had not settled is a missing value wherever results are read."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.service.figures.curves import curves_figure, doubtful_marks
from sprag_study.service.report.content import ranges
from sprag_study.service.results.curve_cases import draw, draw_map, select
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.results.differences import differences
from sprag_study.service.results.joined import joined_points
from sprag_study.service.results.key_answers import answers_query, find_answers
from sprag_study.service.results.regimes import left_out
from sprag_study.service.results.sensitivity import sensitivity
from sprag_study.service.results.tolerances.batch import Asked
from sprag_study.service.results.tolerances.yields import yields
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.studies.records import CaseColumns, RowBlock
from sprag_study.worker import models
from sprag_study.worker.models.usable import against
from sprag_study.worker.planning.goals.plan import GoalPlan
from sprag_study.worker.planning.goals.robust import Table
from sprag_study.worker.planning.goals.scores import judge, outputs_of
from sprag_study.worker.planning.rounds import Rows
from tests.service import refined_study
from tests.service.conftest import Service
from tests.service.results.settled import flagged, settled
from tests.service.spec_sample import changed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

SPEED = "shaft.speed.mean"
DRIVE = "vibration-drive"


def test_a_row_counts_where_it_ended_ok_and_had_settled() -> None:
    endings = ["ok", "ok", "chatter", None, "ok", "ok"]
    flags = ["", "unsettled", "", "", "jumped,not_settled", "irregular,windup_out_of_data"]
    assert models.usable(DRIVE, endings, flags).tolist() == [True, False, False, False, False, True]
    assert models.usable(DRIVE, endings, []).tolist() == [True, True, False, False, True, True]
    assert models.usable("machine-shaft", ["ok", "motor_stalled"], ["", ""]).tolist() == [True, False]


def test_half_widths_count_against_every_limit() -> None:
    values, widths = np.array([5.0, 5.0, 5.0]), np.array([0.5, np.nan, 2.0])
    assert against("at_least", 4.6, values, widths).tolist() == [4.5, 5.0, 3.0]
    assert against("at_most", 5.4, values, widths).tolist() == [5.5, 5.0, 7.0]
    assert against("is", 6.0, values, widths).tolist() == [4.5, 5.0, 3.0]


def rows_of_drives(drives: int) -> tuple[NDArray[np.float64], NDArray[np.float64], list[str]]:
    """Speeds of all drives: of some the mean is known to a half width only, some had not settled."""
    rng = np.random.default_rng(11)
    speed = rng.normal(8.0, 1.0, 1 + drives)
    width = np.where(rng.random(1 + drives) < 0.4, rng.uniform(0.0, 1.5, 1 + drives), np.nan)
    flags = np.where(rng.random(1 + drives) < 0.2, "unsettled", np.where(np.isfinite(width), "irregular", ""))
    return speed, np.where(flags == "unsettled", np.nan, width), flags.tolist()


def test_the_yield_of_a_goal_is_that_of_the_command(spec: dict[str, Any]) -> None:
    """Same rows, same share, by hand too: what is unsettled, or not sure to hold, does not hold."""
    drives, least = 200, 7.5
    speed, width, flags = rows_of_drives(drives)
    by_hand = sum(
        flags[k] != "unsettled" and speed[k] - (0.0 if np.isnan(width[k]) else width[k]) >= least
        for k in range(1, 1 + drives)
    )
    spec |= {
        "run": {"until": "settled"}, "axes": [], "drives": drives,
        "tolerances": [{"path": "pendulums.0.mass", "plus_minus": "1 %"}],
    }  # fmt: skip
    study = parse_spec(spec).study

    def fetch(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        known = {SPEED: speed, f"{SPEED}.half_width": width, "regime": np.zeros(1 + drives)}
        columns = {name: known.get(name, np.full(1 + drives, np.nan))[cases] for name in names}
        return CaseColumns(cases, ["ok"] * len(cases), columns, [flags[case] for case in cases.tolist()])

    (line,) = yields(study, [f"{SPEED} >= {least} rad/s"], Asked(None, (), ()), 3, fetch).lines
    assert round(float(line.whole.value) * drives) == by_hand
    condition = {"result": SPEED, "at_least": least}
    plan = GoalPlan.from_json(goal_plan(best=[{"yield": [condition], "max": True}], drives=drives))
    rows = Rows(
        np.column_stack([np.ones(1 + drives), np.arange(1.0 + drives)]),
        models.usable(DRIVE, ["ok"] * (1 + drives), flags),
        {SPEED: speed, f"{SPEED}.half_width": width},
    )
    share = Table(plan, rows).values(plan.best[0])[0, 0]
    assert share * drives == pytest.approx(by_hand)
    assert 0 < by_hand < np.count_nonzero(speed[1:] >= least)


def goal_plan(**changes: Any) -> dict[str, Any]:
    plan: dict[str, Any] = {
        "vary": [{"paths": ["pendulums.0.mass"], "low": 0.1, "high": 1.0}],
        "best": [], "subject_to": [], "at": [{}], "over": "worst", "population": 4, "generations": 2, "seed": 0,
        "polish": False, "most_cases": 1000, "kind": "goal",
    }  # fmt: skip
    return plan | changes


def test_a_design_with_an_unsettled_case_is_not_feasible() -> None:
    limit = {"result": SPEED, "at_least": 5.0}
    plan = GoalPlan.from_json(goal_plan(best=[{"result": SPEED, "max": True}], subject_to=[limit]))
    rows = Rows(
        np.array([[0.2], [0.4], [0.6], [0.8]]),
        models.usable(DRIVE, ["ok"] * 4, ["", "unsettled", "irregular", "irregular"]),
        {SPEED: np.array([6.0, 9.0, 6.0, 6.0]), f"{SPEED}.half_width": np.array([np.nan, np.nan, 0.9, 1.1])},
    )
    scores = judge(plan, outputs_of(plan, rows))
    assert scores.feasible.tolist() == [True, False, True, False]
    assert scores.failed.tolist() == [False, True, False, False]
    # The goal itself is the mean.
    assert np.abs(scores.goals[[0, 2, 3], 0]).tolist() == [6.0, 6.0, 6.0]


def test_planners_are_told_what_counts(service: Service) -> None:
    study_id = settled(service)
    study, number = service.store.studies.study(study_id), service.store.studies.get(study_id).number
    rows = service.store.work.round_rows(number, study, range(4), [SPEED])
    assert rows.ok.tolist() == [True, True, False, False]
    width = service.store.rows.for_cases(study_id, range(4), [f"{SPEED}.half_width"]).values[f"{SPEED}.half_width"]
    np.testing.assert_array_equal(rows.values[f"{SPEED}.half_width"], width)


def test_curves_join_and_compare_what_counts(service: Service) -> None:
    study_id = flagged(service, {"duration": "60 periods"})
    study = service.store.studies.study(study_id)
    drawn = draw(select(study, CurveQuery("shaft.load", (SPEED,))), partial(service.store.rows.for_cases, study_id))
    (curve,) = drawn.curves
    joined = joined_points(curve, SPEED)
    assert joined is not None
    assert [part.tolist() for part in joined] == [[0], [1], [2]]
    (marks,) = curves_figure([("", drawn)]).panels[0].marks
    assert (marks.regime, np.asarray(marks.x).tolist()) == ("unsettled", [0.2, 0.7])
    (less,) = differences([("a", drawn), ("b", drawn)], 0)[0][1].curves
    assert np.isnan(less.y[SPEED]).tolist() == [False, True, True]
    body = service.get(f"/studies/{study_id}/curves", x="shaft.load", y=SPEED)
    assert body["curves"][0]["flags"] == [[], ["not_settled"], ["windup_out_of_data", "not_settled"]]
    table = service.http.get(f"/api/v1/studies/{study_id}/curves?x=shaft.load&y={SPEED}&format=csv").text
    assert [line.split(",")[-2] for line in table.splitlines()] == [
        "flags", "", "not_settled", "windup_out_of_data not_settled",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("run", "flag"), [({"until": "settled"}, "unsettled"), ({"duration": "9 periods"}, "not_settled")]
)
def test_maps_leave_blank_and_mark_what_does_not_count(run: dict[str, str], flag: str) -> None:
    axes = [{"path": "shaft.load", "values": [0.1, 0.2]}, {"path": "excitation.frequency", "values": [20, 25]}]
    study = parse_spec(changed({"/run": run, "/axes": axes})).study
    flags = ["", flag, "", "windup_out_of_data"]

    def fetch(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        known = {name: np.full(len(cases), 4.0) for name in names} | {SPEED: 1.0 + cases}
        if "regime" in names:
            known["regime"] = np.array([Regime.UNSETTLED if flags[case] == flag else Regime.PERIODIC for case in cases])
        return CaseColumns(cases, ["ok"] * len(cases), known, [flags[case] for case in cases.tolist()])

    drawn = draw_map(study, "shaft.load", "excitation.frequency", SPEED, (), fetch)
    assert drawn.known()[drawn.cases == 1].size == 1
    np.testing.assert_array_equal(np.isnan(drawn.known()), drawn.cases == 1)
    assert not np.isnan(drawn.values).any()
    (marks,) = doubtful_marks(drawn)
    assert (marks.regime, np.asarray(marks.cases).tolist()) == ("unsettled", [1])


def test_sensitivities_and_explore_leave_out_what_does_not_count(service: Service) -> None:
    study_id = flagged(service, {"duration": "60 periods"})
    study = service.store.studies.study(study_id)
    fetch = partial(service.store.rows.for_cases, study_id)
    (found,) = sensitivity(study, service.store.studies.spec(study_id), [SPEED], fetch)
    assert (found.cases, found.missing) == (1, 2)
    assert [note for note in found.notes if "left out" in note] == [left_out(2)], "told once"
    rows = service.get(f"/studies/{study_id}/explore", show=SPEED)["cases"]
    assert [row["results"][SPEED] is None for row in sorted(rows, key=lambda row: row["case"])] == [False, True, True]
    assert [row["flags"] for row in sorted(rows, key=lambda row: row["case"])][1] == ["not_settled"]


def test_a_refined_curve_is_resolved_without_unsettled_points() -> None:
    """Unsettled points beside a gap do not count as points of the curve."""
    study = refined_study.study_of()
    query = CurveQuery("shaft.load", (refined_study.SPEED,), at=())
    selection = select(study, query)
    marked = selection.lines[0].cases[3]

    def fetch(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        columns = refined_study.fetched(study)(cases, names)
        return replace(columns, flags=["unsettled" if case == marked else "" for case in cases.tolist()])

    refined = draw(selection, fetch).curves[0].refined
    assert refined is not None
    assert np.flatnonzero(~refined.ok).tolist() == [3]
    assert np.isnan(refined.values[refined_study.SPEED][3])
    assert not refined.joined[refined_study.SPEED][2:4].any()


def test_what_a_shaft_needs_in_order_to_turn_counts_where_it_does_not() -> None:
    """The required inertia does not depend on the inertia that there is: 1 N*m over half a cycle, in closed form."""
    shaft = {
        "sprag": 1, "model": "machine-shaft",
        "base": {
            "cycle": "1 revolution", "mean_speed": "2 rad/s", "mean_speed_is": "midrange", "wanted_irregularity": 0.5,
            "drive": {"inertia": "5 kg*m^2"},
            "operation": {"quantity": "torque", "over": "angle", "steps": [{"from": 0, "to": "180 deg", "value": 2}]},
        },
        "axes": [{"path": "drive.inertia", "values": [0.1, 5]}],
    }  # fmt: skip
    study = parse_spec(shaft).study
    infos = models.study_results(study)
    batch = models.run_chunk(study, 0, 2)
    places = {info.name: place for place, info in enumerate(infos)}

    def fetch(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        values = {name: batch.values[cases][:, places[name]] for name in names}
        return CaseColumns(cases, [batch.endings[case] for case in cases.tolist()], values, [""] * len(cases))

    assert list(batch.endings) == ["inertia_insufficient", "ok"]
    query = CurveQuery("drive.inertia", ("required_inertia", "least_mean_speed", "irregularity"), (), ())
    (curve,) = draw(select(study, query), fetch).curves
    # Energy to be stored: 1 N*m over half a turn, pi J; pi/(delta omega^2) = pi/(0.5*4).
    assert curve.known("required_inertia") == pytest.approx([np.pi / 2.0, np.pi / 2.0], rel=1e-9)
    assert np.isfinite(curve.shown("least_mean_speed")).all()
    assert np.isnan(curve.known("irregularity")).tolist() == [True, False]
    answers = find_answers(study, answers_query(study), "0.1 kg*m^2", fetch).curves[0].answers
    (needed,) = (one for one in answers if one.answer.result == "required_inertia")
    assert needed.value == pytest.approx(np.pi / 2.0, rel=1e-9)
    block = RowBlock(infos, np.arange(2), list(batch.endings), ["", ""], batch.values)
    least = {one.info.name: one.least for one in ranges("machine-shaft", infos, [block])}
    assert least["required_inertia"] == pytest.approx(np.pi / 2.0, rel=1e-9)
    # Whether the machine works is another question.
    assert models.usable("machine-shaft", batch.endings, ["", ""]).tolist() == [False, True]
