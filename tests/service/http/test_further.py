"""Priority and extension on the page of a study, as the commands have them."""

from __future__ import annotations

import re

import pytest

from tests.service.conftest import Service
from tests.service.timed_spec import SPEC


def test_the_priority_of_a_waiting_study_is_changed(service: Service) -> None:
    study_id = service.submit()
    assert 'name="priority" value="0"' in service.http.get(f"/studies/{study_id}").text
    done = service.http.post(f"/studies/{study_id}/priority", data={"priority": " -3 "})
    assert (done.status_code, done.headers["location"]) == (303, f"/studies/{study_id}")
    assert service.get(f"/studies/{study_id}")["priority"] == -3
    for wrong in ("", "x", "1.5", "1e9", "nan"):
        assert service.http.post(f"/studies/{study_id}/priority", data={"priority": wrong}).status_code == 422, wrong
    service.fill(study_id)
    assert 'name="priority"' not in service.http.get(f"/studies/{study_id}").text
    assert service.http.post(f"/studies/{study_id}/priority", data={"priority": "1"}).status_code == 409


def test_a_study_is_extended_by_values_and_by_cases(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    old = service.get(f"/studies/{study_id}")
    assert 'name="axis:shaft.load"' in service.http.get(f"/studies/{study_id}").text
    fields = {"axis:shaft.load": "0.7; 800 N*mm", "axis:excitation.frequency": "", "points": "", "name": "more"}
    first = service.http.post(f"/studies/{study_id}/extend", data=fields)
    again = service.http.post(f"/studies/{study_id}/extend", data=fields)
    assert first.headers["location"] == again.headers["location"]
    new = service.get(first.headers["location"])
    loads = {axis["paths"][0]: axis["values"] for axis in old["axes"]}["shaft.load"]
    assert (new["name"], new["cases"]) == ("more", old["cases"] // loads * (loads + 2))
    header = ",".join(axis["paths"][0] for axis in old["axes"])
    row = ",".join("21" if "frequency" in axis["paths"][0] else "0.9" for axis in old["axes"])
    table = service.http.post(f"/studies/{study_id}/extend", data={"points": f"{header}\n{row}\n"})
    assert service.get(table.headers["location"])["cases"] == old["cases"] + 1


def test_a_study_extended_by_doubtful_points_says_how_they_were_read(service: Service) -> None:
    study_id = service.submit()
    made = service.http.post(f"/studies/{study_id}/extend", data={"axis:shaft.load": "20.000; 25.000"})
    new = service.get(made.headers["location"])
    assert new["warning_codes"][0] == "ambiguous-point"
    assert "Load torque: &#39;20.000&#39; is read as 20; write 20000" in service.http.get(made.headers["location"]).text


@pytest.mark.parametrize(
    ("fields", "wrong"),
    [
        ({"points": " "}, ""),
        ({"axis:shaft.load": "0.7", "points": "shaft.load\n0.9"}, ""),
        ({"axis:shaft.load": "heavy"}, "axis:shaft.load"),
        ({"axis:shaft.load": "100 200; 300 400"}, "axis:shaft.load"),
        ({"points": "what\n1"}, "points"),
    ],
)
def test_what_cannot_extend_a_study_is_refused_on_its_page(
    service: Service, fields: dict[str, str], wrong: str
) -> None:
    study_id = service.submit(SPEC)
    page = service.http.post(f"/studies/{study_id}/extend", data={**fields, "name": "more of it"})
    assert page.status_code == 422
    form = page.text[page.text.index('<details class="screen" id="extend" open>') :].partition("</form>")[0]
    assert re.findall(r'id="wrong:([^"]*)" role="alert">[^<]', form) == [wrong]
    assert form.count("autofocus") == 1
    assert 'value="more of it"' in form
    assert all(text.strip() in form for text in fields.values())
    # The address that the page has now leads back to the study.
    shown = service.http.get(f"/studies/{study_id}/extend?point=0.1")
    assert (shown.status_code, shown.headers["location"]) == (303, f"/studies/{study_id}?point=0.1")
