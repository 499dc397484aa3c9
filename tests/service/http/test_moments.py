"""A page, and an answer about a study, is read in one transaction: its parts are of one moment."""

from __future__ import annotations

import asyncio
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import pytest
import sqlalchemy as sa

from sprag_study.service.http.threads import _in_one_moment, in_thread
from sprag_study.service.storage.database.session import Moment, Session
from tests.service.conftest import API
from tests.service.http.api.test_one_moment import end

if TYPE_CHECKING:
    from anyio.from_thread import BlockingPortal

    from tests.service.conftest import Service

PAGES = ("", "/rows", "?z=shaft.speed.mean", "/cases/3")
ANSWERS = ("", "/curves", "/answers", "/explore")


@contextmanager
def reading(service: Service, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[list[str], list[str]]]:
    """Transactions that begin inside, and statements that read a study's row."""
    begun, rows = list[str](), list[str]()

    def told(*arguments: Any) -> None:
        if re.search(r"FROM studies\b.*\bstudies\.id =", arguments[2], re.DOTALL):
            rows.append(arguments[2])

    with monkeypatch.context() as patch:
        patch.setattr("sprag_study.service.http.access.BELIEVED_SECONDS", math.inf)  # tokens are read again besides
        patch.setattr(service.store.session, "on_wait", lambda kind, _: begun.append(kind))
        sa.event.listen(sa.Engine, "before_cursor_execute", told)
        yield begun, rows
        sa.event.remove(sa.Engine, "before_cursor_execute", told)


@pytest.mark.parametrize(
    "address", [*(f"/studies/{{}}{page}" for page in PAGES), *(f"{API}/studies/{{}}{of}" for of in ANSWERS)]
)
def test_a_page_reads_its_study_once(
    service: Service, ended: str, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = address.format(ended)
    service.http.get(asked)  # what is kept in memory
    with reading(service, monkeypatch) as (begun, rows):
        assert service.http.get(asked).status_code == 200
    assert begun.count("read") == 1
    assert len(rows) <= 2, "without the long texts of the study, and with them"


@pytest.mark.parametrize("address", ["/studies/{}", f"{API}/studies/{{}}"])
def test_the_parts_of_a_page_are_of_one_moment(
    service: Service, spec: dict[str, Any], address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    study_id = service.submit(spec)
    asked, look = address.format(study_id), service.store.studies.look

    def ended_meanwhile(wanted: str) -> Any:
        seen = look(wanted)
        monkeypatch.undo()
        end(service, study_id)
        return seen

    monkeypatch.setattr(service.store.studies, "look", ended_meanwhile)
    assert "fingerprint" not in service.http.get(asked).text
    assert "fingerprint" in service.http.get(asked).text


def test_what_is_written_in_between_is_seen_after_the_moment(service: Service) -> None:
    store, moment = service.store, Moment()
    study_id = service.submit()
    with moment.joined():
        before = store.studies.get(study_id)
        store.studies.pause(study_id)
        assert store.studies.get(study_id) == before
        moment.end()
        assert store.studies.get(study_id).revision > before.revision
    moment.end()
    assert store.studies.get(study_id).state == "paused"


def test_a_moment_ends_with_an_error_of_the_database(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[Session] = []
    monkeypatch.setattr(Moment, "end", lambda self, end=Moment.end: (taken.append(self), end(self)))
    assert service.http.get(f"{API}/studies/st_0123456789abcdef").status_code == 404
    assert taken
    assert service.store.session._engine.pool.checkedout() == 0  # type: ignore[attr-defined]


def test_many_readers_at_once_do_not_wait_for_each_others_connections(service: Service, portal: BlockingPortal) -> None:
    """Each holds the connection of its moment, and more than there are threads wait for one."""
    pool = service.store.session._engine.pool
    together = pool.size() + pool._max_overflow + 40 + 20  # type: ignore[attr-defined]
    begun = list[int]()

    def read() -> None:
        with service.store.session.read() as connection:
            connection.exec_driver_sql("SELECT 1")

    async def answer() -> None:
        await in_thread(read)
        begun.append(1)
        await in_thread(read)

    async def many() -> None:
        await asyncio.gather(*(_in_one_moment(answer)() for _ in range(together)))

    portal.call(many)
    assert len(begun) == together
