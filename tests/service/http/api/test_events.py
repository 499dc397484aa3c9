"""Server-sent events: the progress of a study up to its end."""

from __future__ import annotations

import json
import threading
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.answers import studies
from sprag_study.service.http import streams
from tests.service.shapes import fits

if TYPE_CHECKING:
    from tests.service.conftest import Service

STUDIES = "/api/v1/studies"


def parse(text: str) -> list[tuple[str, str, dict[str, Any]]]:
    """Id, kind and data of every event of a stream."""
    found = []
    for block in text.split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.splitlines() if ": " in line)
        if "event" in fields:
            found.append((fields["id"], fields["event"], json.loads(fields["data"])))
    return found


def test_an_ended_study_is_told_once(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    answer = service.http.get(f"{STUDIES}/{study_id}/events")
    assert answer.headers["content-type"].startswith("text/event-stream")
    assert answer.text.startswith("retry: ")
    ((number, kind, data),) = parse(answer.text)
    assert (kind, data["state"], data["progress"]["done"]) == ("end", "finished", 9)
    fits(studies.FullProgress, data["progress"])
    again = service.http.get(f"{STUDIES}/{study_id}/events", headers={"Last-Event-ID": number})
    assert (again.status_code, again.content) == (204, b"")
    old = service.http.get(f"{STUDIES}/{study_id}/events", headers={"Last-Event-ID": "1"})
    assert len(parse(old.text)) == 1


def test_a_study_is_followed_to_its_end(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    study_id = service.submit()
    looked = threading.Event()
    look = service.store.studies.look

    def noticed(*arguments: Any) -> Any:
        looked.set()
        return look(*arguments)

    monkeypatch.setattr(service.store.studies, "look", noticed)
    monkeypatch.setattr(streams, "LOOK_SECONDS", 0.01)
    heard: list[str] = []
    listener = threading.Thread(target=lambda: heard.append(service.http.get(f"{STUDIES}/{study_id}/events").text))
    listener.start()
    assert looked.wait(600)
    service.fill(study_id, range(2))
    service.fill(study_id)
    listener.join(600)
    told = parse(heard[0])
    assert told[0][2]["state"] == "queued"
    assert told[-1][1:] == ("end", {**told[-1][2], "state": "finished"})
    done = [data["progress"]["done"] for _, _, data in told]
    assert done == sorted(done)
    numbers = [int(number) for number, _, _ in told]
    assert numbers == sorted(set(numbers))


def test_a_deleted_study_ends_the_stream(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    study_id = service.submit()
    service.fill(study_id)
    look = service.store.studies.look

    def deleted(*arguments: Any) -> Any:
        service.store.studies.delete(study_id)
        return look(*arguments)

    monkeypatch.setattr(service.store.studies, "look", deleted)
    assert parse(service.http.get(f"{STUDIES}/{study_id}/events").text) == []
    assert service.http.get(f"{STUDIES}/{study_id}/events").status_code == 404
