"""What commands say about wrong input: every problem on a line of its own, exit code 2, never a traceback."""

import errno
import json
import math
import os
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sprag_study.engine.endings import Ending
from sprag_study.worker import models
from sprag_study.worker.models import Trajectory
from sprag_study.worker.study import Study
from tests.wrong_specs import WRONG, changed

Sprag = Callable[..., Any]


@pytest.fixture(params=WRONG)
def wrong(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, str]:
    text, named = WRONG[request.param]
    path = tmp_path / "spec.json"
    path.write_text(text)
    return path, named


@pytest.mark.parametrize("command", [["check"], ["run"], ["show", "trajectory", "--case", "0"], ["submit"]])
def test_wrong_specs(sprag: Sprag, wrong: tuple[Path, str], command: list[str]) -> None:
    path, named = wrong
    if command == ["submit"] and named != "nested":
        # Whether the spec can be run is the service's to say; only what cannot be sent is found here.
        assert sprag(*command, path, "--server", "http://127.0.0.1:9").code in (2, 3)
        return
    done = sprag(*command, path)
    assert done.code == 2
    assert done.out == ""
    assert named in done.err


def test_wrong_specs_for_programs(sprag: Sprag, wrong: tuple[Path, str]) -> None:
    path, named = wrong
    done = sprag("check", path, "--json")
    assert done.code == 2
    assert done.data["valid"] is False
    assert named in json.dumps(done.data["problems"])
    failed = sprag("run", path, "--json")
    assert json.loads(failed.err)["problems"] == done.data["problems"]


def test_every_problem_has_its_own_line(sprag: Sprag, tmp_path: Path) -> None:
    spec = json.loads(changed("/base/shaft/load", "0.1 kg"))
    spec["base"]["excitation"]["frequency"] = -25
    spec["bse"] = {}
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(spec))
    lines = sprag("check", path).err.splitlines()
    for pointer in ("/base/shaft/load", "/base/excitation/frequency", "/bse"):
        assert sum(line.strip().startswith(pointer + ":") for line in lines) == 1
    assert any("-25" in line and "allowed: > 0 Hz" in line for line in lines)


def test_a_weak_spring_is_allowed_but_said(sprag: Sprag, tmp_path: Path) -> None:
    path = tmp_path / "spec.json"
    path.write_text(changed("/base/pendulums/0/spring_rate", "1 N/m"))
    done = sprag("check", path)
    assert done.code == 0
    assert done.err.startswith("warning: ")
    assert sprag("check", path, "--json").data["warning_codes"] == ["falls-over"]


@pytest.mark.parametrize("command", [["check"], ["run"], ["submit"], ["fit", "--accuracy", "1"]])
def test_files_that_cannot_be_read(sprag: Sprag, tmp_path: Path, command: list[str]) -> None:
    binary = tmp_path / "spec.json"
    binary.write_bytes(bytes(range(256)))
    for path in (tmp_path / "nothing.json", tmp_path, binary, f"{tmp_path}/\0.json", binary / "below"):
        done = sprag(*command, path)
        assert done.code == 2
        assert done.out == ""
        assert done.err.startswith("sprag: ")


def test_a_file_without_the_right_to_read_it(sprag: Sprag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "spec.json"
    path.write_text("{}")

    def refuse(*_: object) -> None:  # the tests may run as root, who can read everything
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "open", refuse)
    done = sprag("check", path)
    assert done.code == 2
    assert done.err == f"sprag: {path}: permission denied\n"


def test_a_file_beyond_the_limit(sprag: Sprag, tmp_path: Path) -> None:
    path = tmp_path / "spec.json"
    path.write_bytes(b" " * (1024 * 1024 + 1))
    done = sprag("check", path, "--json")
    assert (done.code, done.failure["code"]) == (2, "invalid-file")


def test_toml_json_and_a_name_without_ending_are_told_apart(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    for source in ("one_pendulum.json", "two_pendulums.toml"):
        path = tmp_path / "spec"
        path.write_bytes((examples / source).read_bytes())
        assert sprag("check", path).code == 0
    path = tmp_path / "spec.toml"
    path.write_text("sprag = = 1")
    assert "TOML" in sprag("check", path).err


@pytest.mark.parametrize("command", ["check", "run"])
def test_what_is_wrong_with_points_is_told_of_their_file(
    sprag: Sprag, examples: Path, tmp_path: Path, command: str
) -> None:
    points = tmp_path / "points.csv"
    points.write_text("excitation.frequency [rpm];shaft.load [N*m]\n1500;0.1\n\n1800;-250 N*mm\n-3;\n")
    done = sprag(command, examples / "one_pendulum.json", "--points", points)
    assert (done.code, done.out) == (2, "")
    _, load, speed, empty = done.err.splitlines()
    assert load.startswith(f"  {points}: line 4, column shaft.load [N*m]: ")
    assert "(got '-250 N*mm'; allowed: >= 0 " in load
    assert "line 5, column excitation.frequency [rpm]: " in speed
    assert "line 5, column shaft.load [N*m]: " in empty
    told = sprag(command, examples / "one_pendulum.json", "--points", points, "--json").failure["problems"]
    assert [item["code"] for item in told] == ["out-of-range", "out-of-range", "empty"]
    gone = sprag(command, examples / "one_pendulum.json", "--points", tmp_path / "none.csv")
    assert (gone.code, gone.err) == (2, f"sprag: {tmp_path / 'none.csv'}: no such file or directory\n")
    both = sprag(command, "-", "--points", "-", "--json")
    assert both.code == 2
    assert [(item["pointer"], item["code"]) for item in both.failure["problems"]] == [("--points", "conflict")]


@pytest.mark.parametrize(
    ("encoding", "heading"),
    [
        ("utf-16", "shaft.load [N·m];excitation.phase [°]"),
        ("cp1252", "shaft.load [N·m];excitation.phase [°]"),
        ("cp1251", "shaft.load [Н·м];excitation.phase [град]"),
        ("utf-8-sig", "shaft.load [Н·м];excitation.phase [°]"),
    ],
)
def test_a_table_may_have_the_encodings_of_spreadsheets(
    sprag: Sprag, examples: Path, tmp_path: Path, encoding: str, heading: str
) -> None:
    points = tmp_path / "points.csv"
    points.write_bytes(f"{heading}\r\n0,25;60,5\r\n0,5;90\r\n".encode(encoding))
    preview = sprag("check", examples / "one_pendulum.json", "--points", points, "--json").data
    ends = {axis["paths"][0]: (axis["first"], axis["last"]) for axis in preview["axes"]}
    assert ends == {
        "shaft.load": (0.25, 0.5),
        "excitation.phase": (pytest.approx(math.radians(60.5)), pytest.approx(math.pi / 2.0)),
    }
    data = tmp_path / "clutch.csv"
    units = heading.replace("shaft.load ", "m ").replace("excitation.phase ", "phi ").split(";")
    data.write_bytes((";".join(units[::-1]) + "\n0,25;0,878\n0,5;1,79\n").encode(encoding))
    fit = sprag("fit", data, "--accuracy", "1", "--max-degree", "1", "--json").data
    angles = [math.radians(0.25), math.radians(0.5)]
    slope = (angles[0] * 0.878 + angles[1] * 1.79) / (angles[0] ** 2 + angles[1] ** 2)
    assert fit["coefficients"] == [0.0, pytest.approx(slope, rel=1e-9)]


def test_a_binary_file_is_no_table(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    points = tmp_path / "points.csv"
    points.write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR")
    done = sprag("check", examples / "one_pendulum.json", "--points", points, "--json")
    assert (done.code, done.failure["code"]) == (2, "invalid-file")


def test_points_take_the_place_of_what_varies(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    points = tmp_path / "points.csv"
    points.write_text("excitation.frequency [rpm],shaft.load [N*m]\n1500,0.1\n1800,250 N*mm\n960,0\n")
    spec = json.loads((examples / "one_pendulum.json").read_text())
    assert spec["axes"]
    path = tmp_path / "spec.json"
    path.write_text(json.dumps({**spec, "combine": "grid", "exclude": [{"shaft.load": {"below": 1}}]}))
    made = sprag("check", path, "--points", points, "--json").data
    assert made["cases"] == 3
    assert [(axis["first"], axis["last"]) for axis in made["axes"]] == [(25.0, 16.0), (0.1, 0.0)]


@pytest.mark.parametrize("target", ["", "/nowhere/rows.csv", "rows.csv/below"])
def test_a_file_that_cannot_be_written(sprag: Sprag, examples: Path, tmp_path: Path, target: str) -> None:
    (tmp_path / "rows.csv").write_text("")
    file = target if target.startswith("/") else tmp_path / target
    done = sprag("show", examples / "one_pendulum.json", "trajectory", "--points", "2", "-o", file)
    assert done.code == 2
    assert done.out == ""


def test_a_part_of_a_run_in_periods(sprag: Sprag, examples: Path) -> None:
    spec = examples / "one_pendulum.json"
    done = sprag("show", spec, "trajectory", "--points", "2", "--from", "40 periods", "--to", "9e9 periods", "--json")
    assert (done.code, done.failure["code"]) == (2, "invalid-parameter")
    assert [(item["pointer"], item["code"]) for item in done.failure["problems"]] == [("--to", "out-of-range")]


def test_a_shaft_that_stops_has_no_points_and_is_told_why(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    done = sprag("show", examples / "press.toml", "trajectory", "--points", "5", "-o", tmp_path / "rows.csv")
    assert done.code != 0
    assert "case 0: inertia insufficient, no points: The inertia is insufficient" in done.err
    assert "5 points" not in done.err


def test_a_motion_that_does_not_end_well_is_told_by_the_exit_code(
    sprag: Sprag, examples: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = {"ending": Ending.OK}

    def instead(_study: Study, _case: int, start: float, end: float, _points: int) -> Trajectory:
        return Trajectory(np.array([start, end]), ("speed",), ("rad/s",), np.zeros((2, 1)), {}, made["ending"])

    monkeypatch.setattr(models, "run_trajectory", instead)
    command = ["trajectory", examples / "one_pendulum.json", "--points", "2", "-o", tmp_path / "motion.csv"]
    assert sprag(*command).code == 0
    made["ending"] = Ending.DIVERGED
    assert sprag(*command).code == 4
    assert (tmp_path / "motion.csv").exists()


def test_a_wrong_choice_is_told_without_the_names_of_libraries(sprag: Sprag, examples: Path) -> None:
    done = sprag("run", examples / "one_pendulum.json", "--format", "xml")
    assert done.code == 2
    assert "Invalid value for '--format': 'xml' is not one of" in done.err


def test_the_version(sprag: Sprag) -> None:
    done = sprag("--version")
    assert (done.code, done.out) == (0, f"sprag {version('sprag-study')}\n")


def test_a_usage_error_names_the_help(sprag: Sprag) -> None:
    for arguments in (
        ["nonsense"],
        ["run"],
        ["run", "--nonsense", "x"],
        ["fit", "x", "--accuracy", "1", "--max-degree", "a"],
    ):
        done = sprag(*arguments)
        assert done.code == 2
        assert "--help" in done.err
    assert json.loads(sprag("run", "--json").err)["exit_code"] == 2


def test_the_source_of_a_kernel_is_shown(sprag: Sprag) -> None:
    done = sprag("admin", "doctor", "--kernel")
    assert done.code == 0
    assert done.out.startswith('"""Generated kernel: 1 pendulum(s), 4 clutch coefficients, order 12')
    compile(done.out, "kernel", "exec")
    other = sprag(
        "admin", "doctor", "--kernel", "--pendulums", 2, "--coefficients", 3, "--tolerance", 1e-6, "--json"
    ).data
    assert (other["pendulums"], other["coefficients"], other["tolerance"]) == (2, 3, 1e-6)
    assert other["source"].startswith('"""Generated kernel: 2 pendulum(s), 3 clutch coefficients, order 9')


@pytest.mark.parametrize(
    "options", [["--pendulums", "2"], ["--kernel", "--pendulums", "9"], ["--kernel", "--tolerance", "1"]]
)
def test_a_kernel_that_there_is_not(sprag: Sprag, options: list[str]) -> None:
    done = sprag("admin", "doctor", *options)
    assert done.code == 2
    assert options[-2] in done.err


def small(examples: Path, tmp_path: Path) -> Path:
    """A crank press in three cases, of which one ends otherwise than ok."""
    text = (examples / "press.toml").read_text(encoding="utf-8")
    path = tmp_path / "press.toml"
    path.write_text(
        text.partition("[[axes]]")[0] + '[[axes]]\npath = "mean_speed"\nvalues = ["20 rpm", "120 rpm", "180 rpm"]\n'
    )
    return path


def test_a_run_tells_how_its_cases_ended(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    done = sprag("run", small(examples, tmp_path), "-o", tmp_path / "rows.csv")
    assert done.code == 4
    assert "3 of 3 cases done, 2 ok" in done.err
    assert "  1 inertia_insufficient: The inertia is insufficient" in done.err
    assert done.out == ""


def test_a_run_into_a_file_tells_programs_what_came_of_it(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    file = tmp_path / "rows.csv"
    done = sprag("run", small(examples, tmp_path), "--json", "-o", file)
    told = done.data
    assert told.pop("seconds") > 0.0
    assert told == {
        "file": str(file), "study": None, "cases": 3, "done": 3, "ok": 2, "reused": 0,
        "endings": {"ok": 2, "inertia_insufficient": 1},
    }  # fmt: skip
    assert file.read_text().startswith("case,mean_speed,ending,flags,")
    motion = tmp_path / "motion.csv"
    told = sprag(
        "show", "trajectory", small(examples, tmp_path), "--case", "1", "--points", "5", "--json", "-o", motion
    ).data
    assert told == {"file": str(motion), "case": 1, "ending": "ok", "points": 5}
    assert not motion.read_text().startswith("{")


def test_an_estimate_has_start_and_compilation_in_it(
    sprag: Sprag, examples: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(models, "estimate_compile_seconds", lambda _study: 40.0)
    assert sprag("check", examples / "press.toml", "--json").data["estimated_seconds"] > 42.0


def test_a_timeout_that_is_no_number_is_a_wrong_option(sprag: Sprag) -> None:
    for command in (("watch", "st_1"), ("extend", "st_1"), ("longer", "st_1"), ("submit", "spec.json")):
        done = sprag(*command, "--timeout", "nan", "--server", "http://127.0.0.1:1")
        assert (done.code, done.out) == (2, "")
        assert "--timeout" in done.err
        assert "nan is not in the range x>=0.0" in done.err
