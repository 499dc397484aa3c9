"""Logs: JSON that machines read, with the ids of request and studies; nothing that a client sends breaks a line."""

from __future__ import annotations

import io
import json
import logging
import re
import sys
from collections.abc import Callable, Iterator
from ipaddress import IPv4Network
from typing import TYPE_CHECKING, Any

import httpx
import pytest
from pydantic import SecretStr

from sprag_study.service.http.app import create_app
from sprag_study.service.http.request_log import REQUEST_HEADER
from sprag_study.service.logs import JsonFormatter, TextFormatter, configure
from sprag_study.worker.ports import StoreError
from tests.service.http.people import Office

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service


@pytest.fixture
def log() -> Iterator[io.StringIO]:
    """What goes to the log as JSON, requests too."""
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(JsonFormatter())
    logger = logging.getLogger("sprag")
    requests = logging.getLogger("sprag.requests")
    before = logger.level, requests.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    requests.setLevel(logging.INFO)
    yield stream
    logger.removeHandler(handler)
    logger.setLevel(before[0])
    requests.setLevel(before[1])


def lines(log: io.StringIO) -> list[dict[str, Any]]:
    return [json.loads(line) for line in log.getvalue().splitlines()]


def test_a_request_has_a_line_with_its_id_and_study(service: Service, log: io.StringIO) -> None:
    study_id = service.submit()
    answer = service.http.get(f"/api/v1/studies/{study_id}", headers={REQUEST_HEADER: "from-the-proxy_1"})
    assert answer.headers[REQUEST_HEADER] == "from-the-proxy_1"
    line = lines(log)[-1]
    assert (line["method"], line["path"], line["status"]) == ("GET", f"/api/v1/studies/{study_id}", 200)
    assert (line["request"], line["studies"]) == ("from-the-proxy_1", [study_id])
    assert line["milliseconds"] > 0
    assert line["time"].endswith("+00:00")


def test_a_study_that_is_submitted_stands_in_the_line_of_its_request(service: Service, log: io.StringIO) -> None:
    study_id = service.submit()
    line = lines(log)[-1]
    assert (line["method"], line["path"], line["studies"]) == ("POST", "/api/v1/studies", [study_id])
    service.http.get("/livez")
    assert "studies" not in lines(log)[-1]


def test_every_line_of_a_request_names_token_user_and_address(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], log: io.StringIO,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """The line of the request and those that are written while it is answered, from whatever thread."""
    office = Office(settings, service, connect)
    monkeypatch.setattr(service.store.studies, "page", lambda *_, **__: 1 / 0)
    client = office.program("dora")
    client.get("/api/v1/studies", headers={"X-Forwarded-For": "10.1.2.3"})
    client.get("/api/v1/models")
    office.program(None).get("/api/v1/models")
    fault, failed, good, nobody = [
        line for line in lines(log) if line["logger"] == "sprag.requests" or line["level"] == "error"
    ]
    who = {"token": office.ids["dora"], "user": "dora"}
    assert {name: fault.get(name) for name in ("address", *who)} == {"address": "10.1.2.3", **who}
    assert fault["request"] == failed["request"]
    assert {name: failed.get(name) for name in ("address", *who)} == {"address": "10.1.2.3", **who}
    assert {name: good.get(name) for name in ("address", *who)} == {"address": "127.0.0.1", **who}
    assert nobody["status"] == 401
    assert nobody["address"] == "127.0.0.1"
    assert not {"token", "user"} & {*nobody}
    assert office.tokens["dora"] not in log.getvalue()


def test_an_address_that_no_trusted_proxy_forwards_is_not_believed(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], log: io.StringIO
) -> None:
    office = Office(settings, service, connect, trusted_proxies=(IPv4Network("10.0.0.0/8"),))
    office.program("vera").get("/livez", headers={"X-Forwarded-For": "192.0.2.1"})
    assert lines(log)[-1]["address"] == "127.0.0.1"


def test_the_token_of_the_settings_has_an_id_too(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], log: io.StringIO
) -> None:
    secret = SecretStr("a-token-of-the-settings")
    app = create_app(
        settings.model_copy(update={"token": secret}),
        store=service.store, computer=service.computer, checker=service.checker,
    )  # fmt: skip
    connect(app, headers={"Authorization": f"Bearer {secret.get_secret_value()}"}).get("/api/v1/models")
    assert lines(log)[-1]["token"] == "setting"
    assert secret.get_secret_value() not in log.getvalue()


@pytest.mark.parametrize("given", ["", "x" * 65, "a b", "é", '"}', "a\tb"])
def test_an_id_that_is_none_is_replaced(service: Service, log: io.StringIO, given: str) -> None:
    answer = service.http.get("/livez", headers={REQUEST_HEADER: given.encode("utf-8")})
    assert answer.headers[REQUEST_HEADER] == lines(log)[-1]["request"] != given
    assert len(answer.headers[REQUEST_HEADER]) == 16


@pytest.mark.parametrize("path", ["/%0aFAKE%20LINE", "/%1b[31m", "/%e2%80%ae", "/%22,%22level%22:%22x"])
def test_no_address_breaks_a_line(service: Service, log: io.StringIO, path: str) -> None:
    service.http.get(path)
    (line,) = [line for line in lines(log) if "path" in line]
    assert line["path"].isprintable()
    assert line["path"].isascii()


@pytest.mark.parametrize(
    "sent", ["\x1b[2J", "\x9b31m", "\u202e", "\r", "\n2027-01-01 ERROR forged", "\x00", "\ud800", "\x7f"]
)
def test_no_message_controls_a_terminal_or_begins_a_line(sent: str) -> None:
    """In text; letters of any language stay. JSON escapes all of them by itself."""
    line = logging.LogRecord("sprag.service", logging.WARNING, "", 0, "GET /%s: %s", (sent, "строк минув"), None)
    text = TextFormatter().format(line)
    assert text.isprintable()
    assert ascii(sent)[1:-1] in text
    assert text.endswith(": строк минув")
    library = logging.LogRecord("uvicorn.error", logging.ERROR, "", 0, f"one{sent}\nERROR two\n", None, None)
    first, *further = TextFormatter().format(library).split("\n")
    assert first.isprintable()
    assert further[-1] == "  ERROR two"
    assert all(item.isprintable() and item.startswith("  ") for item in further)
    try:
        raise ValueError(f"about {sent}")
    except ValueError:
        failed = logging.LogRecord("sprag", logging.ERROR, "", 0, "failed", None, sys.exc_info())
    assert all(item.isprintable() for item in TextFormatter().format(failed).split("\n"))


def test_a_refused_path_reaches_the_log_as_text(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The guard refuses before a route is looked for, and says which address it was."""
    stream = io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(TextFormatter())
    logging.getLogger("sprag.service").addHandler(handler)
    app = create_app(settings, store=service.store, computer=service.computer, checker=service.checker)
    monkeypatch.setattr(service.store.people, "tokens", lambda: (_ for _ in ()).throw(StoreError("gone")))
    try:
        assert connect(app).get("/%1b%5b2J%0aforged").status_code == 503
    finally:
        logging.getLogger("sprag.service").removeHandler(handler)
    (line,) = stream.getvalue().splitlines()
    assert line.isprintable()
    assert r"GET /\x1b[2J" in line


def test_a_fault_is_told_with_its_trace_and_request(
    service: Service, log: io.StringIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service.store.studies, "page", lambda *_, **__: 1 / 0)
    answer = service.http.get("/api/v1/studies")
    assert answer.status_code == 500
    told = [line for line in lines(log) if line["level"] == "error"]
    assert "ZeroDivisionError" in told[0]["exception"]
    assert told[0]["request"] == answer.headers[REQUEST_HEADER]


def test_the_form_of_the_log_is_a_setting(monkeypatch: pytest.MonkeyPatch) -> None:
    root, names = logging.getLogger(), ("sprag", "sprag.requests")
    before, levels = root.handlers[:], [logging.getLogger(name).level for name in names]
    stream = io.StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    try:
        for form, requests in (("text", False), ("json", True)):
            root.handlers[:] = []
            configure(form, requests=requests)  # type: ignore[arg-type]
            logging.getLogger("sprag.service").info("it goes")
            logging.getLogger("sprag.requests").info("a request")
            logging.getLogger("library").info("chatter")
    finally:
        root.handlers[:] = before
        for name, level in zip(names, levels, strict=True):
            logging.getLogger(name).setLevel(level)
    plain, *structured = stream.getvalue().splitlines()
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}\+00:00 INFO it goes", plain)
    assert [json.loads(line)["message"] for line in structured] == ["it goes", "a request"]
