"""A clock that jumps: noticed, told, and nothing is deleted on its word; schedules recover."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx
import pytest

from sprag_study.service.cli.app import execute
from sprag_study.service.cli.console import ExitCode
from sprag_study.service.http.app import create_app
from sprag_study.service.jobs.maintenance import Maintenance, MaintenancePlan, backups
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.jobs.submission import accept
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.settings import Settings
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.clock_watch import ClockWatch
from sprag_study.service.storage.errors import StudyNotFoundError
from sprag_study.service.storage.store import Store
from tests.service.conftest import InThread
from tests.service.timed_spec import SPEC
from tests.worker.fakes import HandClock

DAY = 86_400.0  # s
NEW_YEAR = datetime(2026, 1, 1, tzinfo=UTC)


class Wrong(HandClock):
    """A clock that can be put ahead of the time that passes."""

    def __init__(self) -> None:
        super().__init__()
        self.ahead = timedelta()

    def now(self) -> datetime:
        return super().now() + self.ahead


@pytest.fixture
def clock() -> Wrong:
    return Wrong()


@pytest.fixture
def store(settings: Settings, clock: Wrong) -> Iterator[Store]:
    with Store.open(settings.database_url, clock=clock) as opened:
        opened.work.take_over("here:1")
        yield opened


def ended(store: Store) -> str:
    study = accept(store, parse_spec(SPEC))
    store.studies.cancel(study.id)
    store.work.settle(store.work.take_over("here:1"), study.number)
    return study.id


def test_a_jump_deletes_nothing_and_is_told_and_survives_a_restart(
    settings: Settings, store: Store, clock: Wrong, tmp_path: Path, caplog: pytest.LogCaptureFixture,
    connect: Callable[..., httpx.Client],
) -> None:  # fmt: skip
    http = connect(create_app(settings, store=store, checker=InThread()))
    study, plan = ended(store), MaintenancePlan(tmp_path / "b", keep=1, study_days=30)
    maintenance = Maintenance(store, plan)
    maintenance.look()
    clock.seconds = DAY / 2
    maintenance.look()
    clock.ahead = timedelta(days=3650)
    clock.seconds += 20.0
    for looker in (maintenance, Maintenance(store, plan)):  # as it runs on, and when it is started again
        looker.look()
        clock.seconds += DAY
        looker.look()
        assert store.studies.get(study).id == study
    assert backups(plan.folder or tmp_path)[0][0] == NEW_YEAR + timedelta(hours=12), "kept, although keep is 1"
    assert caplog.text.count("The clock jumped ahead, from 2026-01-01T12:00:20+00:00 to 2035-12-30T12:00:20") == 1
    store.work.take_over("here:1")
    answer = http.get("/readyz").json()
    assert "nothing is deleted by age until it is corrected" in answer["warnings"][0]
    clock.ahead = timedelta()
    looker.look()
    assert "The clock is trusted again: it is 2026-01-0" in caplog.text
    assert store.studies.get(study).id == study
    clock.seconds = 31.5 * DAY
    looker.look()
    with pytest.raises(StudyNotFoundError):
        store.studies.get(study)


def test_the_user_can_say_that_the_clock_is_right(store: Store, clock: Wrong) -> None:
    watch = ClockWatch(store.dispatchers)
    assert watch.believable()
    clock.ahead = timedelta(days=100)
    assert not watch.believable()
    store.dispatchers.note_clock(clock.now())
    assert watch.believable()
    assert ClockWatch(store.dispatchers).believable()


def test_a_pause_of_weeks_and_a_clock_that_is_put_back_are_no_jump(store: Store, clock: Wrong) -> None:
    assert ClockWatch(store.dispatchers).believable()
    clock.ahead = timedelta(days=59)
    assert ClockWatch(store.dispatchers).believable()
    clock.ahead = timedelta(days=-20_000)
    watch = ClockWatch(store.dispatchers)
    assert watch.believable()
    clock.ahead = timedelta(days=59)  # it is set by the network a while after the start
    assert watch.believable()


def test_a_first_start_under_a_wrong_clock_does_not_cover_its_next_jump(store: Store, clock: Wrong) -> None:
    clock.ahead = timedelta(days=3650)
    assert ClockWatch(store.dispatchers).believable(), "nothing is known to compare it with"
    clock.ahead = timedelta()
    watch = ClockWatch(store.dispatchers)
    for clock.seconds in (0.0, 1800.0, 3700.0):
        assert watch.believable()
    clock.ahead = timedelta(days=3650)
    assert not watch.believable()
    assert not ClockWatch(store.dispatchers).believable()


def test_the_command_deletes_nothing_on_the_word_of_a_clock_that_jumped(
    settings: Settings, store: Store, clock: Wrong, capsys: pytest.CaptureFixture[str]
) -> None:
    study = ended(store)
    store.dispatchers.note_clock(clock.now())  # in January 2026: the clock of the command is months ahead
    command = ["db", "prune", "--older-than", "1", "--db", settings.database]
    assert execute(command) == ExitCode.TROUBLE
    assert "nothing is deleted by age until it is corrected" in capsys.readouterr().err
    assert store.studies.get(study).id == study
    assert execute(["admin", "db", "clock", "--db", settings.database]) == 0
    assert execute(command) == 0
    with pytest.raises(StudyNotFoundError):
        store.studies.get(study)


def test_what_was_missed_is_deleted_at_the_start_and_while_backups_fail(
    store: Store, clock: Wrong, tmp_path: Path
) -> None:
    study, folder = ended(store), tmp_path / "b"
    folder.write_text("a file where the folder is to be")
    clock.seconds = 31.4 * DAY  # the machine is off at 02:30, always
    Maintenance(store, MaintenancePlan(folder, study_days=30)).look()
    with pytest.raises(StudyNotFoundError):
        store.studies.get(study)


def test_schedules_are_due_again_when_a_clock_that_was_ahead_is_put_back(store: Store, clock: Wrong) -> None:
    kept = store.schedules.create(read_fields({"spec": SPEC, "cron": "0 22 * * *"}, NEW_YEAR))
    look = Scheduler(store).look
    look()
    clock.ahead = timedelta(days=3650)
    clock.seconds = 60.0
    look()
    due = store.schedules.get(kept.id).next_due
    assert due is not None
    assert due.year == 2035
    clock.ahead = timedelta()
    clock.seconds = 120.0
    look()
    assert store.schedules.get(kept.id).next_due == datetime(2026, 1, 1, 22, tzinfo=UTC)
