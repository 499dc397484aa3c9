"""Springs, clutches and motors of the office's own: read and refused, as CSV, over HTTP, on their page, in the form."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.client import Client
from sprag_study.service.exports.components import components_csv
from sprag_study.service.http.web.form.components import take_component
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.spec.components import Component, fields_of, read_components
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.report import SpecError
from tests.service.conftest import PortalTransport, Service
from tests.service.spec_sample import SPEC

SPRING = {"kind": "spring", "name": "F-120", "note": "store 3", "fields": {"spring_rate": "9 Н/мм"}}
CLUTCH = {
    "kind": "clutch",
    "name": "FW 20",
    "fields": {"coefficients": "0; 210; 0; 15000", "backlash": "0.3 град", "windup_limit": "3 deg"},
}
MOTOR = {
    "kind": "motor",
    "name": "1LE1 4 kW",
    "fields": {
        "characteristic": "kloss", "synchronous_speed": "1500 об/мин", "breakdown_torque": "70 N*m",
        "breakdown_slip": "0.2", "inertia": "0.01 kg*m^2",
    },
}  # fmt: skip
ALL = [SPRING, CLUTCH, MOTOR]


def test_components_survive_their_csv_file() -> None:
    texts = [("3,5 mm wire", '5,5 turns, "cold"\nsecond line'), ("-spring", "=x"), ("'=x", "'quoted'")]
    named = [{**SPRING, "name": name, "note": note} for name, note in texts]
    given = read_components({"components": [*ALL, *named]})
    assert read_components({"csv": components_csv(given).decode()}) == given


def test_a_csv_file_has_units_in_its_headings() -> None:
    text = "kind;name;spring_rate [Н/мм];coefficients\nspring;F;9,5;\nclutch;C;;0 200 0,5\n"
    spring, clutch = read_components({"csv": text})
    assert spring == Component("spring", "F", "", {"spring_rate": "9.5 Н/мм"})
    assert clutch.fields == {"coefficients": "0 200 0,5"}


@pytest.mark.parametrize(
    ("changes", "where", "code"),
    [
        ({"kind": "belt"}, "/components/0/kind", "invalid-choice"),
        ({"name": ""}, "/components/0/name", "invalid-text"),
        ({"note": 1}, "/components/0/note", "invalid-text"),
        ({"note": "a\0b"}, "/components/0/note", "invalid-text"),
        ({"fields": {}}, "/components/0/fields/spring_rate", "required"),
        ({"fields": {"spring_rate": "9 N"}}, "/components/0/fields/spring_rate", "wrong-unit"),
        ({"fields": {"spring_rate": "-9 N/m"}}, "/components/0/fields/spring_rate", "out-of-range"),
        ({"fields": {"spring_rate": "1,234 N/m"}}, "/components/0/fields/spring_rate", "ambiguous-comma"),
        ({"fields": {"spring_rate": "9 N/m", "length": "1 m"}}, "/components/0/fields/length", "unknown-field"),
        ({"fields": {"spring_rate": "9 N/m", "price": "4 kg"}}, "/components/0/fields/price", "wrong-unit"),
        ({"fields": {"spring_rate": "9 N/m", "price": "-4 EUR"}}, "/components/0/fields/price", "out-of-range"),
        ({"fields": {"spring_rate": 9}}, "/components/0/fields", "wrong-type"),
        ({"colour": "red"}, "/components/0/colour", "unknown-field"),
    ],
)
def test_faults_name_the_field(changes: dict[str, Any], where: str, code: str) -> None:
    with pytest.raises(SpecError) as caught:
        read_components({"components": [{**SPRING, **changes}]})
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [(where, code)]


@pytest.mark.parametrize(
    ("data", "code"),
    [
        ({}, "exactly-one"),
        ({"components": []}, "wrong-type"),
        ({"components": [SPRING, SPRING]}, "repeated"),
        ({"csv": "kind,name,colour\nspring,F,red\n"}, "unknown-field"),
        ({"csv": "kind,name,spring_rate\nspring,F,9 N\n"}, "wrong-unit"),
        ({"csv": "kind,name,a" + " " * 100_000 + "b\nspring,F,9\n"}, "out-of-range"),
        ({"components": [{**MOTOR, "fields": {"characteristic": "steam"}}]}, "invalid-choice"),
        ({"components": [{**MOTOR, "fields": {"characteristic": "linear"}}]}, "required"),
        ({"components": [{**MOTOR, "fields": {**MOTOR["fields"], "stall_torque": "1 N*m"}}]}, "unknown-field"),
    ],
)
def test_other_faults(data: dict[str, Any], code: str) -> None:
    with pytest.raises(SpecError) as caught:
        read_components(data)
    assert code in {fault.code for fault in caught.value.faults}


def test_every_field_of_a_component_is_one_of_the_form() -> None:
    assert [list(fields_of(kind)) for kind in ("spring", "clutch")] == [
        ["spring_rate", "damping", "price", "mass"],
        [
            "coefficients",
            "windup_limit",
            "backlash",
            "rated_torque",
            "rated_frequency",
            "rated_speed",
            "fatigue_exponent",
            "price",
            "mass",
        ],
    ]


def stored(service: Service, *given: dict[str, Any]) -> dict[str, str]:
    """Id of each component by name."""
    return {
        one.component.name: one.id for one in service.store.components.put(read_components({"components": list(given)}))
    }


def test_a_drive_takes_a_spring_and_a_clutch(service: Service) -> None:
    ids = stored(service, *ALL)
    values = values_of(SPEC) | {"component": ids["F-120"], "component_for": "9" * 5000}  # no pendulum: all
    take_component(values, service.store.components.all())
    values["component"] = ids["FW 20"]
    take_component(values, service.store.components.all())
    values["component"] = ids["1LE1 4 kW"]  # no drive has this motor
    before = dict(values)
    take_component(values, service.store.components.all())
    assert values == before
    base = parse_spec(spec_of(values)[0]).study.base
    assert base["pendulums.0.spring_rate"] == 9000.0
    assert base["pendulums.0.backlash"] == pytest.approx(0.3 * 3.141592653589793 / 180)
    assert base["clutch.coefficients.1"] == 210.0


def test_a_shaft_takes_a_motor(service: Service) -> None:
    values = empty("machine-shaft") | {"component": stored(service, MOTOR)["1LE1 4 kW"]}
    take_component(values, service.store.components.all())
    motor = spec_of(values)[0]["base"]["drive"]["motor"]
    assert motor["kind"] == "kloss"
    assert motor["synchronous_speed"] == "1500 об/мин"


def test_a_motor_has_a_rated_torque_where_it_is_known(service: Service) -> None:
    rated = {**MOTOR, "fields": {**MOTOR["fields"], "rated_torque": "26 N*m"}}
    values = empty("machine-shaft") | {"component": stored(service, rated)["1LE1 4 kW"]}
    take_component(values, service.store.components.all())
    assert spec_of(values)[0]["base"]["drive"]["motor"]["rated_torque"] == "26 N*m"
    with pytest.raises(SpecError, match="/components/0/fields/rated_torque"):
        read_components({"components": [{**MOTOR, "fields": {**MOTOR["fields"], "rated_torque": "0 N*m"}}]})


def test_the_form_offers_them_and_undoes_taking_them(service: Service) -> None:
    assert 'value="take-component"' not in service.http.get("/new").text
    spring = stored(service, *ALL)["F-120"]
    page = service.http.post("/new", data={**values_of(SPEC), "component": spring, "do": "take-component"}).text
    assert 'name="/base/pendulums/0/spring_rate" value="9"' in page
    assert "1LE1" not in page
    assert 'value="undo" data-shape>' in page


def test_the_page_keeps_shows_refuses_and_removes(service: Service) -> None:
    sent = {"kind": "spring", "name": "F-120", "note": "", "fields/spring_rate": "9 N/mm"}
    answer = service.http.post("/parts", data=sent, follow_redirects=False)
    assert answer.status_code == 303
    assert "<td>9 N/mm</td>" in service.http.get("/parts").text
    refused = service.http.post("/parts", data={**sent, "fields/spring_rate": "9 mm"})
    assert refused.status_code == 422
    assert 'id="wrong:fields/spring_rate"' in refused.text
    assert 'value="9 mm"' in refused.text
    refused = service.http.post("/parts", data={"do": "csv", "csv": "kind;name\nbelt;B\n"})
    assert refused.status_code == 422
    assert "line 2, column kind: is not a kind of component" in refused.text
    sent = {"do": "csv", "csv": "kind;name;coefficients\nclutch;C;0 200\n"}
    assert "1 component is read." in service.http.post("/parts", data=sent, follow_redirects=True).text
    assert [one.component.name for one in service.store.components.all()] == ["C", "F-120"]
    component = service.store.components.all("spring")[0].id
    assert f'href="/parts?edit={component}#spring:name"' in service.http.get("/parts").text
    changed = service.http.get(f"/parts?edit={component}").text
    assert '<details class="columns" open><summary>Add or change a spring' in changed
    assert 'name="name" value="F-120"' in changed
    assert 'name="fields/spring_rate" value="9"' in changed
    assert '<option value="N/mm" selected>' in changed
    assert service.http.get("/parts?edit=cm_none").status_code == 404
    # The button that removes is behind one that says so.
    removes = f'<summary>Remove</summary><ul><li><form method="post" action="/parts/{component}/delete">'
    assert removes in service.http.get("/parts").text
    service.http.post(f"/parts/{component}/delete")
    assert service.store.components.all("spring") == ()


def test_a_bare_number_is_kept_with_the_unit_that_the_page_shows(service: Service) -> None:
    sent = {"kind": "motor", "name": "M", "fields/characteristic": "kloss", "fields/breakdown_slip": "0.2"}
    sent |= {"fields/synchronous_speed": "1500", "unit:fields/synchronous_speed": "rpm"}
    sent |= {"fields/breakdown_torque": "70", "unit:fields/breakdown_torque": "N*m"}
    beside = '<select name="unit:fields/synchronous_speed"'
    page = service.http.get("/parts").text
    assert '<option value="rpm" selected>' in page[page.index(beside) :].partition("</select>")[0]
    assert service.http.post("/parts", data=sent, follow_redirects=False).status_code == 303
    fields = service.store.components.all("motor")[0].component.fields
    assert (fields["synchronous_speed"], fields["breakdown_torque"]) == ("1500 rpm", "70 N*m")
    assert fields["breakdown_slip"] == "0.2"
    # A program's bare number is in SI, and says so.
    assert read_components({"csv": "kind,name,spring_rate\nspring,F,9\n"})[0].fields == {"spring_rate": "9 N/m"}


def test_the_page_has_every_component_in_the_words_and_units_of_its_reader(service: Service) -> None:
    stored(service, *ALL)
    english = service.http.get("/parts").text
    shown = ("9 N/mm", "0.3 deg", "1500 rpm", "70 N·m", "0 N·m; 210 N·m/rad; 0 N·m/rad²; 15 000 N·m/rad³")
    for text in (*shown, "an induction motor (Kloss)"):
        assert f"<td>{text}</td>" in english.replace("\N{NARROW NO-BREAK SPACE}", " ").replace("\xa0", " "), text
    ukrainian = service.http.get("/parts?language=uk&units=si").text.replace("\N{NARROW NO-BREAK SPACE}", " ")
    assert "<td>9000 Н/м</td>" in ukrainian
    assert "<td>157,07963 рад/с</td>" in ukrainian
    assert "<td>1500 об/хв</td>" in service.http.get("/parts?language=uk&units=typed").text


def test_faults_of_the_page_name_fields_as_it_does(service: Service) -> None:
    sent = {"kind": "motor", "name": "", "fields/characteristic": "linear", "fields/breakdown_slip": "0.2"}
    page = service.http.post("/parts", data=sent).text
    assert "allowed: Characteristic, No load speed, Stall torque, Inertia" in page
    assert "got ;" not in page
    page = service.http.post("/parts?language=uk", data={"do": "csv", "csv": "kind;name\nbelt;B\n"}).text
    assert "рядок 2, стовпець kind: не є видом вузла" in page


def test_the_client_and_the_interface(service: Service, portal: Any) -> None:
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        made = client.put_components(ALL)
        assert [one["name"] for one in made] == ["F-120", "FW 20", "1LE1 4 kW"]
        assert [one["name"] for one in client.components("motor")] == ["1LE1 4 kW"]
        text = service.http.get("/api/v1/components", params={"format": "csv"}).text
        client.put_components(text)  # what it wrote changes nothing
        assert [{**one, "changed_at": ""} for one in client.components()] == [
            {**one, "changed_at": ""} for one in sorted(made, key=lambda one: (one["kind"], one["name"]))
        ]
        client.delete_component(made[0]["id"])
        assert len(client.components()) == 2
    missing = service.http.delete(f"/api/v1/components/{made[0]['id']}")
    assert missing.status_code == 404
    assert missing.json()["type"] == "/problems/component-not-found"


def test_commands_read_and_write_them(
    service: Service, portal: Any, sprag: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from functools import partial

    from sprag_study.service import client as clients

    genuine = clients.Client
    monkeypatch.setattr(clients, "Client", partial(genuine, transport=PortalTransport(service.app, portal)))
    file = tmp_path / "components.json"
    file.write_text(json.dumps({"components": ALL}))
    assert sprag("component", "put", file).code == 0
    written = tmp_path / "components.csv"
    assert sprag("component", "list", "-o", written).code == 0
    assert read_components({"csv": written.read_text()}) == [one.component for one in service.store.components.all()]
    listed = sprag("component", "list", "--kind", "spring", "--json").data["components"]
    assert [one["fields"] for one in listed] == [SPRING["fields"]]
    assert sprag("component", "delete", listed[0]["id"]).code == 0
    assert sprag("component", "put", written).code == 0
    assert len(service.store.components.all()) == 3
