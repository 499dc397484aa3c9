"""A backup that fails and a disk that fills are said once, to administrators, and again only after all was well."""

from __future__ import annotations

import base64
import errno
import json
import shutil
from collections import namedtuple
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from pydantic import ValidationError

from sprag_study.service.actor import Role
from sprag_study.service.delivery import Delivery, MailServer, origin_of
from sprag_study.service.jobs.dispatching import worker_settings
from sprag_study.service.jobs.maintenance import Maintenance, MaintenancePlan
from sprag_study.service.jobs.reports.reporter import Reporter
from sprag_study.service.settings import Settings
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.store import Store
from tests.service.schedules.receivers import mail_server, webhook
from tests.worker.fakes import HandClock

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.service.conftest import Service

Usage = namedtuple("Usage", "total used free")
GB = 10**9


@pytest.fixture
def store(settings: Settings) -> Iterator[Store]:
    with Store.open(settings.database_url, clock=HandClock()) as opened:
        yield opened


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Sets the free bytes of every disk."""

    def free(number: float) -> None:
        monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(10 * GB, 0, int(number)))

    free(5 * GB)
    return free


def waiting(store: Store) -> list[tuple[str, str, dict[str, Any]]]:
    """Channel, target and content of every report that waits; they are claimed."""
    found = []
    while (report := store.reports.claim()) is not None:
        found.append((report.channel, report.target, report.content))
    return found


def test_a_disk_that_fills_is_said_once_and_again_only_after_it_was_well(
    store: Store, disk: Callable[[float], None], tmp_path: Path
) -> None:
    plan = MaintenancePlan(least_free=GB, alert_to=("ada@example.com", "https://hooks.example/x"))
    look = Maintenance(store, plan).look
    look()
    assert store.alerts.present() == ()
    disk(0.8 * GB)
    look()
    Maintenance(store, plan).look()  # another process, or the next start
    (alert,) = store.alerts.present()
    assert alert.kind == "disk"
    assert alert.problem == (
        f"800 MB are free on the disk that holds {store.session.path.parent}, less than 1000 MB (SPRAG_DISK_FREE)."
    )
    assert [(channel, target) for channel, target, _ in waiting(store)] == [
        ("email", "ada@example.com"), ("webhook", "https://hooks.example/x"),
    ]  # fmt: skip
    disk(1.05 * GB)  # at the limit it is not well yet
    look()
    assert len(store.alerts.present()) == 1
    disk(0.5 * GB)
    look()
    assert waiting(store) == []
    disk(2 * GB)
    look()
    assert store.alerts.present() == ()
    store.clock.seconds += 60.0  # type: ignore[attr-defined]
    disk(0.5 * GB)
    look()
    assert len(waiting(store)) == 2
    actions = [row.action for row in store.audit.rows(AuditFilter()) if row.action.startswith("alert")]
    assert actions == ["alert.begin", "alert.end", "alert.begin"]


def test_a_backup_that_fails_is_said_to_administrators_who_have_an_address(store: Store, tmp_path: Path) -> None:
    for name, role in (
        ("ada@example.com", Role.ADMINISTRATOR),
        ("bob", Role.ADMINISTRATOR),
        ("d@x.example", Role.DESIGNER),
    ):
        store.people.add_user(name, role)
    folder = tmp_path / "b"
    folder.write_text("a file where the folder is to be")
    maintenance = Maintenance(store, MaintenancePlan(folder))
    for _ in range(3):
        maintenance.look()
        store.clock.seconds += 601.0  # type: ignore[attr-defined]
    ((channel, target, content),) = waiting(store)
    assert (channel, target, content["alert"]) == ("email", "ada@example.com", "backup")
    assert content["sentence"].startswith("A backup of the database failed: [Errno 17] File exists")
    folder.unlink()
    maintenance.look()
    assert store.alerts.present() == ()


@pytest.mark.parametrize("office", [Delivery(), Delivery(mail_server=MailServer("m", 25, "none"), domains=("x.org",))])
def test_nothing_waits_for_administrators_whom_no_mail_reaches(
    store: Store, disk: Callable[[float], None], office: Delivery
) -> None:
    store.people.add_user("dora@example.com", Role.ADMINISTRATOR)
    disk(0)
    Maintenance(store, MaintenancePlan(least_free=GB), delivery=office).look()
    assert len(store.alerts.present()) == 1
    assert waiting(store) == []


def test_a_folder_that_cannot_be_looked_at_stops_neither_backup_nor_alert(
    store: Store, disk: Callable[[float], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, gone = tmp_path / "b", PermissionError(errno.EACCES, "Permission denied")
    is_dir = Path.is_dir

    def looked_at(path: Path) -> bool:
        if path == store.session.path.parent:
            raise gone
        return is_dir(path)

    monkeypatch.setattr(Path, "is_dir", looked_at)
    folder.mkdir()
    disk(0)
    Maintenance(store, MaintenancePlan(folder, least_free=GB)).look()
    assert [alert.kind for alert in store.alerts.present()] == ["disk"]
    assert str(folder) in store.alerts.present()[0].problem
    assert len(list(folder.glob("sprag-*.sqlite3"))) == 1


def test_an_alert_ends_when_nothing_is_watched_any_more(
    store: Store, disk: Callable[[float], None], tmp_path: Path
) -> None:
    folder = tmp_path / "b"
    folder.write_text("a file where the folder is to be")
    disk(0)
    Maintenance(store, MaintenancePlan(folder, least_free=GB)).look()
    assert {alert.kind for alert in store.alerts.present()} == {"backup", "disk"}
    Maintenance(store, MaintenancePlan(least_free=GB)).look()
    assert [alert.kind for alert in store.alerts.present()] == ["disk"]
    unwatched = Maintenance(store, MaintenancePlan(least_free=0))
    unwatched.look()
    assert store.alerts.present() == ()
    # Another worker of the database watches: its alert is not ended and begun by turns.
    Maintenance(store, MaintenancePlan(folder, least_free=GB)).look()
    unwatched.look()
    assert {alert.kind for alert in store.alerts.present()} == {"backup", "disk"}


def test_alerts_are_mails_and_webhooks_in_the_language_of_the_office(
    store: Store, disk: Callable[[float], None], tmp_path: Path
) -> None:
    with mail_server() as box, webhook() as hook:
        plan = MaintenancePlan(zone="Europe/Kyiv", least_free=GB, alert_to=("ada@example.com", hook.address))
        disk(0.25 * GB)
        Maintenance(store, plan).look()
        delivery = Delivery(
            "https://sprag.example", box.server("none"), "sprag@example.com", origins=(str(origin_of(hook.address)),),
            secret=b"k" * 32, language="uk",
        )  # fmt: skip
        Reporter(store, delivery).look()
        (mail,) = box.mails
        ((_path, headers, body),) = hook.requests
    assert (mail["To"], mail["Subject"]) == ("ada@example.com", "Sprag: потребує уваги: диск заповнюється")
    part = mail.get_body(("plain",))
    assert part is not None
    text = part.get_content()
    assert "вільно 250 МБ, менше ніж 1000 МБ" in text
    assert "https://sprag.example/me/workers" in text
    assert "02:00" in text
    sent = json.loads(body)
    assert (sent["type"], sent["data"]["alert"]) == ("alert", "disk")
    assert sent["data"]["links"] == {"workers": "https://sprag.example/me/workers"}
    assert "known" not in sent["data"]
    assert "webhook-signature" in {name.lower() for name in headers}
    sends = [row.detail["channel"] for row in store.audit.rows(AuditFilter(action="report.send"))]
    assert sends == ["email", "webhook"]


def test_a_copy_of_the_deployment_alerts_nobody(
    store: Store, disk: Callable[[float], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(store.deployment, "is_copy", lambda: True)
    disk(0)
    Maintenance(store, MaintenancePlan(least_free=GB, alert_to=("ada@example.com",))).look()
    assert (store.alerts.present(), waiting(store)) == ((), [])


def test_alerts_stand_on_the_page_and_the_doctor_finds_them(
    service: Service, sprag: Callable[..., Any], settings: Settings, disk: Callable[[float], None]
) -> None:
    assert "less than" not in service.http.get("/me/workers").text
    disk(0.5 * GB)
    Maintenance(service.store, MaintenancePlan(least_free=GB)).look()
    shown = service.http.get("/me/workers", headers={"Accept-Language": "uk"}).text
    assert "вільно 500 МБ, менше ніж 1\u202f000 МБ" in shown or "вільно 500 МБ, менше ніж 1000 МБ" in shown
    done = sprag("admin", "doctor", "--json", "--db", settings.database)
    (finding,) = (it for it in done.data["findings"] if it["subject"] == "alerts")
    assert (finding["ok"], "500 MB are free" in finding["detail"]) == (False, True)


def test_the_doctor_takes_any_disk_where_none_is_watched(
    service: Service,
    sprag: Callable[..., Any],
    settings: Settings,
    disk: Callable[[float], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    disk(0.5 * GB)
    for least, ok in (("1024", False), ("0", True)):
        monkeypatch.setenv("SPRAG_DISK_FREE", least)
        done = sprag("admin", "doctor", "--json", "--db", settings.database)
        assert [it["ok"] for it in done.data["findings"] if it["subject"] == "disk"] == [ok]


def test_settings_say_who_is_told_and_when(settings: Settings) -> None:
    key = "whsec_" + base64.b64encode(b"k" * 32).decode()
    hooks = {"webhook_origins": "https://hooks.example", "webhook_secret": key}
    mails = {"smtp_url": "smtps://mail.example", "mail_from": "sprag@example.com", "mail_domains": "example.com"}
    given = Settings(disk_free=10, alert_to="ada@example.com, https://hooks.example/x", **hooks, **mails)
    plan = worker_settings(given).maintenance
    assert (plan.least_free, plan.alert_to) == (10 * 2**20, ("ada@example.com", "https://hooks.example/x"))
    for wrong in ("ada", "https://elsewhere.example/x", "http://169.254.169.254/"):
        with pytest.raises(ValidationError):
            Settings(alert_to=wrong, **hooks, **mails)
    with pytest.raises(ValidationError, match="SPRAG_SMTP_URL"):
        Settings(alert_to="ada@example.com")
    with pytest.raises(ValidationError, match="SPRAG_MAIL_DOMAINS"):
        Settings(alert_to="ada@elsewhere.example", **mails)
