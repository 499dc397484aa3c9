"""Sending a report: mail by SMTP, and webhooks with the signatures of Standard Webhooks (standardwebhooks.com)."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import hmac
import math
import smtplib
import socket
import ssl
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.delivery import in_domains, origin_of
from sprag_study.service.languages import N_

if TYPE_CHECKING:
    from datetime import datetime
    from email.message import EmailMessage

    from sprag_study.service.delivery import Delivery, MailServer
    from sprag_study.service.storage.schedules.reports import Claimed

#: Seconds for each step of sending.
TIMEOUT: Final = 30.0
#: Seconds for a report altogether: an answer that drips must not keep other reports waiting.
MOST_SECONDS: Final = 60.0
#: Answers of a webhook that mean that it is gone for good, and replies of a mail server that are final begin here.
_GONE: Final = 410
_PERMANENT: Final = 500
_REFUSED: Final = N_("The mail server refused: {reply}.")


class DeliveryError(Exception):
    """A report that was not sent, and why. ``permanent``: trying again is no use."""

    def __init__(self, sentence: Sentence, *, permanent: bool = False) -> None:
        super().__init__(str(sentence))
        self.sentence = sentence
        self.permanent = permanent


def send_mail(message: EmailMessage, delivery: Delivery, context: ssl.SSLContext | None = None) -> None:
    """Send a mail; raises DeliveryError. ``context`` decides which certificates are trusted; default: the system's."""
    server = delivery.mail_server
    if server is None:
        raise DeliveryError(Sentence("No mail server is set (SPRAG_SMTP_URL)."))
    if not in_domains(str(message["To"]), delivery.domains):
        raise DeliveryError(
            Sentence("{address} has a domain to which no reports go (SPRAG_MAIL_DOMAINS).", address=str(message["To"]))
        )
    began = time.monotonic()
    try:
        connection = _connected(server, context or ssl.create_default_context())
        try:
            connection.send_message(message)
            with suppress(smtplib.SMTPException, OSError):  # the server has the message, however it says goodbye
                connection.quit()
        finally:
            connection.close()
    except smtplib.SMTPRecipientsRefused as error:
        code, text = next(iter(error.recipients.values()))
        raise _refusal(code, text) from error
    except smtplib.SMTPSenderRefused as error:
        raise _refusal(error.smtp_code, error.smtp_error) from error
    except smtplib.SMTPResponseException as error:
        # A wrong password or a busy server is the administrator's to correct: it is tried again.
        permanent = isinstance(error, smtplib.SMTPDataError) and error.smtp_code >= _PERMANENT
        raise DeliveryError(Sentence(_REFUSED, reply=_text(error)), permanent=permanent) from error
    except (smtplib.SMTPException, OSError) as error:
        place = f"{server.host}:{server.port}"
        if time.monotonic() - began >= MOST_SECONDS:
            late = N_("The mail server {place} cannot be used: it did not take the report within {seconds}.")
            raise DeliveryError(Sentence(late, place=place, seconds=Amount(MOST_SECONDS, "s"))) from error
        raise DeliveryError(
            Sentence("The mail server {place} cannot be used: {reason}.", place=place, reason=str(error))
        ) from error


class _Limited(smtplib.SMTP):
    """A connection that ends after `MOST_SECONDS`, whatever it waits for."""

    limit: threading.Timer | None = None
    until: float = math.inf

    def connect(self, *place: Any, **named: Any) -> tuple[int, bytes]:
        self.until = time.monotonic() + MOST_SECONDS
        self.limit = threading.Timer(MOST_SECONDS, self._cut)
        self.limit.daemon = True
        self.limit.start()
        try:
            return super().connect(*place, **named)
        except BaseException:
            self.close()
            raise

    def getreply(self) -> tuple[int, bytes]:
        if self.file is None and self.sock is not None:
            self.file = _Replies(self.sock.makefile("rb"), self.until)
        return super().getreply()

    def close(self) -> None:
        if self.limit is not None:
            self.limit.cancel()
        super().close()

    def _cut(self) -> None:
        if isinstance(self.sock, socket.socket):
            with suppress(OSError):
                # The method of a TLS socket would change its state under the thread that reads from it.
                socket.socket.shutdown(self.sock, socket.SHUT_RDWR)


class _Replies:
    """What a server says, line by line until a time: what arrives is read even after the connection was shut down."""

    def __init__(self, file: Any, until: float) -> None:
        self._file, self._until = file, until

    def readline(self, limit: int) -> bytes:
        """The next line, cut to so many bytes; raises TimeoutError after the time."""
        if time.monotonic() >= self._until:
            raise TimeoutError
        line: bytes = self._file.readline(limit)
        return line

    def close(self) -> None:
        """Read no more."""
        self._file.close()


class _LimitedTLS(_Limited, smtplib.SMTP_SSL):
    """The same with TLS from the start."""


def _connected(server: MailServer, context: ssl.SSLContext) -> smtplib.SMTP:
    """A connection to the server, with TLS and login as its address demands."""
    if server.security == "tls":
        connection: smtplib.SMTP = _LimitedTLS(server.host, server.port, timeout=TIMEOUT, context=context)
    else:
        connection = _Limited(server.host, server.port, timeout=TIMEOUT)
    try:
        if server.security == "starttls":
            connection.starttls(context=context)
        if server.user is not None:
            connection.login(server.user, server.password)
    except BaseException:
        connection.close()
        raise
    return connection


def _refusal(code: int, text: bytes | str) -> DeliveryError:
    reply = text.decode("utf-8", "replace") if isinstance(text, bytes) else text
    return DeliveryError(Sentence(_REFUSED, reply=f"{code} {reply}"), permanent=code >= _PERMANENT)


def _text(error: smtplib.SMTPResponseException) -> str:
    reply = error.smtp_error
    return f"{error.smtp_code} {reply.decode('utf-8', 'replace') if isinstance(reply, bytes) else reply}"


def signature(secret: bytes, report_id: str, seconds: int, body: bytes) -> str:
    """The signature of a webhook: HMAC-SHA256 of id, time (s since 1970) and body, in base64."""
    signed = f"{report_id}.{seconds}.".encode() + body
    return "v1," + base64.b64encode(hmac.new(secret, signed, hashlib.sha256).digest()).decode("ascii")


async def _posted(target: str, body: bytes, headers: dict[str, str]) -> int:
    """The status of the answer; raises TimeoutError. Its body is not read: it may be of any size."""
    import httpx

    async with (
        asyncio.timeout(MOST_SECONDS),
        httpx.AsyncClient(timeout=TIMEOUT, follow_redirects=False) as client,
        client.stream("POST", target, content=body, headers=headers) as answer,
    ):
        return answer.status_code


def send_webhook(report: Claimed, body: bytes, delivery: Delivery, now: datetime) -> None:
    """Send a webhook; raises DeliveryError. Redirects are not followed: they could lead to any address."""
    import httpx  # an eighth of the time to import all of a dispatcher, few of which send anything

    if delivery.secret is None or origin_of(report.target) not in delivery.origins:
        raise DeliveryError(Sentence("Its origin is not one to which webhooks go (SPRAG_WEBHOOK_ORIGINS)."))
    seconds = int(now.timestamp())
    headers = {
        "Content-Type": "application/json",
        "User-Agent": "Sprag",
        "webhook-id": report.id,
        "webhook-timestamp": str(seconds),
        "webhook-signature": signature(delivery.secret, report.id, seconds, body),
    }
    try:
        status = asyncio.run(_posted(report.target, body, headers))
    except TimeoutError:
        raise DeliveryError(
            Sentence("The webhook did not answer within {seconds}.", seconds=Amount(MOST_SECONDS, "s"))
        ) from None
    except (httpx.HTTPError, httpx.InvalidURL) as error:
        reason = f"{type(error).__name__}: {error}"
        raise DeliveryError(Sentence("The webhook cannot be reached: {reason}.", reason=reason)) from error
    if not 200 <= status < 300:
        answered = Sentence("The webhook answered {status}.", status=str(status))
        raise DeliveryError(answered, permanent=status == _GONE)
