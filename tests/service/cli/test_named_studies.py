"""Studies named by people, and the commands about one case, several studies, and the settings."""

from __future__ import annotations

import csv
import io
import json
import re
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from anyio.from_thread import BlockingPortal
from rich.cells import cell_len

from sprag_study.service import client as clients
from sprag_study.service.cli.app import execute
from sprag_study.service.cli.console import WrongInputError
from sprag_study.service.cli.names import study_of
from sprag_study.service.client import Client
from sprag_study.service.client.synchronous import naming
from sprag_study.service.settings import default_database_path
from sprag_study.worker.models import cache_folder
from tests.service.conftest import PortalTransport, Service

Sprag = Callable[..., Any]
API = "/api/v1"


@pytest.fixture
def here(service: Service, portal: BlockingPortal, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands ask the service of the test."""
    transport = PortalTransport(service.app, portal)
    monkeypatch.setattr(clients, "Client", partial(Client, transport=transport))


def submit(service: Service, spec: dict[str, Any], name: str) -> str:
    return service.submit({**spec, "name": name})


def test_what_names_a_study(service: Service, portal: BlockingPortal, spec: dict[str, Any]) -> None:
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert study_of(client, "latest") == "latest", "there is none"
        first, second = submit(service, spec, "Feeder, slow"), submit(service, spec, "Feeder, fast")
        for text, meant in (
            (first, first),
            ("latest", second),
            ("Feeder, slow", first),
            ("feeder, f", second),
            (second[:-2] if first[:-2] != second[:-2] else second, second),
            (first[3:-1] if first[3:-1] != second[3:-1] else first, first),
            ("st_0123456789abcdef", "st_0123456789abcdef"),
            ("nothing", "nothing"),
        ):
            assert study_of(client, text) == meant, text
        for nothing in ("", " "):
            with pytest.raises(WrongInputError) as empty:
                study_of(client, nothing)
            assert [(fault.where, fault.code) for fault in empty.value.faults] == [("ID", "required")]
            with pytest.raises(ValueError, match="an id or name"):
                naming.study_of(client, nothing)
        third = submit(service, spec, "Feeder")
        assert study_of(client, "Feeder") == third, "a whole name precedes the beginning of others"
        with pytest.raises(Exception, match="not unique") as caught:
            study_of(client, "feeder,")
        (fault,) = caught.value.faults  # type: ignore[attr-defined]
        assert fault.code == "ambiguous"
        assert first in str(fault.allowed)
        assert second in str(fault.allowed)


def test_an_unknown_name_is_refused_by_the_service(service: Service, sprag: Sprag, here: None) -> None:
    done = sprag("study", "cancel", "nothing")
    assert done.code == 2
    assert "nothing" in done.err


def test_a_study_is_deleted_after_asking(service: Service, sprag: Sprag, here: None, spec: dict[str, Any]) -> None:
    study_id = submit(service, spec, "old")
    done = sprag("study", "delete", "old", "--yes")
    assert (done.code, service.http.get(f"{API}/studies/{study_id}").status_code) == (2, 200), "it has not ended"
    service.fill(study_id)
    done = sprag("study", "delete", "old", "--json")
    assert done.code == 2
    assert json.loads(done.err)["problems"][0]["code"] == "required", "nobody can be asked here"
    assert service.http.get(f"{API}/studies/{study_id}").status_code == 200
    done = sprag("study", "delete", "old", "--yes", "--json")
    assert (done.code, json.loads(done.out)) == (0, {"deleted": study_id})
    assert service.http.get(f"{API}/studies/{study_id}").status_code == 404


def test_the_study_that_was_deleted_last_is_restored(
    service: Service, sprag: Sprag, here: None, spec: dict[str, Any]
) -> None:
    first, second, there = (submit(service, spec, name) for name in ("first", "second", "there"))
    for study_id in (first, second, there):
        service.fill(study_id)
    assert sprag("study", "restore", "latest").code == 2, "none is deleted"
    for study_id in (second, first):
        assert sprag("study", "delete", study_id, "--yes").code == 0
    for named, study_id in (("latest", first), ("second", second)):
        assert sprag("study", "restore", named).out == f"{study_id}\n"


def test_a_deleted_study_is_deleted_for_good_by_its_whole_id(
    service: Service, sprag: Sprag, here: None, spec: dict[str, Any]
) -> None:
    kept, gone = (submit(service, spec, name) for name in ("kept", "old"))
    for study_id in (kept, gone):
        service.fill(study_id)
        cases = service.get(f"/studies/{study_id}")["progress"]["done"]
        assert sprag("study", "delete", study_id, "--yes").code == 0
    for named in ("old", gone[:-1], "st_0000000000000000"):  # names and beginnings mean studies that are there
        assert sprag("study", "delete", named, "--yes", "--at-once").code == 2, named
    assert sprag("study", "delete", gone, "--yes").code == 2
    assert sprag("study", "restore", gone).code == 0
    assert sprag("study", "delete", gone, "--yes").code == 0
    assert sprag("study", "delete", gone, "--at-once", "--json").code == 2, "nobody can be asked here"
    done = sprag("study", "delete", gone, "--yes", "--at-once")
    assert (done.code, done.out + done.err) == (0, f"{gone} (old, {cases} cases) is deleted\n")
    assert sprag("study", "restore", gone).code == 2
    assert [study["id"] for study in json.loads(sprag("list", "--deleted", "--json").out)["studies"]] == [kept]


def test_a_case_and_its_motions(
    service: Service, sprag: Sprag, here: None, spec: dict[str, Any], tmp_path: Path
) -> None:
    spec["run"] = {"duration": "12 periods", "window": ["6 periods", "12 periods"]}
    service.fill(study := submit(service, spec, "short"))
    done = sprag("show", "short", "case", "--case", 4)
    assert done.code == 0
    assert done.err.startswith("case 4: chatter.")
    words = done.out.split()
    assert words[words.index("excitation.frequency") + 2] == "Hz"
    assert words[words.index("shaft.speed.mean") + 1 :][:2] == ["-", "rad/s"]
    case = json.loads(sprag("show", "short", "case", "--case", 3, "--json").out)
    assert case["case"] == 3
    numbers = [name for name, value in case["results"].items() if not isinstance(value, str)]
    assert {*case["parameters"], *numbers} <= {*case["units"]}
    assert service.get(f"/studies/{study}/cases")["units"] == case["units"]
    listed = sprag("show", "short", "cases", "--result", "torque.mean").out
    assert {"[N*m]", "[Hz]"} <= {*listed.split()}

    done = sprag("show", "short", "trajectory", "--case", 4, "--from", "6 periods", "--points", 20)
    rows = list(csv.DictReader(io.StringIO(done.out)))
    assert len(rows) == 20
    file = tmp_path / "strobes.svg"
    assert sprag("show", "short", "strobes", "--case", 4, "-o", file).code == 0
    assert file.read_bytes().startswith(b"<?xml")
    done = sprag("show", "short", "trajectory", "--case", 4, "--pionts", 20)
    assert done.code == 2
    assert "--pionts" in done.err
    for wrong in (("--points", "20"), ("-o", file), ("trajectory", "--points")):
        done = sprag("show", "short", *wrong, "--case", 4) if len(wrong) > 2 else sprag("show", "short", "case", *wrong)
        assert (done.code, done.out) == (2, ""), wrong


@pytest.mark.parametrize("width", [50, 64, 80, 100, 132, 200])
def test_tables_of_commands_fit_the_terminal(
    service: Service, sprag: Sprag, here: None, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    service.fill(submit(service, spec, "feeder"))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("NO_COLOR", "1")
    listed = [("presets",), ("list",), ("models", "machine-shaft"), ("models", "vibration-drive")]
    for command in (("answers", "feeder"), ("case", "feeder", 3), ("cases", "feeder"), *listed):
        done = sprag(*command)
        assert done.code == 0, done.err
        lines = re.sub(r"\x1b\[[0-9;]*m", "", done.out).splitlines()
        assert 20 < max(map(cell_len, lines)) <= width, command
        assert "\N{HORIZONTAL ELLIPSIS}" not in done.out


def test_times_are_shown_in_seconds(service: Service, sprag: Sprag, here: None, spec: dict[str, Any]) -> None:
    created = service.get(f"/studies/{submit(service, spec, 'feeder')}")["created_at"]
    shown = sprag("list").out
    assert f"\t{created[:19]}Z\t" in shown
    assert json.loads(sprag("list", "--json").out)["studies"][0]["created_at"] == created
    service.fill(submit(service, spec, "old"))
    assert sprag("study", "delete", "old", "--yes").code == 0
    assert re.search(r"T\d\d:\d\d:\d\dZ", sprag("list", "--deleted").out)


def test_studies_side_by_side(service: Service, sprag: Sprag, here: None, spec: dict[str, Any]) -> None:
    heavy = {**spec, "base": {**spec["base"], "shaft": {"inertia": "4e-3 kg*m^2", "load": 0.1}}}
    for name, each in (("light", spec), ("heavy", heavy)):
        service.fill(submit(service, each, name))
    chosen = ("--x", "shaft.load", "--y", "shaft.speed.mean", "--at", "excitation.frequency=16 Hz")
    done = sprag("compare", "light", "heavy", *chosen)
    assert done.code == 0, done.err
    assert "/base/shaft/inertia" in done.out
    assert "4e-3 kg*m^2" in done.out
    found = json.loads(sprag("compare", "light", "heavy", *chosen, "--json").out)
    assert found["studies"] == ["light", "heavy"]
    assert found["inputs"]["/base/shaft/inertia"] == ["2e-3 kg*m^2", "4e-3 kg*m^2"]
    assert len(found["curves"]["heavy"]["curves"][0]["x"]) == 3
    # An axis that only one study has is held at its usual value; without a common one the inputs are all there is.
    axes = [{"path": "shaft.load", "values": [0.1, 0.3]}, {"path": "pendulums.0.mass", "values": [0.4, 0.5]}]
    other = {**heavy, "axes": axes}
    service.fill(submit(service, other, "other"))
    for pair in (("light", "other"), ("other", "light")):
        both = json.loads(sprag("compare", *pair, "--json").out)["curves"]
        assert [curves["x"]["path"] for curves in both.values()] == ["shaft.load"] * 2
        assert [len(curves["curves"]) for curves in both.values()] == [1, 1]
        assert list(both["other"]["curves"][0]["at"]) == ["pendulums.0.mass"]
    held = json.loads(sprag("compare", "light", "other", "--at", "pendulums.0.mass=0.4", "--json").out)["curves"]
    assert held["other"]["curves"][0]["at"] == {"pendulums.0.mass": 0.4}
    assert sprag("compare", "light", "other", "--at", "shaft.mass=0.4").code == 2
    submit(service, {**heavy, "axes": []}, "single")
    apart = sprag("compare", "light", "single")
    assert apart.code == 0
    assert "/base/shaft/inertia" in apart.out
    assert "no varying parameter in common" in apart.err
    assert json.loads(sprag("compare", "light", "single", "--json").out)["curves"] == {}
    assert sprag("compare", "light").code == 2
    assert sprag("compare", "light", "heavy", "--at", "16 Hz").code == 2


def test_models_and_rounds(service: Service, sprag: Sprag, here: None, spec: dict[str, Any]) -> None:
    assert "machine-shaft" in sprag("models").out
    assert "excitation.frequency" in sprag("models", "vibration-drive").out
    assert sprag("models", "perpetuum-mobile").code == 2
    submit(service, spec, "plain")
    assert json.loads(sprag("show", "plain", "rounds", "--json").out)["rounds"] == []
    assert "first case" in sprag("show", "plain", "rounds").out


def test_settings_say_where_they_come_from(sprag: Sprag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "sprag.toml"
    file.write_text('port = 8100\nhost = "127.0.0.2"\n')
    monkeypatch.setenv("SPRAG_SETTINGS", str(file))
    monkeypatch.setenv("SPRAG_PORT", "8200")
    monkeypatch.setenv("SPRAG_TOKEN", "correct-horse-battery-staple")
    monkeypatch.setenv("SPRAG_ZONE", "")
    monkeypatch.setenv("SPRAG_DATABASE", "postgresql://bob:hunter2@host/sprag")
    monkeypatch.setenv("SPRAG_SERVER", "https://tools.example")
    monkeypatch.delenv("SPRAG_COMPILER", raising=False)
    done = sprag("settings", "--json")
    found = {row["name"]: (row["value"], row["origin"]) for row in json.loads(done.out)["settings"]}
    assert found["port"] == ("8200", "SPRAG_PORT")
    assert found["host"] == ("127.0.0.2", str(file))
    assert found["zone"] == ("UTC", "default")
    assert found["token"] == ("(secret)", "SPRAG_TOKEN")
    assert found["database"] == ("postgresql://bob:***@host/sprag", "SPRAG_DATABASE")
    assert found["SPRAG_SETTINGS"] == (str(file), "SPRAG_SETTINGS")
    assert found["SPRAG_SERVER"] == ("https://tools.example", "SPRAG_SERVER")
    assert found["SPRAG_COMPILER"] == ("programs", "default")
    assert found["SPRAG_KERNEL_CACHE"][0] == str(cache_folder())
    assert found["SPRAG_DEBUG"] == ("", "default")
    assert "correct-horse" not in sprag("settings").out
    monkeypatch.delenv("SPRAG_DATABASE")
    found = {row["name"]: row["value"] for row in json.loads(sprag("settings", "--json").out)["settings"]}
    assert found["database"] == str(default_database_path())
    monkeypatch.setenv("SPRAG_PORT", "many")
    assert sprag("settings").code == 2


@pytest.mark.usefixtures("here")
def test_a_file_has_the_header_that_is_asked_for(
    service: Service, spec: dict[str, Any], sprag: Sprag, examples: Path, tmp_path: Path
) -> None:
    service.fill(service.submit(spec))
    done = sprag("export", "latest", "--header", "units")
    assert done.code == 0
    assert "shaft.load [N*m]" in done.out.partition("\n")[0].split(",")
    commas = sprag("export", "latest", "--decimal", "comma")
    assert commas.code == 0
    assert commas.out.startswith("\ufeffcase;")
    for command in (["export", "latest"], ["run", examples / "one_pendulum.json"]):
        for option in (["--header", "units"], ["--decimal", "comma"]):
            refused = sprag(*command, "-o", tmp_path / "rows.xlsx", *option, "--json")
            (problem,) = refused.failure["problems"]
            assert (refused.code, problem["code"], problem["allowed"]) == (2, "not-used", "csv")
    assert list(tmp_path.glob("rows*")) == []


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("name", ["rows.xls", "rows.ods", "rows.csv.gz", "rows.foo"])
def test_a_file_of_an_unknown_ending_is_refused(
    service: Service, spec: dict[str, Any], sprag: Sprag, examples: Path, tmp_path: Path, name: str
) -> None:
    service.fill(service.submit(spec))
    local = examples / "one_pendulum.json"
    for command in (["export", "latest"], ["run", local], ["trajectory", local], ["section", local]):
        refused = sprag(*command, "-o", tmp_path / name, "--json")
        (problem,) = refused.failure["problems"]
        assert (refused.code, problem["pointer"], problem["code"]) == (2, "--output", "invalid-choice"), command
        assert ".json" in problem["allowed"]
    assert list(tmp_path.glob("rows*")) == []
    assert sprag("export", "latest", "-o", tmp_path / name, "--format", "csv").code == 0
    assert sprag("export", "latest", "-o", tmp_path / "rows").code == 0
    assert (tmp_path / "rows").read_bytes() == (tmp_path / name).read_bytes()


@pytest.mark.usefixtures("here")
def test_a_study_is_kept_where_the_answer_is_no(
    service: Service, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    study = submit(service, spec, "Feeder")
    monkeypatch.setattr("sys.stdin.isatty", lambda: True)
    monkeypatch.setattr("sprag_study.service.cli.console.confirmed", lambda _question: False)
    assert execute(["study", "delete", study, "--server", "http://localhost"]) == 0
    assert "nothing is deleted" in capsys.readouterr().err
    assert service.http.get(f"{API}/studies/{study}").status_code == 200
