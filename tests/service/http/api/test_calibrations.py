"""Calibrations over HTTP: values with intervals, residuals, the fitted curve, as JSON, a table and a picture."""

from __future__ import annotations

import csv
import io
import math
from functools import partial

import pytest

from sprag_study.service.answers.calibration import CalibrationReport
from sprag_study.service.report.document import report_of
from sprag_study.service.results import calibration as calibration_module
from sprag_study.service.results.calibration import calibration_of
from sprag_study.service.results.calibration_answers import calibration_json
from sprag_study.service.results.calibration_words import doubts
from sprag_study.service.results.calibration_words import sentences as sentences_of
from sprag_study.service.views.calibration import CalibrationView
from sprag_study.service.views.library import Library
from sprag_study.service.views.study_view import StudyAnswer
from tests.service.calibrating import CALIBRATE, DAMPING, INERTIA, calibration, measured
from tests.service.conftest import API, Service
from tests.service.shapes import fits


def test_an_ended_calibration(service: Service) -> None:
    study_id = calibration(service)
    detail = service.get(f"/studies/{study_id}")
    assert detail["state"] == "finished"
    told = detail["progress"]["rounds"]["sentence"]
    assert "calibrated" in told
    found = service.get(f"/studies/{study_id}/calibration")
    fits(CalibrationReport, found)
    assert (found["phase"], found["complete"], found["refits"]) == ("ended", True, 20)
    damping, inertia = found["parameters"]
    assert damping["paths"] == ["pendulums.0.damping"]
    assert inertia["unit"] == "kg*m^2"
    for one, true in ((damping, DAMPING), (inertia, INERTIA)):
        low, high = one["interval"]
        assert low < true < high
        assert one["low"] < low < one["value"] < high < one["high"]
        assert not one["at_low"]
    assert found["correlations"][0][0] == 1.0
    assert found["correlations"][0][1] == pytest.approx(found["correlations"][1][0])
    assert found["correlations"][0][1] < 0.0
    points = found["points"]
    assert len(points) == 10
    assert found["freedom"] == 8
    assert found["chi_square"] == pytest.approx(sum(point["residual"] ** 2 for point in points))
    for point in points:
        assert point["residual"] == pytest.approx((point["measured"] - point["fitted"]) / point["sigma"])
        assert point["interval"][0] < point["fitted"] < point["interval"][1]
    loads = {point["at"]["shaft.load"] for point in found["curve"]}
    assert {point["at"]["excitation.frequency"] for point in found["curve"]} == {24.0, 28.0}
    assert min(loads) < 0.05 < 0.25 < max(loads)
    assert found["next"]["at"]["shaft.load"] in {min(loads), max(loads)}
    assert max(found["next"]["narrower"].values()) > 0.0
    assert any("degrees of freedom" in sentence for sentence in found["sentences"])
    assert not found["directions"]


def test_an_ended_calibration_keeps_its_answer(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    """A later version of the planner may read other values from the same rows."""
    study_id = calibration(service)
    rows, study = service.store.studies.rounds(study_id), service.store.studies.study(study_id)
    fetch = partial(service.store.rows.for_cases, study_id)
    assert not len(rows[-1].cases)
    replayed = calibration_of(study, rows[:-1], fetch)
    assert calibration_json("", replayed) == calibration_json("", calibration_of(study, rows, fetch))
    monkeypatch.setattr(calibration_module, "CalibratePlanner", None)
    assert service.get(f"/studies/{study_id}/calibration")["complete"]


def test_what_cannot_be_separated_is_named(service: Service) -> None:
    text = "shaft.load,shaft.speed.mean\n" + "".join(f"2,{-30.0 + 0.05 * k}\n" for k in range(5))
    study_id = calibration(service, measured={"csv": text})
    found = service.get(f"/studies/{study_id}/calibration")
    (direction,) = found["directions"]
    assert direction["undetermined"]
    assert set(direction["parameters"]) == {"pendulums.0.damping", "shaft.inertia"}
    assert any("These points cannot separate" in sentence for sentence in found["sentences"])
    assert any("reaches" in sentence for sentence in found["sentences"])
    assert any("follows from the residuals" in sentence for sentence in found["sentences"])


def test_intervals_that_are_whole_ranges_are_not_too_narrow(service: Service) -> None:
    points = "".join(f"2,{-30.0 + 0.05 * k},0.001\n" for k in range(5))
    text = f"shaft.load,shaft.speed.mean,sigma\n{points}"
    for unknown, narrow in ((CALIBRATE["unknown"], False), ([CALIBRATE["unknown"][1]], True)):
        study_id = calibration(service, measured={"csv": text}, unknown=unknown)
        first, *_ = service.get(f"/studies/{study_id}/calibration")["sentences"]
        assert "farther off than sigma explains." in first
        assert first.endswith(" The intervals are too narrow.") == narrow


def test_a_sensor_that_does_not_read_zero_is_named_without_sigma(service: Service) -> None:
    """With the damping given, which acts as the offset does."""
    unknown, points = [CALIBRATE["unknown"][1]], {"csv": measured(0.8, sigma=False)}
    study_id = calibration(service, unknown=unknown, measured=points, refits=0)
    found = service.get(f"/studies/{study_id}/calibration")
    fits(CalibrationReport, found)
    assert found["lack_of_fit"]["test"] == "runs"
    assert found["sentences"][0].startswith("The 10 residuals of shaft.speed.mean ")
    (offset,) = found["offsets"]
    assert abs(offset["offset"] - 0.8) < 3.0 * offset["deviation"]
    assert offset["p"] < 0.01 < offset["p_after"]
    (told,) = [text for text in found["sentences"] if text.startswith("An offset of shaft.speed.mean by +0.")]
    assert "rad/s" in told
    page = service.http.get(f"/studies/{study_id}/matters").text
    assert " of the squares of the residuals (p = " in page


def test_an_offset_that_is_calibrated_has_an_interval_on_every_front(service: Service) -> None:
    sensors = [{"result": "shaft.speed.mean", "offset": {"from": "-2 rad/s", "to": "2 rad/s"}}]
    study_id = calibration(service, unknown=[CALIBRATE["unknown"][1]], measured={"csv": measured(0.8)}, sensors=sensors)
    found = service.get(f"/studies/{study_id}/calibration")
    fits(CalibrationReport, found)
    inertia, offset = found["parameters"]
    assert (offset["name"], offset["paths"], offset["unit"]) == ("shaft.speed.mean.offset", [], "rad/s")
    assert (offset["sensor"], inertia["sensor"]) == ("shaft.speed.mean", None)
    for one, true in ((inertia, INERTIA), (offset, 0.8)):
        assert one["interval"][0] < true < one["interval"][1]
    assert found["offsets"] == []
    assert found["freedom"] == 8
    page = service.http.get(f"/studies/{study_id}/matters").text
    assert "Offset of mean shaft speed" in page
    report = report_of(Library(service.store), study_id)
    assert report.calibration is not None
    assert any(text.startswith("Offset of shaft.speed.mean = 0.") for text in report.calibration.sentences)
    assert list(report.meant) == ["shaft.inertia"]
    assert service.http.get(f"{API}/studies/{study_id}/report?format=html").status_code == 200


def test_priors_stand_beside_their_values_and_contradictions_are_told(service: Service) -> None:
    known = {"mean": DAMPING, "sigma": "0.01 %"}
    wrong = {"mean": 2.4 * INERTIA, "sigma": 0.25 * INERTIA}
    damping, inertia = CALIBRATE["unknown"]
    study_id = calibration(service, unknown=[{**damping, "prior": known}, {**inertia, "prior": wrong}], refits=60)
    found = service.get(f"/studies/{study_id}/calibration")
    fits(CalibrationReport, found)
    assert [one["prior"] for one in found["parameters"]] == [
        {"mean": DAMPING, "sigma": pytest.approx(1e-4 * DAMPING)}, wrong,
    ]  # fmt: skip
    assert found["freedom"] == 10
    assert found["sentences"][1].startswith(
        "Measured values and prior contradict each other in shaft.inertia: the value"
    )
    assert (
        "These points say hardly anything about pendulums.0.damping: its interval is that of the prior."
        in (found["sentences"])
    )
    page = service.http.get(f"/studies/{study_id}/matters").text
    assert "Known before" in page
    assert "Measured values and prior contradict each other in " in page


def test_a_value_far_off_the_others_is_named_with_its_condition(service: Service) -> None:
    lines = measured(sigma=False).splitlines()
    place, value = lines[4].rsplit(",", 1)
    lines[4] = f"{place},{float(value) + 1.0}"
    study_id = calibration(service, measured={"csv": "\n".join(lines)}, refits=0)
    found = service.get(f"/studies/{study_id}/calibration")
    assert found["far_point"]["number"] == 4
    assert found["far_point"]["p"] < 0.001
    (told,) = [text for text in found["sentences"] if "far off the others" in text]
    assert "Measured value 4 (shaft.load = 0.2 N*m, excitation.frequency = 24 Hz, shaft.speed.mean = " in told
    assert "`loss`" in told


def test_a_calibration_that_is_running_shows_what_it_knows(service: Service) -> None:
    first = service.get(f"/studies/{calibration(service, rounds=1)}/calibration")
    fits(CalibrationReport, first)
    assert (first["phase"], first["parameters"][0]["value"], first["points"][0]["fitted"]) == ("fit", None, None)
    later = service.get(f"/studies/{calibration(service, rounds=3, seed=2)}/calibration")
    fits(CalibrationReport, later)
    assert not later["complete"]


def test_a_table_and_a_picture(service: Service) -> None:
    study_id = calibration(service)
    points = service.get(f"/studies/{study_id}/calibration")["points"]
    answer = service.http.get(f"{API}/studies/{study_id}/calibration?format=csv")
    assert answer.headers["content-disposition"] == f'attachment; filename="{study_id}-calibration.csv"'
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert [float(row["fitted"]) for row in rows] == [point["fitted"] for point in points]
    assert list(rows[0])[:3] == ["shaft.load", "excitation.frequency", "result"]
    read = csv.DictReader(
        io.StringIO(service.http.get(f"{API}/studies/{study_id}/calibration?format=csv&units=rpm").text)
    )
    fitted = [float(row["fitted [rpm]"]) for row in read]
    assert fitted == pytest.approx([point["fitted"] * 30.0 / math.pi for point in points])
    picture = service.http.get(f"{API}/studies/{study_id}/calibration?format=svg")
    assert picture.status_code == 200
    assert "Residual" in picture.text


def test_the_report_has_the_calibration(service: Service) -> None:
    study_id = calibration(service)
    report = report_of(Library(service.store), study_id)
    assert report.calibration is not None
    assert report.calibration.figure is not None
    # Its cases lie on no curves; pictures of them took hundreds of megabytes.
    assert (report.answers, report.further) == (None, ((), ""))
    sentences = service.get(f"/studies/{study_id}/calibration")["sentences"]
    assert set(sentences) < set(report.calibration.sentences)
    # What the answer says is not said again below it.
    library = Library(service.store)
    known = library.calibrations.of(study_id)
    below = CalibrationView().shown(StudyAnswer(library, study_id, None, known)).sentences
    assert [*doubts(known), *below] == sentences_of(known)
    assert "pendulums.0.damping = " in report.calibration.sentences[0]
    page = service.http.get(f"{API}/studies/{study_id}/report?format=html&appendix=calibration").text
    assert "<h2>Fitted values</h2>" in page
    assert "<h2>Calibration</h2>" in page
    assert report_of(Library(service.store), service.submit()).calibration is None


def test_a_calibration_that_was_killed_ends_as_an_undisturbed_one(service: Service) -> None:
    whole, killed = (service.store.studies.study(calibration(service, kills=kills)) for kills in (False, True))
    assert whole.cases == killed.cases
    assert whole.points(range(whole.cases)).tobytes() == killed.points(range(killed.cases)).tobytes()


def test_other_studies_are_refused(service: Service) -> None:
    problem = service.http.get(f"{API}/studies/{service.submit()}/calibration")
    assert problem.status_code == 422
    assert problem.json()["type"].endswith("invalid-selection")
