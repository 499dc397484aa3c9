"""Whether a database can accept and run studies: its file, its write lock, and the worker."""

from __future__ import annotations

from contextlib import suppress
from threading import Lock
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import recorded
from sprag_study.service.storage.clock_watch import clock_problem
from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.part import SILENT_SECONDS
from sprag_study.service.storage.work.dispatchers import TAKE_OVER_SECONDS
from sprag_study.worker.ports import StoreError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from sprag_study.service.storage.store import Store

#: Seconds that others may hold the write lock: far longer than any write transaction of Sprag.
LOCKED_SECONDS: Final = 5.0
#: Seconds for which an answer is cached, because anybody may ask.
_KEPT_SECONDS: Final = 2.0
#: So many take-overs lately, the last of them less than so many seconds ago: workers fence each other.
_TAKE_OVERS: Final = 3
_YOUNG_SECONDS: Final = 60.0
#: Seconds between two checks of all pages of a database of moderate size.
_CHECK_SECONDS: Final = 600.0


class Readiness:
    """Checks a store on request, one check at a time."""

    def __init__(self, store: Store, locked_seconds: float = LOCKED_SECONDS) -> None:
        self._store = store
        self._locked_seconds = locked_seconds
        self._looking = Lock()
        self._dispatcher_fails: Callable[[], str | None] = lambda: None
        self._late: Callable[[], int] = lambda: 0
        self._found: tuple[str, ...] = ()
        self._until = float("-inf")
        # Services check the pages when they start.
        self._next_check = store.clock.monotonic() + _CHECK_SECONDS

    def problems(self) -> tuple[str, ...]:
        """What prevents studies from being accepted or run, one sentence each; during a check, the last findings."""
        if self._store.clock.monotonic() < self._until or not self._looking.acquire(blocking=False):
            return self._found
        try:
            self._found = tuple(self._look())
            self._until = self._store.clock.monotonic() + _KEPT_SECONDS
        finally:
            self._looking.release()
        return self._found

    def watch(self, dispatcher_fails: Callable[[], str | None]) -> None:
        """Ask also whether the service's own dispatcher fails again and again; the answer is a sentence, or None."""
        self._dispatcher_fails = dispatcher_fails

    def watch_schedules(self, late: Callable[[], int]) -> None:
        """Ask also how many schedules are late."""
        self._late = late

    def warnings(self) -> tuple[str, ...]:
        """What does not prevent work but needs attention, one sentence each."""
        found = []
        with suppress(StoreError):
            if problem := clock_problem(self._store.dispatchers):
                found.append(f"{problem}.")
            if self._store.schedules.any() and self._store.deployment.is_copy():
                found.append(Sentence(recorded.COPY))
            found += self._hindered()
            if not self._store.session.on_server and (linked := self._store.session.file.second_name()):
                text = str(linked)
                found.append(f"{text[:1].upper()}{text[1:]}.")
        with suppress(StoreError):
            if late := self._late():
                # Anyone may read this, so it must not show names.
                found.append(f"Schedules are late: {late}. The page of the last night says which, and why.")
        return tuple(found)

    def _hindered(self) -> Iterator[str]:
        """What hinders one of several dispatchers."""
        found = [record for record in self._store.dispatchers.all() if record.ended_at is None]
        for record in found if len(found) > 1 else ():
            shortage = (record.report or {}).get("shortage")
            if record.silent:
                yield (
                    f"The worker {record.owner} has not responded since "
                    f"{record.heartbeat_at.isoformat(timespec='seconds')}: its {record.studies} studies are not run "
                    "(`sprag admin worker --take-over` ends it)."
                )
            elif shortage:
                yield f"The worker {record.owner}: {shortage}"

    def _look(self) -> list[str]:
        try:
            self._store.ping()
            self._store.session.require_same_file()
            if self._store.clock.monotonic() >= self._next_check:
                self._next_check = self._store.clock.monotonic() + _CHECK_SECONDS
                self._store.require_sound()
            if self._store.session.damage is not None:
                raise DatabaseError(self._store.session.damage, "database-damaged")
            if not self._store.session.can_write(self._locked_seconds):
                return [
                    f"The write lock of the database was not free for {self._locked_seconds:g} s: a process that holds "
                    "it hangs or was stopped (`sprag admin worker --take-over` ends a hung worker).",
                    *self._worker(),
                ]
            if held := self._store.room.full():
                return [f"Studies are held: {held}.", *self._worker()]
            return self._worker()
        except (DatabaseError, StoreError) as error:
            text = str(error)
            return [text[:1].upper() + text[1:] + "."]

    def _taken_over(self) -> str | None:
        """A sentence when workers take a database in a file from each other, so that none completes its chunks."""
        times = 0 if self._store.session.on_server else self._store.dispatchers.take_overs()
        now = self._store.dispatchers.latest() if times >= _TAKE_OVERS else None
        if now is None or (self._store.clock.now() - now.started_at).total_seconds() > _YOUNG_SECONDS:
            return None
        return (
            f"A worker has taken the database over from another one {times} times within "
            f"{TAKE_OVER_SECONDS / 60:g} minutes: either workers end each other, or one is killed again and again."
        )

    def _worker(self) -> list[str]:
        silence = self._store.dispatchers.silence()
        if silence is not None and silence > SILENT_SECONDS:
            return [f"No worker has responded for {silence:.0f} s: studies are not run."]
        if failing := self._dispatcher_fails():
            return [failing]
        if fenced := self._taken_over():
            return [fenced]
        # Another dispatcher runs the studies of one whose workers are missing.
        shortages = [(record.report or {}).get("shortage") for record in self._store.dispatchers.responding()]
        return [shortages[0]] if shortages and all(shortages) and shortages[0] else []
