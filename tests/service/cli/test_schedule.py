"""``sprag schedule`` against a service in the same process."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from sprag.service.cli.app import execute
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from pathlib import Path

    from tests.service.conftest import Service

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(service: Service, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs a command; exit code, standard output, standard error."""
    from sprag.service import client

    class Connected(client.ServiceClient):
        def __init__(self, server: str, token: str | None = None) -> None:
            super().__init__(server, token)
            self._http.close()
            self._http = service.http

        def __exit__(self, *_: object) -> None:
            """The test goes on with it."""

    monkeypatch.setattr(client, "ServiceClient", Connected)

    def execute_and_read(*arguments: str) -> tuple[int, str, str]:
        code = execute(["schedule", *arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return execute_and_read


@pytest.fixture
def spec_file(tmp_path: Path) -> str:
    file = tmp_path / "spec.json"
    file.write_text(json.dumps(SPEC))
    return str(file)


def test_a_schedule_is_kept_shown_changed_and_deleted(run: Run, service: Service, spec_file: str) -> None:
    options = ("--cron", "0 22 * * 1-5", "--zone", "Europe/Berlin", "--window", "22:00-06:00", "--name", "nightly")
    code, out, err = run("add", spec_file, *options, "--priority", "5", "--fresh")
    assert code == 0, err
    name = out.strip()
    assert "nightly: 0 22 * * 1-5 (Europe/Berlin), between 22:00 and 06:00 only; next run: 20" in err
    kept = service.get(f"/schedules/{name}")
    assert (kept["priority"], kept["fresh"], kept["window"], kept["spec"]) == (5, True, ["22:00", "06:00"], SPEC)
    assert name in run("list")[1]
    assert json.loads(run("list", "--json")[1])["schedules"][0]["id"] == name
    assert run("disable", name)[2].endswith("next run: disabled\n")
    assert service.get(f"/schedules/{name}")["next_due"] is None
    assert run("enable", name)[0] == 0
    assert run("change", name, "--at", "2099-01-31T22:00", "--window", "", "--no-fresh")[0] == 0
    changed = service.get(f"/schedules/{name}")
    assert (changed["cron"], changed["window"], changed["fresh"]) == (None, None, False)
    assert changed["next_due"] == "2099-01-31T21:00:00Z"
    assert "next run: 2099" in run("show", name)[2]
    assert json.loads(run("show", name, "--json")[1])["spec"] == SPEC
    assert run("delete", name)[0] == 0
    assert service.get("/schedules") == {"schedules": []}


def test_what_is_wrong_is_told_by_field(run: Run, spec_file: str) -> None:
    for arguments, where, told in (
        ([], "/cron", "exactly-one"),
        (["--cron", "0 1 * * *", "--window", "night"], "--window", "invalid-text"),
    ):
        code, _, err = run("add", spec_file, *arguments, "--json")
        assert (code, [(item["pointer"], item["code"]) for item in json.loads(err)["problems"]]) == (2, [(where, told)])
    assert run("change", "sc_0")[0] == 2
    code, _, err = run("disable", "sc_0", "--json")
    assert (code, json.loads(err)["code"]) == (2, "schedule-not-found")
