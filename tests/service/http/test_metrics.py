"""Metrics: what Prometheus reads is what happened, and no id becomes a label."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from prometheus_client.parser import text_string_to_metric_families

if TYPE_CHECKING:
    from prometheus_client.samples import Sample

    from tests.service.conftest import Service


def samples(service: Service) -> list[Sample]:
    """Every sample of the metrics, read by the library of those who scrape."""
    answer = service.http.get("/metrics")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/plain; version=")
    return [sample for family in text_string_to_metric_families(answer.text) for sample in family.samples]


def value(found: list[Sample], name: str, /, **labels: str) -> float:
    """The value of the one sample of that name with those labels."""
    (sample,) = [s for s in found if s.name == name and labels.items() <= s.labels.items()]
    return sample.value


def test_queue_endings_and_cases_are_counted(service: Service) -> None:
    first = service.submit()
    service.submit()
    before = samples(service)
    assert value(before, "sprag_queue_cases") == 18
    assert value(before, "sprag_studies", state="queued") == 2
    assert value(before, "sprag_cases_done_total") == 0
    rows = service.fill(first)
    found = samples(service)
    assert value(found, "sprag_queue_cases") == 9
    assert value(found, "sprag_studies", state="finished") == 1
    for ending in set(rows.endings):
        assert value(found, "sprag_stored_cases", ending=ending) == rows.endings.count(ending)
    assert value(found, "sprag_cases_done_total") == 9
    assert value(found, "sprag_case_seconds_bucket", le="+Inf") == 9
    assert value(found, "sprag_case_seconds_count") == 9
    assert value(found, "sprag_reused_cases") == 0
    assert value(found, "sprag_cases_per_second") > 0
    assert value(found, "sprag_worker_heartbeat_age_seconds") >= 0
    service.store.studies.delete(first)
    assert value(samples(service), "sprag_cases_done_total") == 9


def test_the_time_of_cases_falls_into_its_buckets(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    from sprag_study.service.storage.figures import FinishedWork

    now = service.store.clock.now()
    work = [FinishedWork(now, 1.0, 10), FinishedWork(now, 4.0, 2)]  # 0.1 s and 2 s each
    monkeypatch.setattr(service.store.figures, "finished_since", lambda _: work)
    found = samples(service)
    buckets = {s.labels["le"]: s.value for s in found if s.name == "sprag_case_seconds_bucket"}
    assert (buckets["0.03"], buckets["0.1"], buckets["1.0"], buckets["3.0"], buckets["+Inf"]) == (0, 10, 10, 12, 12)
    assert value(found, "sprag_case_seconds_sum") == 5.0


def test_requests_are_counted_by_pattern_and_status(service: Service) -> None:
    study_id = service.submit()
    for _ in range(3):
        service.http.get(f"/api/v1/studies/{study_id}")
    service.http.get("/api/v1/studies/st_none")
    service.http.get("/no/such/page")
    service.http.head("/api/v1/models")
    service.http.request("BREW", "/livez")
    service.http.get("/livez", headers={"Host": "evil.example"})
    found = samples(service)
    pattern = "/api/v1/studies/{study_id}"
    requests = "sprag_http_requests_total"
    assert value(found, requests, route=pattern, status="200", method="GET") == 3
    assert value(found, requests, route=pattern, status="404") == 1
    assert value(found, requests, route="(none)", status="404") == 1
    assert value(found, requests, route="/api/v1/models", method="HEAD") == 1
    assert value(found, requests, method="other", status="405") == 1
    assert value(found, requests, status="421") == 1
    assert value(found, "sprag_http_request_seconds_count", route=pattern) == 4


def test_waits_for_the_database_are_counted(service: Service) -> None:
    count = "sprag_database_wait_seconds_count"
    service.submit()
    before = samples(service)
    service.submit()
    after = samples(service)
    assert value(after, count, kind="write") == value(before, count, kind="write") + 1
    assert value(after, count, kind="read") > value(before, count, kind="read")


def test_no_id_becomes_a_label(service: Service) -> None:
    ids = [service.submit() for _ in range(3)]
    for study_id in ids:
        service.fill(study_id)
        for path in ("", "/cases/0", "/curves?x=shaft.load", "/nothing"):
            service.http.get(f"/api/v1/studies/{study_id}{path}")
        service.http.get(f"/studies/{study_id}")
    text = service.http.get("/metrics").text
    assert not [study_id for study_id in ids if study_id in text]
    assert "cases/0" not in text
