"""The headline of every kind of study, from stored rows that follow from formulas."""

from __future__ import annotations

import copy
import re
from typing import Any

import numpy as np
import pytest

from sprag_study.service.http.web.sheet.view import sheet_of
from sprag_study.service.reading.reader import Choice, Reading
from sprag_study.service.results import key_answers
from sprag_study.service.results.curve_cases import draw
from sprag_study.service.results.defaults import usual_value
from sprag_study.service.results.headlines.headline import KeyNumber
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.views.headline import Headline, headline_of, is_small
from sprag_study.service.views.library import Library, reading_of
from sprag_study.worker import models
from sprag_study.worker.models import ChunkResult
from sprag_study.worker.models.vocabulary import single_parts
from sprag_study.worker.study import Study
from tests.service.calibrating import DAMPING, calibration
from tests.service.conftest import Service
from tests.service.rounds import run_round
from tests.service.searching import search
from tests.service.timed_spec import SPEC

BATCH: dict[str, Any] = {
    "axes": [{"path": "shaft.load", "values": ["0.1 N*m", "0.3 N*m"]}],
    "tolerances": [{"path": "excitation.amplitude_x", "plus_minus": "20 %", "distribution": "uniform"}],
    "drives": 128,
}


def speed_rows(study: Study, cases: range) -> ChunkResult:
    """A speed of 5000 rad/s for each metre of the amplitude, less 10 for each newton metre."""
    columns = {path: np.full(len(cases), value) for path, value in study.base.items()} | study.columns(cases)
    speed = 5000.0 * columns["excitation.amplitude_x"] - 10.0 * columns["shaft.load"]
    values = np.stack(
        [speed if info.name == "shaft.speed.mean" else np.zeros(len(cases)) for info in models.study_results(study)],
        axis=1,
    )
    return ChunkResult(cases.start, [models.OK] * len(cases), [""] * len(cases), values)


def run(service: Service, spec: dict[str, Any]) -> str:
    study_id = service.submit(spec)
    store = service.store
    number, epoch = store.studies.get(study_id).number, store.work.take_over("test")
    run_round(store, number, epoch, speed_rows)
    store.work.settle(epoch, number)
    return study_id


def found(service: Service, study_id: str, point: str | None = None) -> tuple[Headline, Reading]:
    library = Library(service.store)
    return headline_of(library, study_id, point=point), reading_of(service.store, study_id, Choice())


def test_a_search_shows_its_best_design_with_what_it_was(service: Service) -> None:
    study_id = search(service, best=[{"result": "efficiency", "max": True}], generations=6)
    headline, reading = found(service, study_id)
    designs = service.get(f"/studies/{study_id}/front", limit=1)["designs"]
    assert headline.said(reading).startswith(f"The best of {len(_all(service, study_id))} designs: efficiency ")
    told = {one.label: one.value for one in headline.dimensions}
    assert told == pytest.approx(designs[0]["variables"])
    assert reading.say(headline.dimensions[0].note) == "25 Hz before"
    page = service.http.get(f"/studies/{study_id}").text
    shown = reading_of(service.store, study_id, Choice("workshop"))
    for one in headline.dimensions:  # the same digits beside the drawing
        assert len(re.findall(rf">\D*(?<![\d.]){re.escape(one.number(shown))}(?![\d.])", page)) > 1, one
    (limit,) = headline.limits
    assert limit.label == "shaft.speed.mean"
    assert reading.say(limit.note) == "as required: 8 rad/s"
    assert headline.numbers[0].case == designs[0]["cases"][0]


def test_a_search_names_its_operating_points_and_where_a_limit_is_nearest(service: Service) -> None:
    limits = [{"result": "efficiency", "at_least": "10 %"}]
    study_id = search(service, best=[{"result": "efficiency", "max": True}], subject_to=limits)
    headline, reading = found(service, study_id)
    said = reading.say(headline.numbers[0].where)
    assert said == "worst of 2 operating points: load torque = 0.2 N·m; load torque = 0.3 N·m"
    assert reading.say(headline.limits[0].where) == "at load torque = 0.3 N·m"  # the larger load costs efficiency
    text = service.http.get("/", headers={"Accept": "text/html"}).text
    assert "the best design" in text  # the number of designs is that of the sheet only: cases are several to a design


def _all(service: Service, study_id: str) -> list[Any]:
    found: list[Any] = service.get(f"/studies/{study_id}/front", limit=1000)["designs"]
    return found


def test_a_search_without_a_design_within_its_limits_says_so(service: Service) -> None:
    limits = [{"result": "shaft.speed.mean", "at_least": "500 rad/s"}]
    headline, reading = found(service, search(service, subject_to=limits))
    assert headline.said(reading).startswith("None of ")
    assert "missed by" in reading.say(headline.limits[0].note)


def test_several_goals_have_several_best_designs(service: Service) -> None:
    headline, reading = found(service, search(service))
    assert "beaten by no other in every goal" in headline.said(reading)
    assert [one.label for one in headline.numbers] == ["efficiency", "shaft.irregularity"]


def test_a_calibration_shows_its_values_with_intervals(service: Service) -> None:
    study_id = calibration(service)
    headline, reading = found(service, study_id)
    damping, inertia = headline.numbers
    assert damping.low is not None
    assert damping.high is not None
    assert damping.low < DAMPING < damping.high
    assert damping.title(reading) == "Damping"
    assert reading.say(damping.note) == "0.01 N·m·s/rad before"
    assert damping.number(reading) in headline.said(reading)
    assert inertia.interval(reading) in reading.say(inertia.where)
    assert "explains the 10 measured values best." in headline.said(reading)


def test_a_batch_tells_its_spread_and_yield_at_one_place(service: Service) -> None:
    study_id = run(service, {**copy.deepcopy(SPEC), **BATCH})
    headline, reading = found(service, study_id, "0.1 N*m")
    ribbon = service.get(f"/studies/{study_id}/ribbon", y="shaft.speed.mean")["lines"][0]["results"]["shaft.speed.mean"]
    middle, between, nominal, share = headline.numbers
    assert middle.value == pytest.approx(ribbon["values"][1][0])
    assert (between.low, between.high) == pytest.approx((ribbon["values"][0][0], ribbon["values"][2][0]))
    assert (nominal.value, nominal.case) == (pytest.approx(9.0), 0)
    reached = service.get(f"/studies/{study_id}/yield", condition="shaft.speed.mean >= 90 % of nominal")
    assert share.value == pytest.approx(reached["lines"][0]["each"][0]["value"])
    assert headline.said(reading).startswith("At 0.1 N·m half of the drives run faster than 9")
    both, _ = found(service, study_id, "0.2 N*m")
    assert [text.said(reading)[:12] for text in both.sentence] == ["No case was ", "At 0.1 N·m h", "At 0.3 N·m h"]


def test_a_place_that_is_printed_like_a_case_is_that_case(service: Service) -> None:
    plain = {name: value for name, value in copy.deepcopy(SPEC).items() if name not in {"axes", "combine", "exclude"}}
    loads = {"axes": [{"path": "shaft.load", "values": [0.0984375, 0.2]}]}
    study_id = run(service, {**plain, **loads})
    headline, reading = found(service, study_id, "0.098437 N*m")
    assert headline.said(reading).startswith("At 0.098437 N·m it runs ")
    (answer,) = service.get(f"/studies/{study_id}/answers", point="0.098437 N*m")["curves"]
    assert answer["working_point"][0]["cases"] == [0]
    headline, reading = found(service, run(service, {**plain, **BATCH, **loads}), "0.098437 N*m")
    assert headline.said(reading).startswith("At 0.098437 N·m half ")


@pytest.mark.parametrize("more", [{}, BATCH])
def test_a_place_beyond_the_axis_is_told_as_such(service: Service, more: dict[str, Any]) -> None:
    plain = {name: value for name, value in copy.deepcopy(SPEC).items() if name not in {"axes", "combine", "exclude"}}
    study_id = run(service, {**plain, **more, "axes": [{"path": "shaft.load", "values": [0.1, 0.3]}]})
    for point, said, nearest in (("9 N*m", "9", "0.3"), ("-1", "\N{MINUS SIGN}1", "0.1")):
        headline, reading = found(service, study_id, point)
        text = f"{said} N·m is beyond the cases; the nearest is at {nearest} N·m. At {nearest} N·m "
        assert headline.said(reading).startswith(text)
        assert headline.gap is None
    assert "beyond" not in found(service, study_id, "0.3 N*m")[0].said(reading)


def test_what_a_curve_is_held_at_is_told(service: Service) -> None:
    plain = {name: value for name, value in copy.deepcopy(SPEC).items() if name not in {"axes", "combine", "exclude"}}
    axes = [
        {"path": "excitation.frequency", "values": ["24 Hz", "26 Hz", "28 Hz"]},
        {"path": "pendulums.0.arm", "values": ["30 mm", "36 mm"]},
        {"path": "shaft.load", "values": [0.1, 0.3]},
    ]
    headline, reading = found(service, run(service, {**plain, "axes": axes}))
    assert "26 Hz" in reading.say(headline.of)
    assert "arm of the mass = 0.03 m" in reading.say(headline.of)


def test_of_an_axis_around_the_base_the_nearest_place_is_meant_everywhere(service: Service) -> None:
    plain = {name: value for name, value in copy.deepcopy(SPEC).items() if name not in {"axes", "combine", "exclude"}}
    plain["base"]["shaft"]["load"] = 0.1
    loads = {"axes": [{"path": "shaft.load", "linspace": [0.05, 0.35, 4]}]}
    study_id = run(service, {**plain, **BATCH, **loads})
    headline, reading = found(service, study_id)
    assert headline.said(reading).startswith("At 0.15 N·m ")
    study = service.store.studies.study(study_id)
    assert usual_value(study, study.axis_with("shaft.load")) == pytest.approx(0.15)


def test_a_headline_that_takes_long_is_found_elsewhere() -> None:
    base = {name: value for name, value in SPEC.items() if name not in {"axes", "combine", "exclude"}}
    curve = parse_spec({**base, "axes": [{"path": "shaft.load", "linspace": [0, 1, 4096]}]}).study
    batch = parse_spec({**base, **BATCH, "drives": 2048}).study
    assert curve.cases <= batch.cases
    assert is_small(curve)
    assert not is_small(batch)


def test_a_single_case_and_studies_that_have_nothing_yet(service: Service) -> None:
    plain = {name: value for name, value in copy.deepcopy(SPEC).items() if name not in {"axes", "combine", "exclude"}}
    headline, reading = found(service, run(service, plain))
    assert headline.said(reading).startswith("It runs at ")
    waiting = service.submit({**plain, "name": "waiting", "axes": [{"path": "shaft.load", "values": [0.1, 0.2]}]})
    headline, reading = found(service, waiting)
    assert headline.said(reading) == "It waits for its turn; no case has been run yet."
    assert headline.numbers == ()


def test_a_study_all_of_whose_cases_failed_says_how(service: Service) -> None:
    study_id = service.submit()
    store = service.store
    number, epoch = store.studies.get(study_id).number, store.work.take_over("test")

    def failed(study: Study, cases: range) -> ChunkResult:
        values = np.full((len(cases), len(models.study_results(study))), np.nan)
        return ChunkResult(cases.start, ["chatter"] * len(cases), [""] * len(cases), values)

    run_round(store, number, epoch, failed)
    store.work.settle(epoch, number)
    headline, reading = found(service, study_id)
    assert headline.said(reading).endswith(" cases has a result: chatter.")


def test_the_only_pendulum_of_a_machine_is_not_named() -> None:
    paths = ["pendulums.0.arm", "pendulums.0.spring_rate", "shaft.load"]
    reading = Reading("vibration-drive", single=single_parts(paths))
    assert KeyNumber("pendulums.0.spring_rate", 31.5).title(reading) == "Spring rate"
    assert reading.caption("pendulums.0.power.loss") == reading.caption("power.loss.mean") + ", pendulum 1"
    several = Reading("vibration-drive", single=single_parts([*paths, "pendulums.1.arm"]))
    assert several.caption("pendulums.0.spring_rate") == "Spring rate, pendulum 1"
    assert reading.letter("shaft.irregularity") == "<i>δ</i><sub>ω</sub>"  # δ is the backlash in drawings


def test_a_sheet_reads_its_answers_once(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its sentence and its chart are of the same curves; rows that come later are read."""
    study_id = run(service, {**SPEC, "axes": [{"path": "shaft.load", "values": [0.1, 0.2, 0.3]}], "combine": "grid"})
    drawn: list[object] = []

    def counted(*given: Any) -> Any:
        drawn.append(given)
        return draw(*given)

    monkeypatch.setattr(key_answers, "draw", counted)
    library, choice = Library(service.store), Choice()
    first = sheet_of(library, study_id, [], choice, f"/studies/{study_id}/cases")
    assert len(drawn) == 1
    assert sheet_of(library, study_id, [], choice, f"/studies/{study_id}/cases").say == first.say
    assert len(drawn) == 1
    sheet_of(library, study_id, [("point", "0.2")], choice, f"/studies/{study_id}/cases")
    assert len(drawn) == 2
