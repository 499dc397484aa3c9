"""How schedules and backups fare, a backup that an administrator asks for, and settings in the audit log."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Final

import httpx
import pytest
from pydantic import SecretStr

from sprag_study.service.http.web import me
from sprag_study.service.http.web.deployment import schedule_health
from sprag_study.service.jobs import nights
from sprag_study.service.jobs.settings_log import note_settings
from sprag_study.service.settings import Settings, effective
from sprag_study.service.storage.part import micros_of
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.schedules.runs import RunState
from sprag_study.service.storage.schedules.tables import SCHEDULE_RUNS
from sprag_study.service.storage.store import Store
from tests.service.conftest import in_process
from tests.service.http.people import OWN, Office
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from tests.service.conftest import Service


WORKING: Final[dict[str, object]] = {
    **dict.fromkeys(("ended_at", "silent", "shortage", "differs", "scheduler", "dashboard")), "owner": "one",
    "hosts": [], "refused": [], "fingerprint": "0" * 12, "studies": 0, "started_at": "2027-01-31T06:00:00Z",
    "heartbeat_at": "2027-01-31T06:00:00Z",
}  # fmt: skip


@pytest.fixture
def opened(settings: Settings, service: Service, connect: Callable[..., httpx.Client]) -> Callable[..., Office]:
    return lambda **more: Office(settings, service, connect, **more)


def ended(service: Service) -> None:
    """Wait until no backup is being made."""
    limit = time.monotonic() + 60.0
    while any(thread.name == "sprag-backup" for thread in threading.enumerate()):
        assert time.monotonic() < limit
        time.sleep(0.02)


def test_an_administrator_makes_a_backup_and_sees_the_list(
    opened: Callable[..., Office], service: Service, tmp_path: Path
) -> None:
    folder = tmp_path / "backups"
    office = opened(backup_folder=str(folder))
    ada, dora = office.program("ada"), office.program("dora")
    assert "There is no backup" in ada.get("/me/workers").text
    begun = ada.post("/me/backups", headers=OWN)
    assert (begun.status_code, begun.headers["location"]) == (303, "/me/workers#backups")
    ended(service)
    (path,) = folder.glob("sprag-*.sqlite3")
    with Store.open(f"sqlite:///{path}") as copy:
        assert {user.name for user in copy.people.users()} == {"ada", "dora", "vera"}
    shown = ada.get("/me/workers").text
    assert f'<td class="name" translate="no">{path.name}</td>' in shown
    assert "Make a backup now" in shown
    assert "it does not leave by the browser" in shown
    (row,) = service.store.audit.page(AuditFilter(action="database.backup")).records
    assert (row.actor, row.target, row.detail) == ("ada", path.name, {"bytes": path.stat().st_size})
    # Others see when it was made.
    assert "1 backup in" in dora.get("/me/workers").text
    assert path.name not in dora.get("/me/workers").text
    assert dora.post("/me/backups", headers=OWN).status_code == 403


def test_a_backup_that_fails_is_an_alert(opened: Callable[..., Office], service: Service, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    ada = opened(backup_folder=str(tmp_path / "file")).program("ada")
    ada.post("/me/backups", headers=OWN)
    ended(service)
    (alert,) = service.store.alerts.present()
    assert alert.kind == "backup"
    assert "A backup of the database failed" in ada.get("/me/workers").text


def test_a_backup_that_fails_in_a_copy_is_no_alert(
    opened: Callable[..., Office], service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(service.store.deployment, "is_copy", lambda: True)
    opened(backup_folder=str(tmp_path / "file")).program("ada").post("/me/backups", headers=OWN)
    ended(service)
    assert service.store.alerts.present() == ()


def test_of_a_server_it_says_that_postgresql_has_tools_of_its_own(
    settings: Settings, postgres_url: str, connect: Callable[..., httpx.Client], tmp_path: Path
) -> None:
    given = settings.model_copy(update={"database": postgres_url, "backup_folder": str(tmp_path)})
    with in_process(given, connect) as service:
        assert "PostgreSQL has its own tools" in service.http.get("/me/workers").text
        refused = service.http.post("/me/backups", headers=OWN)
    assert refused.status_code == 404
    assert "use PostgreSQL's own tools, such as pg_dump" in refused.json()["detail"]


def test_without_a_folder_there_is_no_backup(opened: Callable[..., Office]) -> None:
    ada = opened().program("ada")
    assert "Make a backup now" not in ada.get("/me/workers").text
    assert ada.post("/me/backups", headers=OWN).status_code == 404


def test_the_page_begins_with_what_needs_attention(
    opened: Callable[..., Office], service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ada, now = opened(backup_folder=str(tmp_path)).program("ada"), service.store.clock.now()

    def attention() -> str:
        page = ada.get("/me/workers").text
        return page.partition('id="alerts"')[2].partition('id="workers"')[0]

    def backup(age: timedelta) -> None:
        (tmp_path / f"sprag-{now - age:%Y%m%dT%H%M%SZ}.sqlite3").touch()

    assert "There is no backup" in attention()
    backup(timedelta(days=3))
    assert "though the worker makes one every night" in attention()
    backup(timedelta(hours=3))
    assert "every night" not in attention()
    assert "<code>sprag serve</code> starts one" in attention(), "and what to do"
    assert "All is well." not in attention()
    monkeypatch.setattr(me, "worker_list", lambda _: {"usable": 2, "chunks_in_flight": 0, "dispatchers": [WORKING]})
    assert "All is well." in attention()
    refused = {**WORKING, "refused": [{"address": "10.0.0.2", "reason": "another version"}]}
    monkeypatch.setattr(me, "worker_list", lambda _: {"usable": 2, "chunks_in_flight": 0, "dispatchers": [refused]})
    assert "another version" in attention()


def test_the_page_says_how_schedules_fare(service: Service) -> None:
    schedule = service.http.post("/api/v1/schedules", json={"spec": SPEC, "cron": "0 22 * * *", "name": "nightly"})
    assert "nightly" in service.http.get("/me/workers").text
    number = next(record.number for record in service.store.schedules.all())
    now = service.store.clock.now()
    for hours in (30, 54):
        due = now - timedelta(hours=hours)
        with service.store.session.write() as connection:
            connection.execute(
                SCHEDULE_RUNS.insert().values(
                    schedule=number, due=micros_of(due), state=RunState.MISSED.value, missed=0, begun_at=micros_of(due),
                    unbound=0, problem="no worker",
                )
            )  # fmt: skip
    text = service.http.get("/me/workers").text
    row = re.search(rf'<tr>\n<td class="name"><a href="/nights/{schedule.json()["id"]}">.*?</tr>', text, re.DOTALL)
    assert row is not None
    assert re.findall(r'<td class="num">(.*?)</td>', row[0]) == ["2", '<span class="wrong">2</span>']
    assert "Runs of the last 7 days" in text


def test_the_page_of_the_log_shows_a_setting_by_its_name_and_an_empty_value(service: Service) -> None:
    given = Settings().model_copy(update={"backup_folder": "/srv/backups"})
    note_settings(service.store, [setting for setting in effective(given) if setting.name == "backup_folder"])
    page = service.http.get("/me/audit", params={"action": "settings.change", "language": "en"}).text
    assert "<td>service<br>" in page
    assert (
        '<code translate="no">backup_folder</code>: <span translate="no">empty</span> → '
        '<span translate="no">/srv/backups</span>'
    ) in page


def test_every_run_of_the_last_days_is_counted(service: Service) -> None:
    service.http.post("/api/v1/schedules", json={"spec": SPEC, "cron": "*/10 * * * *", "name": "often"})
    number = next(record.number for record in service.store.schedules.all())
    now = micros_of(service.store.clock.now())
    runs = [
        {"schedule": number, "due": now - minute * 60_000_000, "state": RunState.SKIPPED.value, "missed": 0,
         "begun_at": now, "unbound": 0, "problem": "the one before still ran"}
        for minute in range(1, nights.MOST_RUNS + 8)
    ]  # fmt: skip
    with service.store.session.write() as connection:
        connection.execute(SCHEDULE_RUNS.insert(), runs)
    (health,) = schedule_health(service.store)
    assert (health.runs, health.trouble) == (nights.MOST_RUNS + 7, nights.MOST_RUNS + 7)


def test_defaults_are_not_in_the_log_at_the_first_start(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SPRAG_DATABASE", raising=False)
    note_settings(service.store, effective(Settings()))
    assert [row.detail for row in service.store.audit.rows(AuditFilter(action="settings.change"))] == []


def test_settings_that_changed_since_the_last_start_are_in_the_log(service: Service) -> None:
    store = service.store

    def noted(**values: object) -> list[dict[str, list[str]]]:
        given = Settings().model_copy(update=values)
        note_settings(store, [setting for setting in effective(given) if setting.name not in ("database", "port")])
        return [row.detail["changes"] for row in store.audit.rows(AuditFilter(action="settings.change"))]

    secret = "whsec_" + "c2VjcmV0" * 5
    hooks = {"webhook_secret": SecretStr(secret)}
    assert noted(keep_days=30, alert_to=("https://hooks.example/path",), **hooks) == [
        {"alert_to": ["", "https://hooks.example:443"], "webhook_secret": ["", "(secret)"], "keep_days": ["0", "30"]}
    ]
    assert len(noted(keep_days=30, alert_to=("https://hooks.example/path",), **hooks)) == 1
    assert noted(keep_days=7)[1:] == [
        {"alert_to": ["https://hooks.example:443", ""], "webhook_secret": ["(secret)", ""], "keep_days": ["30", "7"]}
    ]
    assert secret not in str(list(store.audit.rows(AuditFilter())))
