"""What is reported of workers: sums by host, rates over the last minute, reasons of refusals."""

from __future__ import annotations

from sprag_study.worker.reports import MAX_REFUSED, RATE_SECONDS, ExecutorReport, Reporter, WorkerReport


def test_workers_are_summed_up_by_host() -> None:
    workers = (
        WorkerReport("tcp://b:1", "b", usable=True, busy=True, threads=4, processor="znver5"),
        WorkerReport("tcp://a:1", "a", usable=True, processor="skylake-avx512"),
        WorkerReport("tcp://a:2", "a", usable=False, refusal="numpy: 1 instead of 2"),
        WorkerReport("tcp://a:3", "a", usable=False, busy=True),
    )
    found = Reporter().summary(ExecutorReport("dask", workers, {}, scheduler="tls://head:8786"), 3, 0.0)
    assert found["hosts"] == [
        {
            "host": "a", "processor": "skylake-avx512", "workers": 3, "usable": 1, "refused": 1, "busy": 1,
            "idle_threads": 1, "cases_per_second": 0.0,
        },
        {
            "host": "b", "processor": "znver5", "workers": 1, "usable": 1, "refused": 0, "busy": 1, "idle_threads": 3,
            "cases_per_second": 0.0,
        },
    ]  # fmt: skip
    assert found["refused"] == [{"address": "tcp://a:2", "host": "a", "reason": "numpy: 1 instead of 2"}]
    assert (found["chunks_in_flight"], found["scheduler"]) == (3, "tls://head:8786")


def test_the_rate_of_a_host_is_that_of_the_last_minute() -> None:
    reporter, workers = Reporter(), (WorkerReport("process 1", "here", usable=True),)

    def rate(cases: int, now: float) -> float:
        (host,) = reporter.summary(ExecutorReport("pool", workers, {"here": cases}), 0, now)["hosts"]
        return float(host["cases_per_second"])

    assert rate(0, 100.0) == 0.0
    assert rate(500, 105.0) == 100.0
    for beat in range(12):
        last = rate(500, 110.0 + 5.0 * beat)
    assert last == 0.0, "all of it was more than a minute ago"
    assert rate(500 + 60, 105.0 + RATE_SECONDS + 5.0) == 1.0


def test_the_list_of_refused_workers_is_bounded() -> None:
    refused = tuple(WorkerReport(f"tcp://a:{port}", "a", usable=False, refusal="no") for port in range(MAX_REFUSED + 1))
    found = Reporter().summary(ExecutorReport("dask", refused, {}), 0, 0.0)
    assert len(found["refused"]) == MAX_REFUSED
    assert found["hosts"][0]["refused"] == MAX_REFUSED + 1
