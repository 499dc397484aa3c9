"""To whom a schedule may report: fields, settings, the interface, the form, the command line, the last night."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import pytest
from pydantic import SecretStr, ValidationError

from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import WrongInputError
from sprag_study.service.delivery import is_mail_address, mail_server, origin_of
from sprag_study.service.http.app import chunking, create_app
from sprag_study.service.jobs.maintenance import Maintenance, MaintenancePlan
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.settings import Settings
from sprag_study.service.storage.store import Store
from tests.service.conftest import InThread, Service
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    import httpx

    from tests.service.schedules.conftest import Clock

API = "/api/v1/schedules"
KEY = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"
HOOK = "https://hooks.example/sprag?to=1"


@pytest.fixture
def office(settings: Settings, clock: Clock, connect: Callable[..., httpx.Client]) -> Iterator[Service]:
    """A service that mails to example.com, and sends webhooks to hooks.example."""
    own = Settings(
        database=settings.database,
        smtp_url="smtps://mail.example",
        mail_from="sprag@example.com",
        mail_domains="example.com, example.org",
        webhook_origins="https://hooks.example, http://10.0.0.5:8080",
        webhook_secret=KEY,
    )
    with Store.open(own.database_url, chunking=chunking(own), clock=clock) as store:
        app = create_app(own, store=store, computer=InThread(), checker=InThread())
        yield Service(app, connect(app), store, InThread(), InThread())


def asked(**given: Any) -> dict[str, Any]:
    return {"spec": SPEC, "at": "2026-01-01T02:00", **given}


def test_recipients_and_webhook_are_kept_shown_and_changed(office: Service) -> None:
    body = asked(report_email=["dora@example.com"], report_webhook=HOOK, report_when="trouble")
    made = office.http.post(API, json=body)
    assert made.status_code == 201, made.text
    found = office.get(f"/schedules/{made.json()['id']}")
    assert (found["report_email"], found["report_webhook"]) == (["dora@example.com"], HOOK)
    assert found["report_when"] == "trouble"
    changed = office.http.patch(made.headers["location"], json={"report_email": [], "report_webhook": None})
    assert (changed.json()["report_email"], changed.json()["report_webhook"]) == ([], None)


@pytest.mark.parametrize(
    ("given", "pointer", "code"),
    [
        ({"report_email": "dora@example.com"}, "/report_email", "wrong-type"),
        ({"report_email": ["a@example.com"] * 11}, "/report_email", "too-many"),
        ({"report_email": ["a@example.com", "a@example.com"]}, "/report_email/1", "repeated"),
        ({"report_email": ["dora"]}, "/report_email/0", "invalid-text"),
        ({"report_email": ["dora@example.com\r\nBcc: x@example.com"]}, "/report_email/0", "invalid-text"),
        ({"report_email": ["Dora <dora@example.com>"]}, "/report_email/0", "invalid-text"),
        ({"report_email": [3]}, "/report_email/0", "invalid-text"),
        ({"report_email": ["dora@elsewhere.example"]}, "/report_email/0", "invalid-choice"),
        ({"report_webhook": "ftp://hooks.example"}, "/report_webhook", "invalid-text"),
        ({"report_webhook": "https://u:p@hooks.example/"}, "/report_webhook", "invalid-text"),
        ({"report_webhook": f"https://hooks.example/{'a' * 500}"}, "/report_webhook", "invalid-text"),
        ({"report_webhook": "http://hooks.example/"}, "/report_webhook", "invalid-choice"),
        ({"report_webhook": "https://hooks.example:8443/"}, "/report_webhook", "invalid-choice"),
        ({"report_webhook": "http://169.254.169.254/latest/meta-data"}, "/report_webhook", "invalid-choice"),
        ({"report_webhook": "http://127.0.0.1:8000/api/v1/studies"}, "/report_webhook", "invalid-choice"),
        ({"report_when": "sometimes"}, "/report_when", "invalid-choice"),
    ],
)
def test_who_may_not_be_reached_is_refused(office: Service, given: dict[str, Any], pointer: str, code: str) -> None:
    answer = office.http.post(API, json=asked(**given))
    assert answer.status_code == 422, answer.text
    errors = {(error["pointer"], error["code"]) for error in answer.json()["errors"]}
    assert errors == {(pointer, code)}
    assert all(error["allowed"] for error in answer.json()["errors"])


def test_without_settings_nothing_leaves(service: Service) -> None:
    answer = service.http.post(API, json=asked(report_email=["dora@example.com"], report_webhook=HOOK))
    assert {(error["pointer"], error["code"]) for error in answer.json()["errors"]} == {
        ("/report_email", "conflict"),
        ("/report_webhook", "invalid-choice"),
    }


def test_other_fields_are_changed_although_its_webhook_is_not_allowed_any_more(
    office: Service, settings: Settings, clock: Clock, connect: Callable[..., httpx.Client]
) -> None:
    made = office.http.post(API, json=asked(report_webhook=HOOK))
    with Store.open(settings.database_url, chunking=chunking(settings), clock=clock) as store:
        later = connect(create_app(settings, store=store, computer=InThread(), checker=InThread()))
        assert later.patch(made.headers["location"], json={"name": "renamed"}).status_code == 200
        other = {"report_webhook": "https://hooks.example/other"}
        assert later.patch(made.headers["location"], json=other).status_code == 422


def test_the_form_has_recipients(office: Service) -> None:
    form = {
        "source": "preset one_pendulum",
        "when": "at",
        "at": "2026-01-05T07:30",
        "zone": "UTC",
        "report_email": "dora@example.com, otto@example.org",
        "report_webhook": HOOK,
        "report_when": "trouble",
    }
    assert office.http.post("/nights/new", data=form).status_code == 303
    (kept,) = office.store.schedules.all()
    assert kept.fields.report_to.email == ("dora@example.com", "otto@example.org")
    shown = office.http.get(f"/nights/{kept.id}").text
    assert 'value="dora@example.com, otto@example.org"' in shown
    assert '<option value="trouble" selected>' in shown
    wrong = office.http.post("/nights/new", data={**form, "report_email": "dora@elsewhere.example"})
    assert wrong.status_code == 422
    assert 'id="wrong-report_email" role="alert">' in wrong.text


def test_the_last_night_has_its_reports_without_secrets(office: Service, clock: Clock) -> None:
    office.http.post(API, json=asked(report_email=["dora@example.com"], report_webhook=HOOK, catch_up="none"))
    clock.set("2026-01-01T06:00")
    Scheduler(office.store).look()
    (run,) = office.get("/night")["runs"]
    assert [(report["channel"], report["target"], report["state"]) for report in run["reports"]] == [
        ("email", "dora@example.com", "waiting"),
        ("webhook", "https://hooks.example:443", "waiting"),
    ]
    assert "Report to dora@example.com: waiting" in office.http.get("/nights").text
    assert "?to=1" not in json.dumps(run)


def test_reports_are_deleted_after_ninety_days(office: Service, clock: Clock) -> None:
    store = office.store
    office.http.post(API, json=asked(report_webhook=HOOK, catch_up="none"))
    clock.set("2026-01-01T06:00")
    Scheduler(store).look()
    report = store.reports.claim()
    assert report is not None
    store.reports.sent(report)
    for time, left in (("2026-03-31T05:00", 1), ("2026-04-02T05:00", 0)):
        clock.set(time)
        store.dispatchers.note_clock(clock.now())
        Maintenance(store, MaintenancePlan()).look()
        assert len(store.reports.between(report.created_at.replace(year=2025), clock.now())) == left


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"smtp_url": "http://mail.example", "mail_from": "a@b.c"}, "smtps://"),
        ({"smtp_url": "smtp://mail.example:99999", "mail_from": "a@b.c"}, "port"),
        ({"smtp_url": "smtp+plain://u:p4ssw0rd@mail.example", "mail_from": "a@b.c"}, "plain text"),
        ({"smtp_url": "smtps://mail.example"}, "SPRAG_SMTP_URL needs"),
        ({"mail_from": "Sprag"}, "mail address"),
        ({"webhook_origins": "hooks.example", "webhook_secret": KEY}, "origins"),
        ({"webhook_origins": "https://hooks.example/path", "webhook_secret": KEY}, "origins"),
        ({"webhook_origins": ["https://hooks.example/path"], "webhook_secret": KEY}, "origins"),
        ({"webhook_origins": "https://hooks.example"}, "SPRAG_WEBHOOK_ORIGINS needs"),
        ({"webhook_secret": "whsec_c2hvcnQ="}, "24 to 64 bytes"),
        ({"webhook_secret": "secret"}, "24 to 64 bytes"),
        ({"public_url": "sprag.example"}, "address"),
    ],
)
def test_settings_that_cannot_work_are_refused(settings: Settings, given: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError) as refused:
        Settings(database=settings.database, **given)  # type: ignore[arg-type]
    assert message in str(refused.value)
    assert "p4ssw0rd" not in str(refused.value)
    with pytest.raises(WrongInputError) as told:
        read_settings(**given)
    assert message in str(told.value.faults[0])
    assert not any(secret in str(told.value.faults[0]) for secret in ("p4ssw0rd", KEY, "c2hvcnQ"))


def test_links_have_the_public_address(settings: Settings) -> None:
    assert settings.reports.public_url == "http://127.0.0.1:8000"
    assert not settings.reports.wanted
    public = Settings(database=settings.database, public_url="https://sprag.example/tools/")
    assert public.reports.public_url == "https://sprag.example/tools"
    for path in ("", "/sprag"):
        behind = Settings(url_prefix="/sprag", public_url=f"https://sprag.example{path}")
        assert behind.reports.public_url == "https://sprag.example/sprag"
    plain = Settings(host="2001:db8::1", tls_certificate="x", port=8443, url_prefix="/sprag")
    assert plain.reports.public_url == "https://[2001:db8::1]:8443/sprag"
    assert Settings(host="::1").reports.public_url == Settings(host="[::1]").reports.public_url == "http://[::1]:8000"


def test_lists_of_a_file_are_read_as_text_with_commas_is(settings: Settings) -> None:
    key = SecretStr(KEY)
    lists = Settings(mail_domains=("Example.com ",), webhook_origins=("https://Hooks.example/",), webhook_secret=key)
    text: dict[str, Any] = {"mail_domains": "Example.com,", "webhook_origins": "https://Hooks.example/"}
    assert Settings(**text, webhook_secret=key) == lists
    assert lists.mail_domains == ("example.com",)
    assert lists.webhook_origins == ("https://hooks.example:443",)


def test_a_mail_server_is_read_from_its_address() -> None:
    found = mail_server("smtp://user%40example.com:p%2Fw@mail.example")
    assert (found.host, found.port, found.security) == ("mail.example", 587, "starttls")
    assert (found.user, found.password) == ("user@example.com", "p/w")
    assert "p/w" not in repr(found)
    assert mail_server("smtps://mail.example").port == 465


@pytest.mark.parametrize(
    ("address", "origin"),
    [
        ("https://Hooks.Example/x", "https://hooks.example:443"),
        ("http://[::1]:8080/", "http://[::1]:8080"),
        ("https://hooks.example@evil.example/", None),
        ("https://hooks.example/a b", None),
        ("https://hooks.example\\@evil.example/", None),
        ("https://hooks.example/#f", None),
        ("https://hooks.example:0x50/", None),
        ("file:///etc/passwd", None),
        ("https:///x", None),
        ("https://hööks.example/", None),
    ],
)
def test_an_origin_is_scheme_host_and_port(address: str, origin: str | None) -> None:
    assert origin_of(address) == origin


@pytest.mark.parametrize(
    ("text", "valid"),
    [
        ("a@b", True),
        ("first.last+tag@sub.example.com", True),
        ("a@b@c", False),
        (".a@b", False),
        ("a..b@c", False),
        ("a@-b", False),
        ("a@b.", False),
        ("@b", False),
        (f"{'a' * 65}@b", False),
        ("ä@b", False),
        ("a@b\n", False),
        ("a%evil.example@b", False),
        ("evil.example!a@b", False),
    ],
)
def test_mail_addresses(text: str, valid: bool) -> None:
    assert is_mail_address(text) is valid
