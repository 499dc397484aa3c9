"""Nights of schedules by a moved clock under kill -9, with a mail server and a receiver of webhooks that are real.

Each evening two schedules are due. A process submits their studies, runs them, concludes the runs and sends their
reports; it is killed at a drawn event, or while a receiver reads what it sends, and another process goes on when the
claims of the first have ended. In the end every due time has one study and one report for each of its recipients, and
each of them has arrived: once, or under the same id again where the process was killed after it had handed the report
over, before that was stored.
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from queue import Queue
from typing import Any

from benchmarks.faults.fate import Fate, before_commits, before_writes
from benchmarks.faults.harness import PATIENCE, ROOT, environment
from sprag_study.service.delivery import Delivery
from sprag_study.service.jobs.reports import reporter
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.storage.schedules.reports import CLAIM, ReportState
from sprag_study.service.storage.store import Store
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from tests.service.schedules.receivers import Hook, MailBox, mail_server, webhook
from tests.service.timed_spec import SPEC
from tests.worker import fakes

#: Events of a night, roughly; what is drawn lies within.
_EVENTS = 80
#: Share of the processes that are killed while a receiver reads.
_READING_SHARE = 0.25
_READING = "a receiver reads"
#: What a process is killed in; after the last but one a report has arrived that is not known to have been sent.
_SUBMITTING, _RUNNING, _CONCLUDING, _SENDING, _RECORDING = (
    "submitting", "running", "concluding", "before a report is sent", "after a report was sent"
)  # fmt: skip
_CRONS = {"first": "0 22 * * *", "second": "0 23 * * *"}
_LAST = timedelta(hours=23)
_MAILS = ("dora@example.com", "otto@example.com")


def nights(folder: Path, *, count: int = 50, seed: int = 1, url: str = "") -> dict[str, Any]:
    """Let nights pass, two or more, until ``count`` processes were killed; gives the figures."""
    url = url or f"sqlite:///{folder / 'nights.sqlite3'}"
    draw, clock, begin = random.Random(seed), fakes.HandClock(), time.monotonic()
    killed: Counter[str] = Counter()
    passed = 0
    with mail_server() as box, webhook() as hook, Store.open(url, clock=clock) as store:
        to = {"report_email": list(_MAILS), "report_webhook": f"{hook.address}/in"}
        for name, cron in _CRONS.items():
            fields = {"spec": SPEC, "cron": cron, "zone": "UTC", "name": name, "fresh": True, **to}
            store.schedules.create(read_fields(fields, clock.now()))
        while passed < 2 or killed.total() < count:
            clock.seconds = (timedelta(days=passed) + _LAST).total_seconds()
            while killed.total() < count and (end := _go_on(url, box, hook, clock.seconds, draw)) is not None:
                killed[end] += 1
                clock.seconds += CLAIM.total_seconds()
            assert _go_on(url, box, hook, clock.seconds, None) is None
            passed += 1
        figures = _compare(store, clock, passed, box, hook)
    again = figures.pop("again")
    assert again == killed[_RECORDING] + killed[_READING], (again, killed)
    return {
        "nights": passed,
        "killed": dict(killed),
        **figures,
        "reports that arrived again under their id": again,
        "missing, doubled or wrong studies and reports": 0,
        "seconds": round(time.monotonic() - begin, 1),
    }


def _compare(store: Store, clock: fakes.HandClock, passed: int, box: MailBox, hook: Hook) -> dict[str, int]:
    """Compare what is stored with what has arrived; gives how much that is."""
    since = fakes.HandClock().now()
    runs = store.runs.between(since, clock.now(), 10 * passed)
    assert len(runs) == len({(run.schedule, run.due) for run in runs}) == len(_CRONS) * passed
    studies = store.studies.page(page_size=len(runs) + 1).studies
    assert {run.outcome.study for run in runs} == {study.id for study in studies}
    assert len(studies) == len(runs)
    by_run = store.reports.between(since, clock.now())
    assert len(by_run) == len(runs)
    wanted = sorted([*(("email", mail) for mail in _MAILS), ("webhook", f"{hook.address}/in")])
    for reports in by_run.values():
        assert sorted((report.channel, report.target) for report in reports) == wanted
        assert {report.state for report in reports} == {ReportState.SENT}
    sent = [report for reports in by_run.values() for report in reports]
    mailed = [str(mail["Message-ID"]) for mail in box.mails]
    assert set(mailed) == {f"<{report.id}@example.com>" for report in sent if report.channel == "email"}
    assert set(hook.ids) == {report.id for report in sent if report.channel == "webhook"}
    for mail in box.mails:
        assert str(mail["Subject"]).endswith(": finished, 9 of 9 cases ok"), mail["Subject"]
    return {
        "studies": len(studies),
        "mails": len(set(mailed)),
        "webhooks": len(set(hook.ids)),
        "again": len(mailed) + len(hook.ids) - len(sent),
    }


def _go_on(url: str, box: MailBox, hook: Hook, seconds: float, draw: random.Random | None) -> str | None:
    """Run a process until all is done, None, or until it is killed: where. Without ``draw`` it is left alone."""
    fatal = draw.randint(1, _EVENTS) if draw is not None else 0
    born: Queue[subprocess.Popen[str]] = Queue()
    box.on_mail, hook.on_request = lambda _: None, lambda: None
    if draw is not None and draw.random() < _READING_SHARE:
        fatal = 0
        if draw.random() < 0.5:
            box.on_mail = lambda _: born.get(timeout=PATIENCE).kill()
        else:
            hook.on_request = lambda: born.get(timeout=PATIENCE).kill()
    command = [sys.executable, "-m", "benchmarks.faults.nights"]
    given = [url, str(box.port), hook.address, str(seconds), str(fatal)]
    with subprocess.Popen(
        [*command, *given], cwd=ROOT, env=environment(NO_PROXY="*"), stdout=subprocess.PIPE, text=True
    ) as process:
        born.put(process)
        said = process.communicate()[0].strip()
    if process.returncode == 0:
        return None
    assert process.returncode == -signal.SIGKILL, process.returncode
    return said or _READING


def main(url: str, port: int, address: str, seconds: float, fatal: int) -> None:
    """Do what is to be done at that time, until the event that ends the process."""
    fate, phase = Fate(fatal), _SUBMITTING

    def meet(_event: str) -> None:
        fate.meet(phase)

    def around(send: Callable[..., None]) -> Callable[..., None]:
        def sent(*arguments: Any) -> None:
            nonlocal phase
            meet("sending")
            send(*arguments)
            phase = _RECORDING
            meet("sent")

        return sent

    if fatal:
        before_commits(meet)
        before_writes(meet)
    clock = fakes.HandClock()
    clock.seconds = seconds
    with Store.open(url, clock=clock) as store:
        recorded = store.reports.sent

        def record(report: Any) -> None:
            nonlocal phase
            recorded(report)
            phase = _SENDING

        store.reports.sent = record  # type: ignore[method-assign]
        reporter.send_mail = around(reporter.send_mail)
        reporter.send_webhook = around(reporter.send_webhook)
        Scheduler(store).look()
        phase = _RUNNING
        Dispatcher(store.work, InlineExecutor(fakes.run), clock).run(lambda: not store.work.active_studies())
        phase = _CONCLUDING
        Scheduler(store).look()
        phase = _SENDING
        mails = MailBox(port=port).server("none")
        sender = Delivery("https://sprag.example", mails, "sprag@example.com", (), (address,), bytes(32))
        reporter.Reporter(store, sender).look()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3], float(sys.argv[4]), int(sys.argv[5]))
