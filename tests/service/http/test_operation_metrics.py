"""Metrics of schedules, backups, disks, queues and executors; the dashboard and the alert rules that read them."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import httpx
import pytest
from prometheus_client import CollectorRegistry, generate_latest
from ruamel.yaml import YAML

from sprag_study.service.http.app import create_app
from sprag_study.service.http.operation_metrics import WORKER_STATES, OperationCollector
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.outcomes import Result
from sprag_study.service.settings import Settings
from sprag_study.service.storage.store import Store
from sprag_study.worker.reports import WorkerReport
from tests.conftest import ROOT
from tests.service.conftest import InThread, Service
from tests.service.http.test_metrics import samples, value
from tests.service.schedules.conftest import Clock
from tests.service.timed_spec import SPEC
from tests.worker import fakes

ALERTS = ROOT / "examples" / "alerts.yaml"
DASHBOARD = ROOT / "examples" / "grafana-dashboard.json"


@pytest.fixture
def backed_up(settings: Settings, tmp_path: Path, connect: Callable[..., httpx.Client]) -> Iterator[Service]:
    """A service with a folder for backups and a clock of the test."""
    (tmp_path / "backups").mkdir()
    changed = settings.model_copy(update={"backup_folder": str(tmp_path / "backups")})
    clock = Clock()
    with Store.open(changed.database_url, clock=clock) as store:
        app = create_app(changed, store=store, computer=InThread(), checker=InThread())
        yield Service(app, connect(app), store, InThread())


def family(service: Service, name: str) -> dict[tuple[str, ...], float]:
    """The samples of one name, by the values of their labels in the order of their names."""
    return {tuple(dict(sorted(s.labels.items())).values()): s.value for s in samples(service) if s.name == name}


def test_a_schedule_tells_its_due_time_and_the_outcome_of_the_last(backed_up: Service) -> None:
    store, clock = backed_up.store, backed_up.store.clock
    assert isinstance(clock, Clock)
    made = backed_up.http.post("/api/v1/schedules", json={"spec": SPEC, "name": "nightly", "cron": "0 22 * * *"})
    schedule = made.json()["id"]
    labels = {"schedule": schedule, "name": "nightly"}
    due = "sprag_schedule_next_due_timestamp_seconds"
    assert value(samples(backed_up), due, **labels) == datetime(2026, 1, 1, 22, tzinfo=UTC).timestamp()
    assert family(backed_up, "sprag_schedule_last_run") == {}
    clock.set("2026-01-03T22:05")
    Scheduler(store).look()
    found = samples(backed_up)
    assert value(found, due, **labels) == datetime(2026, 1, 4, 22, tzinfo=UTC).timestamp()
    assert value(found, "sprag_schedule_last_run_timestamp_seconds", **labels) == clock.now().timestamp()
    assert value(found, "sprag_schedule_last_run_missed", **labels) == 2
    outcomes = {s.labels["outcome"]: s.value for s in found if s.name == "sprag_schedule_last_run"}
    assert outcomes == {"taken": 0, "submitted": 1, "refused": 0, "skipped": 0, "missed": 0}
    assert value(found, "sprag_schedule_last_trouble", **labels) == 1, "due times were missed"
    clock.set("2026-01-04T22:00:30")
    Scheduler(store).look()
    study = backed_up.get("/studies")["studies"][0]["id"]
    for result, trouble in (("queued", 0), ("finished", 1)):  # every fifth case of it fails
        if result == "finished":
            backed_up.fill(study)
        results = {s.labels["result"]: s.value for s in samples(backed_up) if s.name == "sprag_schedule_last_result"}
        assert results == {each.value: float(each.value == result) for each in Result}
        assert value(samples(backed_up), "sprag_schedule_last_trouble", **labels) == trouble
    backed_up.http.delete(f"/api/v1/schedules/{schedule}")
    assert family(backed_up, due) == {}


def test_backups_and_disks_are_measured(backed_up: Service, tmp_path: Path) -> None:
    found = samples(backed_up)
    assert value(found, "sprag_backups") == 0
    assert not [s for s in found if s.name.startswith("sprag_backup_last")]
    for stamp, size in {"20260101T023000Z": 100, "20260102T023000Z": 300}.items():
        (tmp_path / "backups" / f"sprag-{stamp}.sqlite3").write_bytes(bytes(size))
    found = samples(backed_up)
    assert value(found, "sprag_backups") == 2
    assert value(found, "sprag_backup_last_size_bytes") == 300
    latest = datetime(2026, 1, 2, 2, 30, tzinfo=UTC).timestamp()
    assert value(found, "sprag_backup_last_timestamp_seconds") == latest
    assert {s.labels["disk"] for s in found if s.name == "sprag_disk_free_bytes"} == {"database", "backups"}
    total = shutil.disk_usage(tmp_path).total
    assert family(backed_up, "sprag_disk_size_bytes") == {("backups",): total, ("database",): total}
    file = backed_up.store.session.path
    assert value(found, "sprag_database_size_bytes") >= file.stat().st_size > 0


def test_a_service_without_backups_says_nothing_of_them(service: Service) -> None:
    found = samples(service)
    assert not [s for s in found if s.name.startswith("sprag_backup")]
    assert {s.labels["disk"] for s in found if s.name == "sprag_disk_free_bytes"} == {"database"}


def test_every_executor_reports_its_workers(service: Service) -> None:
    assert not [s for s in samples(service) if "executor" in s.labels]
    team = [WorkerReport("tls://a:1", "a", usable=True, threads=2), WorkerReport("tls://b:1", "b", usable=False)]
    epoch = service.store.work.take_over("head:7")
    service.store.work.heartbeat(epoch, fakes.report(*team, shortage="No worker."))
    found = samples(service)
    assert value(found, "sprag_workers", executor="dask", host="a", state="usable") == 1
    assert value(found, "sprag_workers", executor="dask", host="b", state="usable") == 0
    assert {s.labels["state"] for s in found if s.name == "sprag_workers"} == {*WORKER_STATES}
    assert value(found, "sprag_idle_threads", executor="dask", host="a") == 2
    assert value(found, "sprag_executor_chunks_in_flight", executor="dask") == 0
    assert value(found, "sprag_executor_shortage", executor="dask") == 1
    service.store.work.heartbeat(epoch, fakes.report(*team))
    assert value(samples(service), "sprag_executor_shortage", executor="dask") == 0


def test_queues_and_requests_in_progress_are_counted(service: Service) -> None:
    """A request is in the queue of checks while its check runs, and not afterwards."""
    seen: list[dict[str, float]] = []

    def look(*_: Any) -> Any:
        shares = service.app.state.context.check_shares
        seen.append({"checks": shares.requests})
        raise RuntimeError("seen")

    assert family(service, "sprag_queue_requests") == {("checks",): 0, ("computations",): 0, ("files",): 0}
    assert value(samples(service), "sprag_http_requests_in_progress") == 1  # the one that asks
    service.checker.answer = look
    service.http.post("/api/v1/studies:preview", json=SPEC)
    assert seen == [{"checks": 1}]
    assert family(service, "sprag_queue_requests") == {("checks",): 0, ("computations",): 0, ("files",): 0}
    assert value(samples(service), "sprag_http_requests_in_progress") == 1


def test_the_metrics_of_a_server_have_its_size_and_no_disk(postgres_url: str) -> None:
    with Store.open(postgres_url) as store:
        registry = CollectorRegistry()
        registry.register(OperationCollector(Settings(database=postgres_url, backup_folder="/no/such"), store))
        text = generate_latest(registry).decode()
    (size,) = re.findall(r"^sprag_database_size_bytes (\S+)$", text, re.MULTILINE)
    assert float(size) > 1e6
    assert "sprag_disk_free_bytes{" not in text
    assert "sprag_backups" not in text


def expressions() -> dict[str, str]:
    """Every expression of the dashboard and of the alert rules, by where it stands."""
    rules = YAML(typ="safe", pure=True).load(ALERTS.read_text(encoding="utf-8"))
    found = {rule["alert"]: rule["expr"] for group in rules["groups"] for rule in group["rules"]}
    panels = json.loads(DASHBOARD.read_text(encoding="utf-8"))["panels"]
    for panel in panels:
        for target in panel.get("targets", ()):
            found[f"{panel['title']} {target['refId']}"] = target["expr"]
    return found


def test_every_metric_of_a_rule_is_in_a_panel() -> None:
    read = {name for where, expression in expressions().items() if where[:5] == "Sprag"
                     for name in re.findall(r"\bsprag_\w+", expression)}  # fmt: skip
    shown = {name for where, expression in expressions().items() if where[:5] != "Sprag"
             for name in re.findall(r"\bsprag_\w+", expression)}  # fmt: skip
    assert read - shown == set()


def test_every_metric_of_the_dashboard_and_of_the_rules_exists_and_every_metric_is_documented(
    backed_up: Service, tmp_path: Path
) -> None:
    service = backed_up
    (tmp_path / "backups" / "sprag-20260101T023000Z.sqlite3").write_bytes(b"x")
    service.store.work.heartbeat(
        service.store.work.take_over("head:7"), fakes.report(WorkerReport("a", "a", usable=True))
    )
    text = service.http.get("/metrics").text
    families = set(re.findall(r"^# TYPE (\w+) ", text, re.MULTILINE))
    names = {s.name for s in samples(service)} | families
    used = {where: set(re.findall(r"\bsprag_\w+", expression)) for where, expression in expressions().items()}
    assert all(used[where] for where in used if where != "SpragDown")
    assert set().union(*used.values()) <= names
    kept = {re.sub(r"_(total|bucket|sum|count|created)$", "", name) for name in set().union(*used.values())}
    own = {re.sub(r"_total$", "", name) for name in families if not name.endswith("_created")}
    assert own - kept == set(), "what nobody looks at"
    page = (ROOT / "docs" / "operations.md").read_text(encoding="utf-8")
    assert {name for name in own if name not in page} == set()


@pytest.fixture(scope="module")
def promtool() -> str:
    """Prometheus's own tool; its absence is a failure in the gate."""
    found = shutil.which("promtool")
    if found is None:
        reason = "needs promtool, of the package prometheus"
        assert "CI" not in os.environ, reason
        pytest.skip(reason)
    return found


def checked(*command: str) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_prometheus_accepts_the_rules_and_they_fire_when_they_should(promtool: str, tmp_path: Path) -> None:
    """Every rule fires in trouble, and none while all is well."""
    for file in (ALERTS, Path(__file__).with_name("alert_cases.yaml")):
        shutil.copy(file, tmp_path)
    assert "14 rules found" in checked(promtool, "check", "rules", str(tmp_path / ALERTS.name))
    assert "SUCCESS" in checked(promtool, "test", "rules", str(tmp_path / "alert_cases.yaml"))


def test_prometheus_accepts_every_expression_of_the_dashboard(promtool: str, tmp_path: Path) -> None:
    plain = [each.replace("$__rate_interval", "5m").replace("$instance", ".*") for each in expressions().values()]
    assert "$" not in "".join(plain)
    rules = [{"record": f"x:{number}", "expr": expression} for number, expression in enumerate(plain)]
    (tmp_path / "rules.yaml").write_text(json.dumps({"groups": [{"name": "dashboard", "rules": rules}]}))
    assert f"{len(rules)} rules found" in checked(promtool, "check", "rules", str(tmp_path / "rules.yaml"))


def test_the_panels_lie_beside_each_other() -> None:
    dashboard = json.loads(DASHBOARD.read_text(encoding="utf-8"))
    panels = dashboard["panels"]
    assert len({panel["id"] for panel in panels}) == len(panels) > 20
    taken: set[tuple[int, int]] = set()
    for panel in panels:
        place = panel["gridPos"]
        cells = {
            (x, y)
            for x in range(place["x"], place["x"] + place["w"])
            for y in range(place["y"], place["y"] + place["h"])
        }
        assert not cells & taken
        assert max(x for x, _ in cells) < 24
        taken |= cells
        assert panel["type"] == "row" or panel["datasource"]["uid"] == "${datasource}"
    assert {variable["name"] for variable in dashboard["templating"]["list"]} == {"datasource", "instance"}


def test_the_scrape_config_of_the_docs_is_yaml() -> None:
    page = (ROOT / "docs" / "operations.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```yaml\n(scrape_configs:.*?)```", page, re.DOTALL)
    (job,) = YAML(typ="safe", pure=True).load(block)["scrape_configs"]
    assert job["job_name"] == "sprag"
    assert job["metrics_path"] == "/metrics"
