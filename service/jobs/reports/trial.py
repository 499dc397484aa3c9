"""A test message: whether reports can leave the service, by mail or by webhook, as an administrator asks."""

from __future__ import annotations

import secrets
from email.message import EmailMessage
from email.policy import SMTP
from email.utils import format_datetime
from typing import TYPE_CHECKING

from sprag_study.sentences import Sentence
from sprag_study.service.delivery import is_mail_address
from sprag_study.service.jobs.reports.channels import DeliveryError, send_mail, send_webhook
from sprag_study.service.json_text import timestamp, to_bytes
from sprag_study.service.languages import _, language
from sprag_study.service.storage.schedules.reports import Claimed

if TYPE_CHECKING:
    from datetime import datetime

    from sprag_study.service.delivery import Delivery


def try_mail(address: str, delivery: Delivery, now: datetime) -> None:
    """Send a test mail, in the language of mails; raises DeliveryError."""
    if not is_mail_address(address):
        raise DeliveryError(Sentence("{address} is not a mail address.", address=repr(address)))
    message = EmailMessage(policy=SMTP)
    with language(delivery.language):
        message["From"], message["To"], message["Subject"] = delivery.sender, address, _("Test mail of Sprag")
        message["Date"], message["Auto-Submitted"] = format_datetime(now), "auto-generated"
        message.set_content(_("Reports of the service {url} reach this address.", url=delivery.public_url) + "\n")
    send_mail(message, delivery)


def try_webhook(target: str, delivery: Delivery, now: datetime) -> None:
    """Send a webhook of the type ``test``, signed as all others; raises DeliveryError."""
    body = to_bytes({"type": "test", "timestamp": timestamp(now), "data": {"links": {"service": delivery.public_url}}})
    report = Claimed(0, f"rp_{secrets.token_hex(8)}", "", "webhook", target, {}, 1, now, now)
    send_webhook(report, body, delivery, now)
