"""Settings: one table, read from the environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from pydantic import ValidationError

from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import WrongInputError
from sprag_study.service.settings import Settings, available_cores, default_database_path, shown, table

if TYPE_CHECKING:
    from pathlib import Path


def test_the_environment_sets_them(settings: Settings, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SPRAG_PORT", "81")
    monkeypatch.setenv("SPRAG_ALLOWED_HOSTS", "a.example, B.example,")
    monkeypatch.setenv("SPRAG_DATABASE", str(tmp_path / "a b.sqlite3"))
    monkeypatch.setenv("SPRAG_TOKEN", "0123456789abcdef")
    monkeypatch.setenv("SPRAG_HOST", "")
    read = Settings()
    assert (read.port, read.host) == (81, "127.0.0.1")
    assert {"a.example", "b.example", "localhost", "127.0.0.1", "[::1]"} <= read.host_names
    assert read.database_url == f"sqlite:///{tmp_path}/a b.sqlite3"
    assert "0123456789abcdef" not in repr(read)


def test_defaults_keep_to_this_machine(settings: Settings) -> None:
    plain = Settings()
    assert plain.loopback
    assert plain.database_url == f"sqlite:///{default_database_path()}"
    assert plain.pool_processes == available_cores() >= 1
    assert Settings(processes=3).pool_processes == 3
    assert Settings(units="si").reports.units == "si"
    assert Settings(database="sqlite:////x/y.db").database_url == "sqlite:////x/y.db"
    plain.require_safe()


@pytest.mark.parametrize(
    ("host", "loopback"),
    [
        ("127.0.0.1", True),
        ("127.8.8.8", True),
        ("::1", True),
        ("[::1]", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("x", False),
    ],
)
def test_loopback_is_recognised(settings: Settings, host: str, loopback: bool) -> None:
    assert settings.model_copy(update={"host": host}).loopback is loopback


@pytest.mark.parametrize(
    "wrong",
    [
        {"port": -1},
        {"user_storage": 2**43},
        {"user_cases": 2**63},
        {"port": "x"},
        {"processes": -1},
        {"chunk_timeout": 0},
        {"token": "short"},
        {"token": "0123456789 abcdef"},
        {"token": "0123456789abcdef\u00e9"},
    ],
)
def test_wrong_settings_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Settings(**wrong)  # type: ignore[arg-type]


def test_commands_say_what_is_wrong_with_a_setting(settings: Settings) -> None:
    with pytest.raises(WrongInputError) as caught:
        read_settings(token="short")
    (problem,) = caught.value.faults
    assert str(problem).startswith("SPRAG_TOKEN: a token needs at least 16 ASCII characters")


@pytest.mark.parametrize(
    ("given", "missing"),
    [
        ({"smtp_url": "smtps://mail.example"}, "SPRAG_MAIL_FROM"),
        ({"webhook_origins": "https://hooks.example"}, "SPRAG_WEBHOOK_SECRET"),
    ],
)
def test_a_setting_that_another_one_needs_is_named(settings: Settings, given: dict[str, object], missing: str) -> None:
    with pytest.raises(WrongInputError) as caught:
        read_settings(**given)
    (problem,) = caught.value.faults
    assert problem.where == missing
    assert f"SPRAG_{next(iter(given)).upper()} needs" in problem.message


def test_the_table_has_every_setting_with_its_help() -> None:
    rows = list(table())
    assert [row.variable for row in rows] == [f"SPRAG_{name.upper()}" for name in Settings.model_fields]
    assert all(row.help for row in rows)
    assert next(row.default for row in rows if row.variable == "SPRAG_HOST") == "127.0.0.1"


def test_a_file_sets_them_and_the_environment_goes_before_it(
    settings: Settings, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "sprag.toml"
    file.write_text(
        """
        port = 81
        host = "127.0.0.2"
        allowed_hosts = ["a.example"]
        keep_days = 30
        log_format = "json"
        """
    )
    monkeypatch.setenv("SPRAG_SETTINGS", str(file))
    monkeypatch.setenv("SPRAG_PORT", "82")
    read = Settings()
    assert (read.port, read.host, read.keep_days, read.log_format) == (82, "127.0.0.2", 30, "json")
    assert "a.example" in read.host_names
    assert read_settings(port=83).port == 83


@pytest.mark.parametrize(
    "text",
    ["prot = 81", "port = ", None, "port = 99999", 'token = "short"', 'zone = "Mars"', 'nightly_at = "25:00"'],
)
def test_a_wrong_file_is_told(
    settings: Settings, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str | None
) -> None:
    file = tmp_path / "sprag.toml"
    if text is not None:
        file.write_text(text)
    monkeypatch.setenv("SPRAG_SETTINGS", str(file))
    with pytest.raises(WrongInputError) as caught:
        read_settings()
    assert caught.value.code == "invalid-settings"


def test_the_names_of_time_zones_are_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    from sprag_study.service import zones

    reads: list[int] = []

    def names() -> set[str]:
        reads.append(1)
        return {"UTC", "Europe/Kyiv"}

    monkeypatch.setattr(zones, "available_timezones", names)
    zones.zones.cache_clear()
    try:
        assert (Settings(zone="UTC").zone, Settings(zone="Europe/Kyiv").zone) == ("UTC", "Europe/Kyiv")
    finally:
        zones.zones.cache_clear()
    assert len(reads) == 1


@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("postgresql://sprag:a/b:c@d@host/sprag", "postgresql://sprag:***@host/sprag"),
        ("postgresql:///sprag?user=a&password=x/y@z:1&host=/run", "postgresql:///sprag?user=a&password=***&host=/run"),
        ("postgresql://a:b@host/sprag?password=c", "postgresql://a:***@host/sprag?password=***"),
        ("postgresql://sprag@host/sprag", "postgresql://sprag@host/sprag"),
        ("sqlite:////data/a:b.sqlite3", "sqlite:////data/a:b.sqlite3"),
    ],
)
def test_no_part_of_a_password_is_shown(address: str, said: str) -> None:
    assert shown(address) == said
