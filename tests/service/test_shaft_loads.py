"""Loads of machine shafts as results of studies: specs, goals, rows, files, captions and the form."""

from __future__ import annotations

import csv
import io
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.reading.reader import Choice, reading_for
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.report import SpecError
from sprag_study.service.storage.tables import results_table
from sprag_study.worker import models
from tests.service.conftest import API
from tests.service.results.settled import stored
from tests.service.spec.machine.test_shaft import PRESS

if TYPE_CHECKING:
    from tests.service.conftest import Service

LOADS = {"loads": True}
AXIS = {"path": "operation.scale", "values": [1.0, 1.2]}
SIX_BAR: dict[str, Any] = {
    "mean_speed": "20 rad/s", "drive": {"inertia": 3.0}, "operation": {"quantity": "force", "value": "700 N"},
    "mechanism": {"linkage": {
        "crank": "60 mm", "working": "R", "elements": [
            {"kind": "pivot", "name": "B", "x": "220 mm", "y": "30 mm"},
            {"kind": "RRR", "name": "C", "from": "A", "to": "B", "first": "200 mm", "second": "130 mm"},
            {"kind": "RRP", "name": "R", "from": "C", "to": "B", "first": "300 mm", "mass": "9 kg", "angle": "0.3 rad"},
        ],
    }},
}  # fmt: skip


def press(run: Any = LOADS, **fields: Any) -> dict[str, Any]:
    return {**deepcopy(PRESS), "axes": [AXIS], **fields, **({} if run is None else {"run": run})}


def six_bar(**fields: Any) -> dict[str, Any]:
    return {"sprag": 1, "model": "machine-shaft", "name": "six-bar", "base": deepcopy(SIX_BAR), "run": LOADS, **fields}


def named(spec: dict[str, Any]) -> list[str]:
    return [info.name for info in models.study_results(parse_spec(spec).study)]


def test_rows_without_loads_are_those_of_before_and_with_them_have_more() -> None:
    plain, off, full = (parse_spec(press(run)).study for run in (None, {"loads": False}, LOADS))
    assert off == plain
    assert (plain.run, full.run) == ({}, LOADS)
    assert (models.variant_of(plain), models.variant_of(full)) == ("", "loads-1-2")
    rows, more = (models.run_chunk(study, 0, 2).values for study in (plain, full))
    np.testing.assert_array_equal(more[:, : rows.shape[1]], rows)
    names = named(press())
    assert len(names) == more.shape[1] == rows.shape[1] + 3 + 4 + 2 * 4
    row = dict(zip(names, more[0].tolist(), strict=True))
    assert row["parts.0.stroke"] == pytest.approx(0.2, rel=1e-12)
    assert row["parts.0.force.max"] == pytest.approx(20e3, rel=1e-12)
    assert 2.0 * row["energy.start"] / row["omega.start"] ** 2 < row["inertia.max"] * (1.0 + 1e-9)
    assert not np.isnan(more[:, rows.shape[1] :]).any()
    assert models.estimate_seconds_per_case(full) > models.estimate_seconds_per_case(plain)


def test_all_variants_with_loads_share_a_table_that_has_their_columns() -> None:
    table = results_table("machine-shaft", "loads-1-7")
    assert table is results_table("machine-shaft", "loads-16-64") is results_table("machine-shaft", "loads")
    known = {column.name for column in table.columns}
    assert {info.column for info in models.result_infos("machine-shaft", "loads-3-11")} < known
    assert results_table("machine-shaft", "").name != table.name


def test_goals_and_quantities_use_them() -> None:
    goal = {
        "vary": [{"path": "drive.inertia", "from": 3.0, "to": 8.0}], "best": [{"result": "irregularity"}],
        "subject_to": [{"result": "joints.0.force.max", "at_most": "40 kN"}, {"result": "inertia.ratio", "at_most": 1}],
    }  # fmt: skip
    spec = {name: value for name, value in press(goal=goal).items() if name != "axes"}
    plan = parse_spec(spec).study.plan
    assert plan is not None
    assert [limit["result"] for limit in plan["subject_to"]] == ["joints.0.force.max", "inertia.ratio"]
    with pytest.raises(SpecError) as refused:
        parse_spec({**spec, "run": {}})
    assert "/goal/subject_to/0/result: is a result where `run` has `loads`" in str(refused.value)
    goal["subject_to"] = [{"result": "joints.2.force.max", "at_most": "40 kN"}]
    with pytest.raises(SpecError, match="/goal/subject_to/0/result: unknown result"):
        parse_spec(spec)
    asked = press(quantities={"mean_way": {"formula": "2*parts.0.stroke*omega.mean/(2*pi)", "unit": "m/s"}})
    assert named(asked)[-1] == "mean_way"


def test_what_a_run_of_a_shaft_may_have() -> None:
    for run, pointer, words in (
        ({"loads": "yes"}, "/run/loads", "must be true or false"), ({"duration": "3 s"}, "/run/duration", "solved for"),
        ([], "/run", "must be an object"),
    ):  # fmt: skip
        with pytest.raises(SpecError) as refused:
            parse_spec(press(run))
        assert f"{pointer}: " in str(refused.value)
        assert words in str(refused.value)
    many = six_bar()
    elements = many["base"]["mechanism"]["linkage"]["elements"]
    elements += [{"kind": "RRR", "name": f"D{k}", "from": "C", "to": "B", "first": 0.3, "second": 0.3}
                 for k in range(20)]  # fmt: skip
    with pytest.raises(SpecError, match="of machines with 64 joints at most, and this one has 67"):
        parse_spec(many)


def test_captions_name_the_joints() -> None:
    study = parse_spec(six_bar()).study
    reading = reading_for(study, {}, Choice())
    assert reading.caption("joints.1.force.max") == "Largest force, joint C.inner"
    assert reading.caption("parts.0.stroke") == "Stroke"
    spec = six_bar()
    base = spec["base"]
    base["parts"] = [{name: base.pop(name) for name in ("mechanism", "operation")}, {"crank_angle": "90 deg"}]
    reading = reading_for(parse_spec(spec).study, {}, Choice())
    assert reading.caption("joints.4.force.rms") == "Root mean square of the force, joint R.inner, part 1"
    assert reading.caption("parts.1.stroke") == "Stroke, part 2"


def test_curves_and_files_have_them(service: Service) -> None:
    study_id = service.submit(press())
    study = service.store.studies.study(study_id)
    rows = models.run_chunk(study, 0, 2)
    stored(service, study_id, rows)
    values = rows.values[:, named(press()).index("joints.1.force.rms")].tolist()
    (curve,) = service.get(f"/studies/{study_id}/curves", x="operation.scale", y="joints.1.force.rms")["curves"]
    assert curve["y"]["joints.1.force.rms"] == values
    text = service.http.get(f"{API}/studies/{study_id}/results", params={"format": "csv"}).text
    (first, second) = csv.DictReader(io.StringIO(text))
    assert [float(row["joints.1.force.rms"]) for row in (first, second)] == values
    assert not any("joints.2." in name or "parts.1." in name for name in first)
    page = service.http.get(f"/studies/{study_id}/cases/0").text
    assert page
    assert "Largest force, joint crank_pin" in service.http.get(f"/studies/{study_id}/rows").text


def test_the_form_keeps_them() -> None:
    given = press()
    values = {**empty("machine-shaft"), **values_of(given)}
    assert values["/run/loads"] == "on"
    made, faults = spec_of(values)
    assert not faults
    assert made["run"] == LOADS
    assert "run" not in spec_of({**values, "/run/loads": ""})[0]
