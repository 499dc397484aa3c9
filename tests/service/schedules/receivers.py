"""A mail server and a receiver of webhooks, both real, in threads of the test."""

from __future__ import annotations

import asyncio
import http.server
import ssl
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from email import message_from_bytes
from email.message import EmailMessage
from email.policy import default
from pathlib import Path
from typing import Any

from aiosmtpd.smtp import SMTP, AuthResult, Envelope, LoginPassword, Session

from sprag_study.service.delivery import MailServer, Security
from tests.worker.executors.certificates import require_openssl

USER, PASSWORD = "sprag", "pass@word/1"


@dataclass
class MailBox:
    """A mail server that keeps what it gets. ``reply`` answers the recipient of each mail; None accepts it."""

    host: str = "localhost"
    port: int = 0
    mails: list[EmailMessage] = field(default_factory=list)
    reply: Callable[[str], str | None] = lambda _: None
    #: Called with the subject of each mail.
    on_mail: Callable[[str], None] = lambda _: None

    def server(self, security: Security, *, login: bool = False) -> MailServer:
        """How it is reached."""
        return MailServer(self.host, self.port, security, USER if login else None, PASSWORD if login else "")

    async def handle_RCPT(  # noqa: N802 - the name that aiosmtpd calls
        self, _server: SMTP, _session: Session, envelope: Envelope, address: str, _options: list[str]
    ) -> str:
        """Accept or refuse a recipient."""
        refusal = self.reply(address)
        if refusal is None:
            envelope.rcpt_tos.append(address)
        return refusal or "250 OK"

    async def handle_DATA(self, _server: SMTP, _session: Session, envelope: Envelope) -> str:  # noqa: N802
        """Keep a mail."""
        content = envelope.content
        assert isinstance(content, bytes)
        message = message_from_bytes(content, policy=default)
        assert isinstance(message, EmailMessage)
        self.mails.append(message)
        self.on_mail(str(message["Subject"]))
        return "250 OK"


@contextmanager
def mail_server(
    *, starttls: ssl.SSLContext | None = None, tls: ssl.SSLContext | None = None, login: bool = False
) -> Iterator[MailBox]:
    """A mail server in a thread, without TLS, with STARTTLS, or with TLS from the start."""
    box, started, loop = MailBox(), threading.Event(), asyncio.new_event_loop()

    def authenticate(_server: Any, _session: Any, _envelope: Any, _mechanism: str, data: Any) -> AuthResult:
        right = isinstance(data, LoginPassword) and (data.login, data.password) == (USER.encode(), PASSWORD.encode())
        return AuthResult(success=right, handled=right)

    def protocol() -> SMTP:
        return SMTP(
            box,
            hostname="mail.test",
            tls_context=starttls,
            require_starttls=starttls is not None,
            authenticator=authenticate,
            # Only STARTTLS counts as TLS for it, and what it wants together it warns about.
            auth_required=login and tls is None,
            auth_require_tls=tls is None,
            loop=loop,
        )

    async def serve(ending: asyncio.Event) -> None:
        server = await loop.create_server(protocol, "127.0.0.1", 0, ssl=tls)
        box.port = server.sockets[0].getsockname()[1]
        started.set()
        await ending.wait()
        server.close()

    ending = asyncio.Event()
    thread = threading.Thread(target=lambda: loop.run_until_complete(serve(ending)))
    thread.start()
    assert started.wait(600)
    try:
        yield box
    finally:
        loop.call_soon_threadsafe(ending.set)
        thread.join()
        loop.run_until_complete(asyncio.sleep(0))
        loop.close()


@dataclass
class Hook:
    """A receiver of webhooks: what it got, and what it answers."""

    address: str = ""
    requests: list[tuple[str, dict[str, str], bytes]] = field(default_factory=list)
    status: int = 204
    #: Called when a request has been read, before it is answered.
    on_request: Callable[[], None] = lambda: None

    @property
    def ids(self) -> list[str]:
        """Ids of the webhooks, in order."""
        return [headers["webhook-id"] for _, headers, _ in self.requests]


@contextmanager
def webhook() -> Iterator[Hook]:
    """A receiver in a thread."""
    hook = Hook()

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            hook.requests.append((self.path, {name.lower(): value for name, value in self.headers.items()}, body))
            hook.on_request()
            with suppress(OSError):  # the sender may have been killed
                self.answer()

        def answer(self) -> None:
            self.send_response(hook.status)
            if 300 <= hook.status < 400:
                self.send_header("Location", f"{hook.address}/elsewhere")
            self.end_headers()

        def log_message(self, *_: object) -> None:
            """Say nothing."""

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    hook.address = f"http://127.0.0.1:{server.server_address[1]}"
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    try:
        yield hook
    finally:
        server.shutdown()
        thread.join()
        server.server_close()


def certificate(folder: Path) -> tuple[ssl.SSLContext, ssl.SSLContext]:
    """The context of a server with a certificate for localhost of its own, and that of a client that trusts it."""
    require_openssl()
    key, file = folder / "key.pem", folder / "certificate.pem"
    command = "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=localhost"
    names = ["-addext", "subjectAltName=DNS:localhost", "-keyout", str(key), "-out", str(file)]
    subprocess.run([*command.split(), *names], check=True, capture_output=True)
    own = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    own.load_cert_chain(file, key)
    return own, ssl.create_default_context(cafile=str(file))
