"""The pages of a calibration: pasted points, values with intervals, points on the fitted curve."""

from __future__ import annotations

import re
from xml.etree import ElementTree

from tests.service.calibrating import CALIBRATE, calibration, spec_of
from tests.service.conftest import API, Service


def test_the_page_shows_values_points_and_figure(service: Service) -> None:
    study_id = calibration(service)
    for address in (f"/studies/{study_id}/curves", f"/studies/{study_id}/cases", f"/new?clone={study_id}"):
        assert service.http.get(address).status_code == 200, address
    overview = service.http.get(f"/studies/{study_id}").text
    assert f'href="/studies/{study_id}/calibration"' in overview
    assert f'data-figure="/studies/{study_id}/figures/calibration?columns=2&amp;units=workshop"' in overview
    answer = service.http.get(f"/studies/{study_id}/calibration")
    assert answer.status_code == 200
    found = service.get(f"/studies/{study_id}/calibration")
    listed = re.search(r"<ul>(<li>.*?</li>)</ul>\s*<h2>Values", answer.text)
    assert listed is not None
    assert listed[1].count("<li>") == len(found["sentences"])
    # For people: captions, and units as typed, 0.03 N*m as mN*m or N*mm.
    assert "A further measurement says most at load torque = " in listed[1]
    assert "pendulums.0.damping" in found["sentences"][-1]
    assert "pendulums.0.damping" not in listed[1]
    assert len(re.findall(r"<tr><td class=\"num\">\d+</td>", answer.text)) == len(found["points"])
    assert f'<img src="{API}/studies/{study_id}/calibration?units=workshop&amp;format=svg"' in answer.text
    figure = service.http.get(f"/studies/{study_id}/figures/calibration").json()
    measured = [trace for trace in figure["data"] if trace.get("name", "").endswith("measured")]
    assert sum(len(trace["y"]) for trace in measured) == 2 * len(found["points"])
    narrow = service.http.get(f"/studies/{study_id}/figures/calibration?columns=1").json()["layout"]
    wide = figure["layout"]
    for layout, beside in ((wide, True), (narrow, False)):
        assert (layout["xaxis"]["domain"] != layout["xaxis2"]["domain"]) is beside, "in a narrow place one per row"
    picture = service.http.get(f"{API}/studies/{study_id}/calibration?format=svg")
    assert ElementTree.fromstring(picture.text).tag.endswith("svg")


def test_a_calibration_without_a_fit_has_a_page(service: Service) -> None:
    study_id = calibration(service, rounds=1)
    assert service.http.get(f"/studies/{study_id}/calibration").status_code == 200
    assert service.http.get(f"/studies/{study_id}/figures/calibration").json()["note"]


def test_pasted_points_become_a_study(service: Service) -> None:
    study_id = service.submit()
    assert f'href="/calibrate?study={study_id}"' in service.http.get(f"/studies/{study_id}").text
    empty = service.http.get("/calibrate", params={"study": study_id})
    assert empty.status_code == 200
    assert 'value="pendulums.0.damping"' in empty.text
    fields = {"study": study_id, "measured": CALIBRATE["measured"]["csv"], "loss": "huber"}
    for row, one in enumerate(CALIBRATE["unknown"]):
        fields |= {f"path{row}": one["path"], f"from{row}": str(one["from"]), f"to{row}": str(one["to"])}
    sent = service.http.post("/calibrate", data=fields, follow_redirects=False)
    assert sent.status_code == 303, sent.text
    made = sent.headers["location"].rpartition("/")[2]
    plan = service.store.studies.study(made).plan
    expected = service.store.studies.study(service.submit(spec_of(loss="huber", refits=200))).plan
    assert plan == expected


def test_faults_of_pasted_points_are_shown_and_the_fields_kept(service: Service) -> None:
    study_id = service.submit()
    fields = {"study": study_id, "measured": "shaft.load;shaft.speed.mean\n0,1;x\n0,2;20\n", "path0": "shaft.inertia"}
    fields |= {"from0": "0.001", "to0": "0.003"}
    sent = service.http.post("/calibrate", data=fields)
    assert sent.status_code == 422
    assert "line 2, column shaft.speed.mean" in sent.text
    assert "0,1;x" in sent.text
    assert 'value="shaft.inertia"' in sent.text
    assert service.http.get("/calibrate", params={"study": "st-none"}).status_code == 404
