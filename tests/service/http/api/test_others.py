"""Clutch fits, models, health and pages."""

from __future__ import annotations

import html
import json
import re
from html.parser import HTMLParser
from typing import TYPE_CHECKING, Any
from urllib.parse import urljoin

import pytest

from sprag_study.service.answers import catalogue, studies
from sprag_study.service.http.api.examples import CLUTCH_FIT
from sprag_study.worker import models
from tests.service.shapes import fits

if TYPE_CHECKING:
    from tests.service.conftest import Service

FITS = "/api/v1/clutch-fits"


def test_a_clutch_fit_reports_on_itself(service: Service) -> None:
    response = service.http.post(FITS, json=CLUTCH_FIT)
    assert response.status_code == 200, response.text
    body = response.json()
    fits(studies.ClutchFitReport, body)
    assert body["max_residual"] <= 0.05
    assert body["coefficients"][0] == 0.0
    assert body["windup_limit"] == 0.05
    assert [degree["degree"] for degree in body["degrees_tried"]] == list(range(1, body["degree"] + 1))
    assert len(body["residuals"]) == len(CLUTCH_FIT["data"])


def test_units_and_backlash_are_taken_off(service: Service) -> None:
    rows = [["0.3 deg", 0], ["0.6 deg", "1 N*m"], ["0.9 deg", "2 N*m"], ["1.2 deg", "3000 N*mm"]]
    body = {"data": rows, "accuracy": 0.01, "angles_include_backlash": True, "backlash": "0.3 deg"}
    fit = service.http.post(FITS, json=body).json()
    assert fit["windup_limit"] == pytest.approx(0.9 * 3.141592653589793 / 180)
    assert fit["degree"] == 1


@pytest.mark.parametrize(
    ("change", "pointer"),
    [
        ({"accuracy": 1e-12, "max_degree": 2}, "/accuracy"),
        ({"accuracy": 0}, "/accuracy"),
        ({"accuracy": ...}, "/accuracy"),
        ({"accuracy": "1 mm"}, "/accuracy"),
        ({"data": ...}, "/data"),
        ({"data": [[0, 0]]}, "/data"),
        ({"data": [[0, 0], [1]]}, "/data/1"),
        ({"data": [[0, 0], [0.1, "x"]]}, "/data/1/1"),
        ({"data": [[0, 0], [0.1, 1], [0.2, -3], [0.3, 4]], "accuracy": 0.1}, "/data"),
        ({"max_degree": 99}, "/max_degree"),
        ({"through_origin": 1}, "/through_origin"),
        ({"backlash": -1}, "/backlash"),
        ({"backlash": 0.001}, "/backlash"),
        ({"backlash": 0.001, "angles_include_backlash": False}, "/backlash"),
        ({"coefficients": [0, 1]}, "/coefficients"),
        ({"datum": 1}, "/datum"),
    ],
)
def test_a_fit_that_cannot_be_made_says_why(service: Service, change: dict[str, Any], pointer: str) -> None:
    body = {key: value for key, value in {**CLUTCH_FIT, **change}.items() if value is not ...}
    response = service.http.post(FITS, json=body)
    assert response.status_code == 422, response.text
    problem = response.json()
    assert problem["type"] == "/problems/invalid-body"
    assert any(error["pointer"].startswith(pointer) for error in problem["errors"]), problem["errors"]


def test_models_describe_parameters_results_and_endings(service: Service) -> None:
    body = service.get("/models")
    fits(catalogue.ModelList, body)
    model, shaft = body["models"]
    assert model == service.get("/models/vibration-drive")
    assert shaft == service.get("/models/machine-shaft")
    assert {"drive.inertia", "mechanism.four_bar.crank", "operation.steps.K.value", "constants.NAME"} <= {
        entry["path"] for entry in shaft["parameters"]
    }
    assert {"omega.mean", "s4.amplitude", "required_inertia"} <= {entry["name"] for entry in shaft["results"]}
    assert {"ok", "inertia_insufficient", "crashed"} <= set(shaft["endings"])
    assert not {"chatter", "step_budget"} & set(shaft["endings"])
    assert shaft["flags"] == {}
    parameters = {entry["path"]: entry for entry in model["parameters"]}
    assert parameters["excitation.frequency"]["required"]
    assert parameters["gravity"]["default"] == 9.80665
    assert parameters["clutch.windup_limit"]["high"] is None
    names = {entry["name"] for entry in model["results"]}
    assert {"shaft.speed.mean", "pendulums.N.torque.max"} <= names
    assert model["endings"] | shaft["endings"] == models.ENDING_SENTENCES
    assert not {"motor_stalled", "cannot_assemble"} & set(model["endings"])
    missing = service.http.get("/api/v1/models/perpetuum-mobile")
    assert missing.status_code == 404
    tag = service.http.get("/api/v1/models").headers["etag"]
    assert service.http.get("/api/v1/models", headers={"If-None-Match": tag}).status_code == 304


def test_presets_can_be_submitted(service: Service) -> None:
    body = service.get("/presets")
    fits(catalogue.PresetList, body)
    assert len(body["presets"]) >= 2
    for preset in body["presets"]:
        assert service.get(f"/presets/{preset['name']}") == preset
        shown = service.get(f"/studies/{service.submit(preset['spec'])}")
        assert (shown["name"], shown["cases"]) == (preset["title"], preset["cases"])
    assert service.http.get("/api/v1/presets/none").status_code == 404


def test_health_is_told(service: Service) -> None:
    assert service.http.get("/livez").json() == service.http.get("/readyz").json() == {"status": "ok"}


class Loads(HTMLParser):
    """Collects what a page loads and links to, and checks that it opens and closes its elements in order."""

    VOID = frozenset({"meta", "link", "img", "br", "input", "source"})

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.linked: list[str] = []
        self.anchors: set[str] = set()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        assert "style" not in values, "the policy forbids styles inside a page"
        assert not any(name.startswith("on") for name in values)
        if tag == "script" and values.get("type") != "application/json":  # data are not run
            assert values.get("src"), "the policy forbids scripts inside a page"
        if tag not in self.VOID:
            self.open.append(tag)
        if values.get("id"):
            self.anchors.add(str(values["id"]))
        if tag in ("link", "img", "script") and values.get("type") != "application/json":
            self.loaded.append(str(values.get("href") or values.get("src")))
        if tag == "a" and "href" in values:  # scripts fill the others
            self.linked.append(str(values["href"]))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def read_page(service: Service, address: str) -> tuple[str, Loads]:
    response = service.http.get(address)
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == "text/html; charset=utf-8"
    loads = Loads()
    loads.feed(response.text)
    assert loads.open == []
    return response.text, loads


def test_pages_load_nothing_from_elsewhere_and_lead_nowhere_wrong(service: Service, spec: dict[str, Any]) -> None:
    study_id = service.submit()
    del spec["axes"]
    single = service.submit(spec)
    service.fill(study_id)
    service.fill(single)
    right: set[str] = set()  # most pages load and link the same
    parts = ("", "?x=shaft.load", "/rows", "/rows?sort=-case", "/cases/0", "/matters", "/document", "/delete")
    for page in (
        "/",
        "/help/interface",
        "/new",
        "/new?preset=two_pendulums",
        "/new?mode=text",
        *(f"/studies/{study_id}{part}" for part in parts),
        f"/studies/{single}",
        "/problems/invalid-spec",
    ):
        _, loads = read_page(service, page)
        for address in {*loads.loaded, *loads.linked}:
            path, _, anchor = address.partition("#")
            if address in loads.loaded and address.startswith("data:image/svg+xml;base64,"):
                continue  # within the page
            assert path.startswith(("/", "?")) or not path, address
            assert not path.startswith("//")
            whole = urljoin(page, path)
            kind = re.sub(r"=[^&]*", "", whole)  # what a choice is called, whatever its value
            if path and kind not in right:
                answer = service.http.get(
                    whole, follow_redirects=whole.endswith("/laboratory")
                )  # the machine is run first
                assert answer.status_code == 200, address
                right.add(kind)
            if anchor and path in ("", page):
                assert anchor in loads.anchors


def test_a_study_page_names_values_with_units_and_shows_the_spec_as_given(
    service: Service, spec: dict[str, Any]
) -> None:
    spec["name"] = "a < b \u00b5"
    spec["axes"] = [
        {"path": "excitation.frequency", "linspace": ["16 Hz", "34 Hz", 19]},
        {"path": "shaft.load", "values": [0.1, 0.2]},
    ]
    study_id = service.submit(spec)
    service.fill(study_id)
    text, _ = read_page(service, f"/studies/{study_id}")
    assert "against load torque, a curve for each of 6 values of excitation frequency" in text
    assert "Mean shaft speed (rpm)" in text
    shown = text.split("<summary>The study as text</summary><pre>")[1].split("</pre>")[0]
    assert "a &lt; b \u00b5" in shown
    assert json.loads(html.unescape(shown)) == spec
    assert list(json.loads(html.unescape(shown))) == list(spec)


def test_pages_show_code_as_code(service: Service) -> None:
    for page in ("/help/interface", "/problems/invalid-spec"):
        text, _ = read_page(service, page)
        assert "`" not in text
        assert "<code>errors</code> lists" in text


def test_a_study_page_shows_how_far_it_is_and_its_curve(service: Service) -> None:
    study_id = service.submit()
    text, loads = read_page(service, f"/studies/{study_id}")
    assert 'http-equiv="refresh"' in text
    assert "0 of 9 cases" in text
    service.fill(study_id)
    text, loads = read_page(service, f"/studies/{study_id}")
    assert 'http-equiv="refresh"' not in text
    assert "<strong>8 of 9</strong> cases with a result" in text
    assert models.ENDING_SENTENCES["chatter"] in text
    (picture,) = [address for address in loads.linked if "/curves?" in address and "format=svg" in address]
    answer = service.http.get(picture)
    assert answer.headers["content-type"] == "image/svg+xml"
    assert "sandbox" in answer.headers["content-security-policy"]
    again = service.http.get(picture, headers={"If-None-Match": answer.headers["etag"]})
    assert again.status_code == 304


def test_names_are_text_on_pages(service: Service, spec: dict[str, Any]) -> None:
    name = "<script>alert(1)</script> & \"'"
    study_id = service.submit({**spec, "name": name})
    others = ("/rows", "/cases/0", "/matters", "/document", "/delete")
    pages = (f"/new?clone={study_id}", f"/compare?study={study_id}", *(f"/studies/{study_id}{part}" for part in others))
    for page in ("/", f"/studies/{study_id}", *pages):
        text, _ = read_page(service, page)
        assert name not in text
        assert "&lt;script&gt;alert(1)" in text


def test_the_list_is_kept_short(service: Service, spec: dict[str, Any]) -> None:
    assert "There is no study yet" in read_page(service, "/")[0]
    for number in range(3):
        service.submit({**spec, "name": f"study-{number}"})
    text, _ = read_page(service, "/")
    assert re.findall(r"(?<=>)study-\d", text) == ["study-2", "study-1", "study-0"]


def test_unknown_pages_and_files_are_problems(service: Service) -> None:
    for path in (
        "/studies/st_none",
        "/studies/st_none/rows",
        "/studies/st_none/matters",
        "/static/none.css",
        "/static/..%2fpages.py",
    ):
        response = service.http.get(path)
        assert response.status_code == 404, path
        assert response.headers["content-type"] == "application/problem+json"


def test_a_study_in_which_nothing_varies_has_no_curve(service: Service, spec: dict[str, Any]) -> None:
    del spec["axes"]
    study_id = service.submit(spec)
    for part, choice in (("curves", ""), ("map", "?z=-")):
        answer = service.http.get(f"/studies/{study_id}/{part}")
        assert (answer.status_code, answer.headers["location"]) == (308, f"/studies/{study_id}{choice}")
        assert 'id="chart"' not in read_page(service, answer.headers["location"])[0]
