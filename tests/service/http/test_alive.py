"""Where a health check asks for the service of this machine's settings."""

from __future__ import annotations

from pathlib import Path

import pytest

from sprag_study.service.http.alive import address, is_alive
from sprag_study.service.settings import Settings
from tests.acceptance.processes import service


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("127.0.0.1", "127.0.0.1"),
        ("localhost", "localhost"),
        ("0.0.0.0", "127.0.0.1"),
        ("::", "[::1]"),
        ("[::]", "[::1]"),
        ("::1", "[::1]"),
        ("192.0.2.10", "192.0.2.10"),
        ("sprag.example", "sprag.example"),
    ],
)
@pytest.mark.parametrize(("certificate", "scheme"), [("", "http"), ("server.pem", "https")])
def test_the_address_is_that_of_the_settings(host: str, expected: str, certificate: str, scheme: str) -> None:
    settings = Settings(host=host, port=8443, tls_certificate=certificate, url_prefix="/sprag")
    assert address(settings) == f"{scheme}://{expected}:8443/sprag/livez"


def test_a_service_is_alive_until_it_ends(tmp_path: Path) -> None:
    fewest = {"SPRAG_PROCESSES": "1", "SPRAG_CHECK_PROCESSES": "1"}
    with service(tmp_path, SPRAG_ALLOWED_HOSTS="sprag.example", **fewest) as started:
        settings = Settings(port=int(started.address.rpartition(":")[2]))
        assert is_alive(settings)
        assert not is_alive(settings.model_copy(update={"tls_certificate": "server.pem"}))
    assert not is_alive(settings)
