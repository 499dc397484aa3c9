"""Hostile input to the interface, forms, commands and files: refused in order, never a fault, never carried further."""

from __future__ import annotations

import csv
import io
import json
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.cli.app import execute
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from pathlib import Path

    from tests.service.conftest import Service

DIGITS = "9" * 1_000_000


def spec_text(load: str) -> bytes:
    """The example with ``load`` as it stands in JSON's text."""
    text = json.dumps({**SPEC, "base": {**SPEC["base"], "shaft": {"inertia": 2e-3, "load": "@"}}})
    return text.replace('"@"', load).encode("utf-8", "surrogatepass")


BODIES = {
    "NaN": spec_text("NaN"),
    "infinity": spec_text("-Infinity"),
    "1e999": spec_text("1e999"),
    "long integer": spec_text(DIGITS[:900_000]),
    "too long integer": spec_text(DIGITS * 2),
    "long exponent": spec_text("1e" + "9" * 5_000),
    "quantity of a million digits": spec_text(f'"{DIGITS[:900_000]} N*m"'),
    "deep lists": b"[" * 100_000,
    "deep objects": b'{"a":' * 100_000 + b"1" + b"}" * 100_000,
    "lone surrogate": spec_text('"\\ud800"'),
    "surrogate in a key": b'{"sprag": 1, "\\udfff": 2}',
    "broken utf-8": b'{"sprag": 1, "name": "\xff\xfe"}',
    "utf-16": json.dumps(SPEC).encode("utf-16"),
    "utf-32": json.dumps(SPEC).encode("utf-32"),
    "nul": b'{"sprag": 1, "name": "\x00"}',
    "null": b"null",
    "nothing": b"",
    "text": b'"spec"',
    "number": b"1",
    "keys twice": b'{"sprag": 1, "sprag": 1}',
    "huge grid": json.dumps({**SPEC, "axes": [{"path": "shaft.load", "linspace": [0, 1, 10**9]}]}).encode(),
    "many grids": json.dumps(
        {**SPEC, "axes": [{"path": path, "linspace": [1, 2, 100_000]} for path in ("shaft.load", "gravity")]}
    ).encode(),
    "many axes": json.dumps({**SPEC, "axes": [{"path": "shaft.load", "values": [1]}] * 1000}).encode(),
    "prototype": b'{"__proto__": {"sprag": 1}, "constructor": 1}',
    "path in the name of a parameter": json.dumps(
        {**SPEC, "axes": [{"path": "../../../etc/passwd", "values": [1]}]}
    ).encode(),
}
#: Bodies whose characters are odd or many.
ODD = ("long integer", "too long integer", "lone surrogate", "nul", "many axes", "path in the name of a parameter")
LONGEST_FIELD = 200_000
TARGETS = ("/api/v1/studies", "/api/v1/studies:preview", "/api/v1/clutch-fits", "/api/v1/schedules")


@pytest.mark.parametrize("name", BODIES)
def test_a_hostile_body_is_refused_by_a_short_problem(service: Service, name: str) -> None:
    headers = {"Content-Type": "application/json"}
    for target in TARGETS:
        answer = service.http.post(target, content=BODIES[name], headers=headers)
        assert answer.status_code in (413, 422), (target, answer.text[:300])
        assert answer.headers["content-type"] == "application/problem+json"
        assert len(answer.content) < 60_000
        answer.content.decode("utf-8")
        assert service.get("/studies")["studies"] == []


@pytest.mark.parametrize("name", [name for name in BODIES if name not in ("nothing", "deep lists", "deep objects")])
def test_a_hostile_spec_is_no_matter_for_the_form(service: Service, name: str) -> None:
    text = BODIES[name].decode("utf-8", "replace")
    # Fields take any text: of bodies that are wrong as JSON only, the text of a spec is enough.
    others = ("/base/shaft/load", "/name", "/axes/0/values", "axes", "pendulums") if name in ODD else ()
    for field in ("/text", *others):
        answer = service.http.post("/new", data={field: text[:LONGEST_FIELD], "do": "check", "format": "json"})
        assert answer.status_code in (200, 413, 422), (field, answer.text[:300])


FORM = {"when": "cron", "cron": "0 22 * * *", "zone": "Europe/Berlin", "priority": "0", "at": "2030-01-01T10:00"}
TEXTS = (
    *("--5", "-", "1e5", "\u0663", "9" * 400, "\x00", "../../etc/passwd", "0-99999999999999 * * * *", "nan"),
    *("9999-12-31T23:59-23:59", "0001-01-01T00:00+23:59", "study \x00", "preset ../x", "<script>alert(1)</script>"),
)


@pytest.mark.parametrize("text", TEXTS)
def test_a_hostile_field_of_a_schedule_is_told_beside_it(service: Service, text: str) -> None:
    source = f"study {service.submit()}"
    for field in ("source", "name", "zone", "cron", "at", "window_begin", "priority", "when"):
        form = {"source": source, **FORM, "when": "at" if field == "at" else "cron", field: text}
        answer = service.http.post("/nights/new", data=form)
        assert answer.status_code in (303, 422), (field, answer.text[:300])
        assert "<script>alert" not in answer.text
    assert "<script>alert" not in service.http.get("/nights").text


@pytest.mark.parametrize("kind", ["json", "toml"])
@pytest.mark.parametrize("name", BODIES)
def test_a_hostile_file_is_refused_by_the_commands(
    name: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / f"spec.{kind}"
    file.write_bytes(BODIES[name])
    database = str(tmp_path / "x.sqlite3")
    for command in (["validate", str(file), "--json"], ["run", str(file), "--json", "--db", database]):
        assert execute(command) == 2
        told = "".join(capsys.readouterr())
        assert isinstance(json.loads(told), dict)
        assert "bug in Sprag" not in told
        assert len(told) < 60_000


@pytest.mark.parametrize(
    "path",
    [
        "/static/../../../../etc/passwd",
        "/static/..%2f..%2f..%2fetc%2fpasswd",
        "/static/%2e%2e/settings.py",
        "/static/sprag.css%00.js",
        "/api/v1/presets/..%2f..%2fsettings",
        "/api/v1/presets/%2e%2e%2f%2e%2e",
        "/api/v1/studies/..%2f..%2fetc",
        "/api/v1/studies/st_1/cases/-1",
        "/api/v1/studies/st_1/cases/" + "9" * 400,
        "/api/v1/models/" + "x" * 5000,
        "/problems/..%2f..%2f",
        "/studies/%3Cscript%3Ealert(1)%3C%2Fscript%3E",
        "//evil.example/",
        "/\\evil.example",
    ],
)
def test_no_address_leads_out(service: Service, path: str) -> None:
    for accept in ("*/*", "text/html"):
        answer = service.http.get(f"http://localhost{path}", headers={"Accept": accept})
        assert answer.status_code in (404, 422), answer.text[:300]
        assert "root:" not in answer.text
        if answer.headers["content-type"].startswith("text/html"):
            assert "<script>alert" not in answer.text


@pytest.mark.parametrize("name", ["a\r\nSet-Cookie: x=1", "\u202egnp.exe", "\x1b[2J", "\ud800", "", "n" * 201])
def test_a_name_that_would_deceive_is_none(service: Service, name: str) -> None:
    answer = service.http.post("/api/v1/studies", content=json.dumps({**SPEC, "name": name}), headers=JSON)
    assert answer.status_code == 422


JSON = {"Content-Type": "application/json"}
NAMES = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    '=HYPERLINK("http://evil.example","x")',
    "{{ 7 * 7 }} ${7*7}",
    "../../etc/passwd",
)


@pytest.mark.parametrize("name", NAMES)
def test_a_hostile_name_is_a_name(service: Service, name: str) -> None:
    study_id = service.submit({**SPEC, "name": name})
    service.fill(study_id)
    for page in ("/", f"/studies/{study_id}", f"/studies/{study_id}/rows", f"/new?clone={study_id}", "/nights/new"):
        text = service.http.get(page).text
        assert "<script>alert" not in text
        assert "<img src=x" not in text
        assert "{{ 7 * 7 }}" in text or "{{ 7 * 7 }}" not in name or page == "/nights/new"
    for form in ("csv", "xlsx", "json"):
        disposition = service.http.get(f"/api/v1/studies/{study_id}/results?format={form}").headers[
            "content-disposition"
        ]
        assert "etc" not in disposition
        assert "evil" not in disposition
        assert "\n" not in disposition
    assert "set-cookie" not in service.http.get(f"/studies/{study_id}").headers
    assert service.get(f"/studies/{study_id}")["name"] == name


def test_no_cell_of_a_table_is_a_formula(service: Service) -> None:
    study_id = service.submit({**SPEC, "name": "=1+1"})
    service.fill(study_id)
    text = service.http.get(f"/api/v1/studies/{study_id}/results?format=csv").text
    cells: list[Any] = [cell for row in csv.reader(io.StringIO(text)) for cell in row]
    for cell in cells:
        if cell[:1] in ("=", "+", "@", "\t", "\r") or (cell.startswith("-") and not cell[1:2].isdigit()):
            float(cell)  # a number may begin with a sign
