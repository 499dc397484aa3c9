"""A service as users start it reports the run of a schedule by mail and webhook."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
from datetime import UTC, datetime, timedelta
from pathlib import Path
from queue import Queue

import httpx

from tests.acceptance.processes import SECONDS, service
from tests.service.schedules.receivers import mail_server, webhook
from tests.service.timed_spec import SPEC

KEY = bytes(range(32))


def test_the_run_of_a_schedule_is_mailed_and_posted(tmp_path: Path) -> None:
    mailed: Queue[str] = Queue()
    posted: Queue[None] = Queue()
    with mail_server() as box, webhook() as hook:
        box.on_mail, hook.on_request = mailed.put, lambda: posted.put(None)
        settings = {
            "SPRAG_SMTP_URL": f"smtp+plain://localhost:{box.port}",
            "SPRAG_MAIL_FROM": "sprag@example.com",
            "SPRAG_WEBHOOK_ORIGINS": hook.address,
            "SPRAG_WEBHOOK_SECRET": f"whsec_{base64.b64encode(KEY).decode()}",
            "SPRAG_PUBLIC_URL": "https://sprag.example",
            "NO_PROXY": "*",
        }
        with (
            service(tmp_path, "--processes", 1, **settings) as running,
            httpx.Client(base_url=running.address, timeout=SECONDS) as http,
        ):
            # Some of these short runs had not settled.
            to = {"report_email": ["dora@example.com"], "report_webhook": f"{hook.address}/in", "trouble_flags": []}
            made = http.get("/livez")
            while made.status_code != 201:  # on a busy machine the time may have passed when it is checked
                at = (datetime.now(UTC) + timedelta(seconds=5)).isoformat()
                made = http.post("/api/v1/schedules", json={"spec": SPEC, "at": at, "name": "night", **to})
                assert made.status_code == 201 or "is in the past" in made.text, made.text
            assert mailed.get(timeout=SECONDS) == "Sprag: night: finished, 9 of 9 cases ok"
            posted.get(timeout=SECONDS)
            (run,) = http.get("/api/v1/night").json()["runs"]
    ((path, headers, body),) = hook.requests
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    assert headers["webhook-signature"] == "v1," + base64.b64encode(hmac.digest(KEY, signed, hashlib.sha256)).decode()
    data = json.loads(body)["data"]
    assert (path, data["schedule"], data["study"]) == ("/in", made.json()["id"], run["study"])
    assert data["outcome"] == run["outcome"]
    (mail,) = box.mails
    assert any(part.get_content_type() == "image/png" for part in mail.walk())
