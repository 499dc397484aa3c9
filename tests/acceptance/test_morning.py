"""A service as users start it reports the run of a schedule by mail and webhook."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
from datetime import UTC, datetime, timedelta
from queue import Queue

import httpx

from tests.acceptance.conftest import Office
from tests.acceptance.processes import SECONDS, Service
from tests.service.timed_spec import SPEC


def test_the_run_of_a_schedule_is_mailed_and_posted(running: Service, office: Office) -> None:
    mailed: Queue[str] = Queue()
    posted: Queue[None] = Queue()
    office.mails.on_mail, office.hook.on_request = mailed.put, lambda: posted.put(None)
    with httpx.Client(base_url=running.address, timeout=SECONDS) as http:
        # Some of these short runs had not settled.
        to = {"report_email": ["dora@example.com"], "report_webhook": f"{office.hook.address}/in", "trouble_flags": []}
        made = http.get("/livez")
        while made.status_code != 201:  # on a busy machine the time may have passed when it is checked
            at = (datetime.now(UTC) + timedelta(seconds=5)).isoformat()
            made = http.post("/api/v1/schedules", json={"spec": SPEC, "at": at, "name": "night", **to})
            assert made.status_code == 201 or "is in the past" in made.text, made.text
        assert mailed.get(timeout=SECONDS) == "Sprag: night: finished, 9 of 9 cases ok"
        posted.get(timeout=SECONDS)
        (run,) = http.get("/api/v1/night").json()["runs"]
    ((path, headers, body),) = office.hook.requests
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    digest = hmac.digest(office.key, signed, hashlib.sha256)
    assert headers["webhook-signature"] == "v1," + base64.b64encode(digest).decode()
    data = json.loads(body)["data"]
    assert (path, data["schedule"], data["study"]) == ("/in", made.json()["id"], run["study"])
    assert data["outcome"] == run["outcome"]
    (mail,) = office.mails.mails
    assert any(part.get_content_type() == "image/png" for part in mail.walk())
