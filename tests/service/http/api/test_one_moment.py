"""What a study tells while it comes to its end: every answer is of one moment, wherever the end falls."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import sqlalchemy as sa

from sprag_study.worker.models import ChunkResult, study_results
from sprag_study.worker.reuse import no_cases

if TYPE_CHECKING:
    from tests.service.conftest import Service


def end(service: Service, study_id: str) -> None:
    """Bring a study to its end as a dispatcher does: known rows are taken, every other row is the same."""
    store = service.store
    record, study = store.studies.get(study_id), store.studies.study(study_id)
    epoch = store.work.take_over("test")
    for chunk in store.work.claim(epoch, store.work.open_chunks(record.number)):
        known = store.work.known(study, chunk)
        values = np.ones((chunk.count, len(study_results(study))))
        same = ChunkResult(chunk.first, ["ok"] * chunk.count, [""] * chunk.count, values)
        assert store.work.commit(epoch, chunk, same if known is None else no_cases(study), known)
    store.work.settle(epoch, record.number)


class Ending:
    """Ends a study right after the given read transaction, counted from 0."""

    def __init__(self, service: Service, study_id: str, after: int) -> None:
        self._service, self._study_id, self._after = service, study_id, after
        self._read, self._reads = service.store.session.read, 0

    @contextmanager
    def read(self) -> Iterator[sa.Connection]:
        with self._read() as connection:
            yield connection
        self._reads += 1
        if self._reads == self._after + 1:
            end(self._service, self._study_id)

    def by_now(self) -> None:
        """End it, unless that was done: there were fewer transactions."""
        if self._reads <= self._after:
            end(self._service, self._study_id)


@pytest.mark.parametrize("after", range(4))
@pytest.mark.parametrize("part", ["", "/events"])
def test_what_a_finished_study_tells_is_final(
    service: Service, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch, after: int, part: str
) -> None:
    end(service, service.submit(spec))
    study_id = service.submit(spec)
    address = f"/api/v1/studies/{study_id}"
    with monkeypatch.context() as patched:
        ending = Ending(service, study_id, after)
        patched.setattr(service.store.session, "read", ending.read)
        patched.setattr("sprag_study.service.http.streams.LOOK_SECONDS", 0.0)
        text = service.http.get(address + part).text
    ending.by_now()
    final = service.http.get(address).json()
    assert (final["state"], final["reused"]) == ("finished", 9)
    assert "no-effect" in final["warning_codes"]
    if not part:
        first = json.loads(text)
        if first["state"] == "finished":
            assert first == final
        else:
            assert (first["state"], first["reused"], first["progress"]["done"]) == ("queued", 0, 0)
            assert first["finished_at"] is None
        return
    told = [json.loads(line.removeprefix("data: ")) for line in text.splitlines() if line.startswith("data: ")]
    assert told[-1]["state"] == "finished"
    for event in told:
        assert event["progress"]["done"] == (9 if event["state"] == "finished" else 0)
