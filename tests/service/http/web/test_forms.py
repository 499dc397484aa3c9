"""The form and the spec: what goes in comes out, and faults are told beside the right fields."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sprag_study.service.faults import Fault
from sprag_study.service.figures.painter.thinning import thin
from sprag_study.service.http.web.form.check import check_form, check_text
from sprag_study.service.http.web.form.entries import plain
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.parts import reshape, share
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.http.web.templates import duration, fragment, time_left
from sprag_study.service.presets import preset_names, preset_text
from sprag_study.service.reading.faults import message
from sprag_study.service.reading.wording import number, symbol, unit_text
from sprag_study.service.spec.document import format_of, load_spec, parse_spec
from sprag_study.service.views.case_view import see
from sprag_study.service.views.trajectory import PhasesView, TrajectoryView
from sprag_study.worker import models
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.study import Study
from tests.service.http.web.fields import field_of
from tests.service.spec_sample import changed

EMPTY_FORM = empty("vibration-drive")
EXAMPLES = Path(__file__).resolve().parents[4] / "examples"


def drives() -> list[dict[str, Any]]:
    """Every study of a vibration drive that comes with the program and that the form has fields for."""
    files = [preset_text(name) for name in preset_names()]
    files += [(path.name, path.read_text()) for path in EXAMPLES.iterdir() if path.suffix in (".json", ".toml")]
    specs = [load_spec(text, format_of(name)) for name, text in files]
    return [
        spec
        for spec in specs
        if isinstance(spec, dict) and spec.get("model") == "vibration-drive" and not {"goal", "starts"} & set(spec)
    ]


def physics(study: Study) -> str:
    return study.physics_hash("1")


@pytest.mark.parametrize("spec", drives(), ids=lambda spec: spec["name"])
def test_a_cloned_study_is_the_same_study(spec: dict[str, Any]) -> None:
    again, faults = spec_of(values_of(json.loads(json.dumps(spec))))
    assert faults == {}
    assert physics(parse_spec(again).study) == physics(parse_spec(spec).study)
    assert again["name"] == spec["name"]


REFINED = changed(
    {
        "/axes": [
            {"path": "excitation.frequency", "values": [20, 25]},
            {"path": "shaft.load", "adaptive": [0, "1.2 N*m"], "include": ["300 N*mm", "base"]},
        ],
        "/refine": {
            "results": [
                "shaft.speed.mean",
                {"result": "torque.max", "error": "0.2 N*m"},
                {"result": "efficiency", "error": 0.005},
            ],
            "error": "2 %",
            "finest": "1/64",
            "most": 300,
        },
    }
)


def test_a_refined_study_is_cloned_with_all_that_it_asks_for() -> None:
    values = values_of(json.loads(json.dumps(REFINED)))
    assert values["/axes/1/values"] == "0 to 1.2 N*m refined with 300 N*mm; base"
    again, faults = spec_of(values)
    assert faults == {}
    assert again["refine"] == REFINED["refine"]
    assert physics(parse_spec(again).study) == physics(parse_spec(REFINED).study)


def test_an_axis_that_is_refined_asks_for_results_and_an_error() -> None:
    values = values_of(changed({}))
    assert "refine" not in spec_of(values)[0]
    values |= {"/axes/2/way": "adaptive", "/axes/2/from": "0", "/axes/2/to": "1.2 N*m"}
    checked = check_form(values, Chunking())
    assert checked.faults == {}
    assert checked.spec["refine"] == {"results": ["shaft.speed.mean", "efficiency"], "error": "1 %"}
    assert checked.preview is not None
    assert (checked.preview["cases"], checked.preview["most_cases"]) == (64 * 17, 64 * 257)


def test_refined_results_may_have_commas_between_them() -> None:
    text = "shaft.speed.mean 0,5 rad/s, efficiency 1 %, torque.max"
    assert spec_of({**values_of(REFINED), "/refine/results": text})[0]["refine"]["results"] == [
        {"result": "shaft.speed.mean", "error": "0,5 rad/s"}, {"result": "efficiency", "error": "1 %"}, "torque.max",
    ]  # fmt: skip


def test_an_empty_table_says_what_to_paste() -> None:
    checked = check_form({**values_of(REFINED), "/base/excitation/further": "measured"}, Chunking())
    assert checked.faults == {
        "/base/excitation/measured/csv": [
            "is empty; allowed: headings, then at least two lines, as in angle [rad],x [m],y [m]"
        ]
    }


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("/refine/results", "", "is required"),
        ("/refine/results", "shaft.speed.mean; speed", "speed"),
        ("/refine/results", "shaft.speed.mean; efficiency 30 %", "out of range"),
        ("/refine/results", "shaft.speed.mean 2 N*m", "rad/s"),
        ("/refine/error", "90 %", "out of range"),
        ("/refine/start", "16", "power of 2"),
        ("/refine/finest", "1/100", "power of 2"),
        ("/refine/most", "1", "out of range"),
        ("/axes/1/values", "? to 1.2 N*m", "must begin with a number"),
        ("/axes/1/values", "0 mm to 1.2 N*m refined", "not a unit of this field"),
        ("/axes/1/values", "1.2 to 1.2 N*m refined", "begins where it ends"),
        ("/axes/1/values", "0 to 1.2 N*m refined with 1.3", "is not between the ends of the axis"),
        ("/axes/1/values", "0 to 1.2 N*m refined with 0.3; 0.3", "is named twice"),
    ],
)
def test_each_fault_of_a_refinement_stands_beside_its_field(name: str, text: str, message: str) -> None:
    checked = check_form({**values_of(REFINED), name: text}, Chunking())
    assert message in " ".join(checked.faults[name])


FORMULAS = {
    "pendulums.*.inertia": "1.1 * pendulums.*.mass * pendulums.*.arm^2 + 2e-4 kg*m^2",
    "clutch.coefficients.1": "200 N*m/rad + 0 N*m/rad * max(shaft.inertia / 1 kg*m^2,1)",
}


def derived_spec() -> dict[str, Any]:
    spec: dict[str, Any] = json.loads(json.dumps(changed({"/derive": FORMULAS, "/base/clutch/coefficients/1": None})))
    del spec["base"]["pendulums"][0]["inertia"]
    return spec


def test_a_formula_is_written_into_the_field_of_its_parameter() -> None:
    spec = derived_spec()
    values = values_of(spec)
    assert values["/base/pendulums/0/inertia"].startswith("= 1.1 * pendulums.0.mass")
    assert values["/base/clutch/coefficients"].split("; ")[1].startswith("= 200 N*m/rad")
    again, faults = spec_of(values)
    assert faults == {}
    assert parse_spec(again).study == parse_spec(spec).study
    assert parse_spec(again).study.derive.keys() == {"pendulums.0.inertia", "clutch.coefficients.1"}


def test_a_wrong_formula_is_told_beside_its_field() -> None:
    values = values_of(derived_spec()) | {"/base/pendulums/0/inertia": "= 2 * pendulums.0.mass"}
    checked = check_form(values, Chunking())
    assert checked.faults.keys() == {"/base/pendulums/0/inertia"}
    assert "kg*m^2" in checked.faults["/base/pendulums/0/inertia"][0]
    values |= {"/base/pendulums/0/inertia": "= 2e-3 kg*m^2", "/base/clutch/coefficients": "0; = 1 kg; 0; 20000"}
    assert check_form(values, Chunking()).faults.keys() == {"/base/clutch/coefficients"}


def test_a_copied_pendulum_follows_from_its_own_parameters() -> None:
    values = values_of(derived_spec())
    reshape(values, "add-pendulums")
    assert "pendulums.1.mass * pendulums.1.arm^2" in values["/base/pendulums/1/inertia"]
    assert "pendulums.0.mass * pendulums.0.arm^2" in values["/base/pendulums/0/inertia"]


@pytest.mark.parametrize(
    "changes",
    [
        {"model": "machine-shaft", "base": {}},
        {"axes": [{"path": "shaft.load", "uniform": [0, 1]}]},
        {"axes": {"sample": "sobol"}},
        {"combine": "union"},
        {"exclude": [{"shaft.load": {"above": 1, "below": 2, "is": 3}}]},
    ],
)
def test_specs_that_the_form_cannot_show_are_not_forced_into_it(changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="form"):
        values_of({**drives()[0], **changes})


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("25", 25),
        (" 0.1 ", 0.1),
        ("1e-9", 1e-9),
        ("25 Hz", "25 Hz"),
        ("1,5", 1.5),
        ("1,500", "1,500"),
        ("nan", "nan"),
        ("1e999", "1e999"),
    ],
)
def test_plain_numbers_are_numbers_and_all_else_is_left_to_the_reader(text: str, value: Any) -> None:
    found = plain(text)
    assert found == value or (text == "1e999" and found == float("inf"))


def filled(**changes: str) -> dict[str, str]:
    values = values_of(load_spec(preset_text("one_pendulum")[1], "json"))  # type: ignore[arg-type]
    return {**values, **{name.replace("__", "/"): text for name, text in changes.items()}}


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("/base/excitation/frequency", "25 mm", "not a unit of this field"),
        ("/base/shaft/inertia", "", "is required"),
        ("/base/pendulums/0/mass", "-1", "out of range"),
        ("/base/clutch/coefficients", "0; -200", "negative"),
        ("/base/clutch/coefficients", "", "is required"),
        ("/base/gravity", "much", "must begin with a number"),
        ("/axes/0/values", "20 to 35 in 0", "out of range"),
        ("/axes/0/values", "20 to 35", "in which steps, or how many values"),
        ("/axes/0/values", "16 mm to 35 Hz in 4", "not a unit of this field"),
        ("/axes/1/values", "1,500 mm", "decimal point"),
        ("/axes/2/path", "shaft.lod", "shaft.load"),
        ("/run/tolerance", "1", "out of range"),
        ("/run/at_most", "1000", "number of excitation periods"),
        ("/run/max_period", "0", "out of range"),
        ("/run/settled", "2", "out of range"),
    ],
)
def test_each_fault_stands_beside_its_field(name: str, text: str, message: str) -> None:
    checked = check_form({**filled(), name: text}, Chunking())
    assert message in " ".join(checked.faults[name])
    assert checked.preview is None


TIMED = {"/run/until": "time", "/run/window/0": "40 periods", "/run/window/1": "60 periods"}


@pytest.mark.parametrize(
    ("changes", "name", "message"),
    [
        (TIMED | {"/run/window/1": "90 periods"}, "/run/window/1", "ends after the run"),
        (TIMED | {"/run/duration": "-1"}, "/run/duration", "out of range"),
    ],
)
def test_faults_of_a_run_for_a_given_time(changes: dict[str, str], name: str, message: str) -> None:
    checked = check_form({**filled(), **changes}, Chunking())
    assert message in " ".join(checked.faults[name])
    assert checked.preview is None


def test_an_empty_form_asks_for_settled_motion_and_the_other_choice_for_60_periods() -> None:
    assert "contradicts" not in str(check_form(EMPTY_FORM, Chunking()).faults)
    for values, run in (
        (EMPTY_FORM, {"until": "settled", "at_most": "1000 periods", "tolerance": 1e-9}),
        ({}, {"until": "settled"}),
        ({"/run/until": "time"}, {"duration": "60 periods"}),
        ({"/run/until": "time", "/run/duration": "2 s"}, {"duration": "2 s"}),
        ({"/run/until": "time", "/run/duration": "2 s", "/run/at_most": "900 periods"}, {"duration": "2 s"}),
        ({"/run/until": "settled", "/run/window/0": "40 periods", "/run/duration": "2 s"}, {"until": "settled"}),
    ):
        assert spec_of(values)[0]["run"] == run


def test_axes_that_are_not_filled_in_do_not_shift_the_faults() -> None:
    values = {"axes": "2", "/axes/1/path": "shaft.load", "/axes/1/values": "0 to 1 step 0.1"}
    assert field_of("/axes/0/range/2", values) == "/axes/1/values"
    assert field_of("/axes/0", values) == "/axes/1/path"
    assert field_of("/axes", values) == "/axes"


def test_a_clutch_is_fitted_whatever_else_is_wrong() -> None:
    data = {
        "/base/clutch/kind": "data",
        "/base/clutch/data": "0 0\n0.01 2\n0.02 4\n0.03 6",
        "/base/clutch/accuracy": "0.01",
    }
    checked = check_form(
        {**filled(), **data, "/base/shaft/inertia": "", "/base/clutch/through_origin": "on"}, Chunking()
    )
    assert "/base/shaft/inertia" in checked.faults
    fit, chart = checked.fits["/base/clutch"]
    assert fit["coefficients"] == pytest.approx([0.0, 200.0])
    assert len(chart.points) == len(chart.residuals) == 4
    # Residuals are nothing here, so every one lies on the line of zero.
    assert {y for _, y in chart.residuals} == {chart.zero}


def test_a_spec_as_text_is_looked_over() -> None:
    assert check_text("{", "json", Chunking()).faults["/text"]
    checked = check_text(preset_text("two_pendulums")[1], "toml", Chunking())
    assert (checked.faults, checked.preview and checked.preview["cases"]) == ({}, 96)


def test_what_is_known_already_is_told() -> None:
    checked = check_text(preset_text("two_pendulums")[1], "toml", Chunking(), lambda study: study.cases - 1)
    assert checked.preview is not None
    assert checked.preview["reusable"] == 95
    assert check_form(filled(), Chunking(), lambda _: 3).preview["reusable"] == 3  # type: ignore[index]
    assert 'data-reusable="95"' in fragment("_form_panel.html", checked=checked, address="")
    checked.preview["reusable"] = 0
    assert "data-reusable" not in fragment("_form_panel.html", checked=checked, address="")


VALUES = arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e9, 1e9) | st.just(float("nan")))


@given(VALUES, st.integers(5, 60))
def test_thinned_lines_keep_their_ends_and_extrema(y: np.ndarray, most: int) -> None:
    kept = thin(y, most)
    assert kept.size <= max(most, 5) or kept.size == y.size <= most
    assert np.all(np.diff(kept) > 0)
    assert {0, y.size - 1} <= set(kept.tolist())
    if np.isnan(y).any():
        assert np.isnan(y[kept]).any()
    if not np.isnan(y).all():
        assert np.nanmax(y[kept]) == np.nanmax(y)
        assert np.nanmin(y[kept]) == np.nanmin(y)


def test_a_hundred_thousand_points_keep_a_single_spike() -> None:
    y = np.sin(np.arange(100_000) / 500.0)
    y[61_803] = 40.0
    kept = thin(y, 2_000)
    assert kept.size <= 2_000
    assert 61_803 in kept


def test_numbers_are_written_for_people() -> None:
    assert [number(v) for v in (None, 0.0, 1234567, 123456.7, -4.5548e-6, 0.30000000000000004)] == [
        "–", "0", "1\u202f234\u202f567", "123\u202f460", "−4.5548·10⁻⁶", "0.3",
    ]  # fmt: skip
    assert [unit_text(u) for u in ("1", "kg*m^2", "N*m/rad^10")] == ["", "kg·m²", "N·m/rad¹⁰"]
    assert [number(v, 3) for v in (1130.4, 999.7, -4321.0)] == ["1130", "1000", "−4320"]
    # In one column: thousands are separated from 10 000 on, with decimals or without.
    assert [number(v, 6) for v in (10890, 9000, 13778.8, -13778.8, 9000.0, 1e-8, 2e-5)] == [
        "10\u202f890", "9000", "13\u202f778.8", "−13\u202f778.8", "9000", "1·10⁻⁸", "2·10⁻⁵",
    ]  # fmt: skip
    assert time_left({"low": 0.2, "high": 0.6}) == "less than 1 s"
    assert time_left({"low": 0.2, "high": 12.0}) == "less than 1 s to 12 s"
    letters = ("m2", "beta", "beta_1", "w_m", "M_c", "lambda", "nu/2pi")
    assert [str(symbol(letter)) for letter in letters] == [
        "<i>m</i><sub>2</sub>", "<i>β</i>", "<i>β</i><sub>1</sub>", "<i>ω</i><sub>m</sub>", "<i>M</i><sub>c</sub>",
        "<i>λ</i>", "<i>f</i>",
    ]  # fmt: skip
    assert [duration(s) for s in (0.2, 45.2, 400.0, 9000.0, 4e5)] == [
        "less than 1 s",
        "45 s",
        "6.7 min",
        "2.5 h",
        "4.6 days",
    ]


def test_clutches_of_their_own_begin_as_the_common_one_and_go_back_to_the_first_ones() -> None:
    values = {**filled(), "pendulums": "2", "/base/clutches": "own"}
    law = values["/base/clutch/coefficients"]
    share(values)
    assert [values[f"/base/pendulums/{index}/clutch/coefficients"] for index in (0, 1)] == [law, law]
    values |= {"/base/pendulums/0/clutch/coefficients": "0; 7", "/base/pendulums/1/clutch/coefficients": "0; 9"}
    share(values)
    assert values["/base/pendulums/1/clutch/coefficients"] == "0; 9"
    values["/base/clutches"] = "common"
    share(values)
    assert values["/base/clutch/coefficients"] == "0; 7"
    assert not [name for name in values if "pendulums" in name and "clutch" in name]


def test_no_torque_at_zero_windup_is_ticked_unless_said_otherwise() -> None:
    for values in (EMPTY_FORM, filled()):
        changed = {**values, "/base/clutch/kind": "data"}
        assert spec_of(changed)[0]["base"]["clutch"]["through_origin"] is True
    measured = {"data": [[0, 1], [0.1, 2]], "accuracy": 1, "through_origin": False}
    spec = spec_of(values_of({**spec_of(filled())[0], "base": {"clutch": measured, "pendulums": []}}))[0]
    assert spec["base"]["clutch"]["through_origin"] is False


def test_empty_fields_and_wrong_ones_are_counted_apart() -> None:
    checked = check_form(
        {**filled(), "/base/shaft/inertia": "", "/base/pendulums/0/inertia": " ", "/base/gravity": "much"}, Chunking()
    )
    assert (checked.missing, checked.attention) == (2, 1)
    told = str(fragment("_form_panel.html", checked=checked, address=""))
    assert "1 entry needs attention" in told
    assert "2 required fields are still empty" in told


def test_units_of_pasted_data_that_are_taken_for_granted_are_told() -> None:
    data = {"/base/clutch/kind": "data", "/base/clutch/data": "0\t0\n0,25\t0,878\n2\t7", "/base/clutch/accuracy": "9"}
    checked = check_form({**filled(), **data}, Chunking())
    assert checked.spec["base"]["clutch"]["data"][1] == [0.25, 0.878]
    assert [note for note in checked.notes if "taken in rad" in note and "taken in N*m" in note]
    assert [note for note in checked.notes if "was it in degrees?" in note]
    checked = check_form({**filled(), **data, "/base/clutch/data": "0,25 0,878\n"}, Chunking())
    assert checked.faults["/base/clutch/data"][0].startswith("line 1: 3 columns; got 0,25 0,878; allowed: two columns")


def test_values_are_repeated_as_people_write_them() -> None:
    assert "got 25;" in message(Fault(None, "out-of-range", "is wrong", value=25.0, allowed="0 .. 1"))
    assert "got 25.5;" in message(Fault(None, "out-of-range", "is wrong", value=25.5, allowed="0 .. 1"))


def test_a_part_after_the_run_stopped_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    study = parse_spec(drives()[0] | {"run": {"duration": "60 periods"}}).study

    def stopped(study: Study, case: int, start: float, end: float, points: int) -> models.Trajectory:
        times = np.linspace(start, end, points)
        times = times[times <= 0.0125]
        return models.Trajectory(times, (), (), np.zeros((times.size, 0)), {}, "chatter")

    monkeypatch.setattr(models, "run_trajectory", stopped)
    sentence = "There is no motion in this part: the run stopped at about t = 0.012 s with chatter."
    for view in (TrajectoryView(), PhasesView()):
        assert view.figure(see(study, 0, view, (0.5, 0.6, 2400), None)).note == sentence
