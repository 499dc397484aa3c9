"""``sprag schedule`` against a service in the same process."""

from __future__ import annotations

import json
from datetime import timedelta
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.schedules.policies import DueTime
from tests.service.schedule_command import Run, runner
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from pathlib import Path

    from tests.service.conftest import Service


@pytest.fixture
def run(service: Service, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    return runner(service, monkeypatch, capsys)


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
    assert run("pause", name)[2].endswith("next run: paused\n")
    assert service.get(f"/schedules/{name}")["next_due"] is None
    assert run("resume", name)[0] == 0
    err = run("pause", name, "--until", "2098-12-31T12:00")[2]
    assert "next run: paused until 2098-12-31 12:00 +01:00; 2098-12-31 22:00 +01:00\n" in err
    assert run("resume", name)[0] == 0
    assert service.get(f"/schedules/{name}")["paused_until"] is None
    policies = ("--overlap", "skip", "--catch-up", "all", "--misfire-grace", "30 min")
    assert run("change", name, *policies)[0] == 0
    changed = service.get(f"/schedules/{name}")
    assert (changed["overlap"], changed["catch_up"], changed["misfire_grace"]) == ("skip", "all", "30 min")
    assert run("change", name, "--misfire-grace", "")[0] == 0
    assert service.get(f"/schedules/{name}")["misfire_grace"] is None
    assert run("change", name, "--at", "2099-01-31T22:00", "--window", "", "--no-fresh")[0] == 0
    changed = service.get(f"/schedules/{name}")
    assert (changed["cron"], changed["window"], changed["fresh"]) == (None, None, False)
    assert changed["next_due"] == "2099-01-31T21:00:00.000000Z"
    assert "next run: 2099" in run("show", name)[2]
    assert json.loads(run("show", name, "--json")[1])["spec"] == SPEC
    assert run("delete", name)[0] == 0
    assert service.get("/schedules") == {"off": None, "schedules": []}


def test_what_is_wrong_is_told_by_field(run: Run, spec_file: str) -> None:
    for arguments, where, told in (
        ([], "/cron", "exactly-one"),
        (["--cron", "0 1 * * *", "--window", "night"], "--window", "invalid-text"),
    ):
        code, _, err = run("add", spec_file, *arguments, "--json")
        assert (code, [(item["pointer"], item["code"]) for item in json.loads(err)["problems"]]) == (2, [(where, told)])
    assert run("change", "sc_0")[0] == 2
    code, _, err = run("pause", "sc_0", "--json")
    assert (code, json.loads(err)["code"]) == (2, "schedule-not-found")


def test_the_last_night_is_a_table_and_an_exit_code(run: Run, service: Service, spec_file: str) -> None:
    assert run("night")[0] == 0
    name = run("add", spec_file, "--cron", "* * * * *", "--misfire-grace", "1 s", "--name", "odd")[1].strip()
    record = service.store.schedules.get(name)
    now = service.store.clock.now()
    assert service.store.runs.take_due(record, [DueTime(now - timedelta(hours=1), too_late=True)], None, now)
    code, out, _ = run("night", "--hours", "2")
    assert code == 4
    assert "Missed: No worker was running" in out.replace("\n", " ")
    assert json.loads(run("night", "--json")[1])["trouble"] == 1
    assert run("night", "--hours", "0")[0] == 2


def test_recipients_are_options(run: Run, service: Service, spec_file: str) -> None:
    """No mail is sent here, so that they are refused by the service."""
    options = ("--email", "dora@example.com", "--webhook", "https://hooks.example/", "--report", "trouble")
    code, _, err = run("add", spec_file, "--cron", "@daily", *options, "--json")
    assert (code, [item["pointer"] for item in json.loads(err)["problems"]]) == (
        2,
        ["/report_email", "/report_webhook"],
    )
    name = run("add", spec_file, "--cron", "@daily", "--report", "trouble")[1].strip()
    assert service.get(f"/schedules/{name}")["report_when"] == "trouble"
    assert run("change", name, "--email", "", "--webhook", "", "--report", "always")[0] == 0
    found = service.get(f"/schedules/{name}")
    assert (found["report_email"], found["report_webhook"], found["report_when"]) == ([], None, "always")


def test_a_schedule_is_named_as_a_study_is(run: Run, service: Service, spec_file: str) -> None:
    ids = {}
    for name in ("nightly", "nightly press", "weekly"):
        ids[name] = run("add", spec_file, "--cron", "@daily", "--name", name)[1].strip()
    shown = {text: run("show", text, "--json") for text in ("nightly", "week", ids["weekly"], ids["weekly"][:-1])}
    names = [json.loads(out)["name"] for _, out, _ in shown.values()]
    assert names == ["nightly", "weekly", "weekly", "weekly"]
    code, _, err = run("pause", "night", "--json")
    (problem,) = json.loads(err)["problems"]
    assert (code, problem["code"], problem["message"]) == (2, "ambiguous", "fits several schedules")
    assert ids["nightly"] in problem["allowed"]
    code, _, err = run("show", " ", "--json")
    assert (code, json.loads(err)["problems"][0]["code"]) == (2, "required")
    assert run("pause", "week")[0] == 0
    assert run("delete", "nightly p")[0] == 0
    kept = {found["id"]: found["enabled"] for found in service.get("/schedules")["schedules"]}
    assert kept == {ids["weekly"]: False, ids["nightly"]: True}
    code, _, err = run("show", "none")
    assert code == 2
    assert "none" in err


def test_the_list_of_a_copied_database_says_that_its_schedules_are_off(
    run: Run, service: Service, spec_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert run("add", spec_file, "--cron", "@daily")[0] == 0
    assert "is a copy" not in run("list")[2]
    assert (run("night")[0], "is a copy" in run("night")[2]) == (0, False)
    monkeypatch.setattr(service.store.deployment, "is_copy", lambda: True)
    assert "This database is a copy, or was moved: its schedules are off" in run("list")[2]
    assert "This database is a copy" in json.loads(run("list", "--json")[1])["off"]
    assert run("night")[0] == 4
    assert "This database is a copy, or was moved: its schedules are off" in run("night")[2]
