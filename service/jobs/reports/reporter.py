"""The reporter: sends the reports that wait, with retries, beside a dispatcher and beside the service."""

from __future__ import annotations

import logging
import socket
from datetime import timedelta
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Sentence
from sprag_study.service.actor import Actor, Door, act_as
from sprag_study.service.jobs.polling import PollingThread
from sprag_study.service.jobs.reports.channels import DeliveryError, send_mail, send_webhook
from sprag_study.service.jobs.reports.message import mail, webhook_body
from sprag_study.service.languages import language
from sprag_study.worker import traces

if TYPE_CHECKING:
    import ssl

    from sprag_study.service.delivery import Delivery
    from sprag_study.service.storage.schedules.reports import Claimed
    from sprag_study.service.storage.store import Store

_LOG = logging.getLogger("sprag.reports")

#: The first and the longest pause before a report is tried again; each is twice the one before.
FIRST_PAUSE: Final = timedelta(minutes=1)
LONGEST_PAUSE: Final = timedelta(hours=1)
#: A report that is older than this is not tried again.
GIVEN_UP_AFTER: Final = timedelta(days=3)


class Reporter(PollingThread):
    """Sends reports until `stop`. Any number of them may run on one database."""

    look_seconds = 5.0
    # One that is cut off is sent again after its claim.
    stop_seconds = 5.0

    def __init__(self, store: Store, delivery: Delivery, context: ssl.SSLContext | None = None) -> None:
        super().__init__(_LOG, "the reports")
        self._store = store
        self._delivery = delivery
        self._context = context

    def look(self) -> None:
        """Send every report that is due to be sent, unless the database is a copy of the deployment."""
        if self._store.deployment.is_copy():
            return
        with act_as(Actor(Door.SERVICE, "reports", socket.gethostname())):
            while not self._ending.is_set() and (report := self._store.reports.claim()) is not None:
                with traces.span("send report", {traces.SCHEDULE: report.schedule}, parent=""):
                    self._send(report)

    def _send(self, report: Claimed) -> None:
        try:
            if report.channel == "email":
                message = mail(report, self._delivery, self._store.clock.now(), self._curve(report))
                send_mail(message, self._delivery, self._context)
            else:
                body = webhook_body(report, self._delivery)
                send_webhook(report, body, self._delivery, self._store.clock.now())
        except DeliveryError as error:
            self._failed(report, error)
            return
        except Exception:  # one report must not keep the others from being sent
            _LOG.exception("The report %s cannot be made", report.id)
            self._failed(report, DeliveryError(Sentence("The report cannot be made; the log says why.")))
            return
        self._store.reports.sent(report)
        _LOG.info("The report %s of %s was sent by %s.", report.id, _subject(report), report.channel)

    def _failed(self, report: Claimed, error: DeliveryError) -> None:
        now = self._store.clock.now()
        # Two to the power of twenty minutes is longer than any report is kept.
        pause = min(FIRST_PAUSE * 2 ** min(report.attempts - 1, 20), LONGEST_PAUSE)
        again = None if error.permanent or now + pause - report.created_at > GIVEN_UP_AFTER else now + pause
        self._store.reports.failed(report, error.sentence, again)
        if again is None:
            _LOG.error("The report %s of %s is given up: %s", report.id, _subject(report), error)
        elif report.attempts == 1:
            _LOG.warning("The report %s of %s is tried again: %s", report.id, _subject(report), error)

    def _curve(self, report: Claimed) -> bytes | None:
        """The curve of the study; None where there is none, or it cannot be drawn."""
        study, outcome = report.content.get("study"), report.content.get("outcome")
        if study is None or outcome is None or not outcome["ok"]:
            return None
        from sprag_study.service.jobs.reports.curve import small_curve

        try:
            with language(self._delivery.language):
                return small_curve(self._store, study, self._delivery.units)
        except Exception as error:  # a report without its picture is better than none
            _LOG.warning("The report %s has no curve: %s", report.id, error)
            return None


def _subject(report: Claimed) -> str:
    """What a report is about, for the log."""
    return f"the schedule {report.schedule}" if report.schedule else "the deployment"
