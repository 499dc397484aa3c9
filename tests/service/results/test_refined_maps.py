"""Refined maps: squares of an even grid that are interpolated, and left blank where a jump is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.service.cli.shown import show_map
from sprag_study.service.faults import SelectionError
from sprag_study.service.figures.orders import map_edges
from sprag_study.service.figures.pictures import draw_map as paint_map
from sprag_study.service.figures.svg_map import map_svg
from sprag_study.service.report import Office, write_report
from sprag_study.service.report.document import made_document, report_of
from sprag_study.service.results.curve_cases import draw_map
from sprag_study.service.results.curves import Map
from sprag_study.service.storage.studies.records import CaseColumns
from sprag_study.service.views.curves import MapView
from sprag_study.service.views.library import Library
from sprag_study.service.views.study_questions import MapQuestion, ReportQuestion
from sprag_study.worker.study import Study
from tests.service.conftest import API, Service
from tests.service.figures.seen import seen
from tests.service.refined_study import EFFICIENCY, JUMP, MAP, SPEED, TORQUE, fetched, fill, map_value, study_of

LOAD, FREQUENCY, MASS = "shaft.load", "excitation.frequency", "pendulums.0.mass"


@pytest.fixture(scope="module")
def study() -> Study:
    return study_of(MAP)


def drawn(study: Study, mass: float, done: int | None = None, x: str = LOAD, y: str = FREQUENCY, z: str = SPEED) -> Map:
    return draw_map(study, x, y, z, ((MASS, str(mass)),), fetched(study, done))


def truth(found: Map, mass: float) -> Any:
    load, frequency = np.meshgrid(found.x_values, found.y_values)
    points = np.stack([np.full(load.size, mass), frequency.reshape(-1), load.reshape(-1)], axis=1)
    return map_value(SPEED, points).reshape(load.shape)


def test_a_smooth_map_is_right_to_the_error_everywhere(study: Study) -> None:
    found = drawn(study, 0.5)
    expected = truth(found, 0.5)
    assert found.values.shape == (32, 32)
    assert np.abs(found.values - expected).max() <= 0.02 * np.ptp(expected)
    assert {ending for row in found.endings for ending in row} == {"interpolated"}
    assert found.refined is not None
    assert found.refined.passed
    assert found.refined.sentence.startswith("Within 2 % of the range, as asked (estimate: ")
    assert found.refined.x.size < 33 * 33 / 4


def test_a_jump_is_blank_and_nothing_else(study: Study) -> None:
    found = drawn(study, 0.4)
    blank = np.isnan(found.values)
    loads = np.array(found.x_values)[blank.any(axis=0)]
    assert loads.size
    assert np.abs(loads - JUMP).max() <= 1.5 / 32.0
    expected = truth(found, 0.4)
    assert np.abs(found.values - expected)[~blank].max() <= 0.02 * np.ptp(expected)
    assert "outside jumps" in str(found.refined and found.refined.sentence)
    turned = drawn(study, 0.4, x=FREQUENCY, y=LOAD)
    np.testing.assert_array_equal(turned.values, found.values.T)


def test_the_answer_has_the_cases_apart_from_the_squares(study: Study) -> None:
    data = drawn(study, 0.4).to_json()
    assert (data["error_asked"], data["passed"], data["cases"]) == (0.02, True, [])
    assert 0.0 < data["jumps_share"] < 0.1
    points = data["points"]
    cases = study.points(range(study.cases))[points["cases"]]
    np.testing.assert_array_equal(cases, np.stack([np.full(len(cases), 0.4), points["y"], points["x"]], axis=1))
    np.testing.assert_array_equal(map_value(SPEED, cases), points["z"])


def test_a_picture_tells_how_right_it_is(study: Study) -> None:
    found = drawn(study, 0.4)
    assert found.refined is not None
    picture = paint_map(found, "", "svg")
    assert seen(picture).has(found.refined.sentence)
    page = map_svg(found, cases="/studies/st_0/cases/")
    assert seen(page).panels[0].cases == found.refined.cases.tolist()
    assert all(part in page for part in ('data-root="/studies/st_0/cases/"', 'role="group"', 'data-units="N·m|Hz"'))
    assert all(part not in map_svg(found) for part in ("data-root", "data-cases", 'role="group"'))


def test_before_the_first_rows_nothing_is_known(study: Study) -> None:
    found = drawn(study, 0.4, done=0)
    assert np.isnan(found.values).all()
    assert found.refined is not None
    assert found.refined.sentence == "The error is not known yet; 2 % of the range is asked."


def test_a_map_without_a_result_has_no_error(study: Study) -> None:
    def failing(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        return replace(fetched(study)(cases, names), endings=["diverged"] * len(cases))

    found = draw_map(study, LOAD, FREQUENCY, SPEED, ((MASS, "0.4"),), failing)
    assert found.refined is not None
    assert found.refined.sentence == "No case has a result, so that there is no error; 2 % of the range is asked."


@pytest.mark.parametrize(
    ("query", "parameter", "told"),
    [
        ((LOAD, MASS, SPEED, ()), "y", "two adaptive axes"),
        ((LOAD, LOAD, SPEED, ()), "y", "two adaptive axes"),
        ((LOAD, FREQUENCY, TORQUE, ((MASS, "0.4"),)), "z", "not refined"),
        ((LOAD, FREQUENCY, SPEED, ()), "at", "left open"),
        ((LOAD, FREQUENCY, SPEED, ((MASS, "0.4"), (LOAD, "0"))), "at", "is drawn"),
    ],
)
def test_what_cannot_be_drawn_is_refused(study: Study, query: Any, parameter: str, told: str) -> None:
    draw = partial(draw_map, study)
    with pytest.raises(SelectionError, match=told) as refused:
        draw(*query, fetched(study))
    assert [fault.where for fault in refused.value.faults] == [parameter]


def test_the_pages_and_files_of_a_service(service: Service, capsys: pytest.CaptureFixture[str]) -> None:
    study_id = service.submit(MAP)
    fill(service, study_id)
    for address in ("", "/map"):
        page = service.http.get(f"/studies/{study_id}{address}", follow_redirects=True).text
        assert 'aria-label="Mean shaft speed over load torque and excitation frequency"' in page
    report = report_of(Library(service.store), study_id, question=ReportQuestion(appendix=["curves", "versions"]))
    assert report.further == ((), "")
    expected = [(mass, name) for mass in (0.5, 0.4) for name in (SPEED, EFFICIENCY)]
    assert [(one.at[MASS], one.result.name) for one in report.maps] == expected
    document = made_document(report)
    html = write_report(document, Office(), "html").decode()
    # One is on the first sheet.
    assert html.count('alt="Mean shaft speed over load torque and excitation frequency"') == 3
    assert write_report(document, Office(), "pdf").startswith(b"%PDF")
    assert (
        dict(document.sections[-1].blocks[0].rows)["rounds"]
        == service.get(f"/studies/{study_id}")["progress"]["rounds"]["sentence"]
    )
    query = {"x": LOAD, "y": FREQUENCY, "z": EFFICIENCY, "at": f"{MASS}=0.4"}
    found = service.get(f"/studies/{study_id}/map", **query)
    assert found["passed"]
    show_map(found)
    shown = capsys.readouterr()
    numbers = [line.split()[-1] for line in shown.out.splitlines() if line.strip()]
    assert [number for number in numbers if number.isdigit()] == [str(case) for case in found["points"]["cases"]]
    assert "2 % asked" in shown.err
    table = service.http.get(f"{API}/studies/{study_id}/map", params={**query, "format": "csv"}).text
    assert table.splitlines()[0] == f"{MASS},{FREQUENCY},{LOAD},{EFFICIENCY},ending"


def test_a_map_is_told_by_the_absolute_error_of_its_result(capsys: pytest.CaptureFixture[str]) -> None:
    results = [{"result": SPEED, "error": "0.3 rad/s"}, EFFICIENCY]
    study = study_of({**MAP, "refine": {**MAP["refine"], "results": results}})
    data = drawn(study, 0.5).to_json()
    error, absolute = data["error"], data["error_absolute"]
    assert (data["error_asked"], data["error_asked_absolute"]) == (0.3, True)
    # 20 to 30 rad/s without load, 10 rad/s less at the largest load.
    assert error is not None
    assert absolute == pytest.approx(20.0 * error)
    assert 0.0 < absolute <= 0.3
    found = drawn(study, 0.5)
    assert np.nanmax(np.abs(found.values - truth(found, 0.5))) <= absolute
    show_map(data)
    assert f"error: {absolute:.2g} rad/s, 0.3 rad/s asked" in capsys.readouterr().err
    known = found.refined
    assert known is not None
    assert str(known.sentence).startswith("Within 0.3 rad/s, as asked (estimate: ")
    other = drawn(study, 0.5, z=EFFICIENCY).to_json()
    assert other["error_asked"] == 0.02
    assert "error_asked_absolute" not in other


def test_the_squares_of_a_settled_map_have_no_regimes(service: Service) -> None:
    study_id = service.submit({**MAP, "run": {"until": "settled"}})
    query = {"x": LOAD, "y": FREQUENCY, "z": SPEED, "at": f"{MASS}=0.4", "format": "csv"}
    answer = service.http.get(f"{API}/studies/{study_id}/map", params=query)
    head, *rows = answer.text.splitlines()
    assert (answer.status_code, head) == (200, f"{MASS},{FREQUENCY},{LOAD},{SPEED},ending")
    assert {row.rsplit(",", 1)[1] for row in rows} == {"pending"}


def test_points_that_had_not_settled_are_missing_values(study: Study) -> None:
    fetch = fetched(study)

    def flagged(cases: Any, names: Any) -> Any:
        columns = fetch(cases, names)
        return replace(columns, flags=["not_settled" if case % 3 == 0 else "" for case in columns.cases.tolist()])

    found = draw_map(study, LOAD, FREQUENCY, SPEED, ((MASS, "0.4"),), flagged)
    points = found.to_json()["points"]
    missing = [case for case, value in zip(points["cases"], points["z"], strict=True) if value is None]
    assert missing
    assert missing == [case for case in points["cases"] if case % 3 == 0]


def test_squares_fill_the_map_to_its_ends(study: Study) -> None:
    found = drawn(study, 0.5)
    for borders, ends in zip(map_edges(found), ((0.0, 1.0), (20.0, 30.0)), strict=True):
        assert borders.size == 33
        assert (borders[0], borders[-1]) == pytest.approx(ends)


def test_a_refined_map_is_checked_before_it_has_rows(study: Study) -> None:
    view = MapView()
    view.check(study, view.choose(study, MapQuestion(LOAD, FREQUENCY, SPEED, at=[f"{MASS}=0.5"])))
    for question, parameter in (
        (MapQuestion(LOAD, MASS, SPEED, at=[]), "y"), (MapQuestion(LOAD, FREQUENCY, "torque.max", at=[]), "z"),
        (MapQuestion(LOAD, FREQUENCY, SPEED, at=[]), "at"),
    ):  # fmt: skip
        with pytest.raises(SelectionError) as refused:
            view.check(study, view.choose(study, question))
        assert [fault.where for fault in refused.value.faults] == [parameter]
