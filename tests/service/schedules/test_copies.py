"""A copy of a database fires neither schedules nor reports until it is adopted; the deployment itself goes on."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.cli import doctor
from sprag_study.service.cli.app import execute
from sprag_study.service.cli.schedule import _show
from sprag_study.service.delivery import Delivery
from sprag_study.service.http.app import create_app
from sprag_study.service.jobs.reports.reporter import Reporter
from sprag_study.service.jobs.reports.watchdog import Watchdog, late_runs
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.storage import deployment, maintenance
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.moving import move
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.store import Store
from tests import postgres
from tests.service.conftest import InThread
from tests.service.schedules.conftest import NEW_YEAR, Clock
from tests.service.schedules.receivers import Hook, webhook
from tests.service.timed_spec import SPEC
from tests.worker import fakes

if TYPE_CHECKING:
    import httpx

    from sprag_study.service.settings import Settings

OFF = "This database is a copy, or was moved: its schedules are off"
#: Opens a store by the clock of the test, and closes it at the end.
Opening = Callable[[str], Store]


@pytest.fixture
def hook(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hook]:
    for name in ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "http_proxy", "https_proxy", "all_proxy"):
        monkeypatch.delenv(name, raising=False)
    with webhook() as received:
        yield received


@pytest.fixture
def opening(clock: Clock) -> Iterator[Opening]:
    stores: list[Store] = []

    def opened(url: str) -> Store:
        stores.append(Store.open(url, clock=clock, create=False))
        return stores[-1]

    yield opened
    for store in stores:
        store.close()


def nightly(store: Store, **given: object) -> None:
    fields = {"spec": SPEC, "cron": "0 1 * * *", "name": "nightly", **given}
    store.schedules.create(read_fields(fields, NEW_YEAR))


def fire(store: Store) -> int:
    """What a dispatcher does at every look; the number of studies afterwards."""
    Scheduler(store).look()
    return len(store.studies.page().studies)


def end_studies(store: Store) -> None:
    """Bring every study to its end, with which its reports are ready to be sent."""
    epoch = store.work.take_over("test")
    for study in store.studies.page().studies:
        if study.state.terminal:
            continue
        for chunk in store.work.claim(epoch, store.work.open_chunks(study.number)):
            store.work.commit(epoch, chunk, fakes.result(chunk.first, chunk.count))
        store.work.settle(epoch, study.number)


def by_cp(store: Store, target: Path) -> None:
    store.session.checkpoint()
    shutil.copy2(store.session.path, target)
    shutil.copy2(f"{store.session.path}-wal", f"{target}-wal")


def by_backup(store: Store, target: Path) -> None:
    assert execute(["admin", "db", "backup", str(target), "--db", str(store.session.path)]) == 0


def by_move(store: Store, target: Path) -> None:
    other = Session(f"sqlite:///{target}")
    try:
        move(store.session, other, "a test", lambda _: None)
    finally:
        other.close()


@pytest.mark.parametrize(("copied", "fired"), [(by_cp, True), (by_backup, False), (by_move, True), (by_move, False)])
def test_a_copy_fires_nothing_until_it_is_adopted_and_the_original_goes_on(
    copied: Callable[[Store, Path], None], fired: bool, settings: Settings, clock: Clock, opening: Opening, hook: Hook,
    tmp_path: Path, caplog: pytest.LogCaptureFixture, connect: Callable[..., httpx.Client],
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    original, target = opening(settings.database_url), tmp_path / "staging" / "sprag.sqlite3"
    target.parent.mkdir()
    nightly(original, report_webhook=hook.address)
    nights = 0
    if fired or copied is by_cp:  # a dispatcher is at work
        clock.set("2026-01-01T01:00" if fired else "2026-01-01T00:30")
        nights = fire(original)
    delivery = Delivery(origins=(hook.address,), secret=bytes(32), sender="a@b")
    if fired:
        end_studies(original)
        fire(original)  # its report waits
    copied(original, target)
    copy = opening(f"sqlite:///{target}")
    clock.set("2026-01-02T01:20")
    scheduler = Scheduler(copy)
    scheduler.look()
    scheduler.look()
    assert len(copy.studies.page().studies) == nights
    Watchdog(copy).look()
    Reporter(copy, delivery).look()
    assert hook.requests == []
    assert caplog.text.count(OFF) == 1
    assert "is late" not in caplog.text
    assert ["a copy, whose schedules are off" in late.sentence for late in late_runs(copy)] == [True]
    own = settings.model_copy(update={"database": str(target)})
    http = connect(create_app(own, store=copy, computer=InThread(), checker=InThread()))
    assert OFF in http.get("/api/v1/schedules").json()["off"]
    assert OFF in http.get("/nights").text
    assert_no_next_run(http, capsys)
    assert "копія" in http.get("/nights", headers={"Accept-Language": "uk"}).text
    assert OFF in http.get("/api/v1/night").json()["off"]
    assert OFF in http.get("/nights").text
    assert "копія" in http.get("/nights", headers={"Accept-Language": "uk"}).text
    copy.work.take_over("here:1")
    ready = http.get("/readyz")
    assert ready.status_code == 200
    assert ready.json()["warnings"][0].startswith(OFF)
    (finding,) = (each for each in doctor.examine(str(target)) if each.subject == "schedules")
    assert not finding.ok
    assert OFF in finding.detail

    assert fire(original) == nights + 1
    end_studies(original)
    fire(original)
    Reporter(original, delivery).look()
    assert len(hook.requests) == nights + 1

    assert execute(["admin", "db", "adopt", "--db", str(target)]) == 0
    (noted,) = copy.audit.rows(AuditFilter(action="database.adopt"))
    assert noted.door == "command"
    scheduler.look()
    assert len(copy.studies.page().studies) == nights + 1
    assert caplog.text.count("This database was adopted: its schedules are on.") == 1
    end_studies(copy)
    fire(copy)
    Reporter(copy, delivery).look()
    assert len(hook.requests) == 2 * (nights + 1)
    (schedule,) = http.get("/api/v1/schedules").json()["schedules"]
    assert schedule["next_due"] == "2026-01-03T01:00:00.000000Z"
    assert http.get(schedule["links"]["self"]).json()["off"] is http.get("/api/v1/schedules").json()["off"] is None
    assert "schedule_next_due_timestamp_seconds{" in http.get("/metrics").text
    assert OFF not in http.get("/nights").text
    assert http.get("/api/v1/night").json()["off"] is None
    assert OFF not in http.get("/nights").text


def assert_no_next_run(http: httpx.Client, capsys: pytest.CaptureFixture[str]) -> None:
    """A copy tells no due time that will pass without a run."""
    (schedule,) = http.get("/api/v1/schedules").json()["schedules"]
    shown = http.get(schedule["links"]["self"]).json()
    for each in (schedule, shown):
        assert each["next_due"] is each["next_due_local"] is None
    assert OFF in shown["off"]
    assert '<td data-head="Next run">none</td>' in http.get("/nights").text
    metrics = http.get("/metrics").text
    assert "schedule_last_run_timestamp_seconds" in metrics
    assert "schedule_next_due_timestamp_seconds{" not in metrics
    _show(shown)
    told = capsys.readouterr().err
    assert "next run: none" in told
    assert OFF in told


def test_a_dump_restored_into_another_database_is_a_copy(
    postgres_url: str, postgres_server: postgres.Server, clock: Clock, opening: Opening
) -> None:
    original = opening(postgres_url)
    nightly(original)
    clock.set("2026-01-01T01:00")
    assert fire(original) == 1
    name = postgres_server.new_database()
    where, source = ["-h", str(postgres_server.folder), "-U", "sprag"], str(original.session.url.database)
    dump = subprocess.run(
        [postgres.program("pg_dump") or "pg_dump", *where, source],
        capture_output=True,
        check=True,
        timeout=600,
    )
    psql = ["psql", *where, "-q", "-v", "ON_ERROR_STOP=1", "-d", name]
    subprocess.run(psql, input=dump.stdout, stdout=subprocess.DEVNULL, check=True, timeout=600)
    copy = opening(postgres_server.url(name))
    clock.set("2026-01-02T01:00")
    assert fire(copy) == 1
    assert fire(original) == 2
    assert copy.deployment.adopt()
    assert fire(copy) == 2
    assert not copy.deployment.adopt()
    with original.session.read() as connection:
        kept = deployment.place_of(original.session, connection)
        control = connection.exec_driver_sql("SELECT system_identifier FROM pg_control_system()").scalar_one()
    assert kept["system"] == str(control)


def test_a_database_on_a_server_that_was_renamed_is_no_copy(
    postgres_server: postgres.Server, clock: Clock, opening: Opening
) -> None:
    import psycopg

    name = postgres_server.new_database()
    Store.open(postgres_server.url(name)).close()
    store = opening(postgres_server.url(name))
    nightly(store)
    assert fire(store) == 0
    store.close()
    with psycopg.connect(
        host=str(postgres_server.folder), user="sprag", dbname="postgres", autocommit=True
    ) as connection:
        connection.execute(f"ALTER DATABASE {name} RENAME TO {name}_renamed".encode())
    clock.set("2026-01-01T01:00")
    assert fire(opening(postgres_server.url(f"{name}_renamed"))) == 1


def as_it_is(_: Path) -> None:
    """Started again."""


def vacuumed(file: Path) -> None:
    session = Session(f"sqlite:///{file}")
    with session.plain() as connection:
        connection.exec_driver_sql("VACUUM")
    session.close()


def restored_in_place(file: Path) -> None:
    session = Session(f"sqlite:///{file}")
    maintenance.backup(session, file.with_name("backup"))
    session.close()
    file.write_bytes(file.with_name("backup").read_bytes())


@pytest.mark.parametrize("change", [as_it_is, vacuumed, restored_in_place])
@pytest.mark.parametrize("machines", [(None, None), ("a", "a"), ("a", None), (None, "a")])
def test_the_same_file_is_no_copy_whatever_happens_to_it_and_wherever_it_is_mounted(
    change: Callable[[Path], None], machines: tuple[str | None, str | None], settings: Settings, clock: Clock,
    opening: Opening, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
) -> None:  # fmt: skip
    first, second = machines
    monkeypatch.setattr(deployment, "_machine", lambda: first)
    file = tmp_path / "before" / "sprag.sqlite3"
    file.parent.mkdir()
    shutil.move(settings.database, file)
    store = opening(f"sqlite:///{file}")
    nightly(store)
    assert fire(store) == 0
    store.close()
    change(file)
    file.parent.rename(tmp_path / "after")
    monkeypatch.setattr(deployment, "_machine", lambda: second)
    clock.set("2026-01-01T01:00")
    assert fire(opening(f"sqlite:///{tmp_path / 'after' / 'sprag.sqlite3'}")) == 1


def test_a_cloned_machine_is_another_one(
    settings: Settings, clock: Clock, opening: Opening, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(deployment, "_machine", lambda: "a")
    store = opening(settings.database_url)
    nightly(store)
    assert fire(store) == 0
    monkeypatch.setattr(deployment, "_machine", lambda: "b")
    clock.set("2026-01-01T01:00")
    assert fire(store) == 0
    assert store.deployment.adopt()
    assert fire(store) == 1


def test_a_file_is_told_by_its_birth_too(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    found = subprocess.run(
        ["stat", "--format=%i %.9W", str(file)], capture_output=True, text=True, check=True, timeout=600
    )
    number, birth = found.stdout.split()
    place = deployment.place_of_file(file)
    assert place["number"] == number
    assert place.get("birth", "0.000000000") == birth
    copy = tmp_path / "copy"
    shutil.copy2(file, copy)
    assert deployment.differs(place, deployment.place_of_file(copy))
    assert deployment.differs(place, {**place, "birth": "1.000000000"}) == ("birth" in place)


def test_a_file_that_is_numbered_anew_is_told_by_what_lasts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(deployment, "file_system_of", lambda _: "vfat")
    assert "number" not in deployment.place_of_file(tmp_path)


@pytest.mark.parametrize(
    ("text", "there"), [("0123456789abcdef0123456789abcdef\n", True), ("uninitialized\n", False), ("", False)]
)
def test_a_machine_has_an_id_where_systemd_runs_and_no_container(
    text: str, there: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "machine-id"
    file.write_text(text)
    monkeypatch.setattr(deployment, "_MACHINE_ID", file)
    monkeypatch.setattr(deployment, "_SYSTEMD", tmp_path)
    monkeypatch.setattr(deployment, "_CONTAINERS", (tmp_path / ".dockerenv",))
    found = deployment._machine()
    assert (found is not None) == there
    assert found is None or text.strip() not in found
    (tmp_path / ".dockerenv").touch()
    assert deployment._machine() is None


def test_a_database_without_schedules_is_copied_freely(settings: Settings, opening: Opening, tmp_path: Path) -> None:
    original = opening(settings.database_url)
    Scheduler(original).look()
    original.backup(tmp_path / "copy.sqlite3")
    copy = opening(f"sqlite:///{tmp_path / 'copy.sqlite3'}")
    nightly(copy)
    assert not copy.deployment.is_copy()
    assert copy.deployment.is_deployment()


def test_a_database_of_before_is_the_deployment_after_its_upgrade_without_a_word(
    settings: Settings, clock: Clock, opening: Opening, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store = opening(settings.database_url)
    nightly(store)
    with store.session.write() as connection:
        connection.exec_driver_sql("DROP TABLE deployment")
        connection.exec_driver_sql("ALTER TABLE schedules DROP COLUMN trouble_flags")
        connection.exec_driver_sql("ALTER TABLE studies DROP COLUMN digest")
        connection.exec_driver_sql("ALTER TABLE studies DROP COLUMN reason_values")
        connection.exec_driver_sql("ALTER TABLE schedule_runs DROP COLUMN problem_values")
        connection.exec_driver_sql("UPDATE alembic_version SET version_num = '0036'")
    store.close()
    assert execute(["admin", "db", "upgrade", "--no-backup", "--db", settings.database]) == 0
    shutil.copy(settings.database, tmp_path / "copy.sqlite3")  # before it is started
    clock.set("2026-01-01T01:00")
    assert fire(opening(settings.database_url)) == 1
    assert caplog.text.count(OFF) == 0
    assert fire(opening(f"sqlite:///{tmp_path / 'copy.sqlite3'}")) == 0
