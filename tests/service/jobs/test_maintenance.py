"""Maintenance: a backup every night that can be used, the latest of which are kept; old studies deleted."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.cli.app import execute
from sprag_study.service.jobs.dispatching import worker_settings
from sprag_study.service.jobs.maintenance import Maintenance, MaintenancePlan, backups
from sprag_study.service.jobs.submission import accept
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.errors import StudyNotFoundError
from sprag_study.service.storage.store import Store
from tests.service.timed_spec import SPEC
from tests.worker.fakes import HandClock

if TYPE_CHECKING:
    from pathlib import Path

    from sprag_study.service.settings import Settings

DAY = 86_400.0  # s


@pytest.fixture
def clock() -> HandClock:
    """It begins on 1 January 2026 at 00:00 UTC."""
    return HandClock()


@pytest.fixture
def store(settings: Settings, clock: HandClock) -> Iterator[Store]:
    with Store.open(settings.database_url, clock=clock) as opened:
        yield opened


def made(folder: Path) -> list[str]:
    return [f"{when:%d %H:%M}" for when, _ in backups(folder)]


def test_a_backup_is_written_every_night_and_some_are_kept(store: Store, clock: HandClock, tmp_path: Path) -> None:
    folder = tmp_path / "safe" / "backups"
    study = accept(store, parse_spec(SPEC))
    maintenance = Maintenance(store, MaintenancePlan(folder, keep=2, time="02:30", zone="Europe/Berlin"))
    maintenance.look()
    assert made(folder) == ["01 00:00"]  # there was none
    (folder / "of somebody else.sqlite3").write_text("stays")
    for hour in range(1, 3 * 24):
        clock.seconds = hour * 3600.0
        maintenance.look()
    assert made(folder) == ["02 02:00", "03 02:00"]  # 02:30 in Berlin is 01:30 UTC, and it looks on the hour here
    assert (folder / "of somebody else.sqlite3").exists()
    _, latest = backups(folder)[-1]
    with Store.open(f"sqlite:///{latest}") as copy:
        assert copy.studies.get(study.id).cases == 9
        assert copy.check().problems == ()


def test_a_missed_backup_is_made_up_for_and_a_fresh_one_is_enough(
    store: Store, clock: HandClock, tmp_path: Path
) -> None:
    plan = MaintenancePlan(tmp_path / "b", time="02:30")
    clock.seconds = 3 * 3600.0
    Maintenance(store, plan).look()
    clock.seconds = 5 * 3600.0
    Maintenance(store, plan).look()  # the service was started again
    assert made(tmp_path / "b") == ["01 03:00"]
    clock.seconds = DAY + 9 * 3600.0
    Maintenance(store, plan).look()
    assert made(tmp_path / "b") == ["01 03:00", "02 09:00"]


def test_a_backup_that_fails_is_said_and_tried_again(
    store: Store, clock: HandClock, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "b"
    folder.write_text("a file where the folder is to be")
    maintenance = Maintenance(store, MaintenancePlan(folder))
    maintenance.look()
    maintenance.look()
    assert len([text for text in caplog.messages if "failed and is retried" in text]) == 1
    folder.unlink()
    clock.seconds = 601.0
    maintenance.look()
    assert len(made(folder)) == 1


def test_what_else_lies_in_the_folder_and_cannot_be_removed_multiplies_no_backups(
    store: Store, clock: HandClock, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "sprag-20250101T000000Z.sqlite3").mkdir()
    (tmp_path / "sprag-20251399T000000Z.sqlite3").touch()  # no such date
    maintenance = Maintenance(store, MaintenancePlan(tmp_path, keep=1))
    for minute in range(0, 60, 11):
        clock.seconds = minute * 60.0
        maintenance.look()
    assert made(tmp_path) == ["01 00:00", "01 00:00"]
    assert "The nightly backup failed and is retried in 10 minutes: [Errno 21] Is a directory" in caplog.text


def test_a_fault_of_one_task_leaves_the_others_and_the_nights_to_come(
    store: Store, clock: HandClock, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = accept(store, parse_spec(SPEC))
    store.studies.cancel(study.id)
    store.work.settle(store.work.take_over("test"), study.number)
    maintenance = Maintenance(store, MaintenancePlan(tmp_path, study_days=30))
    maintenance.look()
    clock.seconds = 31 * DAY
    with monkeypatch.context() as patch:
        patch.setattr(store, "backup", lambda _: 1 / 0)
        maintenance.look()
    with pytest.raises(StudyNotFoundError):
        store.studies.get(study.id)
    clock.seconds += 601.0
    maintenance.look()
    assert made(tmp_path) == ["01 00:00", "01 00:10"]


def test_parts_of_killed_backups_are_removed(store: Store, tmp_path: Path) -> None:
    left, other = tmp_path / ".sprag-20250101T000000Z.sqlite3.1f.part", tmp_path / ".else.part"
    for path in (left, other):
        path.touch()
        os.utime(path, (0, 0))
    Maintenance(store, MaintenancePlan(tmp_path)).look()
    assert (left.exists(), other.exists()) == (False, True)


def test_studies_that_ended_long_ago_are_deleted_and_no_others(store: Store, clock: HandClock) -> None:
    old, running, young = (accept(store, parse_spec(SPEC)) for _ in range(3))
    epoch = store.work.take_over("test")
    store.studies.cancel(old.id)
    store.work.settle(epoch, old.number)
    maintenance = Maintenance(store, MaintenancePlan(study_days=30))
    maintenance.look()
    clock.seconds = 20 * DAY
    store.studies.cancel(young.id)
    store.work.settle(epoch, young.number)
    clock.seconds = 29 * DAY
    maintenance.look()
    assert store.studies.get(old.id)
    clock.seconds = 31 * DAY
    maintenance.look()
    with pytest.raises(StudyNotFoundError):
        store.studies.get(old.id)
    assert {store.studies.get(running.id).id, store.studies.get(young.id).id} == {running.id, young.id}


def test_old_studies_are_deleted_by_command_too(
    store: Store, settings: Settings, capsys: pytest.CaptureFixture[str]
) -> None:
    study = accept(store, parse_spec(SPEC))
    store.studies.cancel(study.id)
    store.work.settle(store.work.take_over("test"), study.number)  # by the clock of the test it ended in January 2026
    arguments = ["db", "prune", "--older-than", "1", "--db", settings.database]
    for options, code in ((["--dry-run", "--json"], 0), ([], 0), (["--json"], 0)):
        assert execute([*arguments, *options]) == code
    told = capsys.readouterr()
    first, text, last = told.out.splitlines()
    assert json.loads(first) == {"database": settings.database, "deleted": [], "found": [study.id]}
    assert text == study.id
    assert json.loads(last) == {"database": settings.database, "deleted": [], "found": []}
    assert "1 studies deleted" in told.err


def test_the_plan_follows_from_the_settings(settings: Settings, tmp_path: Path) -> None:
    folder = str(tmp_path)
    changed = settings.model_copy(update={"backup_folder": folder, "keep_days": 7, "zone": "Europe/Berlin"})
    plan = worker_settings(changed).maintenance
    assert plan == MaintenancePlan(tmp_path, 14, 7, "02:30", "Europe/Berlin")
    assert plan.timing.next_after(datetime(2026, 7, 1, tzinfo=UTC)) == datetime(2026, 7, 1, 0, 30, tzinfo=UTC)


def test_the_thread_ends_when_it_is_told(store: Store, tmp_path: Path) -> None:
    maintenance = Maintenance(store, MaintenancePlan(tmp_path / "b"))
    maintenance.start()
    maintenance.stop()
    assert not maintenance.is_alive()
    assert len(made(tmp_path / "b")) == 1
