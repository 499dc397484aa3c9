"""The pages of a calibration: pasted points, values with intervals, points on the fitted curve."""

from __future__ import annotations

import html
import math
import re
from typing import Final

from tests.service.calibrating import CALIBRATE, calibration, measured, spec_of
from tests.service.conftest import Service

#: Field of the measured points.
CSV: Final = "/calibrate/measured/csv"


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


def filled(study_id: str, **fields: str) -> dict[str, str]:
    """The form of that calibration, as a browser sends it."""
    values = {"study": study_id, "unknown": "3", "sensors": "2", CSV: CALIBRATE["measured"]["csv"]}
    for row, one in enumerate(CALIBRATE["unknown"]):
        values |= {f"/calibrate/unknown/{row}/{name}": str(text) for name, text in one.items()}
    return values | {f"/calibrate/{name}": text for name, text in fields.items()}


def test_pasted_points_become_a_study(service: Service) -> None:
    study_id = service.submit()
    own = f"/studies/{study_id}/matters?ask=measurement"
    assert f'href="{own}"' in service.http.get(f"/studies/{study_id}").text
    old = service.http.get("/calibrate", params={"study": study_id}, follow_redirects=False)
    assert (old.status_code, old.headers["location"]) == (308, own)
    empty = service.http.get(own)
    assert empty.status_code == 200
    assert 'value="pendulums.0.damping"' in empty.text
    sensor = {"result": "shaft.speed.mean", "gain": "1,02", "offset": "-1 to 1 rad/s"}
    fields = filled(study_id, loss="huber", **{f"sensors/1/{name}": text for name, text in sensor.items()})
    fields["/calibrate/unknown/0/prior"] = "0,012 +- 20 %"
    sent = service.http.post("/calibrate", data=fields, follow_redirects=False)
    assert sent.status_code == 303, sent.text
    made = sent.headers["location"].rpartition("/")[2]
    plan = service.store.studies.study(made).plan
    offset = {"from": "-1 rad/s", "to": "1 rad/s"}
    sensors = [{"result": "shaft.speed.mean", "gain": 1.02, "offset": offset}]
    damping, inertia = CALIBRATE["unknown"]
    unknown = [{**damping, "prior": {"mean": 0.012, "sigma": "20 %"}}, inertia]
    spec = spec_of(loss="huber", refits=200, sensors=sensors, unknown=unknown)
    expected = service.store.studies.study(service.submit(spec)).plan
    assert plan == expected
    # Its fields are those of a further calibration.
    further = service.http.get(f"/studies/{made}/matters?ask=measurement&again=on").text
    for text in ("-1 to 1 rad/s", "0.5e-3 kg*m^2", "pendulums.*.damping", "0.012 ± 20 %"):
        assert f'value="{text}"' in further
    assert '<option value="huber" selected>' in further
    assert 'id="sensors" open' in further


def test_rows_of_the_form_are_added_and_removed(service: Service) -> None:
    fields = filled(service.submit(), **{"sensors/0/gain": "1.1"})
    more = service.http.post("/calibrate", data=fields | {"do": "add-sensors"})
    assert more.status_code == 200
    assert 'name="sensors" value="3"' in more.text
    assert 'name="/calibrate/sensors/2/result"' in more.text
    assert CALIBRATE["measured"]["csv"][:40] in more.text
    fewer = service.http.post("/calibrate", data=fields | {"do": "drop-unknown 0"}).text
    assert 'name="unknown" value="2"' in fewer
    assert 'name="/calibrate/unknown/0/from" value="0.5e-3 kg*m^2"' in fewer


def test_an_offset_that_is_advised_is_filled_in_by_a_link(service: Service) -> None:
    unknown, points = [CALIBRATE["unknown"][1]], {"csv": measured(0.8, sigma=False)}
    study_id = calibration(service, unknown=unknown, measured=points, refits=0)
    text = service.http.get(f"/studies/{study_id}/matters").text
    address, label = re.findall(r'<a class="button" href="([^"]*again[^"]*)">([^<]*)<', text)[0]
    assert re.fullmatch(r"Calibrate again with an offset of mean shaft speed near 7\.\d+ rpm", label), label
    form = service.http.get(html.unescape(address)).text
    span = re.findall(r'name="/calibrate/sensors/0/offset" value="(\S+) to (\S+) rpm"', form)[0]
    low, high = map(float, span)
    assert low < 0.8 * 30.0 / math.pi < high
    assert '<option value="shaft.speed.mean" selected>' in form


def test_faults_of_pasted_points_are_beside_their_fields(service: Service) -> None:
    study_id = service.submit()
    for changes, told, wrong in (
        ({"measured/csv": "shaft.load;shaft.speed.mean\n0,1;x\n0,2;20\n"}, "line 2, column shaft.speed.mean", CSV),
        ({"unknown/2/path": "pendulums.0.mass", "unknown/2/to": "1"}, "is required", "/calibrate/unknown/2/from"),
        ({"unknown/0/prior": "0.012"}, "is required", "/calibrate/unknown/0/prior"),
        ({"unknown/0/prior": "1 ± 0.1"}, "lies outside of the range", "/calibrate/unknown/0/prior"),
        ({"sensors/1/gain": "1.1"}, "is required", "/calibrate/sensors/1/result"),
        ({"sensors/1/result": "shaft.speed.mean", "sensors/1/gain": "x"}, "got x", "/calibrate/sensors/1/gain"),
        ({"refits": "many"}, "must be a whole number", "/calibrate/refits"),
    ):
        sent = service.http.post("/calibrate", data=filled(study_id, **changes))
        assert sent.status_code == 422
        assert re.findall(r'id="(/calibrate[^"]*)"[^>]*aria-invalid', sent.text) == [wrong]
        assert told in sent.text.partition(f'id="wrong:{wrong}"')[2].partition("</span>")[0]
        assert "0.5e-3 kg*m^2" in sent.text
    assert service.http.get("/studies/st-none/matters?ask=measurement").status_code == 404
