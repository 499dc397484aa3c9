"""The workers as answers, pages and the command line show them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag_study.service.json_text import timestamp

if TYPE_CHECKING:
    from sprag_study.service.answers.workers import Dispatcher, WorkerList
    from sprag_study.service.storage.studies.records import DispatcherRecord
    from sprag_study.service.storage.work.dispatchers import Dispatchers


def worker_list(dispatchers: Dispatchers) -> WorkerList:
    """The dispatchers and their workers, as they last reported them."""
    found = [_dispatcher(record) for record in dispatchers.all()]
    return {
        "usable": sum(item["usable"] for item in found),
        "chunks_in_flight": sum(item["chunks_in_flight"] for item in found if not (item["ended_at"] or item["silent"])),
        "dispatchers": found,
    }


def _dispatcher(record: DispatcherRecord) -> Dispatcher:
    report = record.report or {}
    # Reports of earlier versions say nothing of processors.
    hosts: list[Any] = [{"processor": "", **host} for host in report.get("hosts", [])]
    return {
        "owner": record.owner,
        "fingerprint": record.fingerprint,
        "differs": record.differs,
        "studies": record.studies,
        "started_at": timestamp(record.started_at),
        "heartbeat_at": timestamp(record.heartbeat_at),
        "ended_at": None if record.ended_at is None else timestamp(record.ended_at),
        "silent": record.silent,
        "executor": report.get("executor"),
        "scheduler": report.get("scheduler") or None,
        "dashboard": report.get("dashboard") or None,
        "shortage": report.get("shortage") or None,
        "chunks_in_flight": report.get("chunks_in_flight", 0),
        "usable": record.usable,
        "hosts": hosts,
        "refused": report.get("refused", []),
    }
