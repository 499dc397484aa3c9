"""Answers against closed forms: a drive whose speed falls linearly with the load."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.interpolate import interp1d

from sprag_study.service.faults import SelectionError
from sprag_study.service.figures.answers import answers_figure
from sprag_study.service.figures.svg import svg
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.results.key_answer_words import answer_facts, note_of, report
from sprag_study.service.results.key_answers import answers_query, find_answers, find_overall
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.studies.records import CaseColumns
from sprag_study.worker import models
from tests.service.figures.seen import seen

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.results.key_answers import CurveAnswers, ReadAnswer, StudyAnswers
    from sprag_study.worker.study import Study

#: No-load speed (rad/s) at an amplitude of 1 m, stall torque (N*m).
SPEED, STALL = 20.0, 1.0
LOADS = [0.0, 0.2, 0.4, 0.55, 0.8, 1.0, 1.3]


def speed(study: Study) -> NDArray[np.float64]:
    """w0 d (1 - M/Ms), 0 from the stall torque on."""
    columns = study.columns(range(study.cases))
    load, amplitude = columns["shaft.load"], columns.get("excitation.amplitude_x", np.ones(study.cases))
    return np.asarray(SPEED * amplitude * np.maximum(1.0 - load / STALL, 0.0))


class Rows:
    """Rows of the linear drive, with flags of single cases."""

    def __init__(self, study: Study, flags: dict[int, str] | None = None) -> None:
        load = study.columns(range(study.cases))["shaft.load"]
        own = speed(study)
        self.study, self.flags = study, flags or {}
        info = models.regime_info(models.study_results(study))
        self.values = {
            "shaft.speed.mean": own,
            "torque.mean": load,
            "power.useful.mean": load * own,
            "efficiency": 0.9 * load * (STALL - load) * (load <= STALL),
        }
        if info is not None:
            names = ["held" if value == 0.0 else "periodic" for value in own]
            self.values["regime"] = np.array([info.categories.index(name) for name in names], dtype=float)

    def whole(self, names: Sequence[str]) -> CaseColumns:
        """Results of all cases."""
        return self(np.arange(self.study.cases, dtype=np.int64), names)

    def __call__(self, cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        endings: list[str | None] = ["ok"] * len(cases)
        empty = np.full(self.study.cases, np.nan)
        columns = {name: self.values.get(name, empty)[cases] for name in names}
        return CaseColumns(cases, endings, columns, [self.flags.get(case, "") for case in cases.tolist()])


def study_of(spec: dict[str, Any], **changes: Any) -> Study:
    axes = [{"path": "shaft.load", "values": LOADS}]
    return parse_spec({**spec, "axes": axes, **changes}).study


def found_in(study: Study, rows: Rows, point: str | None = None) -> StudyAnswers:
    found = find_answers(study, answers_query(study), point, rows)
    return replace(found, overall=tuple(find_overall(study, rows.whole)))


def only(found: StudyAnswers) -> dict[str, ReadAnswer]:
    (curve,) = found.curves
    return by_name(curve)


def by_name(curve: CurveAnswers) -> dict[str, ReadAnswer]:
    return {item.answer.name: item for item in (*curve.answers, *curve.working_point)}


def test_answers_of_a_linear_characteristic(spec: dict[str, Any]) -> None:
    study = study_of(spec)
    found = only(found_in(study, Rows(study), "0.5 N*m"))
    assert (found["no_load_speed"].value, found["no_load_speed"].case) == (SPEED, 0)
    # The largest of the parabola M w0 (1 - M/Ms) is at Ms/2, between the neighbours of the best case.
    power = found["largest_power"]
    assert power.value == pytest.approx(max(SPEED * load * (1.0 - load) for load in LOADS if load <= STALL))
    assert (power.x, power.low, power.high, power.cases) == (0.55, 0.4, 0.8, len(LOADS))
    assert power.low < STALL / 2.0 < power.high
    assert not power.edge
    stall = found["stall_torque"]
    assert (stall.value, stall.low, stall.high, stall.above, stall.unit) == (0.8, 0.8, STALL, False, "N*m")
    assert stall.low < STALL <= stall.high
    # The speed is linear, so interpolation gives it; the power is not.
    by_scipy = interp1d(LOADS, np.array(LOADS) * speed(study))(0.5)
    here = found["shaft.speed.mean"]
    assert (here.value, here.interpolated, here.case, here.other) == (pytest.approx(SPEED * 0.5), True, 2, 3)
    assert found["power.useful.mean"].value == pytest.approx(by_scipy)
    assert "interpolated between the cases at 0.4 and 0.55 N·m" in note_of(answer_facts(here), "N*m")


def test_a_working_point_on_a_case_is_that_case(spec: dict[str, Any]) -> None:
    study = study_of(spec)
    here = only(found_in(study, Rows(study), "400 N*mm"))["shaft.speed.mean"]
    assert (here.value, here.case, here.interpolated) == (speed(study)[2], 2, False)


@pytest.mark.parametrize(("point", "why"), [("2", "outside"), ("-0.1", "outside"), ("0.9", "not-joined")])
def test_there_is_no_value_beyond_the_cases_and_where_the_motion_changes(
    spec: dict[str, Any], point: str, why: str
) -> None:
    study = study_of(spec, run={"until": "settled"})
    here = only(found_in(study, Rows(study), point))["shaft.speed.mean"]
    assert (here.value, here.why) == (None, why)
    assert note_of(answer_facts(here), "N*m")


def test_a_case_that_failed_is_no_extreme_among_all(spec: dict[str, Any]) -> None:
    class Failing(Rows):
        def whole(self, names: Sequence[str]) -> CaseColumns:
            columns = super().whole(names)
            return replace(columns, endings=["unstable_motion" if case == 3 else "ok" for case in range(len(LOADS))])

    study = study_of(spec)
    overall = {item.answer.name: item for item in found_in(study, Failing(study)).overall}
    power = np.array(LOADS) * speed(study)
    power[3] = 0.0
    assert (overall["largest_power"].case, overall["largest_power"].value) == (int(power.argmax()), power.max())
    assert overall["largest_power"].cases == len(LOADS) - 1


def test_a_case_that_failed_has_no_result(spec: dict[str, Any]) -> None:
    class Failing(Rows):
        def __call__(self, cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
            columns = super().__call__(cases, names)
            return replace(columns, endings=["unstable_motion" if case == 3 else "ok" for case in cases.tolist()])

    study = study_of(spec)
    there = only(found_in(study, Failing(study), "0.55"))["shaft.speed.mean"]
    assert (there.value, there.why, there.case) == (None, "no-result", 3)


def test_a_case_that_had_not_settled_is_a_missing_value(spec: dict[str, Any]) -> None:
    study = study_of(spec)
    power = only(found_in(study, Rows(study, flags={3: "not_settled"})))["largest_power"]
    assert (power.x, power.cases, power.flags) == (0.4, len(LOADS) - 1, ())
    # The line to its neighbours is broken, and the place itself has no value but says why.
    between = only(found_in(study, Rows(study, flags={3: "not_settled"}), "0.5"))["shaft.speed.mean"]
    assert (between.value, between.why) == (None, "not-joined")
    there = only(found_in(study, Rows(study, flags={3: "unsettled"}), "0.55"))["shaft.speed.mean"]
    assert (there.value, there.why, there.case, there.flags) == (None, "unsettled", 3, ("unsettled",))
    every = dict.fromkeys(range(len(LOADS)), "not_settled,windup_out_of_data")
    none = only(found_in(study, Rows(study, flags=every)))
    assert {item.value for item in none.values()} == {None}
    assert none["largest_power"].why == "unsettled"
    assert note_of(answer_facts(none["largest_power"]), "N*m") == "no case had settled"
    assert note_of(answer_facts(there), "N*m") == "not settled there: a missing value"


def test_an_axis_that_ends_before_stall_gives_a_bound(spec: dict[str, Any]) -> None:
    study = study_of(spec, axes=[{"path": "shaft.load", "values": [0.1, 0.2, 0.3]}])
    found = only(found_in(study, Rows(study)))
    stall, power = found["stall_torque"], found["largest_power"]
    assert (stall.value, stall.above, stall.there) == (0.3, True, pytest.approx(0.7 * SPEED))
    assert (power.x, power.edge, power.high) == (0.3, True, None)
    assert (found["no_load_speed"].value, found["no_load_speed"].why) == (None, "no-case")
    assert "at the end of the axis" in note_of(answer_facts(power), "N*m")


def test_each_curve_has_answers_and_the_study_its_own(spec: dict[str, Any]) -> None:
    amplitudes = {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": ["1 mm", "3 mm", "2 mm"]}
    study = study_of(spec, axes=[amplitudes, {"path": "shaft.load", "values": LOADS}])
    found = found_in(study, Rows(study))
    assert [by_name(one)["no_load_speed"].value for one in found.curves] == pytest.approx([0.02, 0.04, 0.06])
    best = {item.answer.name: item for item in found.overall}["largest_power"]
    power = study.columns(range(study.cases))["shaft.load"] * speed(study)
    assert (best.case, best.value, best.cases) == (int(np.argmax(power)), power.max(), study.cases)
    data = report("st_1", study, found)
    assert data["overall"][0]["parameters"]["excitation.amplitude_x"] == 0.003
    assert data["units"]["shaft.load"] == "N*m"


def test_answers_stand_on_their_lines(spec: dict[str, Any]) -> None:
    study = study_of(spec)
    figure = answers_figure(found_in(study, Rows(study), "0.5 N*m"), 2)
    assert (figure.at, figure.noted) == (0.5, ("largest", "point"))
    for panel in figure.panels:
        (line,) = panel.lines
        rings = [note for note in panel.notes if note.kind == "point"]
        assert [note.y for note in rings] == pytest.approx([np.interp(0.5, line.x, line.y)])
    (peak,) = [note for panel in figure.panels for note in panel.notes if "W" in note.text]
    assert (peak.x, peak.kind, peak.text) == (0.55, "largest", "4.95 W at 0.55 N·m")
    # Where its text has room: to the right in the left half, to the left in the other.
    power = figure.panels[0]
    assert [power.on_the_right(replace(peak, x=x)) for x in (0.55, 1.3)] == [False, True]
    assert seen(svg(figure)).has("4.95 W at 0.55 N·m")


def test_chosen_curves_and_wrong_choices(spec: dict[str, Any]) -> None:
    frequencies = {"path": "excitation.frequency", "linspace": ["20 Hz", "30 Hz", 11]}
    study = study_of(spec, axes=[frequencies, {"path": "shaft.load", "values": LOADS}])
    of = (("excitation.frequency", "22 Hz"), ("excitation.frequency", "21"))
    query = CurveQuery("shaft.load", ("torque.mean",), ("excitation.frequency",), of=of)
    found = find_answers(study, answers_query(study, query), None, Rows(study))
    assert [one.line.by["excitation.frequency"] for one in found.curves] == [21.0, 22.0]
    with pytest.raises(SelectionError) as caught:
        find_answers(study, query, "3 mm", Rows(study))
    assert caught.value.faults[0].where == "point"
    for point in (None, "3 mm"):
        with pytest.raises(SelectionError) as caught:
            find_answers(study, replace(query, x="shaft.lod"), point, Rows(study))
        assert (caught.value.faults[0].where, caught.value.faults[0].code) == ("x", "not-an-axis")


def test_one_machine_has_the_results_of_its_case(spec: dict[str, Any]) -> None:
    study = study_of(spec, axes=[])

    def fetch(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
        values = {name: np.full(1, 0.25 if name == "efficiency" else np.nan) for name in names}
        return CaseColumns(cases, ["ok"], values, ["windup_out_of_data"])

    assert answers_query(study) is None
    (curve,) = find_answers(study, None, None, fetch).curves
    values = {item.answer.name: (item.value, item.why) for item in curve.working_point}
    assert values["efficiency"] == (0.25, None)
    assert values["torque.mean"] == (None, "no-result")
    assert curve.working_point[0].flags == ("windup_out_of_data",)
