"""Files of rows where no room is left: all rows or a refusal, never a well-formed file that lacks some."""

from __future__ import annotations

import errno
import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Any

import httpx
import pytest

from sprag_study.service.exports import netcdf
from sprag_study.service.formats import FORMATS
from sprag_study.service.http.api import results as results_of_api
from sprag_study.service.storage.rows.rows import Rows
from tests.service.conftest import API, Service
from tests.serving import served

#: Formats that are built in a folder of their own; the others can be sent without one.
BUILT = ("xlsx", "netcdf")


@pytest.fixture(autouse=True)
def _small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = Rows.blocks
    monkeypatch.setattr(Rows, "blocks", lambda self, study_id, size=2: blocks(self, study_id, size))


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """Let no file of this process grow beyond ``size`` bytes: the system refuses to write more, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def ask(service: Service, study_id: str, form: str) -> httpx.Response:
    address = f"{API}/studies/{study_id}/results?format={form}"
    return service.http.get(address, headers={"Accept-Encoding": "identity"})


@pytest.mark.parametrize("form", FORMATS)
def test_all_rows_or_a_refusal_wherever_the_disk_ends(service: Service, ended: str, form: str) -> None:
    random = Random(form)
    other = service.submit({**service.store.studies.spec(ended), "name": "whole"})
    service.fill(other)
    size = len(ask(service, other, form).content)
    whole = None
    for limit in (0, 1, *(random.randrange(size) for _ in range(8)), size - 1):
        with room_for(limit):
            answer = ask(service, ended, form)
        if form in BUILT:
            assert (answer.status_code, answer.json()["type"]) == (507, "/problems/storage-full"), limit
        else:
            assert answer.status_code == 200, answer.text
            whole = whole or answer.content
            assert answer.content == whole, limit
    kept = ask(service, ended, form)
    assert kept.status_code == 200
    assert form in BUILT or kept.content == whole


@pytest.mark.parametrize("over", [True, False], ids=["ended", "under way"])
def test_kept_files_give_way_to_what_finds_no_room(
    service: Service, ended: str, spec: dict[str, Any], over: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    wanted = ended if over else service.submit({**spec, "name": "under way"})
    service.fill(wanted, None if over else range(4))
    kept = service.app.state.context.files

    def full(folder: Path, _size: int) -> None:
        if any(path.is_file() and path.stat().st_size for path in kept._folder.iterdir()):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder))

    whole = ask(service, ended, "csv").content
    monkeypatch.setattr(netcdf, "require_room", full)
    assert ask(service, wanted, "netcdf").status_code == 200
    assert ask(service, ended, "csv").content == whole, "it is written again"
    monkeypatch.setattr(netcdf, "require_room", refuse)
    other = service.submit({**spec, "name": "other"})
    service.fill(other)
    assert ask(service, other, "netcdf").status_code == 507, "it is tried once more, not for ever"


def refuse(folder: Path, _size: int) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder))


@pytest.mark.parametrize("chunk_cases", [1_000])
def test_a_grid_is_smaller_than_the_room_it_asks_for(
    service: Service, ended: str, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """HDF5 ends its process where a write fails, so that it must never come to that."""
    asked: list[int] = []
    monkeypatch.setattr(netcdf, "require_room", lambda _folder, size: asked.append(size))
    large = service.submit({**spec, "axes": [{"path": "shaft.load", "linspace": [0.01, 0.5, 1_000]}]})
    service.fill(large)
    for study_id in (ended, large):
        assert len(ask(service, study_id, "netcdf").content) < asked.pop()


@pytest.mark.parametrize("form", FORMATS)
def test_rows_that_are_not_read_are_missed(
    service: Service, ended: str, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    read = Rows.block
    with monkeypatch.context() as patch:
        # Rows that the database lost: the third block is the last one.
        patch.setattr(
            Rows, "block", lambda self, study, after, limit: read(self, study, after if after < 5 else 99, limit)
        )
        assert ask(service, ended, form).status_code == 503
        patch.setattr(results_of_api, "_AT_ONCE", 0)  # as a large study, which is sent while it is read
        with served(service.app) as address:
            if form in (*BUILT, "parquet"):  # nothing is sent before all rows of a group are read
                assert httpx.get(f"{address}{API}/studies/{ended}/results?format={form}").status_code == 503
            else:
                with pytest.raises(httpx.RemoteProtocolError):
                    httpx.get(f"{address}{API}/studies/{ended}/results?format={form}")
    assert ask(service, ended, form).status_code == 200
