"""Refined curves: drawn by default as they were asked for, with their error and their jumps, never across a jump."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.service.cli.shown import show_curves
from sprag_study.service.figures.curves import SCATTER, curves_figure
from sprag_study.service.figures.figure import BANDS, Figure, Line
from sprag_study.service.figures.svg import svg
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Reading
from sprag_study.service.reading.wording import percent
from sprag_study.service.report.document import report_of
from sprag_study.service.results.curve_cases import draw, select
from sprag_study.service.results.curves import CurveQuery, Curves
from sprag_study.service.results.defaults import completed, main_query
from sprag_study.service.results.key_answers import _Reader
from sprag_study.service.results.rounds import sentence
from sprag_study.service.storage.studies.records import CaseColumns, RoundProgress, RoundRecord
from sprag_study.service.views.library import Library
from sprag_study.worker import models
from sprag_study.worker.models.presentation import Answer
from sprag_study.worker.states import StudyState
from sprag_study.worker.study import Study
from tests.service.conftest import API, Service
from tests.service.figures.seen import seen
from tests.service.refined_study import EFFICIENCY, HALF_WIDTH, JUMP, SPEC, SPEED, TORQUE, ZONE, fetched, fill, study_of

WIDTH = 1.0 / 256.0


@pytest.fixture(scope="module")
def study() -> Study:
    return study_of()


def drawn(study: Study, done: int | None = None, **changes: Any) -> Curves:
    """The curves that are shown first, or changed ones."""
    query = main_query(study)
    assert query is not None
    return draw(select(study, replace(query, **changes)), fetched(study, done))


def lines_of(figure: Figure, result: str) -> list[Line]:
    return [line for panel in figure.panels for line in panel.lines if panel.y.name == result]


def test_the_first_curves_are_those_that_were_asked_for(study: Study) -> None:
    curves = drawn(study)
    assert (curves.selection.x, [info.name for info in curves.selection.results]) == ("shaft.load", [SPEED, EFFICIENCY])
    assert [curve.line.by for curve in curves.curves] == [{"excitation.frequency": f} for f in (20.0, 25.0)]
    for curve in curves.curves:
        assert np.all(np.diff(curve.line.x) > 0.0)
        assert (curve.line.x[0], curve.line.x[-1]) == (0.0, 1.0)
        assert len(curve.line.x) < 160


def test_a_fixed_axis_without_a_role_tells_curves_apart(study: Study) -> None:
    named = select(study, CurveQuery("shaft.load", (SPEED,)))
    assert [line.by for line in named.lines] == [{"excitation.frequency": f} for f in (20.0, 25.0)]
    held = select(study, CurveQuery("shaft.load", (SPEED,), at=(("excitation.frequency", "20 Hz"),)))
    assert [(line.by, line.at) for line in held.lines] == [({}, {"excitation.frequency": 20.0})]


def test_what_is_not_chosen_is_as_in_the_first_curves(study: Study) -> None:
    assert completed(study, None, (), (), ()) == main_query(study)
    only = completed(study, None, (TORQUE,), (), (("excitation.frequency", "20 Hz"),))
    assert (only.x, only.y, only.by) == ("shaft.load", (TORQUE,), ())


def test_each_curve_tells_its_error_and_its_jumps(study: Study) -> None:
    data = drawn(study, y=(SPEED, TORQUE)).to_json()
    assert data["error_asked"] == 0.01
    with_jump, smooth = data["curves"]
    for curve in (with_jump, smooth):
        assert curve["passed"]
        assert set(curve["error"]) == {SPEED}
        error = curve["error"][SPEED]
        assert error is not None
        assert 0.0 < error <= 0.01
    (jump,) = with_jump["jumps"]
    assert jump["low"] <= JUMP <= jump["high"] <= jump["low"] + 2.0 * WIDTH
    assert (jump["why"], jump["results"]) == ("steep", [SPEED])
    assert smooth["jumps"] == []


def test_curves_that_were_not_refined_say_nothing_of_errors() -> None:
    listed = replace(study_of(), plan=None)
    curves = draw(select(listed, CurveQuery("shaft.load", (SPEED,))), fetched(listed))
    assert "error_asked" not in curves.to_json()
    assert not {"error", "jumps", "passed"} & set(curves.to_json()["curves"][0])


def test_lines_break_where_a_jump_is_told(study: Study) -> None:
    curves = drawn(study)
    (jump,) = curves.to_json()["curves"][0]["jumps"]
    figure = curves_figure([("", curves)])
    broken, whole = lines_of(figure, SPEED)
    assert broken.stretches is not None
    assert [broken.x[part[[0, -1]]].tolist() for part in broken.stretches] == [[0.0, jump["low"]], [jump["high"], 1.0]]
    for line in (whole, *lines_of(figure, EFFICIENCY)):
        assert line.stretches is not None
        assert len(line.stretches) == 1
    curve = next(curve for curve in seen(svg(figure)).panels[0].curves if curve.name == "20")
    assert [part[[0, -1], 0].tolist() for part in curve.stretches] == [
        pytest.approx([0.0, jump["low"]], abs=2e-3), pytest.approx([jump["high"], 1.0], abs=2e-3)
    ]  # fmt: skip


def test_a_point_between_two_jumps_is_seen_in_the_browser_too(study: Study) -> None:
    curves = drawn(study, y=(SPEED,), by=(), at=(("excitation.frequency", "20"),))
    (curve,) = curves.curves
    assert curve.refined is not None
    joined = curve.refined.joined[SPEED].copy()
    joined[:2] = [False, False]
    alone = replace(curve, refined=replace(curve.refined, joined={SPEED: joined}))
    page = seen(svg(curves_figure([("", replace(curves, curves=(alone,)))]), cases="/studies/st_0/cases/"))
    assert {int(case) for case in curve.line.cases[:2]} <= set(page.panels[0].cases)


def test_no_line_of_another_result_crosses_a_jump_either(study: Study) -> None:
    figure = curves_figure([("", drawn(study, y=(TORQUE,)))])
    broken, whole = lines_of(figure, TORQUE)
    assert [len(line.stretches or ()) for line in (broken, whole)] == [2, 1]
    assert len(figure.panels[0].bands) == 1
    assert figure.below == ""


def test_jumps_are_marked_in_the_panels_of_their_results(study: Study) -> None:
    curves = drawn(study)
    (jump,) = curves.to_json()["curves"][0]["jumps"]
    figure = curves_figure([("", curves)])
    speed, efficiency = figure.panels
    assert [(band.low, band.high, band.colour) for band in speed.bands] == [
        (jump["low"], jump["high"], speed.lines[0].colour)
    ]
    assert efficiency.bands == ()
    shown = seen(svg(figure))
    assert shown.panels[0].bands == [pytest.approx((jump["low"], jump["high"]), abs=2e-3)]
    assert shown.texts.count(BANDS) == 1


def test_a_sentence_tells_how_right_the_curves_are(study: Study) -> None:
    told = curves_figure([("", drawn(study))]).below
    (jump,) = drawn(study).to_json()["curves"][0]["jumps"]  # none on the other curve; both are 1 N*m long
    share = percent((jump["high"] - jump["low"]) / 2.0)
    assert told.startswith(f"Within 1 % of the range, as asked, outside 1 jump ({share} of the axis) (estimate: ")
    smooth = drawn(study, y=(SPEED, TORQUE), by=(), at=(("excitation.frequency", "25"),))
    told = curves_figure([("", smooth)]).below
    assert told.startswith("Within 1 % of the range, as asked (estimate: ")
    assert told.endswith(f" No error was asked for {TORQUE}.")


def test_each_result_with_an_error_of_its_own_is_told_by_it(capsys: pytest.CaptureFixture[str]) -> None:
    errors = [{"result": SPEED, "error": "60 rpm"}, {"result": EFFICIENCY, "error": "4 %"}]
    study = study_of({**SPEC, "refine": {"results": [TORQUE, *errors], "error": "2 %"}})
    curves = drawn(study, y=(SPEED, EFFICIENCY, TORQUE))
    data = curves.to_json()
    rpm = np.pi / 30.0
    assert data["error_asked"] == 0.02
    assert data["errors_asked"] == {
        SPEED: {"value": pytest.approx(60.0 * rpm), "absolute": True},
        EFFICIENCY: {"value": 0.04, "absolute": False},
    }
    # The speed falls from 30 to 10 rad/s, at 20 Hz to 2 rad/s; lines over a parabola are off by a quarter at most.
    for curve, values in zip(data["curves"], (28.0, 20.0), strict=True):
        relative, absolute = curve["error"][SPEED], curve["error_absolute"][SPEED]
        assert relative is not None
        assert absolute == pytest.approx(values * relative)
        assert curve["error_absolute"][EFFICIENCY] == curve["error"][EFFICIENCY]
        assert absolute < 60.0 * rpm
    told = curves_figure([("", curves)]).below.said(Reading(study.model, Units({"rad/s": "rpm"})))
    torque, speed, efficiency = (
        told.index(text) for text in ("Largest clutch torque: ", "Mean shaft speed: ", "Efficiency: ")
    )
    assert torque < speed < efficiency
    assert told[torque:].startswith("Largest clutch torque: Within 2 % of the range, as asked (estimate: ")
    assert told[speed:].startswith("Mean shaft speed: Within 60 rpm, as asked, outside 1 jump (")
    assert told[efficiency:].startswith("Efficiency: Within 4 % of the range, as asked (estimate: ")
    show_curves(data)
    shown = capsys.readouterr().err
    assert f"error of {EFFICIENCY}: " in shown
    assert ", 4 % asked" in shown
    assert ", 6.2832 rad/s asked" in shown


def test_a_study_that_is_not_done_says_what_it_has_not_reached() -> None:
    study = study_of(rounds=2)
    told = curves_figure([("", drawn(study))]).below
    assert told.startswith("Not reached: ")
    assert told.endswith(", 1 % asked.")
    nothing = drawn(study, done=0)
    assert curves_figure([("", nothing)]).below == "The error is not known yet; 1 % of the range is asked."
    assert [curve["error"] for curve in nothing.to_json()["curves"]] == [{SPEED: None, EFFICIENCY: None}] * 2
    some = drawn(study, done=20)
    assert all(curve.refined is not None and len(curve.refined.x) == curve.run().size for curve in some.curves)


def test_the_answers_of_a_service(service: Service) -> None:
    study_id = service.submit(SPEC)
    fill(service, study_id)
    curves = service.get(f"/studies/{study_id}/curves")
    assert list(curves["results"]) == [SPEED, EFFICIENCY]
    assert [len(curve["jumps"]) for curve in curves["curves"]] == [1, 0]
    table = service.http.get(f"{API}/studies/{study_id}/curves", params={"format": "csv"}).text
    rows = list(csv.DictReader(io.StringIO(table)))
    (marked,) = [row for row in rows if row["not_joined"]]
    jump = curves["curves"][0]["jumps"][0]
    assert (float(marked["shaft.load"]), marked["not_joined"]) == (jump["low"], SPEED)
    sentence = service.get(f"/studies/{study_id}")["progress"]["rounds"]["sentence"]
    assert f"Cases are chosen in rounds: {sentence}." in service.http.get(f"/studies/{study_id}").text
    axes = service.get(f"/studies/{study_id}")["axes"]
    assert (axes[0]["values"], axes[0]["first"], axes[0]["last"]) == (2, 20.0, 25.0)
    assert (axes[1]["first"], axes[1]["last"]) == (0.0, 1.0)
    pictures, _ = report_of(Library(service.store), study_id).further
    told = [[len(curve.refined.jumps) if curve.refined else None for curve in part.curves] for part in pictures]
    assert told == [[1, 0]] * len(pictures)


def test_irregular_motion_is_a_line_with_a_band_on_every_front(
    service: Service, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = {**SPEC, "run": {}, "name": "Irregular"}
    study_id = service.submit(spec)
    fill(service, study_id)
    curves = service.get(f"/studies/{study_id}/curves")
    width = np.sqrt(2.0) * HALF_WIDTH
    for curve in curves["curves"]:
        (stretch,) = curve["irregular"]
        assert [stretch["low"], stretch["high"]] == pytest.approx(ZONE, abs=1.0 / 64.0)
        assert ZONE[0] < stretch["low"] < stretch["high"] < ZONE[1]
        assert stretch["half_widths"] == {EFFICIENCY: pytest.approx(width)}
        inside = [stretch["low"] <= x <= stretch["high"] for x in curve["x"]]
        assert curve["band"][EFFICIENCY] == [pytest.approx(width) if own else None for own in inside]
        assert curve["band"][SPEED] == [None] * len(inside)
        assert not any(jump["low"] >= stretch["low"] and jump["high"] <= stretch["high"] for jump in curve["jumps"])
    table = service.http.get(f"{API}/studies/{study_id}/curves", params={"format": "csv"}).text
    rows = list(csv.DictReader(io.StringIO(table)))
    marked = [row for row in rows if row["irregular"]]
    assert {row["irregular"] for row in marked} == {EFFICIENCY}
    assert {row["not_joined"] for row in marked} == {""}
    banded = [row for row in rows if row[f"{EFFICIENCY}.band"]]
    assert len(banded) == len(marked) + 2  # the last point of each stretch, too
    assert float(banded[0][f"{EFFICIENCY}.band"]) == pytest.approx(width)
    assert {row[f"{SPEED}.band"] for row in rows} == {""}
    study = study_of(spec)
    figure = curves_figure([("", drawn(study, y=(SPEED, EFFICIENCY, TORQUE)))])
    assert [[fill.listed for fill in panel.fills] for panel in figure.panels] == [[], [True, False], []]
    (fill_, _) = figure.panels[1].fills
    assert np.nanmax(fill_.high - fill_.low) == pytest.approx(2.0 * width)
    assert [np.nanmin(fill_.x), np.nanmax(fill_.x)] == pytest.approx(ZONE, abs=1.0 / 64.0)
    assert svg(figure).count(SCATTER) == 1
    share = percent(sum(own["irregular"][0]["high"] - own["irregular"][0]["low"] for own in curves["curves"]) / 2.0)
    assert f"Where the motion is irregular ({share} of the axis), results scatter around the line by" in figure.below
    # A result that was not asked for has no band: its lines end there.
    line = lines_of(figure, TORQUE)[1]
    assert line.stretches is not None
    assert all(not ZONE[0] < line.x[part[:-1]].mean() < ZONE[1] for part in line.stretches if part.size > 1)
    assert any(band.low < 0.7 < band.high for band in figure.panels[2].bands)
    show_curves(curves)
    assert f"{EFFICIENCY} within 0.071 of the line" in capsys.readouterr().err


def test_a_value_read_off_a_band_has_its_half_width() -> None:
    study = study_of({**SPEC, "run": {}})
    info = next(info for info in models.study_results(study) if info.name == EFFICIENCY)
    here = Answer("efficiency", "efficiency", EFFICIENCY, "here")
    curve = drawn(study).curves[0]
    inside, beside = (_Reader(study, curve, "shaft.load", load).read(here, info) for load in (0.7013, 0.5013))
    assert inside.half_width == pytest.approx(np.sqrt(2.0) * HALF_WIDTH)
    assert beside.half_width is None


def test_a_study_in_which_nothing_varies_has_no_first_curves(service: Service) -> None:
    spec = {name: value for name, value in SPEC.items() if name not in {"axes", "refine"}}
    answer = service.http.get(f"{API}/studies/{service.submit(spec)}/curves")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["code"] == "not-an-axis"


def test_a_sentence_says_when_the_bound_of_cases_ended_the_rounds() -> None:
    summary = {"kind": "refine", "asked": 0.01, "error": None, "passed": False}
    record = RoundRecord(1, range(3, 3), summary, datetime(2026, 1, 1, tzinfo=UTC))
    assert sentence(RoundProgress(record, 5, 3), StudyState.FINISHED) == (
        "1 round, error not known, asked 1 %, not reached with the cases allowed"
    )
    several = RoundRecord(1, range(3, 5), {**summary, "error": 0.021, "each": True}, record.planned_at)
    assert sentence(RoundProgress(several, 5, 9), StudyState.RUNNING) == (
        "round 2 of at most 5, largest error 2.1 times the one asked"
    )
    ended = RoundRecord(1, range(3, 3), {**summary, "error": 0.004, "passed": True}, record.planned_at)
    assert sentence(RoundProgress(ended, 5, 3), StudyState.FINISHED) == "1 round, error 0.4 %, asked 1 %"
    going = RoundRecord(1, range(3, 5), {**summary, "error": 0.021}, record.planned_at)
    assert (
        sentence(RoundProgress(going, 5, 9), StudyState.RUNNING) == "round 2 of at most 5, error now 2.1 %, asked 1 %"
    )


def test_the_best_values_of_a_search_have_their_units() -> None:
    summary = {"kind": "goal", "phase": "search", "generation": 1, "generations": 9, "feasible": 4, "polish": None}
    record = RoundRecord(1, range(3, 5), {**summary, "best": [51.28, 0.25]}, datetime(2026, 1, 1, tzinfo=UTC))
    told = sentence(RoundProgress(record, 9, 36), StudyState.RUNNING, ("rad/s", "1"))
    assert told == "generation 2 of 9, 4 feasible, best 51.3 rad/s / 0.25"
    assert told.said(Reading("vibration-drive", Units({"rad/s": "rpm"}))).endswith("best 490 rpm / 0.25")


def test_a_queued_study_waits_for_its_round() -> None:
    summary = {"kind": "refine", "asked": 0.01, "error": None, "passed": False}
    first = RoundRecord(0, range(3), summary, datetime(2026, 1, 1, tzinfo=UTC))
    assert sentence(RoundProgress(first, 5, 9), StudyState.QUEUED) == "waiting for round 1 of at most 5"
    assert (
        sentence(RoundProgress(first, 5, 9), StudyState.RUNNING)
        == "round 1 of at most 5, error not known yet, asked 1 %"
    )
    third = RoundRecord(2, range(5, 7), {**summary, "error": 0.021}, first.planned_at)
    assert (
        sentence(RoundProgress(third, 5, 9), StudyState.QUEUED)
        == "waiting for round 3 of at most 5, error now 2.1 %, asked 1 %"
    )


def test_curves_without_a_result_are_not_told_to_be_within_the_error(study: Study) -> None:
    def failing(cases: NDArray[np.int64], names: Sequence[str], lost: float = np.inf) -> CaseColumns:
        found = fetched(study)(cases, names)
        bad = study.columns(cases)["excitation.frequency"] < lost
        endings = ["diverged" if one else models.OK for one in bad.tolist()]
        return replace(found, endings=endings, values={n: np.where(bad, np.nan, v) for n, v in found.values.items()})

    query = main_query(study)
    assert query is not None
    none = draw(select(study, query), failing)
    assert [curve["passed"] for curve in none.to_json()["curves"]] == [True, True]  # nothing is left to refine
    told = curves_figure([("", none)]).below
    assert told == "No case has a result, so that there is no error; 1 % of the range is asked."
    one = draw(select(study, query), partial(failing, lost=22.5))
    told = curves_figure([("", one)]).below
    assert told.startswith("Within 1 % of the range, as asked")
    assert told.endswith(" 1 curve has no result.")
