"""Examples of answers in the documentation: every answer of text has one, and it fits its schema.

They are recorded by

    python -m pytest -o python_functions=record_examples tests/service/http/api/test_answer_examples.py
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import pytest

from sprag_study.service.http.api import answer_examples
from sprag_study.service.http.api.answer_examples import TEXTS
from sprag_study.worker.models.tasks import chunk_task, run_task
from tests.conftest import ROOT
from tests.service import conftest
from tests.service.conftest import made_up
from tests.service.http.api.test_openapi import operations, sent_to, studied

if TYPE_CHECKING:
    import httpx

    from sprag_study.worker.models import ChunkResult
    from sprag_study.worker.study import Study
    from tests.service.conftest import Service

RECORD = f"record them: see {Path(__file__).name}"
FILE = ROOT / "service" / "http" / "api" / answer_examples.FILE
#: Lines of a text, items of a list, and entries of an object with names of any kind, that are kept.
LINES, ITEMS, ENTRIES = 3, 2, 6
#: Lines of a stream of events up to the end of the first one.
EVENT = 6


@pytest.fixture
def document(service: Service) -> dict[str, Any]:
    """The document as the service gives it."""
    found: dict[str, Any] = service.http.get("/openapi.json").json()
    return found


def answers(document: dict[str, Any]) -> list[tuple[str, str, dict[str, Any]]]:
    """Operation, media type and content of every answer that needs an example."""
    return [
        (f"{method} {path}", media, content)
        for path, method, operation in operations(document)
        for status, answer in operation["responses"].items()
        if status.startswith("2")
        for media, content in answer.get("content", {}).items()
        if media in TEXTS
    ]


def fits(value: Any, content: dict[str, Any], document: dict[str, Any]) -> bool:
    """Whether an answer is one that is documented."""
    schema = {**content.get("schema", {}), "components": document["components"]}
    return bool(jsonschema.Draft202012Validator(schema).is_valid(value))


def cut(value: Any, fit: Callable[[Any], bool], whole: Callable[[Any], Any] = lambda part: part) -> Any:
    """The value with fewer items and entries, as few as its schema lets it have."""
    if isinstance(value, list):
        for count in range(ITEMS, len(value)):
            if fit(whole(value[:count])):
                value = value[:count]
                break
        for index in range(len(value)):
            value[index] = cut(value[index], fit, lambda part, i=index: whole([*value[:i], part, *value[i + 1 :]]))
    elif isinstance(value, dict):
        fewer = dict(list(value.items())[:ENTRIES])
        if len(value) > ENTRIES and fit(whole(fewer)):
            value = fewer
        for name in value:
            value[name] = cut(value[name], fit, lambda part, n=name: whole({**value, n: part}))
    return value


def computed(study: Study, known: dict[str, ChunkResult] = {}) -> ChunkResult:  # noqa: B006 - what was computed
    """The results of every case, from the engine."""
    if (text := repr(study)) not in known:
        known[text] = run_task(chunk_task(study, 0, study.cases))
    return known[text]


def record_examples(with_token: Service, document: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """Write the file of examples: those that it lacks, and those that no longer fit."""
    service, found = with_token, dict[str, dict[str, Any]]()
    by_name = {f"{method} {path}": (path, method, operation) for path, method, operation in operations(document)}
    for name, media, content in answers(document):
        kept = answer_examples.recorded().get(name, {}).get(media)
        if kept is not None and (media != "application/json" or fits(kept, content, document)):
            found.setdefault(name, {})[media] = kept
            continue
        path, method, operation = by_name[name]
        for rows in (computed, made_up):  # some ask for cases that failed
            monkeypatch.setattr(conftest, "made_up", rows)
            answer: httpx.Response = sent_to(service, path, method, operation, studied(service, path), media)[0]
            if answer.status_code < 300:
                break
        assert answer.status_code < 300, (name, media, answer.text)
        assert answer.headers["content-type"].partition(";")[0] == media
        if media == "application/json":
            value = cut(answer.json(), lambda part, c=content: fits(part, c, document))
        else:
            value = "\n".join(answer.text.splitlines()[: EVENT if media == "text/event-stream" else LINES]) + "\n"
        found.setdefault(name, {})[media] = value
    text = json.dumps(found, indent=1, ensure_ascii=False)
    FILE.write_text(re.sub(r"http://(?:testserver|localhost)(?::\d+)?", "http://127.0.0.1:8000", text) + "\n")


def test_every_answer_of_text_has_an_example_that_fits(document: dict[str, Any]) -> None:
    needed = answers(document)
    assert [(name, media) for name, media, content in needed if "example" not in content] == [], RECORD
    for name, media, content in needed:
        if media == "application/json":
            assert fits(content["example"], content, document), f"{name}: {RECORD}"
        else:
            assert isinstance(content["example"], str)
            assert content["example"].endswith("\n")
    recorded = {(name, media) for name, by_media in answer_examples.recorded().items() for media in by_media}
    assert recorded == {(name, media) for name, media, _ in needed}


def test_what_is_cut_still_fits() -> None:
    schema = {"type": "object", "properties": {"pair": {"minItems": 3}}, "required": ["z"]}
    value: dict[str, Any] = {**{f"k{index}": index for index in range(9)}, "pair": [1, 2, 3, 4], "z": list(range(9))}
    fitting = jsonschema.Draft202012Validator(schema).is_valid
    short = cut(value, fitting)
    assert fitting(short)
    assert (short["pair"], short["z"]) == ([1, 2, 3], [0, 1])
    assert cut({f"k{index}": index for index in range(9)}, lambda _: True) == {f"k{index}": index for index in range(6)}
