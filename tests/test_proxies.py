"""The examples of proxies say what the service says: its sizes, times, streams, and the header of logged-in users."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from sprag_study.service.http import attempts
from sprag_study.service.http.roles import ROLES
from sprag_study.service.settings import Settings
from sprag_study.worker import limits

ROOT = Path(__file__).resolve().parents[1]
NGINX, CADDY = ((ROOT / "examples" / name).read_text("utf-8") for name in ("nginx.conf", "Caddyfile"))
PAGE = (ROOT / "docs" / "proxy.md").read_text("utf-8")
#: The locations of nginx for a service with a prefix.
PREFIXED = next(text for text in re.findall(r"```nginx\n(.*?)```", PAGE, re.DOTALL) if "location = /sprag" in text)
UNITS = {"s": 1, "m": 60, "h": 3_600, "k": 2**10, "KiB": 2**10, "MiB": 2**20}


def values(text: str, name: str) -> list[str]:
    """The values of a directive, in order; comments do not count."""
    plain = re.sub(r"(?m)^\s*#.*$", "", text)
    return [" ".join(value.split()) for value in re.findall(rf"(?m)^\s*{re.escape(name)}\s+([^;\n]+?)\s*;?$", plain)]


def amount(text: str, size: bool = False) -> int:
    number, unit = re.fullmatch(r"(\d+)(\w*)", text).groups()  # type: ignore[union-attr]
    return int(number) * (2**20 if size and unit == "m" else UNITS[unit])


def test_nginx_has_the_sizes_and_times_of_the_service() -> None:
    assert amount(values(NGINX, "client_header_timeout")[0]) == limits.HEAD_SECONDS
    assert amount(values(NGINX, "client_body_timeout")[0]) == limits.BODY_SECONDS
    assert amount(values(NGINX, "send_timeout")[0]) == limits.WRITE_SECONDS
    assert amount(values(NGINX, "client_max_body_size")[0], size=True) == limits.MAX_BODY_BYTES
    count, size = values(NGINX, "large_client_header_buffers")[0].split()
    assert (amount(size), int(count) > 1) == (limits.MAX_HEAD_BYTES, True)
    assert amount(values(NGINX, "proxy_read_timeout")[0]) > limits.FILE_SECONDS + limits.FILE_WAIT_SECONDS
    assert int(values(NGINX, "limit_conn")[0].split()[1]) < limits.MAX_CONNECTIONS


def test_caddy_has_them_too() -> None:
    assert amount(values(CADDY, "read_header")[0]) == limits.HEAD_SECONDS
    assert amount(values(CADDY, "read_body")[0]) == limits.BODY_SECONDS
    assert amount(values(CADDY, "max_size")[0]) == limits.MAX_BODY_BYTES
    assert amount(values(CADDY, "max_header_size")[0]) == limits.MAX_HEAD_BYTES
    assert values(CADDY, "write") == [], "it would cut off large files"


def test_both_lead_to_the_service_and_do_not_compress() -> None:
    default = Settings.model_fields["port"].default
    assert set(values(NGINX, "proxy_pass")) == {f"http://127.0.0.1:{default}"}
    assert values(CADDY, "reverse_proxy") == [f"127.0.0.1:{default} {{"]
    assert values(NGINX, "gzip") == ["off"]
    assert values(CADDY, "encode") == []


def test_a_prefix_stays_in_the_path() -> None:
    """The service answers with it; a path behind the address of `proxy_pass` would replace it."""
    assert set(values(PREFIXED, "proxy_pass")) == {"http://127.0.0.1:8000"}
    assert values(PREFIXED, "location") != []
    assert "reverse_proxy /sprag/* 127.0.0.1:8000 {" in PAGE
    assert "handle_path" not in PAGE + CADDY
    for text in (NGINX, CADDY):
        assert "SPRAG_URL_PREFIX=/sprag" in text
        assert "SPRAG_PUBLIC_URL=https://sprag.example/sprag" in text


def test_an_office_behind_one_address_can_be_left_out_of_the_limits() -> None:
    """nginx counts no request whose key is empty."""
    assert {zone.split()[0] for name in ("limit_req_zone", "limit_conn_zone") for zone in values(NGINX, name)} == {
        "$sprag_address"
    }
    assert 'map $sprag_limited $sprag_address {\n    0 "";\n    1 $binary_remote_addr;' in NGINX
    assert (attempts.MOST_WAITING, attempts.LONGEST_SECONDS) == (4, 4.0), "docs/proxy.md says so"


def test_nginx_speaks_http_2_as_caddy_does_by_itself() -> None:
    assert values(NGINX, "http2") == ["on"]


@pytest.mark.parametrize(("text", "prefix"), [(NGINX, ""), (NGINX, "/sprag"), (PREFIXED, "/sprag")])
def test_nginx_passes_streams_on_as_they_come(text: str, prefix: str) -> None:
    (location,) = re.findall(r"location ~ (\S+) \{[^}]*proxy_buffering off;", text)
    study = f"{prefix}/api/v1/studies/st_0123456789abcdef"
    for path in (f"{study}/events", f"{prefix}/live/nights", f"{prefix}/live/study"):
        assert re.search(location, path), path
    for path in ("/", study, f"{study}/results", f"{prefix}/nights", f"{prefix}/static/live.js"):
        assert not re.search(location, path), path
    assert "GET /live/{name}" in ROLES
    assert "GET /api/v1/studies/{study_id}/events" in ROLES


@pytest.mark.parametrize(
    ("text", "headers"),
    [
        (NGINX, {"Host $host", "X-Forwarded-For $remote_addr", "X-Forwarded-Proto $scheme", 'X-Forwarded-User ""'}),
        (CADDY, {"-X-Forwarded-User"}),
    ],
    ids=["nginx", "caddy"],
)
def test_no_client_can_say_who_it_is(text: str, headers: set[str]) -> None:
    assert headers <= {*values(text, "proxy_set_header"), *values(text, "header_up")}


@pytest.mark.parametrize("text", [NGINX, CADDY], ids=["nginx", "caddy"])
def test_braces_match(text: str) -> None:
    plain = re.sub(r"#.*", "", text)
    depth = 0
    for mark in re.findall(r"[{}]", re.sub(r"\{http\.[a-z.]+\}", "", plain)):
        depth += 1 if mark == "{" else -1
        assert depth >= 0
    assert depth == 0


def test_the_page_shows_both_files() -> None:
    assert f"```nginx\n{NGINX}```" in PAGE
    assert f"```caddy\n{CADDY}```" in PAGE


def test_the_page_names_the_ranges_of_the_project() -> None:
    project = (ROOT / "pyproject.toml").read_text("utf-8")
    for package, lowest, below in re.findall(r"(?m)^\| (\w+) \| ([\d.]+) to below (\d+) \|", PAGE):
        assert f'"{package.lower()}>={lowest},<{below}"' in project, package
