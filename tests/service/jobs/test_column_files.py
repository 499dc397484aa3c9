"""Columns of ended studies in files: what is read back, what goes first, damage, and reading them ahead."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.http import read_ahead as ahead
from sprag_study.service.http.read_ahead import read_ahead
from sprag_study.service.storage.rows.columns import RowColumns
from sprag_study.service.views import columns as module
from sprag_study.service.views import explore
from sprag_study.service.views.columns import ColumnFiles, Columns
from sprag_study.worker.pool.child_pool import JobStoppedError
from sprag_study.worker.states import StudyState
from tests.service.conftest import Service

KINDS = (("ok", ""), ("chatter", "late,odd"))


def rows(count: int, *names: str) -> RowColumns:
    """Made-up columns of so many cases."""
    draw = np.random.default_rng(count)
    values = {name: draw.normal(size=count) for name in names}
    return RowColumns(np.arange(count), KINDS, draw.integers(0, 2, count, dtype=np.int32), values)


def same(one: RowColumns, other: RowColumns) -> bool:
    arrays = [np.array_equal(one.cases, other.cases), np.array_equal(one.kind, other.kind), one.kinds == other.kinds]
    return all(arrays) and all(
        np.array_equal(one.values[name], other.values[name], equal_nan=True) for name in other.values
    )


def test_columns_are_read_back_and_further_ones_added(tmp_path: Path) -> None:
    files, first = ColumnFiles(tmp_path / "columns"), rows(50, "a", "b")
    assert files.read("one", ["a"]) == (None, ["a"])
    files.write("one", first)
    found, missing = files.read("one", ["a", "c"])
    assert found is not None
    assert (set(found.values), missing) == ({"a"}, ["c"])
    third = RowColumns(first.cases, KINDS, first.kind, {"c": np.linspace(0.0, 1.0, 50)})
    ColumnFiles(tmp_path / "columns").write("one", third)
    found, missing = files.read("one", ["a", "b", "c"])
    assert found is not None
    assert not missing
    assert same(found, first)
    assert same(found, third)
    assert [path.name for path in (tmp_path / "columns").iterdir()] == ["one"]  # nothing half written is left


@pytest.mark.parametrize("file", ["case.npy", "a.npy", "kinds.json"])
def test_damaged_files_are_deleted_and_written_anew(tmp_path: Path, file: str) -> None:
    files, whole = ColumnFiles(tmp_path), rows(50, "a")
    files.write("one", whole)
    damaged = tmp_path / "one" / file
    damaged.write_bytes(damaged.read_bytes()[:-9])
    assert files.read("one", ["a"]) == (None, ["a"])
    files.write("one", whole)
    found, _ = files.read("one", ["a"])
    assert found is not None
    assert same(found, whole)


@pytest.mark.parametrize("content", [b"", None])
@pytest.mark.parametrize("file", ["case.npy", "kind.npy", "a.npy"])
def test_empty_files_and_those_of_another_length_are_deleted(tmp_path: Path, file: str, content: bytes | None) -> None:
    files = ColumnFiles(tmp_path)
    files.write("one", rows(50, "a"))
    if content is None:
        np.save(tmp_path / "one" / file, np.zeros(49))
    else:
        (tmp_path / "one" / file).write_bytes(content)
    assert files.read("one", ["a"]) == (None, ["a"])


def test_kinds_that_are_no_list_are_deleted(tmp_path: Path) -> None:
    files = ColumnFiles(tmp_path)
    files.write("one", rows(50, "a"))
    (tmp_path / "one" / "kinds.json").write_text("7")
    assert files.read("one", ["a"]) == (None, ["a"])


def test_the_least_recently_used_studies_are_deleted_beyond_the_limit(tmp_path: Path) -> None:
    files = ColumnFiles(tmp_path, most=3_000)
    for place, key in enumerate(("one", "two")):
        files.write(key, rows(50, "a"))
        os.utime(tmp_path / key, (place, place))
    files.read("one", ["a"])  # now the latest
    files.write("three", rows(50, "a"))
    assert {path.name for path in tmp_path.iterdir()} == {"one", "three"}


def test_a_folder_that_cannot_be_written_is_no_failure(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    files = ColumnFiles(tmp_path / "file" / "columns")
    files.write("one", rows(5, "a"))
    assert files.read("one", ["a"]) == (None, ["a"])


def test_an_ended_study_is_read_once_until_it_has_run_again(
    service: Service, spec: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LARGE", 5)
    study_id = service.submit(spec)
    service.fill(study_id)
    reads, read = list[list[str]](), service.store.rows.columns

    def counting(study: str, names: list[str]) -> RowColumns:
        reads.append(list(names))
        return read(study, names)

    monkeypatch.setattr(service.store.rows, "columns", counting)
    first = Columns(service.store, ColumnFiles(tmp_path / "columns")).of(study_id, ["efficiency"])
    again = Columns(service.store, ColumnFiles(tmp_path / "columns")).of(study_id, ["efficiency", "torque.mean"])
    assert same(again, first)
    assert same(again, read(study_id, ["efficiency", "torque.mean"]))
    assert reads == [["efficiency"], ["torque.mean"]]
    record = service.store.studies.get(study_id)
    assert record.state is StudyState.FINISHED
    assert [path.name.split("-")[0] for path in (tmp_path / "columns").iterdir()] == [study_id]


def test_columns_are_read_ahead_once_a_study_has_ended(
    service: Service, spec: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, portal: BlockingPortal
) -> None:
    context = service.app.state.context
    monkeypatch.setattr(module, "LARGE", 5)
    columns = Columns(service.store, ColumnFiles(tmp_path / "columns"))
    monkeypatch.setattr(context.library, "columns", columns)
    study_id = service.submit(spec)
    service.fill(study_id, range(6))
    assert columns.waiting() == []  # it still runs
    service.fill(study_id)
    assert columns.waiting() == [study_id]
    portal.call(read_ahead, context, set[str]())
    assert columns.waiting() == []
    monkeypatch.setattr(service.store.rows, "columns", None)  # nothing reads the database any more
    explore.explored(context.library, study_id, explore.ExploreQuery())


def test_a_study_whose_columns_cannot_be_read_does_not_keep_others_waiting(
    service: Service, monkeypatch: pytest.MonkeyPatch, portal: BlockingPortal
) -> None:
    context, asked, tried = service.app.state.context, list[str](), set[str]()

    async def run(_function: object, _library: object, study_id: str) -> None:
        asked.append(study_id)
        if study_id == "st_bad":
            raise JobStoppedError

    monkeypatch.setattr(context.library.columns, "waiting", lambda: ["st_bad", "st_good"])
    monkeypatch.setattr(context.checker, "run", run)
    for _ in range(2):
        portal.call(read_ahead, context, tried)
    assert asked == ["st_bad", "st_good"]


def test_reading_ahead_goes_on_after_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    turns = iter([ValueError("a fault of the program"), asyncio.CancelledError()])

    async def fail(*_: object) -> None:
        raise next(turns)

    monkeypatch.setattr(ahead, "read_ahead", fail)
    monkeypatch.setattr(ahead, "LOOK_SECONDS", 0.0)
    with pytest.raises(asyncio.CancelledError):
        asyncio.run(ahead.keep_reading_ahead(cast("Any", None)))
