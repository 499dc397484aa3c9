"""Specs written in Python: the classes of the models, their methods, and the names of parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

import sprag_study as sprag
from sprag_study.service.client import ArgumentError
from sprag_study.service.client.queries import CASE_FIELDS, spec_of
from sprag_study.service.plain_data import plain
from sprag_study.service.presets import preset_names
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.kinds.registry import CASES
from sprag_study.worker import models

CLASSES: dict[str, Any] = {"vibration-drive": sprag.Drive, "machine-shaft": sprag.Shaft}
SPEED = "shaft.speed.mean"
PENDULUM: dict[str, Any] = {
    "inertia": 1e-3, "mass": 0.5, "arm": "30 mm", "spring_rate": 9000, "spring_arm": "50 mm", "damping": 0.01,
}  # fmt: skip


def drive(pendulums: int = 1) -> sprag.Drive:
    return sprag.Drive(
        excitation={"frequency": "25 Hz", "amplitude_x": "2 mm", "amplitude_y": "2 mm"},
        pendulums=[PENDULUM] * pendulums,
        shaft={"inertia": 2e-3},
        clutch={"coefficients": [0, 200, 0, 20000]},
        run={"duration": "60 periods"},
    )


def cases(draft: Any) -> int:
    data, faults = plain(draft)
    assert not faults
    return parse_spec(data).study.cases


def test_every_model_has_a_class() -> None:
    assert {kind._model for kind in CLASSES.values()} == set(models.model_names())


def test_every_preset_is_a_draft_of_its_model() -> None:
    for name in preset_names():
        spec = sprag.preset(name)
        draft = CLASSES[spec["model"]].of(name)
        assert dict(draft) == spec
        assert repr(draft).startswith(f"{type(draft).__name__}({spec['name']!r}")


def test_every_parameter_of_a_drive_has_its_name() -> None:
    spec = parse_spec(plain(drive(2))[0]).study
    for path in spec.base:
        if ".coefficients." not in path:
            assert drive(2).path(path) == path
            assert path.replace(".0.", ".*.").replace(".1.", ".*.") in sprag.Drive._parameters


def test_values_of_any_kind_vary_by_name() -> None:
    draft = drive().vary(load=np.linspace(0.0, 0.4, 3), frequency=["20 Hz", "25 Hz"])
    assert cases(draft) == 6
    assert [axis["path"] for axis in draft["axes"]] == ["shaft.load", "excitation.frequency"]
    assert "axes" not in drive()
    assert cases(draft.vary({"shaft.load": "0 to 1 N*m step 0.5 N*m"})) == 6
    assert cases(draft.vary(shaft__load={"geomspace": ["0.1 N*m", "1 N*m", 4]})) == 8
    assert repr(draft) == "Drive(varies shaft.load, excitation.frequency)"
    held = draft.hold(load="0.3 N*m", excitation__frequency=21.5)
    assert cases(held) == 1
    assert (held["base"]["shaft"]["load"], held["base"]["excitation"]["frequency"]) == ("0.3 N*m", 21.5)
    assert cases(draft) == 6
    second = drive(2).hold({"pendulums.1.mass": "0.4 kg"})
    assert [pendulum["mass"] for pendulum in second["base"]["pendulums"]] == [0.5, "0.4 kg"]


@pytest.mark.parametrize(
    ("name", "allowed"),
    [
        ("lod", "load"),
        ("inertia", "one of the paths pendulums.0.inertia, pendulums.1.inertia, shaft.inertia"),
        ("mass", "one of the paths pendulums.0.mass, pendulums.1.mass"),
    ],
)
def test_a_name_that_is_none_or_several_is_refused(name: str, allowed: str) -> None:
    with pytest.raises(ArgumentError, match=f"{name}: .*{allowed}"):
        drive(2).vary({name: [1.0]})


def test_a_condition_needs_no_blanks() -> None:
    best = {"shaft.speed.mean": "max"}
    spec = drive().goal(vary={"frequency": ("20 Hz", "35 Hz")}, best=best, subject_to=["torque.max<=3 N*m"])
    assert spec["goal"]["subject_to"] == [{"result": "torque.max", "at_most": "3 N*m"}]


def test_what_is_held_leaves_a_shared_axis_to_the_others() -> None:
    draft = sprag.Drive.of("one_pendulum").hold(amplitude_x="1 mm")
    (axis,) = (axis for axis in draft["axes"] if axis["path"] == "excitation.amplitude_y")
    assert len(axis["values"]) > 1
    assert draft["base"]["excitation"]["amplitude_x"] == "1 mm"


def test_what_is_held_leaves_points_samples_and_groups() -> None:
    points = {"points": "excitation.frequency [Hz],shaft.load [N*mm]\n25,100\n26,150\n"}
    base = {"sprag": 1, "model": "vibration-drive", "base": drive()["base"]}
    draft = sprag.Drive.of({**base, "axes": [points]})
    assert repr(draft) == "Drive(varies excitation.frequency, shaft.load)"
    held = draft.hold(load="0.3 N*m")
    assert held["axes"] == [{"points": "excitation.frequency [Hz]\n25\n26\n"}]
    assert cases(held) == 2
    assert "axes" not in held.hold(frequency="25 Hz")
    assert cases(draft.vary(load=[0.1, 0.2, 0.3])) == 6
    commas = sprag.Drive.of({**base, "axes": [{"points": "shaft.load, excitation.frequency\n0,5, 20,25\n1,5, 21,5\n"}]})
    (held_points,) = commas.hold(load=0.1)["axes"]
    assert held_points == {"points": "sep=;\nexcitation.frequency\n20,25\n21,5\n"}
    assert cases(commas.hold(load=0.1)) == 2
    for begin, sign, cells in (("", "\t", "20,25"), ("sep=|\n", "|", "20.25"), ("sep=|\n", "|", "20,25")):
        text = f"{begin}shaft.load{sign}excitation.frequency\n0.5{sign}{cells}\n"
        left = sprag.Drive.of({**base, "axes": [{"points": text}]}).hold(load=0.1)
        assert left["axes"] == [{"points": f"sep={sign}\nexcitation.frequency\n{cells}\n"}]
        assert cases(left) == 1
    ranges = [{"path": path, "from": 0.1, "to": 0.2} for path in ("shaft.load", "excitation.amplitude_y")]
    sample = {"sample": "sobol", "count": 4, "ranges": ranges}
    group = {"combine": "zip", "axes": [sample]}
    held = sprag.Drive.of({**base, "axes": [group]}).hold(load=0.1)
    assert held["axes"] == [{"combine": "zip", "axes": [{**sample, "ranges": ranges[1:]}]}]
    assert "axes" not in held.hold(amplitude_y="1 mm")


def test_a_part_that_is_not_there_is_refused() -> None:
    with pytest.raises(ArgumentError, match="a place from 0 to 0"):
        drive(1).hold({"pendulums.1.mass": "0.4 kg"})


def test_a_draft_of_another_model_is_refused() -> None:
    with pytest.raises(ArgumentError, match="a spec of the model 'vibration-drive'"):
        sprag.Drive.of("press")
    with pytest.raises(sprag.SpecFileError):
        sprag.Drive.of("nothing")


def test_goals_are_written_by_name() -> None:
    draft = drive().goal(
        vary={"frequency": ("20 Hz", "35 Hz"), "shaft__inertia": ["1e-3 kg*m^2", "2e-3 kg*m^2"]},
        best={"shaft.speed.mean": "max"},
        subject_to=["torque.max <= 3 N*m"],
        population=8,
        generations=2,
    )
    assert draft["goal"] == {
        "vary": [
            {"path": "excitation.frequency", "from": "20 Hz", "to": "35 Hz"},
            {"path": "shaft.inertia", "values": ["1e-3 kg*m^2", "2e-3 kg*m^2"]},
        ],
        "best": [{"result": "shaft.speed.mean", "max": True}],
        "subject_to": [{"result": "torque.max", "at_most": "3 N*m"}],
        "population": 8,
        "generations": 2,
    }
    assert cases(draft) == 8
    assert repr(draft) == "Drive(goal)"
    with pytest.raises(ArgumentError, match="'min', 'max'"):
        drive().goal(vary={"frequency": (20, 35)}, best={"efficiency": "largest"})


def test_other_studies_and_fields_are_written_too() -> None:
    assert cases(drive().set(name="batch", tolerances={"mass": "5 %"}, drives=8)) == 9
    refined = drive().vary(load={"adaptive": ["0 N*m", "1 N*m"]}).refine(results="shaft.speed.mean")
    assert refined["refine"] == {"results": ["shaft.speed.mean"]}
    assert cases(refined) > 1
    errors = {"torque.max": None, "shaft.speed.mean": "0.5 rad/s", "efficiency": 0.005}
    listed = ["torque.max", *({"result": name, "error": error} for name, error in errors.items() if error)]
    for results in (errors, listed):
        assert refined.refine(results=results)["refine"] == {"results": listed}
    assert cases(refined.refine(results=errors)) == 17
    assert cases(sprag.Shaft.of("press").vary(mean_speed=["60 rpm"])) == 13


def test_a_draft_is_run_as_any_spec_is() -> None:
    with sprag.run(drive().vary(load=[0.0, 0.1]), processes=0) as study:
        assert len(study) == 2
        assert study.name == "untitled"


def test_a_search_takes_the_place_of_what_varies() -> None:
    draft = sprag.Drive.of("one_pendulum").set(combine="grid")
    search = draft.goal(vary={"mass": (0.3, 0.6)}, best={"efficiency": "max"}, population=8, generations=2)
    assert cases(search) == 8
    measured = {"csv": "shaft.load,shaft.speed.mean\n0,4\n0.1,3\n0.2,2"}
    assert dict(search.calibrate(unknown={"mass": (0.3, 0.6)}, measured=measured)).keys() & {"axes", "goal"} == set()
    table = spec_of(search, cases={"shaft.load": [0.0, 0.1]})
    assert table.keys() & CASE_FIELDS == {"axes"}


def test_fields_that_say_which_cases_a_study_has_are_those_of_the_spec() -> None:
    assert frozenset(CASES.fields) == CASE_FIELDS


def test_a_number_in_a_condition_is_one() -> None:
    goal = drive().goal(vary={"mass": (0.3, 0.6)}, subject_to=["efficiency >= 0.5", "torque.max <= 3 N*m"])
    assert goal["goal"]["subject_to"][0]["at_least"] == 0.5
    assert goal["goal"]["subject_to"][1]["at_most"] == "3 N*m"
    limited = drive().goal(vary={"mass": (0.3, 0.6)}, best={"efficiency": "max"}, subject_to=["efficiency >= 0.5"])
    assert cases(limited) == 100


def test_measured_points_are_a_table() -> None:
    table = pd.DataFrame({"shaft.load": [0.05, 0.1, 0.2], SPEED: [400.0, np.nan, 300.0], "sigma": [4.0, np.nan, 3.0]})
    table.attrs["units"] = {"shaft.load": "N*m", SPEED: "rpm"}
    text = f"shaft.load [N*m],{SPEED} [rpm],sigma\n0.05,400.0,4.0\n0.1,,\n0.2,300.0,3.0\n"
    for measured in (table, {"csv": text}):
        draft = drive().set(run={}).calibrate(unknown={"damping": (0.001, 0.1)}, measured=measured)
        assert draft["calibrate"]["measured"] == {"csv": text}
    rows = [{"shaft.load": "0.1 N*m", SPEED: 40.0}, {"shaft.load": 0.2, SPEED: 30.0}]
    assert cases(drive().calibrate(unknown={"damping": (0.001, 0.1)}, measured=rows)) > 2
    sensors = {SPEED: {"gain": 1.02, "offset": ("-1 rad/s", "1 rad/s")}}
    read = drive().calibrate(unknown={"damping": (0.001, 0.1)}, measured=rows, sensors=sensors)["calibrate"]["sensors"]
    assert read == [{"result": SPEED, "gain": 1.02, "offset": {"from": "-1 rad/s", "to": "1 rad/s"}}]
    with pytest.raises(ArgumentError, match="gain"):
        drive().calibrate(unknown={"damping": (0.001, 0.1)}, measured=rows, sensors={SPEED: 1.02})
    with pytest.raises(ArgumentError, match="measured"):
        drive().calibrate(unknown={"damping": (0.001, 0.1)}, measured=3)
