"""The service speaks TLS by itself, with a certificate that is checked at the start and may be renewed."""

from __future__ import annotations

import json
import logging
import os
import ssl
import subprocess
from pathlib import Path

import httpx
import pytest

from sprag_study.service.client import Client
from sprag_study.service.client.errors import UntrustedError
from sprag_study.service.http.tls import Certificate, CertificateError
from sprag_study.service.settings import Settings
from tests.acceptance.processes import service, sprag
from tests.worker.executors.certificates import require_openssl

TOKEN = "a-token-of-the-tests"


def make(folder: Path, name: str = "own", *options: str) -> tuple[Path, Path]:
    """A certificate that signs itself, for localhost, and its key."""
    require_openssl()
    file, key = folder / f"{name}.pem", folder / f"{name}.key"
    kind = options or ("-nodes",)
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", *kind, "-days", "2", "-subj", f"/CN={name}",
         "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout", str(key), "-out", str(file)],
        check=True, capture_output=True,
    )  # fmt: skip
    return file, key


def key_of_512_bits(folder: Path) -> Path:
    """A certificate and its key, which today's OpenSSL refuses, in one file."""
    file = folder / "short.pem"
    options = ["-newkey", "rsa:512", "-keyout", "/dev/stdout", "-nodes", "-subj", "/CN=short"]
    made = subprocess.run(["openssl", "req", "-x509", *options], check=True, capture_output=True)
    file.write_bytes(made.stdout)
    return file


def test_a_service_with_a_certificate_speaks_https_only(tmp_path: Path) -> None:
    file, key = make(tmp_path)
    trust = ssl.create_default_context(cafile=str(file))
    settings = {"SPRAG_TOKEN": TOKEN, "SPRAG_PROCESSES": "1", "SPRAG_CHECK_PROCESSES": "1"}
    with service(tmp_path, SPRAG_TLS_CERTIFICATE=str(file), SPRAG_TLS_KEY=str(key), **settings) as started:
        assert started.address.startswith("https://127.0.0.1:")
        with httpx.Client(base_url=started.address, verify=trust, timeout=600, trust_env=False) as client:
            assert client.get("/livez").json() == {"status": "ok"}
            entered = client.post("/login", data={"token": TOKEN}, headers={"Origin": started.address})
            assert entered.status_code == 303
            assert "; secure" in entered.headers["set-cookie"].lower()
            head = {"Authorization": f"Bearer {TOKEN}"}
            assert client.get("/openapi.json", headers=head).status_code == 200
        with pytest.raises(httpx.ConnectError, match=r"(?i)certificate verify failed"):
            httpx.get(f"{started.address}/livez", trust_env=False, timeout=600)
        with pytest.raises(httpx.TransportError):
            httpx.get(f"http{started.address.removeprefix('https')}/livez", trust_env=False, timeout=600)
        # The commands trust the office's own authority by the variable of OpenSSL.
        variables = {"SPRAG_SERVER": started.address, "SPRAG_TOKEN": TOKEN, "SSL_CERT_FILE": str(file)}
        assert sprag("list", "--json", **variables).code == 0
        refused = sprag("list", "--json", **variables | {"SSL_CERT_FILE": ""})
        assert (refused.code, json.loads(refused.err)["code"]) == (3, "unreachable")
        assert "its certificate is not trusted: self-signed certificate; SSL_CERT_FILE" in refused.err
        with pytest.raises(UntrustedError), Client(started.address) as script:
            script.live()


def peer(context: ssl.SSLContext, trusted: Path) -> str:
    """The name of the certificate that a server with that context shows."""
    client = ssl.create_default_context(cafile=str(trusted))
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    server_in, server_out = outgoing, incoming
    here = client.wrap_bio(incoming, outgoing, server_hostname="localhost")
    there = context.wrap_bio(server_in, server_out, server_side=True)
    for side in (here, there, here, there, here):
        try:
            side.do_handshake()
        except ssl.SSLWantReadError:
            continue
    shown = here.getpeercert()
    assert shown is not None
    return str(dict(pair for (pair,) in shown["subject"])["commonName"])


def test_a_renewed_certificate_is_used_by_new_connections(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "sprag")
    file, key = make(tmp_path, "first")
    certificate = Certificate.of(Settings(tls_certificate=str(file), tls_key=str(key)))
    assert certificate is not None
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(file, key)
    assert not certificate.renew(context)
    new, new_key = make(tmp_path, "second")
    os.replace(new, file)
    os.utime(file, (1, 1))
    assert not certificate.renew(context)  # the key has not come yet
    assert "the key belongs to another certificate" in caplog.text
    os.replace(new_key, key)
    os.utime(key, (2, 2))
    assert certificate.renew(context)
    assert peer(context, file) == "second"
    assert not certificate.renew(context)
    key.unlink()
    assert not certificate.renew(context)
    assert peer(context, file) == "second"


def test_files_that_cannot_be_used_are_named_before_anything_starts(tmp_path: Path) -> None:
    file, key = make(tmp_path)
    _, other = make(tmp_path, "other")
    locked, locked_key = make(tmp_path, "locked", "-passout", "pass:secret")
    text = tmp_path / "text.pem"
    text.write_text("no certificate\n")
    for given, reason in {
        (file, tmp_path / "none.key"): "No such file or directory",
        (file, other): "the key belongs to another certificate",
        (locked, locked_key): "the key is encrypted",
        (text, key): "they are not PEM",
        (file, ""): "they are not PEM",  # there is no key in it
        (key_of_512_bits(tmp_path), ""): "the key is too short",
    }.items():
        with pytest.raises(CertificateError, match=reason) as caught:
            Certificate.of(Settings(tls_certificate=str(given[0]), tls_key=str(given[1])))
        assert "SPRAG_TLS_CERTIFICATE" in str(caught.value)
    with pytest.raises(CertificateError, match="SPRAG_TLS_KEY needs SPRAG_TLS_CERTIFICATE"):
        Certificate.of(Settings(tls_key=str(key)))
    both = tmp_path / "both.pem"
    both.write_text(file.read_text() + key.read_text())
    assert Certificate.of(Settings(tls_certificate=str(both))) is not None
    ended = sprag("serve", "--json", "--port", 0, "--db", tmp_path / "a.sqlite3", "--tls-certificate", text)
    assert ended.code == 2
    assert json.loads(ended.err.splitlines()[-1])["code"] == "invalid-settings"
    assert not (tmp_path / "a.sqlite3").exists()
