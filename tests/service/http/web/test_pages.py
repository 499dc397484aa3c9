"""Pages of studies of every shape, over made-up rows."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.service.conftest import API
from tests.service.figures.seen import seen

if TYPE_CHECKING:
    from tests.service.conftest import Service

LOAD = {"path": "shaft.load", "values": [0.1, 0.2, 0.3]}
FREQUENCY = {"path": "excitation.frequency", "values": [20, 25, 30]}
MEASURED = {"data": [[0, 0], [0.01, 2], [0.02, 4], [0.03, 6]], "accuracy": 0.1}
SHAPES: dict[str, dict[str, Any]] = {
    "grid": {"axes": [LOAD, FREQUENCY]},
    "zip": {"axes": [LOAD, FREQUENCY], "combine": "zip"},
    "union": {"axes": [LOAD, FREQUENCY], "combine": "union"},
    "one axis": {"axes": [LOAD]},
    "one value": {"axes": [{**LOAD, "values": [0.1]}]},
    "nothing": {"axes": []},
    "three axes": {"axes": [LOAD, FREQUENCY, {"path": "pendulums.0.mass", "values": [0.4, 0.5]}]},
}


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_of_study_has_its_pages(service: Service, spec: dict[str, Any], shape: str) -> None:
    spec["base"]["clutch"] = MEASURED
    study_id = service.submit({**spec, **SHAPES[shape]})
    for part in ("", "/rows", "/cases/0", "?x=shaft.load"):  # nothing has run yet
        assert service.http.get(f"/studies/{study_id}{part}").status_code == 200, part
    service.fill(study_id)
    for part in ("", "/rows", "/rows?sort=-shaft.speed.mean&ending=ok", "/cases/0"):
        assert service.http.get(f"/studies/{study_id}{part}").status_code == 200, part
    for query in ("x=shaft.load", "z=efficiency", "z=efficiency&kind=contour", "lower=efficiency&point=0.2"):
        assert service.http.get(f"/studies/{study_id}?{query}").status_code in (200, 422), query
    page = service.http.get(f"/studies/{study_id}?units=workshop").text
    assert re.search(r"<p>Clutch: degree 1 reaches the accuracy .* windup of 0\.03 rad;", page)
    assert service.http.get(f"/new?clone={study_id}").status_code == 200


def test_figures_have_the_numbers_of_the_interface(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    query = {"x": "shaft.load", "by": "excitation.frequency", "y": ["torque.mean", "efficiency"]}
    told = service.get(f"/studies/{study_id}/curves", **query)
    picture = service.http.get(f"{API}/studies/{study_id}/curves", params={**query, "format": "svg"}).text
    for panel, name in zip(seen(picture).panels, query["y"], strict=True):
        most = max(abs(value) for curve in told["curves"] for value in curve["y"][name] if value is not None)
        for drawn, curve in zip(panel.curves, told["curves"], strict=True):
            known = [value for value in curve["y"][name] if value is not None]
            np.testing.assert_allclose(drawn.values[:, 1], known, atol=2e-3 * most)


def test_compared_studies_tell_what_is_held_with_its_unit(service: Service, spec: dict[str, Any]) -> None:
    names = ["a", "A name that goes on and on, longer than any legend has room for: the end"]
    ids = [service.submit({**spec, "name": name, "axes": [LOAD, FREQUENCY]}) for name in names]
    for study_id in ids:
        service.fill(study_id)
    query = {"study": ids, "x": "shaft.load"}
    page = service.http.get("/compare", params=query).text
    assert page.count("Excitation frequency = 25 Hz") == 1
    figure = seen(service.http.get("/compare", params=query).text)
    assert figure.has("A name that goes on", "room for: the end")
    assert [curve.name for curve in figure.panels[0].curves] == names


def test_a_compared_family_says_the_name_of_a_study_once(service: Service, spec: dict[str, Any]) -> None:
    ids = [service.submit({**spec, "name": name, "axes": [LOAD, FREQUENCY]}) for name in ("first & best", "other")]
    for study_id in ids:
        service.fill(study_id)
    query = {"study": ids, "x": "shaft.load", "by": "excitation.frequency"}
    # A chart has at most five curves, as many of each study.
    values = [f"{value:g}" for value in FREQUENCY["values"]][:2]
    page = seen(service.http.get("/compare", params=query).text)
    assert [curve.name for curve in page.panels[0].curves] == values * 2
    picture = service.http.get("/compare/picture.svg", params=query)
    assert picture.status_code == 200
    for drawn in (page, seen(picture.text)):
        assert drawn.has("Excitation frequency (Hz)", " ".join(["first & best", *values, "other", *values]))
        assert drawn.texts.count("other") == 1


def test_a_picture_without_rows_is_a_sentence_and_the_first_one_has_rows(
    service: Service, spec: dict[str, Any]
) -> None:
    masses = {"path": "pendulums.0.mass", "linspace": [0.4, 0.6, 3]}
    frequencies = {"path": "excitation.frequency", "values": [21, 25, 30]}
    loads = {"path": "shaft.load", "linspace": [0, 0.5, 40]}
    study_id = service.submit({**spec, "axes": [masses, frequencies, loads]})
    query = {"x": "shaft.load", "y": "efficiency", "at": ["excitation.frequency=30", "pendulums.0.mass=0.5"]}
    assert "no case has been run yet" in service.http.get(f"/studies/{study_id}").text
    service.fill(study_id, range(1))
    told = service.http.get(f"/studies/{study_id}", params=query).text
    assert "No case at excitation frequency = 30 Hz, mass = 0.5 kg is done" in told
    page = service.http.get(f"/studies/{study_id}").text
    assert "at=pendulums.0.mass%3D0.4" in page


@pytest.mark.parametrize(
    ("part", "text"),
    [
        ("?x=shaft.lod", "did you mean"),
        ("?x=shaft.load&y=efficency", "did you mean"),
        ("?x=shaft.load&by=&at=excitation.frequency=99", "the axis has no such value"),
        ("?x=shaft.load&at=nonsense", "must be path=value"),
        ("?z=none", "unknown result"),
        ("/rows?sort=nothing", "is neither a parameter that varies nor a numeric result"),
        ("/rows?ending=nothing", "is not an ending"),
        ("/rows?at=shaft.load=7", "the axis has no such value"),
        ("/cases/0?from=9&to=3", "outside the run"),
    ],
)
def test_wrong_choices_are_told_on_the_page(service: Service, part: str, text: str) -> None:
    study_id = service.submit()
    answer = service.http.get(f"/studies/{study_id}{part}", headers={"Accept": "text/html"})
    assert answer.status_code == 422
    assert answer.headers["content-type"].startswith("text/html")
    assert text in answer.text
    assert 'role="alert"' in answer.text


def test_errors_are_pages_for_browsers_and_documents_for_programs(service: Service) -> None:
    for path in ("/studies/st_none", "/nowhere", "/new?preset=none", "/compare?study=st_none"):
        page = service.http.get(path, headers={"Accept": "text/html,application/xhtml+xml"})
        assert (page.status_code, page.headers["content-type"]) == (404, "text/html; charset=utf-8")
        assert service.http.get(path).headers["content-type"] == "application/problem+json"
    api = service.http.get("/api/v1/studies/st_none", headers={"Accept": "text/html"})
    assert api.headers["content-type"] == "application/problem+json"


def test_forms_take_what_browsers_send_and_nothing_else(service: Service) -> None:
    assert service.http.post("/new", json={}).status_code == 415
    form = {"Content-Type": "application/x-www-form-urlencoded"}
    assert service.http.post("/new", content="&".join(["a=1"] * 3000), headers=form).status_code == 400
    assert service.http.post("/new", content=b"\xff\xfe", headers=form).status_code == 400
    empty = service.http.post("/new", content="do=submit", headers=form)
    assert empty.status_code == 422
    assert "is required" in empty.text
    cross = service.http.post("/new", content="do=submit", headers={**form, "Origin": "http://evil.example"})
    assert cross.status_code == 403


def test_a_form_sent_twice_is_one_study(service: Service) -> None:
    page = service.http.get("/new?preset=one_pendulum&mode=text").text
    form = {"do": "submit", "key": "k", "format": "json", "/text": _textarea(page)}
    first, again = (service.http.post("/new", data=form) for _ in range(2))
    assert first.status_code == again.status_code == 303
    assert first.headers["location"] == again.headers["location"]
    changed = service.http.post("/new", data={**form, "/text": form["/text"].replace("0.5 kg", "0.6 kg")})
    assert changed.headers["location"] != first.headers["location"]
    other = service.http.post("/new", data={**form, "key": "another"})
    assert other.headers["location"] != first.headers["location"]


def _textarea(page: str) -> str:
    import html

    found = re.search(r"<textarea[^>]*>(.*?)</textarea>", page, re.DOTALL)
    assert found is not None
    return html.unescape(found[1])


def test_wishes_come_from_buttons(service: Service) -> None:
    study_id = service.submit()
    for verb, state in (("pause", "paused"), ("resume", "queued"), ("cancel", "cancelling")):
        answer = service.http.post(f"/studies/{study_id}/{verb}")
        assert (answer.status_code, answer.headers["location"]) == (303, f"/studies/{study_id}")
        assert service.get(f"/studies/{study_id}")["state"] == state
    assert service.http.post(f"/studies/{study_id}/resume").status_code == 409
    assert service.http.post(f"/studies/{study_id}/explode").status_code == 404


def test_a_study_is_deleted_after_a_question_and_only_once_it_has_ended(service: Service) -> None:
    study_id, other = service.submit(), service.submit()
    address = f"/studies/{study_id}/delete"
    asked = service.http.get(address)
    assert asked.status_code == 200
    assert "has not ended" in asked.text
    assert "<button" not in asked.text.partition("<main")[2].partition("</main>")[0]
    refused = service.http.post(address, headers={"Accept": "text/html"})
    assert refused.status_code == 409
    assert service.get(f"/studies/{study_id}")["state"] == "queued"
    assert address not in service.http.get(f"/studies/{study_id}").text

    service.fill(study_id)
    assert f'href="{address}"' in service.http.get(f"/studies/{study_id}").text
    assert f'<form method="post" action="{address}">' in service.http.get(address).text
    assert service.get(f"/studies/{study_id}")["state"] == "finished"  # asking deletes nothing
    strange = service.http.post(address, headers={"Origin": "http://elsewhere.example"})
    assert strange.status_code == 403
    assert service.get(f"/studies/{study_id}")["state"] == "finished"
    done = service.http.post(address)
    assert (done.status_code, done.headers["location"]) == (303, f"/?done=delete&changed={study_id}")
    for gone in (f"/studies/{study_id}", f"/api/v1/studies/{study_id}"):
        assert service.http.get(gone).status_code == 404
    assert service.http.post(address).status_code == 404
    assert other in service.http.get("/").text
