"""Commands and a real service: followed and stopped; pipes and signals, where a command is a process of its own."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
from collections.abc import Callable
from itertools import product
from pathlib import Path

import pytest
from pydantic import SecretStr

from benchmarks.faults.harness import with_tables
from sprag_study.service.http.app import create_app
from sprag_study.service.settings import Settings
from tests.acceptance import processes
from tests.acceptance.processes import COMMAND, EXAMPLES, INTERRUPTIBLE, SECONDS, Service, environment
from tests.conftest import Finished
from tests.service.conftest import InThread
from tests.serving import served

Sprag = Callable[..., Finished]

SPEC = EXAMPLES / "one_pendulum.json"
SMALL = EXAMPLES / "measured_clutch.json"


def test_a_study_from_submission_to_picture(running: Service, tmp_path: Path, sprag: Sprag) -> None:
    at = ("--server", running.address)
    submitted = sprag("submit", SMALL, *at)
    assert submitted.code == 0
    study = submitted.out.strip()
    watched = sprag("study", "watch", study, *at)
    assert watched.code == 0
    assert "17 of 17 cases done, 17 ok" in watched.err
    assert watched.out.strip() == study
    assert study in [item["id"] for item in sprag("list", "--json", *at).data["studies"]]
    assert study in sprag("list", "--state", "finished", *at).out
    assert study not in sprag("list", "--state", "running", *at).out

    picture = tmp_path / "curve.svg"
    curve = ("curve", study, "--x", "shaft.load", "--y", "shaft.speed.mean", "--y", "efficiency", *at)
    shown = sprag(*curve, "-o", picture)
    assert shown.code == 0
    assert "\tshaft.speed.mean\t" in shown.out
    assert len([line for line in shown.out.splitlines() if line.strip()[:1].isdigit()]) == 17
    assert "<svg" in picture.read_text()
    data = sprag(*curve, "--json").data
    assert data["x"]["values"][0] == 0.0
    assert len(data["curves"][0]["y"]["efficiency"]) == 17

    for name in ("rows.csv", "rows.json"):
        file = tmp_path / name
        assert sprag("export", study, "-o", file, *at).code == 0
        assert sprag("export", study, "--format", name[5:], *at).out.encode() == file.read_bytes()
    assert json.loads((tmp_path / "rows.json").read_text())["rows"][3]["case"] == 3


def test_points_of_a_file_are_run_here_and_by_the_service(running: Service, tmp_path: Path, sprag: Sprag) -> None:
    at = ("--server", running.address)
    points = tmp_path / "points.csv"
    points.write_text("shaft.load;excitation.frequency [rpm]\n250 N*mm;1500\n0;1560\n")
    here = sprag("run", SPEC, "--points", points, "--json")
    assert here.code == 0
    rows = here.data["rows"]
    assert [tuple(row["parameters"].values()) for row in rows] == [(0.25, 25.0), (0.0, 26.0)]
    submitted = sprag("submit", SPEC, "--points", points, "--wait", "--json", *at)
    assert submitted.code == 0
    assert sprag("export", submitted.data["id"], "--json", *at).data["rows"] == rows
    points.write_text("shaft.load;excitation.frequency [rpm]\n250 N*mm;1500\n-1 N*m;1560\n")
    refused = sprag("submit", SPEC, "--points", points, *at)
    assert refused.code == 2
    assert f"{points}: line 3, column shaft.load: is out of range (got '-1 N*m'; allowed: >= 0 N*m" in refused.err


def test_the_same_key_submits_once(running: Service, sprag: Sprag) -> None:
    arguments = ("submit", SMALL, "--key", "once", "--json", "--server", running.address)
    assert sprag(*arguments).data["id"] == sprag(*arguments).data["id"]
    other = sprag("submit", EXAMPLES / "two_pendulums.toml", "--key", "once", "--server", running.address)
    assert other.code == 2


def test_a_study_is_held_and_cancelled(running: Service, tmp_path: Path, sprag: Sprag) -> None:
    at = ("--server", running.address, "--json")
    spec = json.loads(SPEC.read_text())
    spec["run"] = {"duration": "20000 periods", "window": ["40 periods", "60 periods"]}
    long = tmp_path / "long.json"
    long.write_text(json.dumps(spec))
    study = sprag("submit", long, *at).data["id"]
    assert sprag("study", "pause", study, *at).data["state"] == "paused"
    assert sprag("study", "resume", study, *at).data["state"] in ("queued", "running")
    assert sprag("study", "cancel", study, *at).data["state"] in ("cancelling", "cancelled")
    watched = sprag("study", "watch", study, *at)
    assert watched.code == 4
    assert watched.data["state"] == "cancelled"


def test_nobody_at_the_address_is_said_in_one_sentence(sprag: Sprag) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))  # bound but not listening: nobody answers, and nobody else can begin to
        address = f"http://127.0.0.1:{taken.getsockname()[1]}"
        for arguments in (("list",), ("study", "watch", "st_1"), ("submit", SMALL)):
            done = sprag(*arguments, "--server", address)
            assert done.code == 3
            assert done.err.count("\n") == 1
            assert address in done.err
            assert "`sprag serve`" in done.err


@pytest.mark.parametrize("address", ["nonsense", "ftp://127.0.0.1", "http://", "http://[", "http://127.0.0.1:99999999"])
def test_no_address(address: str, sprag: Sprag) -> None:
    assert sprag("list", "--server", address).code in (2, 3)


def test_a_service_that_others_could_reach_needs_a_token(tmp_path: Path, sprag: Sprag) -> None:
    done = sprag("serve", "--host", "0.0.0.0", "--port", "0", "--db", tmp_path / "x.sqlite3")
    assert done.code == 2
    assert "SPRAG_TOKEN" in done.err


def test_a_port_that_is_taken(running: Service, tmp_path: Path, sprag: Sprag) -> None:
    port = running.address.rpartition(":")[2]
    done = sprag("serve", "--port", port, "--db", with_tables(tmp_path / "x.sqlite3"))
    assert done.code == 3
    assert port in done.err


def test_wrong_settings_are_told_together(sprag: Sprag, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPRAG_PORT", "x")
    monkeypatch.setenv("SPRAG_PROCESSES", "-1")
    done = sprag("serve")
    assert done.code == 2
    assert "SPRAG_PORT" in done.err
    assert "SPRAG_PROCESSES" in done.err


def test_a_database_that_is_none(tmp_path: Path, sprag: Sprag) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("not a database, but long enough to be looked at as one" * 100)
    for arguments in (("run", SMALL, "--db", file), ("db", "upgrade", "--db", file), ("db", "check", "--db", file)):
        done = sprag(*arguments)
        assert done.code == 3, arguments
        assert "bug in Sprag" not in done.err
    assert sprag("run", SMALL, "--db", "postgresql://localhost/x").code == 3


def test_a_run_kept_in_a_database_is_found_there_by_whoever_has_the_token(
    tmp_path: Path, sprag: Sprag, monkeypatch: pytest.MonkeyPatch
) -> None:
    database = tmp_path / "study.sqlite3"
    done = sprag("run", SMALL, "--db", database, "--json", "--processes", 1)
    assert done.code == 0
    assert sprag("admin", "db", "check", "--db", database).code == 0
    copy = tmp_path / "copy.sqlite3"
    assert sprag("admin", "db", "backup", copy, "--db", database).code == 0
    assert sprag("admin", "db", "backup", copy, "--db", database).code == 2
    assert sprag("admin", "db", "upgrade", "--db", copy, "--json").data["before"] is not None
    assert "already at revision" in sprag("admin", "db", "upgrade", "--db", copy).out
    token = sprag("admin", "token").out.strip()
    app = create_app(
        Settings(database=str(copy), token=SecretStr(token)), computer=InThread(), checker=InThread(), writer=InThread()
    )
    with served(app) as address:
        refused = sprag("list", "--server", address)
        assert refused.code == 3
        assert "token" in refused.err.lower()
        monkeypatch.setenv("SPRAG_TOKEN", token)
        rows = sprag("export", done.data["study"], "--json", "--server", address)
    assert rows.data["rows"] == done.data["rows"]


def test_a_worker_alone_runs_what_a_service_was_given(tmp_path: Path, sprag: Sprag) -> None:
    database = tmp_path / "study.sqlite3"
    assert sprag("admin", "db", "upgrade", "--db", database).code == 0
    worker = subprocess.Popen(
        [*COMMAND, "admin", "worker", "--db", str(database)],
        stderr=subprocess.PIPE,
        env=environment(SPRAG_PROCESSES="1"),
    )
    assert worker.stderr is not None
    with worker, worker.stderr as said:
        try:
            assert b"is working on" in said.readline()
            # This process finds the database's lock taken, and leaves the study to the worker.
            done = sprag("run", SMALL, "--db", database, "--json")
            worker.send_signal(signal.SIGTERM)
            assert worker.wait(SECONDS) == 0
        finally:
            worker.kill()  # one that goes on would be waited for without end
    assert done.code == 0
    assert len(done.data["rows"]) == 17


def test_a_reader_that_goes_away_is_no_failure_to_talk_about(tmp_path: Path) -> None:
    short = tmp_path / "short.json"  # but with more rows than a pipe holds; so few cases need no pool
    axes = [{"path": "shaft.load", "linspace": ["0 N*m", "0.5 N*m", 120]}]
    short.write_text(json.dumps(json.loads(SPEC.read_text()) | {"run": {"duration": "12 periods"}, "axes": axes}))
    with subprocess.Popen(
        [*COMMAND, "run", str(short)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment(),
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline().startswith(b"case,")
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(SECONDS) == 141


#: Commands that write with each of the ways to write: tables, plain text, JSON, click's help; and each way to have no
#: reader. What a service does where nobody reads its address does not depend on the way.
WITHOUT_READER = [
    *product(("presets", "admin token", "presets --json", "run --help"), (">&-", ">&- <&-", "| true")),
    ("serve --json --port 0 --db x.sqlite3", ">&- <&-"),
]


@pytest.mark.parametrize(("command", "redirection"), WITHOUT_READER)
def test_a_closed_standard_output_ends_quietly(tmp_path: Path, command: str, redirection: str) -> None:
    script = f'{{ "$@"; echo $? >code; }} 2>said {redirection}'
    done = subprocess.run(
        ["sh", "-c", script, "sh", *COMMAND, *command.split()],
        cwd=tmp_path, env=environment(SPRAG_PROCESSES="1"), timeout=SECONDS, check=False,
    )  # fmt: skip
    assert done.returncode in (0, 2)  # that of true, or of the shell that cannot close what is closed
    assert ((tmp_path / "said").read_text(), (tmp_path / "code").read_text()) == ("", "141\n")


def test_files_do_not_get_the_number_of_a_closed_stream() -> None:
    """What is said would otherwise be written into the database."""
    command = [*COMMAND, "presets", "none"]
    for redirection in ("2>&-", "<&- >&- 2>&-"):
        done = subprocess.run(
            ["sh", "-c", f'"$@" {redirection}', "sh", *command],
            stdout=subprocess.PIPE, env=environment(), timeout=SECONDS, check=False,
        )  # fmt: skip
        assert (done.returncode, done.stdout) == (2, b"")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_nothing_behind(tmp_path: Path, number: signal.Signals) -> None:
    spec = json.loads(SPEC.read_text())
    spec["run"] = {"duration": "100000 periods"}
    long = tmp_path / "long.json"
    long.write_text(json.dumps(spec))
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    with subprocess.Popen(
        [*INTERRUPTIBLE, "run", str(long), "--processes", "1", "-o", str(tmp_path / "rows.csv")],
        stderr=subprocess.PIPE,
        env=environment(TMPDIR=str(temporary)),
    ) as process:
        assert process.stderr is not None
        while not list(temporary.rglob("*.sqlite3")):
            with pytest.raises(subprocess.TimeoutExpired):  # it is still at work
                process.wait(0.05)
        process.send_signal(number)
        said = process.stderr.read()
        assert process.wait(SECONDS) == 130
    assert said == b"interrupted\n"
    assert list(temporary.iterdir()) == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["long.json", "tmp"]


@pytest.mark.parametrize(("command", "number"), [("submit", signal.SIGINT), ("watch", signal.SIGHUP)])
def test_an_interrupt_of_a_command_that_follows_names_the_study_that_goes_on(
    running: Service, tmp_path: Path, sprag: Sprag, command: str, number: signal.Signals
) -> None:
    at = ("--server", running.address)
    spec = {**json.loads(SPEC.read_text()), "run": {"duration": "1000000 periods"}}
    long = tmp_path / "long.json"
    long.write_text(json.dumps(spec))
    if command == "watch":
        study = sprag("submit", long, *at).out.strip()
        arguments = ["study", "watch", study, *at]
    else:
        study, arguments = "", ["submit", str(long), "--wait", "--key", str(tmp_path), *at]
    with subprocess.Popen([*INTERRUPTIBLE, *arguments], stderr=subprocess.PIPE, env=environment()) as process:
        assert process.stderr is not None
        study = study or sprag("submit", long, "--key", str(tmp_path), *at).out.strip()
        # A pause shows that the command follows the study.
        assert sprag("study", "pause", study, *at).code == 0
        lines = iter(process.stderr.readline, b"")
        assert any(b"is paused" in line for line in lines)
        assert sprag("study", "resume", study, *at).code == 0
        process.send_signal(number)
        said = process.stderr.read().decode()
        assert process.wait(SECONDS) == 130
    assert "interrupted" in said.splitlines()
    assert f"{study} continues" in said
    assert f"sprag study cancel {study}" in said
    state = json.loads(sprag("list", "--json", *at).out)
    assert {item["id"]: item["state"] for item in state["studies"]}[study] in ("queued", "running")
    assert sprag("study", "cancel", study, *at).code == 0


def test_a_full_disk_is_storage_trouble(sprag: Sprag) -> None:
    if not os.path.exists("/dev/full"):  # only Linux has it
        return
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [*COMMAND, "presets"], stdout=full, stderr=subprocess.PIPE, env=environment(), timeout=SECONDS, check=False
        )
    assert done.returncode == 3
    assert b"no space left" in done.stderr
    assert sprag("run", SMALL, "--processes", 1, "-o", "/dev/full").code == 3


def test_specs_and_data_come_through_standard_input(sprag: Sprag, monkeypatch: pytest.MonkeyPatch) -> None:
    with (EXAMPLES / "two_pendulums.toml").open() as spec, (EXAMPLES / "clutch_measured.csv").open() as measured:
        monkeypatch.setattr("sys.stdin", spec)
        assert sprag("check", "-").code == 0
        monkeypatch.setattr("sys.stdin", measured)
        assert sprag("fit", "-", "--accuracy", "0.05", "--json").data["degree"] == 3


def test_output_for_a_terminal_of_another_character_set() -> None:
    shown = processes.sprag("--help", PYTHONIOENCODING="ascii", SPRAG_LANGUAGE="uk")
    assert (shown.code, shown.out.decode().startswith("Використання: ")) == (0, True)


def test_doctor_finds_the_installation_sound(tmp_path: Path, sprag: Sprag) -> None:
    done = sprag("admin", "doctor", "--json", "--db", tmp_path / "x.sqlite3")
    assert done.code == 0, done.data
    assert done.data["sound"] is True
    assert {
        "versions",
        "SQLite",
        "database",
        "rights",
        "disk",
        "backups",
        "alerts",
        "clock",
        "workers",
        "schedules",
        "service of commands",
        "kernel cache",
        "engine",
    } == {finding["subject"] for finding in done.data["findings"]}


def test_doctor_names_files_that_others_may_read(tmp_path: Path, sprag: Sprag) -> None:
    file = tmp_path / "x.sqlite3"
    assert sprag("admin", "db", "upgrade", "--db", file).code == 0
    file.chmod(0o640)
    done = sprag("admin", "doctor", "--db", file)
    assert done.code == 3
    assert f"others can read {file}: `chmod 600`" in done.out


def test_doctor_finds_a_database_of_another_program(tmp_path: Path, sprag: Sprag) -> None:
    file = tmp_path / "x.sqlite3"
    file.write_text("no database at all" * 1000)
    done = sprag("admin", "doctor", "--db", file)
    assert done.code == 3
    assert "WRONG" in done.out
