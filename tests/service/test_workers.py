"""The workers of a cluster as every door shows them, and what follows from their number."""

from __future__ import annotations

import json
import platform
from functools import partial
from typing import TYPE_CHECKING

import pytest
import sqlalchemy as sa
from prometheus_client.parser import text_string_to_metric_families

from sprag_study.service.answers.workers import WorkerList
from sprag_study.service.cli import workers
from sprag_study.service.cli.app import execute
from sprag_study.service.cli.doctor import examine
from sprag_study.service.storage.tables import DISPATCHERS
from sprag_study.worker import fingerprint
from sprag_study.worker.reports import WorkerReport
from tests.service.conftest import SPEC
from tests.service.shapes import fits
from tests.worker import fakes

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from tests.service.conftest import Service

SHORTAGE = "No usable worker has joined the scheduler tls://head:8786; the study waits for one."
REFUSED = WorkerReport("tls://b:1", "b", usable=False, refusal="numpy: 1.0 instead of 2.0")


@pytest.fixture
def team() -> list[WorkerReport]:
    """Five usable workers on two hosts, and one that is refused."""
    usable = [WorkerReport(f"tls://a:{n}", "a", usable=True, busy=n < 3, processor="znver5") for n in range(1, 5)]
    return [*usable, WorkerReport("tls://b:2", "b", usable=True, threads=4, processor="skylake-avx512"), REFUSED]


def report(service: Service, *workers: WorkerReport, shortage: str = "") -> None:
    """Let a dispatcher take over and report those workers."""
    service.store.work.heartbeat(service.store.work.take_over("head:7"), fakes.report(*workers, shortage=shortage))


def test_before_the_first_dispatcher_there_is_none(service: Service) -> None:
    found = service.get("/workers")
    fits(WorkerList, found)
    assert (found["usable"], found["dispatchers"]) == (0, [])
    assert "No dispatcher has worked" in service.http.get("/me/workers").text
    service.store.work.take_over("head:7")
    (found,) = service.get("/workers")["dispatchers"]
    assert found["executor"] is None, "it has not reported yet"


def test_the_workers_are_shown_by_host_with_refusals(
    service: Service,
    team: list[WorkerReport],
    connected: Callable[[ModuleType], None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    connected(workers)
    report(service, *team)
    found = service.get("/workers")
    fits(WorkerList, found)
    (team_of,) = found["dispatchers"]
    assert (found["usable"], team_of["executor"], team_of["owner"]) == (5, "dask", "head:7")
    assert [(host["host"], host["busy"], host["idle_threads"], host["refused"]) for host in team_of["hosts"]] == [
        ("a", 2, 2, 0),
        ("b", 0, 4, 1),
    ]
    page = service.http.get("/me/workers").text
    assert "5 workers run chunks" in page
    assert '<td class="name">a</td><td>znver5</td>' in page
    assert "<code>tls://b:1</code>: numpy: 1.0 instead of 2.0" in page
    assert 'href="http://head:8787/status"' in page
    assert execute(["admin", "workers", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == found
    assert execute(["admin", "workers"]) == 0
    shown = capsys.readouterr()
    assert "idle threads" in shown.out
    rows = [line for line in shown.out.splitlines() if line.split()[:1] in (["a"], ["b"])]
    shown_of = [(row.split()[1], row.split()[-1]) for row in rows]
    assert shown_of == [("znver5", "head:7"), ("skylake-avx512", "head:7")]
    assert "tls://b:1 is refused: numpy: 1.0 instead of 2.0" in shown.err
    assert "head:7 has 0 studies and 0 chunks in flight, fingerprint " in shown.err
    assert "Dask's dashboard: http://head:8787/status" in shown.err
    doctor = {finding.subject: finding for finding in examine(str(service.store.session.path))}
    assert "5 usable on 2 hosts, 6 idle threads, 0 chunks in flight, 0 cases/s; " in doctor["workers"].detail
    samples = {
        (sample.name, *sorted(sample.labels.items())): sample.value
        for family in text_string_to_metric_families(service.http.get("/metrics").text)
        for sample in family.samples
    }
    dask = (("executor", "dask"),)
    assert samples["sprag_workers", *dask, ("host", "a"), ("state", "usable")] == 4
    assert samples["sprag_workers", *dask, ("host", "b"), ("state", "refused")] == 1
    assert samples["sprag_host_cases_per_second", *dask, ("host", "a")] == 0.0
    with service.store.session.write() as connection:
        connection.execute(sa.update(DISPATCHERS).values(heartbeat_at=DISPATCHERS.c.heartbeat_at - 120_000_000))
    assert execute(["admin", "workers"]) == 0
    shown = capsys.readouterr()
    assert "idle threads" not in shown.out, "the workers of a silent dispatcher are not known"
    assert "has not responded since" in shown.err
    assert "is refused" not in shown.err
    assert "\nsprag_dispatchers 0.0\n" in service.http.get("/metrics").text


def test_a_report_of_an_earlier_version_names_no_processor(service: Service, team: list[WorkerReport]) -> None:
    earlier = fakes.report(*team)
    for host in earlier["hosts"]:
        del host["processor"]
    service.store.work.heartbeat(service.store.work.take_over("head:7"), earlier)
    found = service.get("/workers")
    fits(WorkerList, found)
    assert [host["processor"] for host in found["dispatchers"][0]["hosts"]] == ["", ""]
    assert '<td class="name">a</td><td></td>' in service.http.get("/me/workers").text


def test_a_difference_says_from_which_dispatcher(
    service: Service,
    connected: Callable[[ModuleType], None],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    connected(workers)
    monkeypatch.setattr(service.store.dispatchers, "presence", fakes.Present())
    service.store.work.take_over("head:7")
    monkeypatch.setattr(fingerprint, "digest", lambda: "another")
    monkeypatch.setattr(fingerprint, "present", partial(dict, fingerprint.present(), Python="2.7"))
    service.store.work.take_over("other:8")
    difference = f"Python: 2.7 instead of {platform.python_version()}"
    assert f"<code>another</code> (differs from that of head:7: {difference})" in service.http.get("/me/workers").text
    assert execute(["admin", "workers"]) == 0
    said = capsys.readouterr().err
    assert said.count("Its fingerprint differs from that of ") == 1
    assert f"Its fingerprint differs from that of head:7: {difference}." in said


def test_the_service_is_not_ready_while_no_worker_can_work(service: Service) -> None:
    report(service, REFUSED, shortage=SHORTAGE)
    answer = service.http.get("/readyz")
    assert (answer.status_code, answer.json()["detail"]) == (503, SHORTAGE)
    page = service.http.get("/me/workers").text
    assert "No worker can be used at present." in page
    assert SHORTAGE in page
    doctor = {finding.subject: finding for finding in examine(str(service.store.session.path))}
    assert (doctor["workers"].ok, doctor["workers"].detail) == (False, SHORTAGE)


def test_a_worker_that_hangs_is_a_fault_of_the_installation(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    hung = {"owner": "head:7", "silent": True, "ended_at": None}
    monkeypatch.setattr("sprag_study.service.jobs.workers.worker_list", lambda _store: {"dispatchers": [hung]})
    doctor = {finding.subject: finding for finding in examine(str(service.store.session.path))}
    assert not doctor["workers"].ok
    assert doctor["workers"].detail.startswith("no heartbeat from head:7")


def test_the_service_is_not_ready_while_its_dispatcher_fails_again_and_again(service: Service) -> None:
    service.app.state.readiness.watch(lambda: "The worker has ended 3 times within 10 minutes.")
    answer = service.http.get("/readyz")
    assert answer.status_code == 503
    assert "ended 3 times within 10 minutes" in answer.json()["detail"]


def test_estimates_and_chunks_follow_the_workers_that_there_are(service: Service, team: list[WorkerReport]) -> None:
    axes = [{"path": "shaft.load", "linspace": [0.0, 0.5, 4000]}]
    spec = {**SPEC, "axes": axes}
    alone = service.http.post("/api/v1/studies:preview", json=spec).json()["estimated_seconds"]
    report(service, *(WorkerReport(f"tls://a:{port}", "a", usable=True) for port in range(100)))
    many = service.http.post("/api/v1/studies:preview", json=spec).json()["estimated_seconds"]
    assert many < alone
    assert service.store.dispatchers.chunking.processes == 100
    report(service, *team)
    assert service.store.dispatchers.chunking.processes == 5
    report(service, REFUSED)
    assert service.store.dispatchers.chunking == service.store.dispatchers.base_chunking
