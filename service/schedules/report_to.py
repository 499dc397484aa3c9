"""To whom a schedule reports, and when."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence, plural
from sprag_study.service.delivery import in_domains, is_mail_address, origin_of
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report

if TYPE_CHECKING:
    from sprag_study.service.delivery import Delivery

MOST_RECIPIENTS: Final = 10
LONGEST_WEBHOOK: Final = 500
EMAIL_ALLOWED: Final = Sentence("at most {count} different addresses, such as dora@example.com", count=MOST_RECIPIENTS)
WEBHOOK_ALLOWED: Final = Sentence(
    "an address of http or https without user and fragment, at most {count} characters", count=LONGEST_WEBHOOK
)


class ReportWhen(StrEnum):
    """After which runs a schedule reports."""

    ALWAYS = "always"
    TROUBLE = "trouble"


@dataclass(frozen=True, slots=True)
class ReportTo:
    """Recipients of mail, the address of a webhook, and after which runs they get a report."""

    email: tuple[str, ...] = ()
    webhook: str | None = None
    when: ReportWhen = ReportWhen.ALWAYS

    @property
    def targets(self) -> tuple[tuple[str, str], ...]:
        """Channel and target of every report of a run."""
        webhooks = () if self.webhook is None else (("webhook", self.webhook),)
        return (*(("email", address) for address in self.email), *webhooks)

    def to_json(self) -> dict[str, Any]:
        """The fields as `read_report_to` reads them."""
        return {"report_email": list(self.email), "report_webhook": self.webhook, "report_when": self.when.value}


def read_report_to(schedule: Node, when: str | None) -> ReportTo:
    """Recipients and webhook of the fields of a schedule; faults are recorded."""
    recipients, webhook = schedule["report_email"].otherwise([]), schedule["report_webhook"]
    email = recipients.value
    if not isinstance(email, list):
        recipients.refuse("wrong-type", "must be a list of addresses", allowed=EMAIL_ALLOWED)
        email = []
    elif len(email) > MOST_RECIPIENTS:
        many = plural("has {count} address", "has {count} addresses", len(email))
        recipients.refuse("too-many", many, None, allowed=EMAIL_ALLOWED)
        email = []
    for number, address in enumerate(email):
        if not isinstance(address, str) or not is_mail_address(address):
            recipients[number].refuse("invalid-text", "is not a mail address", allowed=EMAIL_ALLOWED)
        elif address in email[:number]:
            recipients[number].refuse("repeated", "is given twice", allowed=EMAIL_ALLOWED)
    address = webhook.value
    if address is not None and not (
        isinstance(address, str) and len(address) <= LONGEST_WEBHOOK and origin_of(address) is not None
    ):
        webhook.refuse("invalid-text", "is not the address of a webhook", allowed=WEBHOOK_ALLOWED)
    if schedule.report.faults:
        return ReportTo()
    return ReportTo(tuple(email), address, ReportWhen(when or ReportWhen.ALWAYS))


def require_deliverable(wanted: ReportTo, delivery: Delivery) -> None:
    """Raise SpecError for recipients and webhooks that the administrator has not allowed.

    Whoever may create a schedule must not reach any address from the network of the service.
    """
    data = wanted.to_json()
    node = Node(Report(data), "", data)
    if wanted.email and delivery.mail_server is None:
        node["report_email"].refuse(
            "conflict", "no mail is sent here", None,
            allowed="none, until the administrator sets a mail server (SPRAG_SMTP_URL)",
        )  # fmt: skip
    for number, address in enumerate(wanted.email):
        if not in_domains(address, delivery.domains):
            allowed = Sentence("addresses of {domains} (SPRAG_MAIL_DOMAINS)", domains=", ".join(delivery.domains))
            node["report_email"][number].refuse(
                "invalid-choice", "has a domain to which no reports go", allowed=allowed
            )
    if wanted.webhook is not None and origin_of(wanted.webhook) not in delivery.origins:
        allowed = Sentence("none, until the administrator allows origins (SPRAG_WEBHOOK_ORIGINS)")
        if delivery.origins:
            allowed = Sentence("addresses at {origins} (SPRAG_WEBHOOK_ORIGINS)", origins=", ".join(delivery.origins))
        node["report_webhook"].refuse("invalid-choice", "has an origin to which no webhooks go", allowed=allowed)
    node.report.raise_if_any()
