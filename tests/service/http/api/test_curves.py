"""Curves and maps: the right cases at the right points, exact, and every unclear question refused by name."""

from __future__ import annotations

import csv
import io
import math
import pickle
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.service.answers import results
from sprag_study.service.faults import SelectionError
from sprag_study.service.http import respond
from sprag_study.service.results.curve_cases import select
from sprag_study.service.results.curves import CurveQuery
from sprag_study.worker import models
from tests.service.shapes import fits

if TYPE_CHECKING:
    import httpx
    from conftest import Service

    from sprag_study.worker.models import ChunkResult
    from sprag_study.worker.study import Study

API = "/api/v1"
TIED = ["excitation.amplitude_x", "excitation.amplitude_y"]


@pytest.fixture
def grid(spec: dict[str, Any]) -> dict[str, Any]:
    """Three axes with values out of order, one of them tied, and an axis of one value."""
    spec["axes"] = [
        {"path": "excitation.frequency", "values": [25, 16, "35 Hz"]},
        {"path": TIED, "values": ["1 mm", "2 mm"]},
        {"path": "pendulums.0.mass", "values": [0.5]},
        {"path": "shaft.load", "values": [0.3, 0.02, 0.1]},
    ]
    return spec


def ask(service: Service, study_id: str, query: str, kind: str = "curves") -> httpx.Response:
    return service.http.get(f"{API}/studies/{study_id}/{kind}?{query}")


def expected(study: Study, rows: ChunkResult, name: str, **fixed: float) -> list[float | None]:
    """Results in ascending order of load of the cases with these parameters, found by looking at every case."""
    column = [info.name for info in models.study_results(study)].index(name)
    found = []
    for case in range(study.cases):
        parameters = study.case_parameters(case)
        if all(parameters[path.replace("__", ".")] == value for path, value in fixed.items()):
            value = float(rows.values[case, column])
            found.append((parameters["shaft.load"], None if math.isnan(value) else value))
    return [value for _, value in sorted(found, key=lambda pair: pair[0])]


def test_curves_are_the_rows_bit_for_bit(service: Service, grid: dict[str, Any]) -> None:
    study_id = service.submit(grid)
    rows = service.fill(study_id)
    study = service.store.studies.study(study_id)
    response = ask(
        service,
        study_id,
        "x=shaft.load&y=shaft.speed.mean&y=torque.max&by=excitation.frequency&at=excitation.amplitude_y=2%20mm",
    )
    body = response.json()
    fits(results.Curves, body)
    assert body["x"] == {"path": "shaft.load", "unit": "N*m", "values": [0.02, 0.1, 0.3]}
    assert body["results"]["torque.max"]["unit"] == "N*m"
    assert body["units"]["excitation.frequency"] == "Hz"
    assert [curve["by"] for curve in body["curves"]] == [{"excitation.frequency": f} for f in (16.0, 25.0, 35.0)]
    for curve in body["curves"]:
        assert curve["at"] == {"excitation.amplitude_y": 0.002, "pendulums.0.mass": 0.5}
        for name in ("shaft.speed.mean", "torque.max"):
            fixed = {"excitation__frequency": curve["by"]["excitation.frequency"], "excitation__amplitude_x": 0.002}
            assert curve["y"][name] == expected(study, rows, name, **fixed)
        assert curve["endings"] == [rows.endings[case] for case in curve["cases"]]
        for case, value in zip(curve["cases"], curve["x"], strict=True):
            assert study.case_parameters(case)["shaft.load"] == value
    assert any(None in curve["y"]["torque.max"] for curve in body["curves"])


def test_points_not_computed_yet_are_pending(service: Service, grid: dict[str, Any]) -> None:
    study_id = service.submit(grid)
    service.fill(study_id, range(2))
    query = "x=shaft.load&y=torque.max&at=excitation.frequency=25&at=excitation.amplitude_x=0.001"
    (curve,) = ask(service, study_id, query).json()["curves"]
    by_case = dict(zip(curve["cases"], zip(curve["endings"], curve["y"]["torque.max"], strict=True), strict=True))
    assert by_case[0][0] == by_case[1][0] == "ok"
    assert by_case[0][1] is not None
    assert by_case[2] == ("pending", None)


def test_a_study_without_choice_needs_no_at(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = [{"path": "shaft.load", "linspace": [0, 1, 5]}, {"path": "excitation.phase", "values": [0]}]
    study_id = service.submit(spec)
    (curve,) = ask(service, study_id, "x=shaft.load&y=efficiency").json()["curves"]
    assert curve["at"] == {"excitation.phase": 0.0}
    assert curve["x"] == [0.0, 0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize(
    ("query", "parameter", "code", "allowed"),
    [
        (
            "x=shaft.load&y=torque.max&by=excitation.frequency",
            "at",
            "not-fixed",
            "0.001, 0.002",
        ),
        ("x=shaft.lod&y=torque.max", "x", "not-an-axis", "shaft.load"),
        ("x=shaft.inertia&y=torque.max", "x", "not-an-axis", "shaft.load"),
        ("x=shaft.load&y=torque.maxx", "y", "unknown-name", "torque.mean"),
        ("x=shaft.load&y=torque.max&by=shaft.load", "by", "repeated", None),
        ("x=shaft.load&y=torque.max&at=shaft.load=0.1", "at", "repeated", None),
        ("x=shaft.load&y=torque.max&at=excitation.frequency=17", "at", "unknown-value", "16.0, 25.0, 35.0"),
        ("x=shaft.load&y=torque.max&at=excitation.frequency=2%20mm", "at", "wrong-unit", None),
        ("x=shaft.load&y=torque.max&at=excitation.frequency=fast", "at", "not-a-number", None),
        ("x=shaft.load&y=torque.max&at=excitation.frequency=1e999", "at", "out-of-range", None),
        ("x=shaft.load&y=torque.max&at=excitation.frequency=nan", "at", "not-a-number", None),
        (
            "x=shaft.load&y=torque.max&at=excitation.amplitude_x=0.001&at=excitation.amplitude_y=0.002",
            "at",
            "repeated",
            None,
        ),
        ("x=shaft.load&y=torque.max&at=excitation.frequency", "at", "invalid-text", None),
        ("x=shaft.load&y=torque.max&bye=excitation.frequency", "bye", "unknown-field", None),
        ("x=shaft.load&x=shaft.load&y=torque.max", "x", "repeated", None),
        ("x=shaft.load&y=torque.max&format=docx", "format", "invalid-choice", "json, csv, svg, png, pdf"),
    ],
)
def test_what_is_not_clear_is_refused_by_name(
    service: Service, grid: dict[str, Any], query: str, parameter: str, code: str, allowed: str | None
) -> None:
    response = ask(service, service.submit(grid), query)
    assert response.status_code == 422
    (error,) = [item for item in response.json()["errors"] if item["parameter"] == parameter]
    assert error["code"] == code
    if allowed is not None:
        assert allowed in error["allowed"]


def test_a_fixed_parameter_may_be_named_with_its_own_value(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit(spec)
    query = "x=shaft.load&y=torque.max&by=excitation.frequency&at=shaft.inertia=2e-3%20kg*m^2"
    assert ask(service, study_id, query).status_code == 200
    assert ask(service, study_id, query.replace("2e-3", "3e-3")).status_code == 422


def test_values_are_found_within_their_rounding(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = [
        {"path": "excitation.frequency", "linspace": [16, 35, 3]},
        {"path": "shaft.load", "values": [0.1, 0.3]},
    ]
    study_id = service.submit(spec)
    for text in ("25.5", "25.50000000001", "1530 rpm", "160.22122533307945 rad/s"):
        (curve,) = ask(service, study_id, f"x=shaft.load&y=torque.max&at=excitation.frequency={text}").json()["curves"]
        assert curve["at"] == {"excitation.frequency": 25.5}


def test_zipped_axes_give_a_curve_for_each_machine(service: Service, spec: dict[str, Any]) -> None:
    spec["combine"] = "zip"
    spec["axes"] = [
        {"path": "shaft.load", "values": [0.3, 0.1, 0.2, 0.1]},
        {"path": "excitation.frequency", "values": [25, 16, 25, 20]},
    ]
    study_id = service.submit(spec)
    rows = service.fill(study_id)
    body = ask(service, study_id, "x=shaft.load&y=torque.max").json()
    assert body["x"]["values"] == [0.1, 0.2, 0.3]
    grouped = ask(service, study_id, "x=shaft.load&y=torque.max&by=excitation.frequency").json()["curves"]
    assert grouped == body["curves"]
    assert [(c["by"]["excitation.frequency"], c["x"], c["cases"]) for c in grouped] == [
        (16.0, [0.1], [1]),
        (20.0, [0.1], [3]),
        (25.0, [0.2, 0.3], [2, 0]),
    ]
    column = [info.name for info in models.result_infos("vibration-drive", "1")].index("torque.max")
    assert grouped[2]["y"]["torque.max"] == [rows.values[2, column], rows.values[0, column]]
    at = ask(service, study_id, "x=shaft.load&y=torque.max&at=excitation.frequency=25").json()
    assert at["curves"][0]["cases"] == [2, 0]
    nothing = ask(service, study_id, "x=shaft.load&y=torque.max&at=excitation.frequency=17")
    assert nothing.status_code == 422
    refused = ask(service, study_id, "x=shaft.load&y=excitation.frequency&z=torque.max", "map")
    assert [item["code"] for item in refused.json()["errors"]] == ["not-a-grid"]


def test_a_map_has_rows_of_y(service: Service, grid: dict[str, Any]) -> None:
    study_id = service.submit(grid)
    rows = service.fill(study_id)
    study = service.store.studies.study(study_id)
    body = ask(
        service, study_id, "x=shaft.load&y=excitation.frequency&z=torque.max&at=excitation.amplitude_x=1%20mm", "map"
    ).json()
    fits(results.Map, body)
    assert body["y"]["values"] == [16.0, 25.0, 35.0]
    assert body["at"] == {"excitation.amplitude_x": 0.001, "pendulums.0.mass": 0.5}
    for frequency, values in zip(body["y"]["values"], body["z"]["values"], strict=True):
        fixed = {"excitation__frequency": frequency, "excitation__amplitude_y": 0.001}
        assert values == expected(study, rows, "torque.max", **fixed)
    assert np.shape(body["endings"]) == np.shape(body["cases"]) == (3, 3)
    twice = ask(service, study_id, "x=shaft.load&y=shaft.load&z=torque.max&at=excitation.frequency=25", "map")
    assert [item["parameter"] for item in twice.json()["errors"]] == ["y"]
    left = ask(service, study_id, "x=shaft.load&y=excitation.frequency&z=torque.max", "map")
    (error,) = left.json()["errors"]
    assert error["parameter"] == "at"
    assert "at=excitation.amplitude_x=" in left.json()["detail"]
    assert "by=" not in left.json()["detail"]


@pytest.mark.parametrize(
    "address",
    [
        "/api/v1/studies/{}/curves?x=shaft.load&y=torque.max&by=excitation.frequency&at=excitation.amplitude_x=0.001",
        "/api/v1/studies/{}/curves?x=shaft.load&y=torque.max&at=excitation.frequency=16&at=excitation.amplitude_x=0.001"
        "&format=csv",
        "/api/v1/studies/{}/map?x=shaft.load&y=excitation.frequency&z=torque.max&at=excitation.amplitude_x=0.001",
    ],
)
def test_many_numbers_are_written_by_a_process_that_checks(
    service: Service, grid: dict[str, Any], address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    study_id = service.submit(grid)
    service.fill(study_id)
    service.checker.calls.clear()
    here = service.http.get(address.format(study_id))
    assert here.status_code == 200
    assert service.checker.calls == []
    monkeypatch.setattr("sprag_study.service.views.study_view.FEW", 0)
    elsewhere = service.http.get(address.format(study_id))
    assert len(service.checker.calls) == 1
    pickle.dumps(service.checker.calls)
    assert elsewhere.content == here.content
    names = ("content-type", "content-disposition", "etag", "vary")
    assert [elsewhere.headers.get(name) for name in names] == [here.headers.get(name) for name in names]


def test_what_a_process_refuses_comes_back_whole(service: Service, grid: dict[str, Any]) -> None:
    study = service.store.studies.study(service.submit(grid))
    with pytest.raises(SelectionError) as refused:
        select(study, CurveQuery("nonsense", ("torque.max",)))
    again = pickle.loads(pickle.dumps(refused.value))
    assert (again.faults, str(again)) == (refused.value.faults, str(refused.value))


def test_too_many_numbers_are_refused(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = [
        {"path": "excitation.frequency", "linspace": [16, 35, 1100]},
        {"path": "shaft.load", "linspace": [0, 1, 1000]},
    ]
    response = ask(service, service.submit(spec), "x=shaft.load&y=torque.max&by=excitation.frequency")
    assert response.status_code == 422
    assert [item["code"] for item in response.json()["errors"]] == ["too-many"]


def test_a_picture_shows_only_so_much(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = [
        {"path": "excitation.frequency", "linspace": [16, 35, 201]},
        {"path": "shaft.load", "linspace": [0, 1, 500]},
    ]
    study_id = service.submit(spec)
    curves = ask(service, study_id, "x=shaft.load&y=torque.max&by=excitation.frequency&format=png")
    assert [(item["code"], item["parameter"]) for item in curves.json()["errors"]] == [("too-many", "format")]
    points = ask(service, study_id, "x=excitation.frequency&y=shaft.load&z=torque.max&format=svg", "map")
    assert [(item["code"], item["parameter"]) for item in points.json()["errors"]] == [("too-many", "format")]


def test_the_cells_of_a_map_may_be_shown_in_a_file_of_its_own(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"][0] = {"path": "excitation.frequency", "linspace": [16, 35, 12]}
    study_id = service.submit(spec)
    service.fill(study_id)
    drawn = ask(service, study_id, "x=excitation.frequency&y=shaft.load&z=torque.max&format=svg", "map")
    assert 'href="data:image/png' in drawn.text
    assert "style" not in drawn.text
    assert drawn.headers["content-security-policy"] == "default-src 'none'; img-src data:; sandbox"


def test_pictures_are_the_same_for_the_same_numbers(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"][0] = {"path": "excitation.frequency", "linspace": [16, 35, 12]}
    study_id = service.submit(spec)
    service.fill(study_id)
    query = "x=shaft.load&y=torque.max&y=torque.mean&y=efficiency&by=excitation.frequency&format="
    for form in ("svg", "png", "pdf"):
        first, again = ask(service, study_id, query + form), ask(service, study_id, query + form)
        assert first.status_code == 200
        assert first.content == again.content


def test_curves_have_a_tag_that_changes_with_the_rows_and_the_program(
    service: Service, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    study_id = service.submit(spec)
    address = f"{API}/studies/{study_id}/curves?x=shaft.load&y=torque.max&by=excitation.frequency"
    tag = service.http.get(address).headers["etag"]
    assert service.http.get(address, headers={"If-None-Match": f'"x", W/{tag}'}).status_code == 304
    assert service.http.get(address, headers={"If-None-Match": "*"}).status_code == 304
    service.fill(study_id, range(2))
    changed = service.http.get(address, headers={"If-None-Match": tag})
    assert changed.status_code == 200
    assert changed.headers["etag"] != tag
    assert service.http.get(address + "&format=csv").headers["etag"] != changed.headers["etag"]
    monkeypatch.setattr(respond, "program_hash", lambda: "after an upgrade")
    assert service.http.get(address, headers={"If-None-Match": changed.headers["etag"]}).status_code == 200


@pytest.mark.parametrize(
    ("form", "media", "start"),
    [
        ("svg", "image/svg+xml", b"<?xml"),
        ("png", "image/png", b"\x89PNG"),
        ("pdf", "application/pdf", b"%PDF"),
        ("csv", "text/csv", b"excitation.frequency,case,shaft.load,torque.max,flags,ending\n16.0,0,0.02,"),
    ],
)
def test_curves_come_as_pictures_and_tables(
    service: Service, spec: dict[str, Any], form: str, media: str, start: bytes
) -> None:
    study_id = service.submit({**spec, "name": "a $x^2$ <b> & \u8a66 \U0001f600 \u05d0"})
    service.fill(study_id, range(4))
    query = "x=shaft.load&y=torque.max&by=excitation.frequency"
    named = ask(service, study_id, f"{query}&format={form}")
    wanted = service.http.get(f"{API}/studies/{study_id}/curves?{query}", headers={"Accept": f"{media}, */*;q=0.1"})
    assert named.status_code == 200, named.text
    assert named.headers["content-type"].startswith(media)
    assert named.content.startswith(start)
    assert wanted.content == named.content
    if form != "csv":
        area = ask(service, study_id, f"x=shaft.load&y=excitation.frequency&z=torque.max&format={form}", "map")
        assert area.content.startswith(start)


def test_the_table_of_curves_reads_back_exactly(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit(spec)
    service.fill(study_id)
    query = "x=shaft.load&y=torque.max&y=pendulums.0.engagements&by=excitation.frequency"
    curves = ask(service, study_id, query).json()["curves"]
    table = list(csv.DictReader(io.StringIO(ask(service, study_id, query + "&format=csv").text)))
    cells = [float(row["torque.max"]) if row["torque.max"] else None for row in table]
    assert cells == [value for curve in curves for value in curve["y"]["torque.max"]]
    assert all(isinstance(value, int | None) for value in curves[0]["y"]["pendulums.0.engagements"])
