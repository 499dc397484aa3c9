"""The documented interface is the real one: the document is valid, and every example in it works."""

from __future__ import annotations

import json
import tomllib
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import pytest
from fastapi.routing import iter_route_contexts
from openapi_spec_validator import OpenAPIV31SpecValidator
from pydantic import SecretStr

from sprag_study.service.actor import Role
from sprag_study.service.http.api.components import EXAMPLE as COMPONENTS
from sprag_study.service.http.api.examples import SPEC
from sprag_study.service.http.api.schedules import EXAMPLE
from sprag_study.service.http.app import create_app
from sprag_study.service.http.guard import OPEN_PATHS
from sprag_study.service.http.problems import PROBLEM_TYPES
from sprag_study.service.storage.errors import UserExistsError
from sprag_study.service.storage.people.scopes import TokenScope
from tests.service.calibrating import calibration
from tests.service.conftest import in_process, settings_of
from tests.service.searching import search
from tests.service.swept_study import swept_study

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import httpx

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

    Connect = Callable[..., httpx.Client]

TOKEN = "correct-horse-battery-staple"
METHODS = ("get", "post", "patch", "delete")
TOLERANT = {**SPEC, "tolerances": [{"path": "shaft.inertia", "plus_minus": "5 %"}], "drives": 4}


@pytest.fixture(scope="module")
def document(
    tmp_path_factory: pytest.TempPathFactory, empty_database: bytes, connect: Connect
) -> Iterator[dict[str, Any]]:
    """The document as a service gives it."""
    with pytest.MonkeyPatch.context() as patch:
        settings = settings_of(tmp_path_factory.mktemp("document"), empty_database, 2, patch)
        with in_process(settings, connect) as service:
            yield service.http.get("/openapi.json").json()


def operations(document: dict[str, Any]) -> list[tuple[str, str, dict[str, Any]]]:
    """Address, method and description of every operation."""
    return [
        (path, method, item[method]) for path, item in document["paths"].items() for method in METHODS if method in item
    ]


def validator(document: dict[str, Any], schema: dict[str, Any]) -> jsonschema.Draft202012Validator:
    """For values of a schema of the document: that all of this is valid is checked once, below."""
    return jsonschema.Draft202012Validator({**schema, "components": document["components"]})


def test_the_document_is_openapi_3_1(document: dict[str, Any]) -> None:
    assert document["openapi"].startswith("3.1")
    OpenAPIV31SpecValidator(document).validate()


def test_links_give_what_their_targets_take(document: dict[str, Any]) -> None:
    by_id = {operation["operationId"]: operation for _, _, operation in operations(document)}
    links = [
        (link, answer)
        for operation in by_id.values()
        for answer in operation["responses"].values()
        for link in answer.get("links", {}).values()
    ]
    targets = {link["operationId"] for link, _ in links}
    assert {"get_study", "delete_study", "get_curves", "get_case", "change_schedule", "create_study"} <= targets
    for link, answer in links:
        target = by_id[link["operationId"]]
        taken = {parameter["name"]: parameter for parameter in target.get("parameters", ())}
        needed = {name for name, parameter in taken.items() if parameter["in"] == "path"}
        assert needed == set(link.get("parameters", {})), link
        assert ("requestBody" in link) <= ("requestBody" in target), link
        assert "application/json" in answer["content"], link


def test_the_document_says_whether_a_token_is_needed(service: Service, settings: Settings, connect: Connect) -> None:
    with_token = settings.model_copy(update={"token": SecretStr(TOKEN)})
    app = create_app(with_token, store=service.store, computer=service.computer, checker=service.checker)
    header = {"Authorization": f"Bearer {TOKEN}"}
    guarded = connect(app).get("/openapi.json", headers=header).json()
    opened = service.http.get("/openapi.json").json()
    assert guarded["components"] == opened["components"]
    for path, method, operation in operations(guarded):
        wanted: list[dict[str, list[str]]] = [] if path in OPEN_PATHS else [{"bearer": []}]
        assert operation["security"] == wanted, (path, method)
        assert opened["paths"][path][method]["security"] == (wanted and [*wanted, {}])


def test_every_operation_is_documented(service: Service, document: dict[str, Any]) -> None:
    found = {(path, method) for path, method, _ in operations(document)}
    routes = {
        (str(route.path_format), method.lower())
        for route in iter_route_contexts(service.app.routes)
        for method in route.methods or ()
        if getattr(route.original_route, "include_in_schema", True) and str(route.path_format).startswith("/api")
    }
    assert routes <= found
    identifiers = [operation["operationId"] for _, _, operation in operations(document)]
    assert len(set(identifiers)) == len(identifiers)
    for path, method, operation in operations(document):
        assert operation["tags"], path
        assert operation["description"].endswith("."), (path, method)
        for parameter in operation.get("parameters", ()):
            assert parameter["description"], (path, parameter["name"])


def test_every_operation_documents_its_problems(document: dict[str, Any]) -> None:
    problem = validator(document, document["components"]["schemas"]["Problem"])
    seen: set[str] = set()
    for path, method, operation in operations(document):
        responses = operation["responses"]
        if path.startswith("/api"):
            assert {"401", "421", "422", "500", "503"} <= set(responses), (path, method)
        for status, response in responses.items():
            if int(status) < 400:
                continue
            (media, content), *others = response["content"].items()
            assert (media, others) == ("application/problem+json", [])
            assert content["schema"] == {"$ref": "#/components/schemas/Problem"}
            for slug, example in content["examples"].items():
                assert example["value"]["status"] == int(status)
                problem.validate(example["value"])
                seen.add(slug)
    undocumented = set(PROBLEM_TYPES) - seen - {"not-found", "method-not-allowed", "bad-request"}
    assert undocumented == set()


def sent_to(
    service: Service, path: str, method: str, operation: dict[str, Any], study_id: str, accept: str | None = None
) -> list[httpx.Response]:
    """What the service answers to every documented example of an operation, in the format ``accept`` where given."""
    address = path.replace("{study_id}", study_id)
    if "{schedule_id}" in path:
        kept = service.http.post("/api/v1/schedules", json=EXAMPLE).json()["id"]
        address = address.replace("{schedule_id}", kept)
    if "{component_id}" in path:
        made = service.http.post("/api/v1/components", json=COMPONENTS).json()["components"]
        address = address.replace("{component_id}", made[0]["id"])
    if "/users" in path or "/tokens" in path:
        for name in ("dora@example.com", "emil@example.com"):
            with suppress(UserExistsError):
                service.store.people.add_user(name, Role.DESIGNER)
        address = address.replace("{user}", "dora@example.com")
    if "{token_id}" in path:
        address = address.replace("{token_id}", service.store.people.create_token("old", TokenScope.READ)[1].id)
    if "{view_id}" in path:
        curves = {"page": "curves", "name": "loads", "study": study_id, "in_report": True}
        saved = service.http.post("/api/v1/views", json=curves).json()["id"]
        address = address.replace("{view_id}", saved)
    query: list[tuple[str, str]] = []
    headers: dict[str, str] = {} if accept is None else {"Accept": accept}
    for parameter in operation.get("parameters", ()):
        for example in parameter["schema"].get("examples", ())[:1]:
            if parameter["in"] == "path":
                address = address.replace(f"{{{parameter['name']}}}", str(example))
            elif parameter["in"] == "header":
                headers[parameter["name"]] = str(example)
            elif accept is not None and parameter["name"] in ("format", "header", "units"):
                continue
            elif parameter["name"] != "by" or not path.endswith("/curves"):
                values = example if isinstance(example, list) else [example]
                query += [
                    (parameter["name"], str(value))
                    for value in values
                    if parameter["name"] != "at" or "map" not in path
                ]
    answers = []
    contents = operation.get("requestBody", {}).get("content", {None: {"examples": {"none": {"value": None}}}})
    for media, content in contents.items():
        for example in content["examples"].values():
            text = example["value"] if isinstance(example["value"], str) else json.dumps(example["value"])
            kind = {} if media is None else {"Content-Type": media}
            if path.endswith(":extend") and "generations" in text:
                address = address.replace(study_id, search(service))
            body = None if media is None else text
            sent = {**headers, **kind}
            if body is not None and "Idempotency-Key" in sent:
                sent["Idempotency-Key"] += str(len(answers))
            answers.append(service.http.request(method, address, params=query, content=body, headers=sent))
    return answers


def studied(service: Service, path: str, usual: str | None = None) -> str:
    """The id of a study for which the operation of a path has an answer; ``usual`` where that needs no other one."""
    # Only cases of settled studies are run longer, only studies with a goal have designs, and so on.
    spec = SPEC if path.endswith(":longer") else TOLERANT if path.endswith(("/ribbon", "/yield")) else None
    if path.endswith("/basin"):
        ranges = {"shaft.initial_speed": [0, 30], "pendulums.0.initial_angle": [-0.1, 0.1]}
        spec = {**SPEC, "starts": {"count": 2, "ranges": ranges}}
    if path.endswith(("/transient", "/speeds")):
        spec = tomllib.loads((Path(__file__).resolve().parents[4] / "examples" / "slotter.toml").read_text())
    kinds = {"front": search, "calibration": calibration, "{study_id}:narrow": swept_study}
    chosen = kinds.get(path.rpartition("/")[2])
    if usual is not None and spec is None and chosen is None:
        return usual
    study_id = service.submit(spec) if chosen is None else chosen(service)
    if not path.endswith((":cancel", ":pause", ":resume", ":prioritize")):
        service.fill(study_id)
    return study_id


def test_every_example_works(with_token: Service, document: dict[str, Any]) -> None:
    service, read = with_token, studied(with_token, "")
    for path, method, operation in operations(document):
        study_id = studied(service, path, read if method == "get" else None)
        for answer in sent_to(service, path, method, operation, study_id):
            assert answer.status_code < 300, (method, path, answer.text)
            declared = operation["responses"][str(answer.status_code)].get("content", {})
            media = answer.headers.get("content-type", "").partition(";")[0]
            if declared:
                assert media in declared, (method, path)
            if media == "application/json" and "schema" in declared[media]:
                validator(document, declared[media]["schema"]).validate(answer.json())


def test_examples_of_bodies_fit_their_schemas(document: dict[str, Any]) -> None:
    for _path, _method, operation in operations(document):
        content = operation.get("requestBody", {}).get("content", {}).get("application/json", {"examples": {}})
        for example in content["examples"].values():
            validator(document, content["schema"]).validate(example["value"])
