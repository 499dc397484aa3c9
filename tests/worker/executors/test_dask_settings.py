"""Which cluster is meant, and what it needs, before there is one."""

from __future__ import annotations

import sys

import dask
import pytest
from pydantic import ValidationError

from sprag_study.service.jobs.dispatching import WorkerSettings, pool
from sprag_study.service.settings import Settings
from sprag_study.worker.executors.dask_tasks import scheduler_address
from sprag_study.worker.ports import ExecutorError


def test_other_machines_need_certificates() -> None:
    with pytest.raises(ExecutorError, match="needs certificates: set DASK_DISTRIBUTED__COMM__TLS__CA_FILE"):
        scheduler_address("dask://cluster.example:8786")
    assert scheduler_address("dask://localhost:8786") == ("tcp://localhost:8786", None)
    assert scheduler_address("dask://[::1]:8786") == ("tcp://[::1]:8786", None)


def test_the_loopback_address_has_tls_where_dask_requires_it() -> None:
    with dask.config.set({"distributed.comm.require-encryption": True}), pytest.raises(ExecutorError, match="TLS"):
        scheduler_address("dask://127.0.0.1:8786")


def test_the_setting_is_checked() -> None:
    for good in ("pool", "dask", "dask://head.example:8786", "dask://[::1]:8786"):
        assert Settings(executor=good).executor == good
    for wrong in ("dusk", "dask://", "dask://head.example", "dask://head.example:0", "tcp://head.example:8786"):
        with pytest.raises(ValidationError) as refused:
            Settings(executor=wrong)
        assert [error["loc"] for error in refused.value.errors()] == [("executor",)]


def test_without_dask_the_command_that_brings_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sprag_study.worker.executors.dask", None)
    with pytest.raises(ExecutorError, match=r'pip install "sprag-study\[cluster\]"'):
        pool(WorkerSettings("", 1, 60.0, executor="dask"))
