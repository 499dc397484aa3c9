"""Reports of schedules, sent to a real mail server and a real receiver of webhooks."""

from __future__ import annotations

import base64
import hashlib
import hmac
import json
import socket
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from email.message import EmailMessage
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.sentences import Sentence
from sprag_study.service.delivery import Delivery, MailServer, Security
from sprag_study.service.jobs.reports import channels
from sprag_study.service.jobs.reports.channels import signature
from sprag_study.service.jobs.reports.curve import small_curve
from sprag_study.service.jobs.reports.message import mail, subject
from sprag_study.service.jobs.reports.reporter import Reporter
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.schedules.reports import CLAIM, Claimed, ReportRecord, ReportState
from sprag_study.service.storage.store import Store
from tests.service.schedules.conftest import NEW_YEAR
from tests.service.schedules.receivers import Hook, certificate, mail_server, webhook
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from pathlib import Path

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service
    from tests.service.schedules.conftest import Clock

KEY = bytes(range(32))
DORA = "dora@example.com"


@pytest.fixture(autouse=True)
def no_proxy(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever proxy the machine has, the receivers are here."""
    for name in ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"):
        monkeypatch.delenv(name, raising=False)
        monkeypatch.delenv(name.lower(), raising=False)


@pytest.fixture
def hook() -> Iterator[Hook]:
    with webhook() as received:
        yield received


def delivery_to(hook: Hook, **more: Any) -> Delivery:
    return Delivery("https://sprag.example", origins=(hook.address,), secret=KEY, sender="sprag@example.com", **more)


def run_over(service: Service, clock: Clock, time: str = "2026-01-01T01:00", **given: Any) -> str:
    """A schedule that was due at ``time`` and whose study has ended; the id of the study."""
    fields = {"spec": SPEC, "at": time, "name": "Nächtlich", "zone": "Europe/Berlin", **given}
    service.store.schedules.create(read_fields({**fields, "at": f"{time}Z"}, NEW_YEAR))
    clock.set(time)
    Scheduler(service.store).look()
    study = service.store.studies.page().studies[0].id
    service.fill(study)
    Scheduler(service.store).look()
    return study


def records(store: Store) -> list[ReportRecord]:
    found = store.reports.between(NEW_YEAR.replace(year=2025), NEW_YEAR.replace(year=2027))
    return [record for reports in found.values() for record in reports]


@pytest.mark.parametrize("security", ["starttls", "tls"])
def test_a_mail_has_the_outcome_a_curve_and_links(
    service: Service, clock: Clock, tmp_path: Path, security: Any
) -> None:
    own, trusting = certificate(tmp_path)
    study = run_over(service, clock, report_email=[DORA, "otto@example.com"])
    with mail_server(**{security: own}, login=True) as box:
        delivery = Delivery("https://sprag.example", box.server(security, login=True), "sprag@example.com")
        Reporter(service.store, delivery, trusting).look()
        Reporter(service.store, delivery, trusting).look()
    assert sorted(str(mail["To"]) for mail in box.mails) == [DORA, "otto@example.com"]
    mail = next(mail for mail in box.mails if mail["To"] == DORA)
    assert mail["From"] == "sprag@example.com"
    assert mail["Subject"] == "Sprag: needs attention: Nächtlich: finished, 8 of 9 cases ok"
    assert mail["Auto-Submitted"] == "auto-generated"
    text, html = mail.get_body(("plain",)), mail.get_body(("html",))
    assert text is not None
    assert html is not None
    for part in (text.get_content(), html.get_content()):
        assert "Finished: 9 of 9 cases are done, and 8 of them ended ok." in part
        assert "2026-01-01 02:00 CET (Europe/Berlin)" in part
        assert f"https://sprag.example/studies/{study}" in part
        assert "https://sprag.example/night" in part
    assert 'src="cid:curve"' in html.get_content()
    (picture,) = [part for part in mail.walk() if part.get_content_type() == "image/png"]
    assert picture["Content-ID"] == "<curve>"
    assert picture.get_content().startswith(b"\x89PNG")
    # It is in the units of the office.
    assert picture.get_content() == small_curve(service.store, study, "workshop")
    assert picture.get_content() != small_curve(service.store, study, "typed")
    sent = records(service.store)
    assert {(report.target, report.state, report.attempts) for report in sent} == {
        (DORA, ReportState.SENT, 1),
        ("otto@example.com", ReportState.SENT, 1),
    }
    assert {str(mail["Message-ID"]) for mail in box.mails} == {f"<{report.id}@example.com>" for report in sent}


def test_a_webhook_is_signed_and_says_the_same(service: Service, clock: Clock, hook: Hook) -> None:
    study = run_over(service, clock, report_webhook=f"{hook.address}/in?a=1")
    Reporter(service.store, delivery_to(hook)).look()
    ((path, headers, body),) = hook.requests
    assert path == "/in?a=1"
    signed = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
    expected = base64.b64encode(hmac.digest(KEY, signed, hashlib.sha256)).decode()
    assert headers["webhook-signature"] == f"v1,{expected}"
    assert int(headers["webhook-timestamp"]) == int(clock.now().timestamp())
    said = json.loads(body)
    assert said["type"] == "schedule.run"
    assert said["data"]["due_local"] == "2026-01-01T02:00:00+01:00"
    assert said["data"]["outcome"]["endings"] == {"chatter": 1}
    assert said["data"]["links"]["study"] == f"https://sprag.example/studies/{study}"


def test_the_signature_is_that_of_the_standard() -> None:
    """The example of standardwebhooks.com, its specification, section "Signature scheme"."""
    secret = base64.b64decode("MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw")
    body = b'{"test": 2432232314}'
    made = signature(secret, "msg_p5jXN8AQM9LWM0D4loKWxJek", 1614265330, body)
    assert made == "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="


def test_a_redirect_is_not_followed_and_tried_again_with_longer_pauses(
    service: Service, clock: Clock, hook: Hook, caplog: pytest.LogCaptureFixture
) -> None:
    run_over(service, clock, report_webhook=hook.address)
    hook.status = 302
    reporter = Reporter(service.store, delivery_to(hook))
    for minutes in (0, 1, 3, 7):
        clock.set(f"2026-01-01T01:{minutes:02}:30")
        reporter.look()
        reporter.look()
    assert [path for path, _, _ in hook.requests] == ["/"] * 4
    (waiting,) = records(service.store)
    assert (waiting.state, waiting.attempts) == (ReportState.WAITING, 4)
    assert waiting.problem == "The webhook answered 302."
    assert caplog.text.count("is tried again") == 1
    hook.status = 200
    clock.set("2026-01-01T02:00")
    reporter.look()
    assert len(set(hook.ids)) == 1, "each attempt has the same id"
    assert records(service.store)[0].state is ReportState.SENT


def test_a_report_is_given_up_after_three_days_or_when_its_receiver_is_gone(
    service: Service, clock: Clock, hook: Hook
) -> None:
    store = service.store
    run_over(service, clock, report_webhook=f"{hook.address}/a")
    hook.status = 500
    reporter = Reporter(store, delivery_to(hook))
    for day in (1, 2, 3, 4, 5):
        clock.set(f"2026-01-0{day}T02:00")
        reporter.look()
    assert [(report.state, report.attempts) for report in records(store)] == [(ReportState.FAILED, 4)]
    run_over(service, clock, "2026-01-05T03:00", report_webhook=f"{hook.address}/b")
    hook.status = 410
    reporter.look()
    assert [report.state for report in records(store)] == [ReportState.FAILED] * 2
    log = list(store.audit.rows(AuditFilter(action="report.fail")))
    assert [(row.actor, row.detail["problem"]) for row in log] == [
        ("reports", "The webhook answered 500."),
        ("reports", "The webhook answered 410."),
    ]
    assert all(row.detail["to"].count("/") == 2 for row in log)  # the origin: its path can be a secret


def test_why_a_report_failed_is_said_in_the_language_of_the_reader(service: Service, clock: Clock, hook: Hook) -> None:
    store = service.store
    run_over(service, clock, report_webhook=hook.address)
    claimed = store.reports.claim()
    assert claimed is not None
    store.reports.failed(claimed, Sentence("The webhook answered {status}.", status="503"), None)
    page = {
        language: service.http.get("/nights", headers={"Accept-Language": language}).text for language in ["en", "uk"]
    }
    assert ("The webhook answered 503." in page["en"], "Вебхук відповів 503." in page["uk"]) == (True, True)
    (run,) = service.http.get("/api/v1/night", params={"hours": 744}).json()["runs"]
    assert run["reports"][0]["problem"] == "The webhook answered 503."
    with store.session.write() as connection:  # as earlier versions wrote it
        connection.exec_driver_sql("UPDATE reports SET problem_values = NULL")
    assert "The webhook answered 503." in service.http.get("/nights", headers={"Accept-Language": "uk"}).text
    assert records(store)[0].problem == "The webhook answered 503."


def test_a_process_that_dies_before_sending_loses_nothing(service: Service, clock: Clock, hook: Hook) -> None:
    store = service.store
    run_over(service, clock, report_webhook=hook.address)
    killed = store.reports.claim()
    assert killed is not None
    reporter = Reporter(store, delivery_to(hook))
    reporter.look()
    assert hook.requests == [], "the other process may be sending it"
    clock.seconds += CLAIM.total_seconds()
    reporter.look()
    reporter.look()
    assert hook.ids == [killed.id]
    store.reports.failed(killed, "late", None)  # the other process was not dead, only slow
    assert [(report.state, report.attempts) for report in records(store)] == [(ReportState.SENT, 2)]


def test_a_process_that_dies_after_sending_sends_it_again_under_the_same_id(
    service: Service, clock: Clock, hook: Hook, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = service.store
    run_over(service, clock, report_webhook=hook.address)

    class KilledError(BaseException):
        """The process ends here."""

    def die(*_: object) -> None:
        raise KilledError

    with monkeypatch.context() as patch:
        patch.setattr(store.reports, "sent", die)
        with pytest.raises(KilledError):
            Reporter(store, delivery_to(hook)).look()
    clock.seconds += CLAIM.total_seconds()
    Reporter(store, delivery_to(hook)).look()
    Reporter(store, delivery_to(hook)).look()
    assert len(hook.ids) == 2
    assert len(set(hook.ids)) == 1
    assert records(store)[0].state is ReportState.SENT


def test_two_reporters_at_once_send_each_report_once(
    service: Service, settings: Settings, clock: Clock, hook: Hook
) -> None:
    for number in range(8):
        run_over(service, clock, f"2026-01-01T0{number + 1}:00", report_webhook=f"{hook.address}/{number}")
    gate = threading.Barrier(2)
    faults: list[BaseException] = []

    def work(store: Store) -> None:
        gate.wait(600)
        try:
            Reporter(store, delivery_to(hook)).look()
        except BaseException as fault:
            faults.append(fault)

    with Store.open(settings.database_url, clock=clock) as other:
        threads = [threading.Thread(target=work, args=(store,)) for store in (service.store, other)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert faults == []
    assert sorted(path for path, _, _ in hook.requests) == [f"/{number}" for number in range(8)]
    assert {report.state for report in records(service.store)} == {ReportState.SENT}


def test_a_claim_of_a_clock_that_was_put_back_does_not_last(service: Service, clock: Clock, hook: Hook) -> None:
    run_over(service, clock, report_webhook=hook.address)
    clock.set("2026-03-01T00:00")
    assert service.store.reports.claim() is not None
    clock.set("2026-01-01T01:05")
    Reporter(service.store, delivery_to(hook)).look()
    assert len(hook.requests) == 1


@pytest.mark.parametrize(
    ("reply", "state"), [("550 no such user", ReportState.FAILED), ("450 try later", ReportState.WAITING)]
)
def test_a_refused_recipient_is_final_only_where_the_server_says_so(
    service: Service, clock: Clock, reply: str, state: ReportState
) -> None:
    run_over(service, clock, report_email=[DORA, "otto@example.com"])
    with mail_server() as box:
        box.reply = lambda address: reply if address == DORA else None
        Reporter(service.store, Delivery(mail_server=box.server("none"), sender="sprag@example.com")).look()
    assert [str(mail["To"]) for mail in box.mails] == ["otto@example.com"]
    found = {report.target: report for report in records(service.store)}
    assert (found[DORA].state, found["otto@example.com"].state) == (state, ReportState.SENT)
    assert reply in str(found[DORA].problem)


def test_no_password_is_sent_without_tls_nor_to_an_unknown_certificate(
    service: Service, clock: Clock, tmp_path: Path
) -> None:
    own, _ = certificate(tmp_path)
    run_over(service, clock, report_email=[DORA])
    for options in ({}, {"starttls": own}):
        with mail_server(**options) as box:
            delivery = Delivery(mail_server=box.server("starttls", login=True), sender="sprag@example.com")
            Reporter(service.store, delivery).look()
        assert box.mails == []
        clock.seconds += 3600.0
    (report,) = records(service.store)
    assert (report.state, report.attempts) == (ReportState.WAITING, 2)


def test_reports_follow_the_settings_at_the_time_of_sending(service: Service, clock: Clock, hook: Hook) -> None:
    run_over(service, clock, report_webhook=hook.address, report_email=[DORA])
    with mail_server() as box:
        allowed = delivery_to(hook, mail_server=box.server("none"), domains=("example.org",))
        Reporter(service.store, replace(allowed, origins=())).look()
    assert (hook.requests, box.mails) == ([], [])
    assert {str(report.problem).partition("(")[2] for report in records(service.store)} == {
        "SPRAG_WEBHOOK_ORIGINS).",
        "SPRAG_MAIL_DOMAINS).",
    }


def test_only_trouble_is_reported_where_that_is_asked_for(
    service: Service, clock: Clock, hook: Hook, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.service import conftest

    monkeypatch.setattr(
        conftest, "made_up", lambda study, made=conftest.made_up: replace(made(study), endings=["ok"] * study.cases)
    )
    run_over(service, clock, report_webhook=hook.address, report_when="trouble")
    assert records(service.store) == []
    service.store.schedules.create(
        read_fields(
            {
                "spec": SPEC,
                "at": "2026-01-01T02:00",
                "report_webhook": hook.address,
                "report_when": "trouble",
                "catch_up": "none",
            },
            NEW_YEAR,
        )
    )
    clock.set("2026-01-01T06:00")
    Scheduler(service.store).look()
    Reporter(service.store, delivery_to(hook)).look()
    assert [json.loads(body)["data"]["outcome"]["result"] for _, _, body in hook.requests] == ["missed"]


def test_a_study_that_is_gone_is_reported_without_its_curve(service: Service, clock: Clock) -> None:
    study = run_over(service, clock, report_email=[DORA])
    service.store.studies.delete(study)
    with mail_server() as box:
        Reporter(service.store, Delivery(mail_server=box.server("none"), sender="sprag@example.com")).look()
    (mail,) = box.mails
    assert not any(part.get_content_type() == "image/png" for part in mail.walk())


def test_old_reports_are_deleted(service: Service, clock: Clock, hook: Hook) -> None:
    run_over(service, clock, report_webhook=hook.address)
    assert service.store.reports.prune(NEW_YEAR.replace(year=2027)) == 0, "it waits"
    Reporter(service.store, delivery_to(hook)).look()
    assert service.store.reports.prune(NEW_YEAR) == 0
    assert service.store.reports.prune(NEW_YEAR.replace(year=2027)) == 1


def test_an_answer_that_drips_does_not_keep_other_reports_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(channels, "MOST_SECONDS", 0.2)
    with socket.create_server(("127.0.0.1", 0)) as server, ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(server.accept)
        origin = f"http://127.0.0.1:{server.getsockname()[1]}"
        delivery = Delivery(origins=(origin,), secret=b"s" * 24)
        report = Claimed(1, "rp_1", "sc_1", "webhook", f"{origin}/x", {}, 1, NEW_YEAR, NEW_YEAR)
        with pytest.raises(channels.DeliveryError, match="did not answer within"):
            channels.send_webhook(report, b"{}", delivery, NEW_YEAR)
        waiting.result()[0].close()


@pytest.mark.parametrize("security", ["tls", "starttls", "none"])
def test_a_mail_server_without_an_end_does_not_keep_other_reports_waiting(
    monkeypatch: pytest.MonkeyPatch, security: Security, tmp_path: Path
) -> None:
    monkeypatch.setattr(channels, "MOST_SECONDS", 0.5)
    served, trusted = certificate(tmp_path)

    def talk(server: socket.socket) -> None:
        accepted = server.accept()[0]
        with (
            suppress(OSError),
            served.wrap_socket(accepted, server_side=True) if security == "tls" else accepted as peer,
        ):
            while True:  # the client goes away in the end
                peer.sendall(b"220-and more\r\n")

    with socket.create_server(("127.0.0.1", 0)) as server, ThreadPoolExecutor(1) as pool:
        talking = pool.submit(talk, server)
        mails = MailServer("localhost", server.getsockname()[1], security)
        message = EmailMessage()
        message["To"] = DORA
        with pytest.raises(channels.DeliveryError, match=r"within 0\.5 s"):
            channels.send_mail(message, Delivery(mail_server=mails), trusted)
        talking.result()


@pytest.mark.parametrize("name", ["=?utf-8?q?x?=", "press =?", "Pr\u00fcfstand =?utf-8?b?eA==?= " + "x" * 80])
def test_a_name_that_looks_like_an_encoded_word_arrives_as_it_is(name: str) -> None:
    content = {
        "name": name,
        "schedule": "sc_1",
        "due": NEW_YEAR.isoformat(),
        "zone": "UTC",
        "sentence": "It did not run.",
    }
    report = Claimed(1, "rp_1", "sc_1", "email", DORA, content, 1, NEW_YEAR, NEW_YEAR)
    sent = mail(report, Delivery(sender="sprag@example.com"), NEW_YEAR, None)
    with mail_server() as box:
        channels.send_mail(sent, Delivery(mail_server=box.server("none"), sender="sprag@example.com"))
    assert box.mails[0]["Subject"] == subject(content)
    assert name in str(box.mails[0]["Subject"])
