"""Wrong requests: each a problem document that says what and where, none of them a 500."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.http.problems import PROBLEM_TYPES, Problem
from sprag_study.service.storage.errors import DatabaseBusyError, DatabaseFullError
from sprag_study.worker.limits import MAX_BODY_BYTES
from tests.service.http.routes import every_route
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable

    import httpx

    from tests.service.conftest import Service

API = "/api/v1"
JSON = {"Content-Type": "application/json"}
BODY_PATHS = ("/studies", "/studies:preview", "/clutch-fits")


def assert_problem(response: httpx.Response, status: int) -> dict[str, Any]:
    """The body of a problem document that is one in every respect."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    body: dict[str, Any] = response.json(parse_constant=lambda name: pytest.fail(f"{name} in an answer"))
    Problem.model_validate(body)
    kind = PROBLEM_TYPES[body["type"].removeprefix("/problems/")]
    assert (body["status"], body["title"], body["type"]) == (status, kind.title, kind.uri)
    assert "Traceback" not in response.text
    for error in body.get("errors", ()):
        assert error["message"]
        assert ("pointer" in error) != ("parameter" in error)
    return body


def changed(path: str, value: Any) -> dict[str, Any]:
    """The example spec with one thing changed; ``path`` has dots, ``...`` deletes."""
    spec: dict[str, Any] = json.loads(json.dumps(SPEC))
    *parents, last = path.split(".")
    place: Any = spec
    for key in parents:
        place = place[int(key) if isinstance(place, list) else key]
    if value is ...:
        del place[last]
    else:
        place[int(last) if isinstance(place, list) else last] = value
    return spec


BAD_SPECS = {
    "negative inertia": ("base.pendulums.0.inertia", -1e-3, "/base/pendulums/0/inertia"),
    "negative inertia with unit": ("base.pendulums.0.inertia", "-1 kg*m^2", "/base/pendulums/0/inertia"),
    "unknown field": ("base.pendulums.0.masss", 1, "/base/pendulums/0/masss"),
    "unknown section": ("bases", {}, "/bases"),
    "wrong unit": ("base.excitation.frequency", "25 mm", "/base/excitation/frequency"),
    "unit of nothing": ("base.excitation.frequency", "25 blorp", "/base/excitation/frequency"),
    "no number": ("base.shaft.load", None, "/base/shaft/load"),
    "truth for a number": ("base.shaft.load", True, "/base/shaft/load"),
    "huge integer": ("base.shaft.load", 10**400, "/base/shaft/load"),
    "missing field": ("base.shaft.inertia", ..., "/base/shaft/inertia"),
    "empty axis": ("axes.0", {"path": "shaft.load", "values": []}, "/axes/0"),
    "a billion cases": ("axes.0", {"path": "shaft.load", "linspace": [0, 1, 1_000_000_000]}, "/axes/0"),
    "duplicate axis": ("axes.0", {"path": "shaft.load", "values": [1, 2]}, "/axes/1"),
    "axis of no parameter": ("axes.0.path", "shaft.weight", "/axes/0"),
    "window outside the run": ("run.window", ["40 periods", "70 periods"], "/run/window"),
    "clutch law negative": ("base.clutch.coefficients", [0, 200, -1e6], "/base/clutch"),
    "unreachable fit": (
        "base.clutch",
        {"data": [[0, 0], [0.01, 5], [0.02, 1], [0.03, 9], [0.04, 0.5]], "accuracy": 1e-9, "max_degree": 2},
        "/base/clutch",
    ),
    "wrong version": ("sprag", 2, "/sprag"),
    "wrong model": ("model", "perpetuum-mobile", "/model"),
    "name of another kind": ("name", ["x"], "/name"),
    "lone surrogate": ("name", "x\ud800", "/name"),
}


@pytest.mark.parametrize("fault", BAD_SPECS)
@pytest.mark.parametrize("path", ["/studies", "/studies:preview"])
def test_a_wrong_spec_names_its_fault(service: Service, path: str, fault: str) -> None:
    place, value, pointer = BAD_SPECS[fault]
    response = service.http.post(API + path, content=json.dumps(changed(place, value)), headers=JSON)
    body = assert_problem(response, 422)
    assert body["type"] == "/problems/invalid-spec"
    assert any(error["pointer"].startswith(pointer) for error in body["errors"]), body["errors"]


RAW_BODIES = {
    "nothing": b"",
    "no JSON": b"{",
    "NaN": json.dumps(SPEC).replace('"0.1 N*m"', "NaN", 1).encode(),
    "Infinity": json.dumps(SPEC).replace('"0.1 N*m"', "Infinity", 1).encode(),
    "minus Infinity": json.dumps(SPEC).replace('"0.1 N*m"', "-Infinity", 1).encode(),
    "1e999": json.dumps(SPEC).replace('"0.1 N*m"', "1e999", 1).encode(),
    "5000 digits": json.dumps(SPEC).replace('"0.1 N*m"', "1" * 5000, 1).encode(),
    "twice the same key": b'{"sprag": 1, "sprag": 1}',
    "40 deep": b"[" * 40 + b"]" * 40,
    "100000 deep": b"[" * 100_000,
    "40 deep objects": b'{"a":' * 40 + b"1" + b"}" * 40,
    "a list": b"[]",
    "a text": b'"x"',
    "a number": b"1",
    "null": b"null",
    "lone surrogate in a key": b'{"\\ud800": 1}',
    "broken UTF-8": b'{"name": "\xff"}',
    "UTF-16": json.dumps(SPEC).encode("utf-16"),
    "null byte": b"\x00",
}


@pytest.mark.parametrize("body", RAW_BODIES)
@pytest.mark.parametrize("path", BODY_PATHS)
def test_what_is_no_plain_json_is_unprocessable(service: Service, path: str, body: str) -> None:
    response = service.http.post(API + path, content=RAW_BODIES[body], headers=JSON)
    assert assert_problem(response, 422)["errors"]


@pytest.mark.parametrize("body", [b"a = [", b"a = 1979-05-27", b"a = nan", b"a = " + b"[" * 2000, b"\xff"])
def test_what_is_no_plain_toml_is_unprocessable(service: Service, body: bytes) -> None:
    response = service.http.post(f"{API}/studies", content=body, headers={"Content-Type": "application/toml"})
    assert_problem(response, 422)


@pytest.mark.parametrize(
    "media",
    [
        None,
        "text/plain",
        "application/x-www-form-urlencoded",
        "multipart/form-data",
        "application/json;charset=utf-16",
        "x",
    ],
)
@pytest.mark.parametrize("path", BODY_PATHS)
def test_another_content_type_is_refused(service: Service, path: str, media: str | None) -> None:
    headers = {} if media is None else {"Content-Type": media}
    response = service.http.post(API + path, content=json.dumps(SPEC).encode(), headers=headers)
    assert "application/json" in assert_problem(response, 415)["errors"][0]["allowed"]


@pytest.mark.parametrize("path", BODY_PATHS)
def test_a_body_over_the_limit_is_refused(service: Service, path: str) -> None:
    response = service.http.post(API + path, content=b" " * (MAX_BODY_BYTES + 1), headers=JSON)
    assert_problem(response, 413)
    assert assert_problem(service.http.post(API + path, content=b" " * MAX_BODY_BYTES, headers=JSON), 422)


@pytest.mark.parametrize(
    "path",
    [
        "/nope",
        "/api",
        f"{API}/",
        f"{API}/studies/",
        f"{API}/studies/a b",
        f"{API}/studies/%ff",
        f"{API}/studies/x:frob",
    ],
)
def test_an_unknown_address_is_not_found(service: Service, path: str) -> None:
    assert assert_problem(service.http.get(path), 404)["type"] == "/problems/not-found"


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("PUT", f"{API}/studies", "GET, HEAD, OPTIONS, POST"),
        ("POST", f"{API}/studies/st_1", "DELETE, GET, HEAD, OPTIONS, PATCH"),
        ("GET", f"{API}/studies:preview", "OPTIONS, POST"),
        ("GET", f"{API}/studies/st_1:cancel", "OPTIONS, POST"),
        ("DELETE", "/", "GET, HEAD, OPTIONS"),
    ],
)
def test_another_method_is_not_allowed(service: Service, method: str, path: str, allowed: str) -> None:
    response = service.http.request(method, path)
    assert_problem(response, 405)
    assert response.headers["allow"] == allowed


@pytest.mark.parametrize(
    ("query", "parameter"),
    [
        ("page_size=0", "page_size"),
        ("page_size=1001", "page_size"),
        ("page_size=x", "page_size"),
        ("page_size=" + "9" * 5000, "page_size"),
        ("page_token=x", "page_token"),
        ("page_token=" + "9" * 300, "page_token"),
        ("state=happy", "state"),
        ("sate=queued", "sate"),
        ("page_size=1&page_size=2", "page_size"),
        ("%ff=1", "\ufffd"),
    ],
)
def test_a_wrong_query_parameter_is_named(service: Service, query: str, parameter: str) -> None:
    body = assert_problem(service.http.get(f"{API}/studies?{query}"), 422)
    assert [error["parameter"] for error in body["errors"]] == [parameter]
    assert len(json.dumps(body)) < 2000


@pytest.mark.parametrize(
    ("error", "status"), [(DatabaseBusyError("busy"), 503), (DatabaseFullError("the disk is full"), 507)]
)
def test_trouble_with_the_database_is_told(
    service: Service, monkeypatch: pytest.MonkeyPatch, error: Exception, status: int
) -> None:
    def fail(*_: Any, **__: Any) -> Any:
        raise error

    for part, name in ((service.store.studies, "insert"), (service.store, "ping"), (service.store.studies, "page")):
        monkeypatch.setattr(part, name, fail)
    assert_problem(service.http.post(f"{API}/studies", json=SPEC), status)
    assert_problem(service.http.get("/readyz"), 503)  # not ready, whatever the trouble
    assert service.http.get("/livez").status_code == 200


def test_a_fault_of_the_program_tells_no_secrets(
    service: Service, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: Any, **__: Any) -> Any:
        raise RuntimeError("the secret")

    monkeypatch.setattr(service.store.studies, "page", fail)
    response = service.http.get(f"{API}/studies")
    assert_problem(response, 500)
    assert "secret" not in response.text
    assert "nosniff" in response.headers["x-content-type-options"]
    assert "the secret" in caplog.text


def test_every_problem_has_a_page(service: Service, connect: Callable[..., httpx.Client]) -> None:
    for kind in PROBLEM_TYPES.values():
        page = service.http.get(kind.uri)
        assert page.status_code == 200
        assert kind.uri in page.text
    assert_problem(service.http.get("/problems/none"), 404)


def test_operations_refuse_unknown_parameters_and_pages_ignore_them(service: Service) -> None:
    operations = {path for path, item in service.http.get("/openapi.json").json()["paths"].items() if "get" in item}
    plain = {address for method, address in every_route(service.app) if method == "GET" and "x_1" not in address}
    asked = {path: service.http.get(path, params={"utm_source": "mail"}) for path in operations if "{" not in path}
    assert len(asked) > 10
    for path, answer in asked.items():
        assert assert_problem(answer, 422)["errors"][0]["parameter"] == "utm_source", path
    pages = {path for path in plain - operations if service.http.get(path).status_code == 200}
    assert {"/", "/nights", "/me/workers", "/help/interface", "/compare", "/new"} <= pages
    for path in pages:
        assert service.http.get(path, params={"utm_source": "mail"}).status_code == 200, path
