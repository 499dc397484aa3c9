"""Whether a database in a file has changed is noticed without reading it."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from sprag_study.service.storage.database import file_news
from sprag_study.service.storage.database.file_news import FileNews
from sprag_study.service.storage.store import Store
from sprag_study.worker.chunking import Chunking
from tests.worker import fakes


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with Store.open(f"sqlite:///{tmp_path / 'a.sqlite3'}", chunking=Chunking(cases=4)) as store:
        yield store


@pytest.fixture
def news(store: Store, monkeypatch: pytest.MonkeyPatch) -> Iterator[FileNews]:
    monkeypatch.setattr(file_news, "LEAST_SECONDS", 0.0)
    news = store.session.news()
    assert isinstance(news, FileNews)
    yield news
    news.close()


def test_every_commit_of_another_connection_is_reported_once(store: Store, news: FileNews) -> None:
    assert news.wait(0.0)  # whatever was there before
    assert not news.wait(0.0)
    store.work.take_over("test")
    assert news.wait(0.0)
    assert not news.wait(0.0)
    assert store.work.active_studies() == []  # reading changes nothing
    assert not news.wait(0.0)
    store.studies.create({}, fakes.study(4), fresh=True)
    assert news.wait(0.0)


def test_a_change_while_it_waits_is_reported(store: Store, news: FileNews, monkeypatch: pytest.MonkeyPatch) -> None:
    assert news.wait(0.0)
    waited: list[float] = []

    def rest(seconds: float) -> None:
        waited.append(seconds)
        store.work.take_over("test")

    monkeypatch.setattr("sprag_study.service.storage.database.file_news.time.sleep", rest)
    assert news.wait(0.5)
    assert waited == [0.5]


def test_changes_are_reported_so_often_and_none_is_lost(
    store: Store, news: FileNews, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = 0.0
    monkeypatch.setattr("sprag_study.service.storage.database.file_news.time.monotonic", lambda: now)
    monkeypatch.setattr(file_news, "LEAST_SECONDS", 1.0)
    assert news.wait(0.0)
    store.work.take_over("test")
    assert not news.wait(0.0)
    now = 1.0
    assert news.wait(0.0)


def test_an_absent_file_is_news_and_is_not_created(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_news, "LEAST_SECONDS", 0.0)
    news = FileNews(tmp_path / "gone.sqlite3")
    assert news.wait(0.0)
    assert news.wait(0.0)
    assert not (tmp_path / "gone.sqlite3").exists()
    news.close()
