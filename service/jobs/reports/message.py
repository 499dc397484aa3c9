"""What a report says: as mail with text, HTML and a curve, and as the body of a webhook."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from email.header import Header
from email.message import EmailMessage
from email.policy import SMTP
from email.utils import format_datetime
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined

from sprag_study.sentences import sentence_of
from sprag_study.service.json_text import timestamp, to_bytes
from sprag_study.service.languages import ENGLISH, N_, _, current, grouped, language, ngettext
from sprag_study.service.reading.reader import shown, shown_stored, term
from sprag_study.service.schedules.outcomes import Outcome
from sprag_study.service.schedules.times import wall_clock

if TYPE_CHECKING:
    from sprag_study.service.delivery import Delivery
    from sprag_study.service.storage.schedules.reports import Claimed

_CURVE: Final = "curve"
#: What the addresses of `links` lead to.
_LINKS: Final = {
    "study": N_("Study"),
    "schedule": N_("Schedule"),
    "night": N_("Night"),
    "workers": N_("Workers and backups"),
}
#: What alerts are about.
_ALERTS: Final = {"backup": N_("a backup failed"), "disk": N_("a disk fills")}


@dataclass(frozen=True, slots=True)
class Fact:
    """A line of a report: what it is about, and the value."""

    name: str
    value: str


def subject(content: dict[str, Any]) -> str:
    """The subject of a mail: the schedule, and whether somebody should look."""
    if "alert" in content:
        return _("Sprag: needs attention: {what}", what=_(_ALERTS[content["alert"]]))
    outcome = content.get("outcome")
    result = _("did not run") if outcome is None else _(outcome["result"])
    if outcome is not None and outcome["cases"]:
        cases = {"ok": grouped(outcome["ok"]), "cases": grouped(outcome["cases"])}
        result = _("{result}, {ok} of {cases} cases ok", result=result, **cases)
    name = content["name"] or content["schedule"]
    if outcome is None or outcome["trouble"]:
        return _("Sprag: needs attention: {name}: {result}", name=name, result=result)
    return f"Sprag: {name}: {result}"


def sentence(content: dict[str, Any]) -> str:
    """What happened, in a few sentences."""
    outcome = content.get("outcome")
    if outcome is None:
        values = content.get("known", {}).get("sentence_values")
        return shown_stored(str(content["sentence"]) if values is None else sentence_of(values))
    if current() == ENGLISH or "known" not in content:  # of a report that an earlier version has put off
        return str(outcome["sentence"])
    names = {item.name for item in fields(Outcome)}
    known = {name: value for name, value in outcome.items() if name in names}
    return Outcome.of_json({**known, **content["known"], "study": content.get("study")}).sentence


def facts(content: dict[str, Any]) -> Iterator[Fact]:
    """The lines of a report."""
    if "alert" in content:
        yield Fact(_("Since"), wall_clock(datetime.fromisoformat(content["begun"]), content["zone"]))
        return
    yield Fact(_("Due"), wall_clock(datetime.fromisoformat(content["due"]), content["zone"]))
    outcome = content.get("outcome")
    if outcome is None:
        return
    if outcome["ended_at"] is not None:
        yield Fact(_("Ended"), wall_clock(datetime.fromisoformat(outcome["ended_at"]), content["zone"]))
    if outcome["coverage"] is not None:
        yield Fact(_("Coverage"), shown_stored(_coverage(content)))
    endings, flags = outcome["endings"] or {}, outcome["flags"] or {}
    yield from (Fact(_("Ended {name}", name=_words(name)), _cases(count)) for name, count in endings.items())
    yield from (Fact(_("Flag {name}", name=_words(name)), _cases(count)) for name, count in flags.items())


def _coverage(content: dict[str, Any]) -> str:
    values = content.get("known", {}).get("coverage_values")
    return str(content["outcome"]["coverage"]) if values is None else sentence_of(values)


def _words(code: str) -> str:
    return shown(term(code))


def _cases(count: int) -> str:
    return ngettext("{count} case", "{count} cases", count, count=grouped(count))


def links(content: dict[str, Any], public_url: str) -> dict[str, str]:
    """Addresses of the pages of the study, the schedule and the last night; of an alert, that of the workers."""
    if "alert" in content:
        return {"workers": f"{public_url}/me/workers"}
    study = {"study": f"{public_url}/studies/{content['study']}"} if content.get("study") else {}
    return {**study, "schedule": f"{public_url}/nights/{content['schedule']}", "night": f"{public_url}/nights"}


def mail(report: Claimed, delivery: Delivery, now: datetime, curve: bytes | None) -> EmailMessage:
    """The report as a mail in the language of mails; its Message-ID is the same each time that it is sent."""
    with language(delivery.language):
        return _mail(report, delivery, now, curve)


def _mail(report: Claimed, delivery: Delivery, now: datetime, curve: bytes | None) -> EmailMessage:
    content = report.content
    named = {_(_LINKS[name]): url for name, url in links(content, delivery.public_url).items()}
    lines = tuple(facts(content))
    message = EmailMessage(policy=SMTP)
    message["From"] = delivery.sender
    message["To"] = report.target
    _set_subject(message, subject(content))
    message["Date"] = format_datetime(now.astimezone(UTC))
    message["Message-ID"] = f"<{report.id}@{delivery.sender.rpartition('@')[2]}>"
    # No out-of-office replies (RFC 3834).
    message["Auto-Submitted"] = "auto-generated"
    text = [sentence(content), "", *(f"{fact.name}: {fact.value}" for fact in lines), ""]
    message.set_content("\n".join([*text, *(f"{name}: {url}" for name, url in named.items())]) + "\n")
    html = _template().render(
        title=subject(content),
        sentence=sentence(content),
        trouble="outcome" not in content or content["outcome"]["trouble"],
        facts=lines,
        links=named,
        language=current(),
        picture=_("Curve of the study"),
        curve=None if curve is None else _CURVE,
    )
    message.add_alternative(html, subtype="html")
    if curve is not None:
        body = message.get_body(("html",))
        assert isinstance(body, EmailMessage)
        body.add_related(curve, "image", "png", cid=f"<{_CURVE}>", disposition="inline", filename="curve.png")
    return message


def _set_subject(message: EmailMessage, text: str) -> None:
    """Set the subject; one that looks like an encoded word, as ``=?utf-8?q?x?=``, is encoded to arrive as it is."""
    if "=?" in text:
        message.set_raw("Subject", Header(text, "utf-8", header_name="Subject").encode(linesep="\r\n"))
    else:
        message["Subject"] = text


def webhook_body(report: Claimed, delivery: Delivery) -> bytes:
    """The report as the body of a webhook; it is the same each time that it is sent."""
    content = report.content
    kind = "schedule.run" if "outcome" in content else "alert" if "alert" in content else "schedule.overdue"
    own = {name: value for name, value in content.items() if name != "known"}
    data = {**own, "sentence": sentence(content), "links": links(content, delivery.public_url)}
    return to_bytes({"type": kind, "timestamp": timestamp(report.created_at), "data": data})


@lru_cache(maxsize=1)
def _template() -> Any:
    environment = Environment(
        loader=PackageLoader("sprag_study.service.jobs.reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("mail.html")
