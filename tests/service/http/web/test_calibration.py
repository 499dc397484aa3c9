"""The pages of a calibration: pasted points, values with intervals, points on the fitted curve."""

from __future__ import annotations

import re

from tests.service.calibrating import CALIBRATE, calibration, spec_of
from tests.service.conftest import Service


def test_the_page_shows_values_points_and_figure(service: Service) -> None:
    study_id = calibration(service)
    for address in (f"/studies/{study_id}", f"/studies/{study_id}/rows", f"/new?clone={study_id}"):
        assert service.http.get(address).status_code == 200, address
    answer = service.http.get(f"/studies/{study_id}/matters")
    assert answer.status_code == 200
    found = service.get(f"/studies/{study_id}/calibration")
    # For people: captions, and units as typed, 0.03 N*m as mN*m or N*mm.
    assert "A further measurement says most at load torque = " in answer.text
    assert "pendulums.0.damping" in found["sentences"][-1]
    assert "pendulums.0.damping" not in answer.text.partition("Measured values")[0]
    rows = answer.text.partition("Measured values")[2].partition("<tbody>")[2].partition("</tbody>")[0]
    assert rows.count("<tr>") == len(found["points"])
    figure = answer.text.partition('<svg class="figure double"')[2].partition("</svg>")[0]
    assert "measured" in figure
    assert "Residual" in figure


def test_a_calibration_without_a_fit_has_a_page(service: Service) -> None:
    study_id = calibration(service, rounds=1)
    answer = service.http.get(f"/studies/{study_id}/matters")
    assert answer.status_code == 200
    assert "The first fit has not ended yet." in answer.text


def test_pasted_points_become_a_study(service: Service) -> None:
    study_id = service.submit()
    own = f"/studies/{study_id}/matters?ask=measurement"
    assert f'href="{own}"' in service.http.get(f"/studies/{study_id}").text
    old = service.http.get("/calibrate", params={"study": study_id}, follow_redirects=False)
    assert (old.status_code, old.headers["location"]) == (308, own)
    empty = service.http.get(own)
    assert empty.status_code == 200
    assert 'value="pendulums.0.damping"' in empty.text
    fields = {"study": study_id, "measured": CALIBRATE["measured"]["csv"], "loss": "huber"}
    for row, one in enumerate(CALIBRATE["unknown"]):
        fields |= {f"path{row}": one["path"], f"from{row}": str(one["from"]), f"to{row}": str(one["to"])}
    fields |= {"sensor0": "shaft.speed.mean", "gain_from0": "1,02", "offset_from0": "-1", "offset_to0": "1 rad/s"}
    sent = service.http.post("/calibrate", data=fields, follow_redirects=False)
    assert sent.status_code == 303, sent.text
    made = sent.headers["location"].rpartition("/")[2]
    plan = service.store.studies.study(made).plan
    offset = {"from": "-1 rad/s", "to": "1 rad/s"}
    sensors = [{"result": "shaft.speed.mean", "gain": 1.02, "offset": offset}]
    expected = service.store.studies.study(service.submit(spec_of(loss="huber", refits=200, sensors=sensors))).plan
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
    assert service.http.get("/studies/st-none/matters?ask=measurement").status_code == 404
    fields |= {"measured": CALIBRATE["measured"]["csv"], "path0": "", "from0": "", "to0": ""}
    for changes, told, wrong in (
        ({"path2": "shaft.inertia", "to2": "1"}, "Parameter 3, from: must be a number", "from2"),
        (
            {"path2": "shaft.inertia", "from2": "1e-3", "to2": "3e-3", "gain_from1": "1.1"},
            "Sensor 2, result: is required",
            "sensor1",
        ),
    ):
        sent = service.http.post("/calibrate", data=fields | changes)
        assert sent.status_code == 422
        assert told in sent.text
        assert re.findall(r'<input id="(\w+)"[^>]*aria-invalid', sent.text) == [wrong]
