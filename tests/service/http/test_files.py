"""Files with their length and in parts, answers compressed, links between pages, methods of an address."""

from __future__ import annotations

import gzip
import tempfile
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import httpx
import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.http.api import results as results_of_api
from sprag_study.service.http.kept_files import KeptFiles
from tests.service.conftest import API, Service


@pytest.fixture
def ended(service: Service) -> str:
    """A study that has ended."""
    study_id = service.submit()
    service.fill(study_id)
    return study_id


def results(service: Service, study_id: str, form: str = "parquet", method: str = "GET", **headers: str) -> Any:
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    return service.http.request(method, f"{API}/studies/{study_id}/results?format={form}", headers=named)


def test_a_file_has_its_length_and_comes_in_parts(service: Service, ended: str) -> None:
    whole = results(service, ended)
    assert whole.status_code == 200
    assert int(whole.headers["content-length"]) == len(whole.content)
    assert whole.headers["accept-ranges"] == "bytes"
    assert "content-encoding" not in whole.headers
    assert whole.content.endswith(b"PAR1")
    size = len(whole.content)
    for asked, first, end in (
        ("bytes=0-99", 0, 100),
        ("bytes=100-", 100, size),
        ("bytes=-8", size - 8, size),
        (f"bytes=10-{size + 5}", 10, size),
        (f"bytes=-{size + 5}", 0, size),
    ):
        part = results(service, ended, Range=asked)
        assert part.status_code == 206, asked
        assert part.content == whole.content[first:end], asked
        assert part.headers["content-range"] == f"bytes {first}-{end - 1}/{size}"
        assert part.headers["etag"] == whole.headers["etag"]
    for ignored in ("bytes=5-3", "lines=1-2", "bytes=0-1,3-4", "bytes=a-b", "bytes=-"):
        assert results(service, ended, Range=ignored).content == whole.content, ignored
    beyond = results(service, ended, Range=f"bytes={size}-")
    assert (beyond.status_code, beyond.headers["content-range"]) == (416, f"bytes */{size}")
    assert beyond.json()["type"] == "/problems/range-not-satisfiable"
    assert results(service, ended, Range="bytes=-0").status_code == 416
    newer = results(service, ended, Range="bytes=0-9", If_Range='"another"')
    assert newer.status_code == 200
    same = results(service, ended, Range="bytes=0-9", If_Range=whole.headers["etag"])
    assert same.status_code == 206


def test_its_length_alone_is_asked_for(service: Service, ended: str) -> None:
    whole = results(service, ended)
    head = results(service, ended, method="HEAD")
    assert (head.status_code, head.content) == (200, b"")
    assert head.headers["content-length"] == whole.headers["content-length"]


def test_every_format_in_parts_is_the_whole(service: Service, ended: str) -> None:
    for form in ("csv", "json", "jsonl", "parquet", "arrow", "xlsx", "netcdf"):
        whole = results(service, ended, form, Accept_Encoding="identity").content
        half = len(whole) // 2
        parts = [
            results(service, ended, form, Range=asked).content for asked in (f"bytes=0-{half - 1}", f"bytes={half}-")
        ]
        assert b"".join(parts) == whole, form


def test_a_large_study_is_streamed_unless_a_part_is_asked_for(
    service: Service, ended: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results_of_api, "_AT_ONCE", 8)
    streamed = results(service, ended, "csv", Accept_Encoding="identity")
    assert "accept-ranges" not in streamed.headers
    assert results(service, ended, "csv", Range="bytes=0-9").content == streamed.content[:10]


def test_rows_are_sent_where_no_file_can_be_kept(
    service: Service, ended: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
        streamed = results(service, ended, "csv")
    kept = results(service, ended, "csv")
    assert (streamed.status_code, streamed.content) == (200, kept.content)
    assert "accept-ranges" not in streamed.headers
    assert kept.headers["accept-ranges"] == "bytes"
    assert "A file of results cannot be kept" in caplog.text


def test_a_running_study_has_no_parts(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id, range(4))
    answer = results(service, study_id, "csv", Range="bytes=0-9")
    assert answer.status_code == 200
    assert answer.content.count(b"\n") == 5


def test_files_are_written_once_and_the_oldest_go(tmp_path: Any, portal: BlockingPortal) -> None:
    files, made = KeptFiles(most_bytes=25), list[str]()

    def opened(name: str, content: str | None = None) -> Any:
        async def write(path: str, between: str) -> None:
            made.append(name)
            (Path(between) / "part").write_text("what a killed process would leave")
            if content is None:
                raise ValueError("broken")
            Path(path).write_text(content)

        return portal.call(files.opened, name, "owner", nullcontext, write)

    def content(name: str) -> bytes:
        with opened(name, name * 5 + "." * 5) as file:
            return bytes(file.read())

    assert content("a") == content("a") == b"aaaaa....."
    held = opened("a")
    content("b")
    content("a")
    content("c")
    assert made == ["a", "b", "c"]
    content("a")
    content("b")
    assert made == ["a", "b", "c", "b"], "the one that was used longest ago was removed"
    with held:
        assert held.read() == b"aaaaa.....", "an open file stays"
    with pytest.raises(ValueError, match="broken"):
        opened("d")
    content("d")
    assert made[-1] == "d"
    assert files._folder is not None
    folder = files._folder
    assert [path.is_file() for path in folder.iterdir()] == [True, True]
    files.close()
    assert not folder.exists()


def test_answers_are_compressed_and_their_tags_weak(service: Service, ended: str) -> None:
    address = f"{API}/studies/{ended}/results?format=json"
    plain = service.http.get(address, headers={"Accept-Encoding": "identity"})
    packed = service.http.get(address, headers={"Accept-Encoding": "gzip"})
    assert "Accept-Encoding" in packed.headers["vary"]
    assert packed.json() == plain.json()
    assert packed.headers["etag"] == f"W/{plain.headers['etag']}"
    for tag in (packed.headers["etag"], plain.headers["etag"]):
        assert service.http.get(address, headers={"If-None-Match": tag}).status_code == 304
    short = service.http.get("/livez", headers={"Accept-Encoding": "gzip"})
    assert "content-encoding" not in short.headers


@pytest.mark.parametrize(
    ("accepted", "packed"),
    [
        ("gzip, br", True),
        ("GZIP;q=0.5", True),
        ("*;q=0.1", True),
        ("gzip, identity", True),
        ("br, *;q=0.5, identity;q=0", True),
        ("gzip;q=0", False),
        ("gzip;q=0, *", False),
        ("*;q=0", False),
        ("br", False),
        ("gzip;q=0.5, identity;q=0.8", False),
        ("", False),
    ],
)
def test_gzip_is_sent_to_whoever_takes_it(ended: str, raw: Any, accepted: str, packed: bool) -> None:
    answer = raw(f"{API}/studies/{ended}", {"Accept-Encoding": accepted})
    assert answer.headers["content-encoding"] == ("gzip" if packed else "")
    assert answer.content.startswith(b"\x1f\x8b" if packed else b"{")
    assert answer.headers["vary"].count("Accept-Encoding") == 1


def test_what_is_sent_is_gzip(service: Service, ended: str, raw: Any) -> None:
    answer = raw(f"{API}/studies/{ended}", {"Accept-Encoding": "gzip"})
    assert answer.headers["content-encoding"] == "gzip"
    assert b'"physics_hash"' in gzip.decompress(answer.content)


@pytest.fixture
def raw(service: Service, portal: Any) -> Any:
    """Asks the application and gives the bytes that it sends."""

    def ask(address: str, headers: dict[str, str]) -> httpx.Response:
        async def send() -> httpx.Response:
            transport = httpx.ASGITransport(service.app)
            async with (
                httpx.AsyncClient(transport=transport, base_url="http://localhost") as client,
                client.stream("GET", address, headers=headers) as response,
            ):
                content = b"".join([piece async for piece in response.aiter_raw()])
            kept = [(name, value) for name, value in response.headers.items() if name != "content-encoding"]
            made = httpx.Response(response.status_code, headers=kept, content=content)
            made.headers["content-encoding"] = response.headers.get("content-encoding", "")
            return made

        return portal.call(send)

    return ask


def test_pages_name_the_next_one(service: Service, ended: str) -> None:
    service.submit()
    for address, size, name in (("/studies?", 1, "studies"), (f"/studies/{ended}/cases?ending=ok&", 4, "cases")):
        seen: list[Any] = []
        following: str | None = f"{API}{address}page_size={size}"
        while following:
            page = service.http.get(following)
            seen += page.json()[name]
            following = page.links["next"]["url"] if "next" in page.links else None
        assert seen == service.http.get(f"{API}{address}page_size=50").json()[name]
        assert len(seen) > size


def test_an_address_tells_its_methods(service: Service) -> None:
    answer = service.http.request("OPTIONS", f"{API}/studies/st_1")
    assert (answer.status_code, answer.headers["allow"]) == (204, "DELETE, GET, HEAD, OPTIONS, PATCH")
    assert service.http.request("OPTIONS", "/nothing").status_code == 404


def test_a_refusal_for_now_says_when_to_come_back(service: Service) -> None:
    from sprag_study.service.http.problems import ApiError, problem_response

    for kind in ("queue-full", "too-many-requests", "unavailable"):
        assert int(problem_response(ApiError(kind, "later")).headers["retry-after"]) > 0
    assert "retry-after" not in problem_response(ApiError("not-found", "never")).headers


@pytest.mark.parametrize("form", ["csv", "json", "parquet"])
def test_vary_is_that_of_the_address_whatever_is_asked_of_it(service: Service, ended: str, form: str) -> None:
    whole = results(service, ended, form, Accept_Encoding="gzip")
    assert {name.strip() for name in whole.headers["vary"].split(",")} == {"Accept", "Accept-Encoding"}
    for other in (
        results(service, ended, form, method="HEAD"),
        results(service, ended, form, Range="bytes=0-9"),
        results(service, ended, form, Accept_Encoding="identity"),
        results(service, ended, form, If_None_Match=whole.headers["etag"]),
    ):
        assert other.headers["vary"] == whole.headers["vary"], other.status_code
