"""Forces and duty as results of studies: the numbers of the views of each case, and what is made of them."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sprag_study
from sprag_study.service.client import Client
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.spec.components import read_components
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.report import SpecError
from sprag_study.worker import models
from sprag_study.worker.models.abilities import bearing_of, run_forces
from sprag_study.worker.models.starts import at_start
from sprag_study.worker.study import Study
from tests.service.conftest import API, PortalTransport, Service
from tests.service.results.settled import stored

PENDULUM = {
    "inertia": 1e-3, "mass": 0.5, "arm": 0.03, "spring_rate": 9000.0, "spring_arm": 0.05, "damping": 0.01,
    "backlash": 0.005, "rated_torque": "5 N*m", "rated_frequency": "3000 1/min", "rated_speed": "300 rpm",
    "fatigue_exponent": 5,
}  # fmt: skip
BASE: dict[str, Any] = {
    "excitation": {"frequency": 20.0, "amplitude_x": "2 mm", "amplitude_y": "2 mm"},
    "pendulums": [PENDULUM],
    "clutch": {"coefficients": [0.0, 200.0, 0.0, 2e4]},
    "shaft": {
        "inertia": 2e-3, "load": 0.1, "rotor_mass": "0.7 kg", "bearing_rating": "6 kN", "bearing_share": "60 %",
        "bearing_exponent": 3.3,
    },
}  # fmt: skip
UNKNOWN = [name for name in PENDULUM if name.startswith(("rated", "fatigue"))]
TWO = deepcopy(BASE)
TWO["pendulums"] = [PENDULUM, {name: PENDULUM[name] for name in PENDULUM if name not in UNKNOWN}]
TWO["pendulums"][1]["spring_rate"] = 12000.0
LOADS = {"loads": True}
TIMED = {**LOADS, "duration": "24 periods", "window": ["14 periods", "20 periods"]}
#: No load and one at which nothing moves on among them; at 35 Hz the motion of the second one is irregular.
AXIS = {"path": "shaft.load", "values": [0.0, 0.1, 5.0]}


def spec(run: dict[str, Any], base: dict[str, Any] = BASE, **fields: Any) -> dict[str, Any]:
    return {"sprag": 1, "model": "vibration-drive", "name": "loads", "base": base, "run": run, **fields}


def study_of(run: dict[str, Any], base: dict[str, Any] = BASE, **fields: Any) -> Study:
    return parse_spec(spec(run, base, **fields)).study


def shown(study: Study, case: int) -> dict[str, float]:
    """What the views of a case tell."""
    numbers = dict(run_forces(study, case, bearing_of(study, case), 2).results)
    for row in models.run_duty(study, case, None).rows:
        names = (name for name in row.__slots__ if name != "clutch")
        numbers |= {f"pendulums.{row.clutch}.duty.{name}": getattr(row, name) for name in names}
    return numbers


def names_of(study: Study) -> list[str]:
    return [info.name for info in models.study_results(study)]


def loads_of(study: Study, values: Any) -> dict[str, float]:
    """The results of a row that a study without ``loads`` has not."""
    plain = set(names_of(study_without(study)))
    return {name: value for name, value in zip(names_of(study), values, strict=True) if name not in plain}


def study_without(study: Study) -> Study:
    return Study(
        study.model, study.name, study.base, {name: value for name, value in study.run.items() if name != "loads"},
        study.axes, study.combine, sweep=study.sweep,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("run", "base", "axis"),
    [
        (LOADS, BASE, AXIS),
        (TIMED, TWO, AXIS),
        ({**LOADS, "at_most": "900 periods"}, TWO, {"path": "excitation.frequency", "values": [20.0, 35.0]}),
        (LOADS, BASE, {"path": "excitation.frequency", "values": [20.0, 21.0, 22.0], "sweep": "down"}),
    ],
    ids=["settled", "timed", "two pendulums", "swept"],
)
def test_rows_have_the_numbers_of_the_views_and_all_others_are_as_without_them(
    run: dict[str, Any], base: dict[str, Any], axis: dict[str, Any]
) -> None:
    study = study_of(run, base, axes=[axis])
    result = models.run_chunk(study, 0, study.cases)
    plain = models.run_chunk(study_without(study), 0, study.cases)
    assert (result.endings, result.flags) == (plain.endings, plain.flags)
    np.testing.assert_array_equal(result.values[:, : plain.values.shape[1]], plain.values)
    assert result.endings == ["ok"] * study.cases
    for case in range(study.cases):
        numbers, row = shown(study, case), loads_of(study, result.values[case])
        assert len(row) == 19 + 16 * len(base["pendulums"])
        np.testing.assert_array_equal(list(row.values()), [numbers.get(name, math.nan) + 0.0 for name in row])


def test_rows_of_several_regimes_have_those_of_each() -> None:
    two_wells = deepcopy(BASE)
    two_wells["pendulums"][0] |= {"spring_rate": 50.0, "backlash": 1.0}
    starts = {"count": 4, "ranges": {"pendulums.0.initial_angle": ["-1 rad", "1 rad"]}}
    study = study_of({**LOADS, "at_most": "300 periods"}, two_wells, starts=starts)
    result = models.run_chunk(study, 0, 1)
    assert result.further is not None
    rows = np.vstack([result.values, result.further.values])
    assert len(rows) > 1
    for values in rows:
        row = dict(zip(names_of(study), values, strict=True))
        numbers = shown(at_start(study, 0, int(row["regime.start"])), 0)
        loads = [name for name in row if name.startswith(("table.", "bearing.")) or ".duty." in name]
        np.testing.assert_array_equal([row[name] for name in loads], [numbers.get(n, math.nan) + 0.0 for n in loads])


def test_margins_are_ratings_over_what_other_results_tell() -> None:
    study = study_of(LOADS, TWO)
    row = dict(zip(names_of(study), models.run_chunk(study, 0, 1).values[0], strict=True))
    assert row["pendulums.0.duty.torque_margin"] == pytest.approx(5.0 / row["pendulums.0.torque.max"], rel=1e-12)
    turn = row["regime.order"] / 20.0
    assert row["pendulums.0.duty.frequency_margin"] == pytest.approx(50.0 * turn / row["pendulums.0.engagements"])
    fastest = row["pendulums.0.duty.overrunning_speed_max"]
    assert row["pendulums.0.duty.speed_margin"] == pytest.approx(300.0 * math.pi / 30.0 / fastest)
    assert row["shaft.speed.max"] - row["pendulums.0.speed.min"] >= fastest > row["shaft.speed.min"]
    unknown = ("torque_margin", "frequency_margin", "speed_margin", "torque_equivalent")
    assert all(math.isnan(row[f"pendulums.1.duty.{name}"]) for name in unknown)
    assert row["bearing.load.rms"] == 0.6 * row["table.force.rms"]
    power = row["excitation.power_x.mean"] + row["excitation.power_y.mean"]
    assert power == pytest.approx(row["power.input.mean"], rel=1e-9)


def test_studies_without_them_are_those_of_before() -> None:
    plain, off = study_of({}), study_of({"loads": False})
    assert off == plain
    assert "loads" not in plain.run
    assert models.variant_of(plain) == "1-settled"
    assert models.variant_of(study_of(LOADS)) == "1-settled-loads"


def test_the_estimate_counts_the_periods_that_they_examine() -> None:
    def longer(start: int, end: int) -> float:
        study = study_of({**LOADS, "duration": "2000 periods", "window": [f"{start} periods", f"{end} periods"]})
        return models.estimate_seconds_per_case(study) - models.estimate_seconds_per_case(study_without(study))

    nothing = longer(0, 100)  # only the last 500 periods are examined
    each = longer(1990, 2000) - nothing
    assert each > 0.0
    assert longer(1800, 2000) - nothing == pytest.approx(20.0 * each)
    assert longer(0, 2000) - nothing == pytest.approx(50.0 * each)


def test_a_goal_needs_them_in_the_run() -> None:
    goal = {
        "vary": [{"path": "shaft.load", "from": "0.1 N*m", "to": "0.5 N*m"}],
        "best": [{"result": "table.force.rms"}],
        "subject_to": [{"result": "pendulums.0.duty.torque_margin", "at_least": 1.5}],
    }
    with pytest.raises(SpecError) as refused:
        parse_spec(spec({}, goal=goal))
    for place in ("/goal/best/0/result", "/goal/subject_to/0/result"):
        assert f"{place}: is a result where `run` has `loads`" in str(refused.value)
    assert str(refused.value).count('allowed: "loads": true in `run`') == 2
    plan = study_of(LOADS, goal=goal).plan
    assert plan is not None
    (limit,) = plan["subject_to"]
    assert (limit["result"], limit["at_least"]) == ("pendulums.0.duty.torque_margin", 1.5)
    with pytest.raises(SpecError, match="must be true or false"):
        parse_spec(spec({"loads": "yes"}))


@pytest.mark.parametrize("run", [{}, LOADS])
def test_a_goal_of_a_pendulum_that_is_not_there_is_of_an_unknown_result(run: dict[str, Any]) -> None:
    goal = {"vary": [{"path": "shaft.load", "from": 0.1, "to": 0.5}], "best": [{"result": "pendulums.1.force.max"}]}
    with pytest.raises(SpecError, match="/goal/best/0/result: unknown result"):
        parse_spec(spec(run, goal=goal))


def test_a_machine_shaft_is_not_told_to_have_them() -> None:
    shaft = sprag_study.preset("least_flywheel")
    with pytest.raises(SpecError, match="/goal/best/0/result: unknown result"):
        parse_spec({**shaft, "goal": {**shaft["goal"], "best": [{"result": "table.force.rms"}]}})


def test_a_refinement_may_follow_a_force() -> None:
    refine = {"results": ["table.force.rms"], "error": "5 %", "start": 3, "most": 5}
    plan = study_of(LOADS, axes=[{"path": "shaft.load", "adaptive": ["0.1 N*m", "0.3 N*m"]}], refine=refine).plan
    assert plan is not None
    assert "table.force.rms" in json.dumps(plan)


def test_a_search_keeps_to_a_margin(tmp_path: Path, sprag: Callable[..., Any]) -> None:
    vary = {"path": "excitation.amplitude_x", "from": "1.5 mm", "to": "3 mm"}
    limit = {"result": "pendulums.0.duty.torque_margin", "at_least": 3.7}
    best = {"result": "shaft.speed.mean", "max": True}
    goal = {"vary": [vary], "best": [best], "subject_to": [limit], "population": 6, "generations": 3}
    (tmp_path / "spec.json").write_text(json.dumps(spec(TIMED, goal=goal)), encoding="utf-8")
    run = ("run", tmp_path / "spec.json", "--processes", 1, "--db", tmp_path / "db.sqlite3")
    done = sprag(*run, "-o", tmp_path / "rows.csv")
    assert done.code == 0, done.err
    rows = list(csv.DictReader((tmp_path / "rows.csv").read_text(encoding="utf-8").splitlines()))
    margins = [float(row["pendulums.0.duty.torque_margin"]) for row in rows]
    assert min(margins) < 3.7 < max(margins)  # the limit decides
    front = sprag("show", tmp_path / "spec.json", "front", "--db", tmp_path / "db.sqlite3", "--json")
    assert front.code == 0, front.err
    first, *_ = json.loads(front.out)["designs"]
    assert first["results"]["pendulums.0.duty.torque_margin"][0] >= 3.7
    assert first["cases"][0] != margins.index(min(margins))


def test_curves_files_and_frames_have_them(service: Service, portal: Any) -> None:
    study_id = service.submit(spec(TIMED, axes=[{"path": "shaft.load", "values": [0.1, 0.2]}]))
    study = service.store.studies.study(study_id)
    rows = models.run_chunk(study, 0, 2)
    stored(service, study_id, rows)
    name = "pendulums.0.duty.torque_margin"
    values = rows.values[:, names_of(study).index(name)].tolist()
    (curve,) = service.get(f"/studies/{study_id}/curves", x="shaft.load", y=name)["curves"]
    assert curve["y"][name] == values
    text = service.http.get(f"{API}/studies/{study_id}/curves", params={"x": "shaft.load", "y": name, "format": "csv"})
    assert [float(row[name]) for row in csv.DictReader(io.StringIO(text.text))] == values
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(study_id).grid()[name].values.tolist() == values
    forces = service.get(f"/studies/{study_id}/cases/1/forces")
    assert (forces["shaft_mass"], forces["load_rating"], forces["share"], forces["exponent"]) == (0.7, 6e3, 0.6, 3.3)
    life = names_of(study).index("bearing.rating_life.time")
    assert forces["results"]["bearing.rating_life.time"] == rows.values[1, life]
    (duty,) = service.get(f"/studies/{study_id}/cases/1/duty")["clutches"]
    assert duty["torque_margin"] == values[1]
    page = service.http.get(f"/studies/{study_id}/cases/1?show=duty").text
    assert "Rated torque over the largest" in page


def test_the_form_keeps_them() -> None:
    given = spec(TIMED, axes=[AXIS])
    values = {**empty("vibration-drive"), "/run/at_most": "", **values_of(given)}
    assert values["/run/loads"] == "on"
    made, faults = spec_of(values)
    assert not faults
    assert made["run"]["loads"] is True
    assert parse_spec(made).study == parse_spec(given).study


def test_a_clutch_of_the_office_has_its_ratings() -> None:
    text = "kind,name,coefficients,rated_torque [N*m],rated_speed [rpm]\nclutch,FX,0; 200,40,900\n"
    (component,) = read_components({"csv": text})
    assert component.fields["rated_torque"] == "40 N*m"
