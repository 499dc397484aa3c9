"""What commands say about wrong input: every problem on a line of its own, exit code 2, never a traceback."""

import errno
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Sprag = Callable[..., Any]

BASE: dict[str, Any] = {
    "sprag": 1,
    "model": "vibration-drive",
    "base": {
        "excitation": {"frequency": "25 Hz", "amplitude_x": "2 mm", "amplitude_y": "2 mm"},
        "pendulums": [
            {
                "inertia": "1e-3 kg*m^2",
                "mass": "0.5 kg",
                "arm": "30 mm",
                "spring_rate": "9000 N/m",
                "spring_arm": "50 mm",
                "damping": "0.01 N*m*s/rad",
                "backlash": "0.005 rad",
            }
        ],
        "shaft": {"inertia": "2e-3 kg*m^2", "load": "0.1 N*m"},
        "clutch": {"coefficients": [0, 200, 0, 20000]},
    },
    "run": {"duration": "6 periods"},
    "axes": [{"path": "shaft.load", "values": [0, 0.1]}],
}


def changed(path: str, value: object) -> str:
    """The base spec as JSON text with the field at a JSON Pointer set to ``value``."""
    spec = json.loads(json.dumps(BASE))
    *parents, last = path.strip("/").split("/")
    place: Any = spec
    for key in parents:
        place = place[int(key)] if isinstance(place, list) else place[key]
    place[last] = value
    return json.dumps(spec)


#: Text of a wrong spec, and what the message has to name.
WRONG: dict[str, tuple[str, str]] = {
    "NaN": (changed("/base/shaft/load", float("nan")), "/base/shaft/load"),
    "Infinity": (changed("/base/shaft/load", float("inf")), "/base/shaft/load"),
    "1e999": (json.dumps(BASE).replace('"0.1 N*m"', "1e999"), "/base/shaft/load"),
    "negative inertia": (changed("/base/shaft/inertia", -1), "/base/shaft/inertia"),
    "unknown field": (changed("/base/shaft/lode", 1), "/base/shaft/lode"),
    "wrong unit": (changed("/base/shaft/load", "0.1 kg"), "/base/shaft/load"),
    "empty axis": (changed("/axes", [{"path": "shaft.load", "values": []}]), "/axes/0"),
    "a billion cases": (
        changed("/axes", [{"path": p, "linspace": [1, 2, 1000]} for p in ("shaft.load", "shaft.inertia", "gravity")]),
        "/axes",
    ),
    "40 levels": ('{"sprag":1,"base":' + "[" * 40 + "]" * 40 + "}", "nested"),
    "duplicate axis": (
        changed("/axes", [{"path": "shaft.load", "values": [1]}, {"path": "shaft.load", "values": [2]}]),
        "/axes/1",
    ),
    "window outside the run": (changed("/run/window", ["4 periods", "9 periods"]), "/run/window"),
    "law negative in its range": (changed("/base/clutch/coefficients", [0, 200, -1e5, 0]), "/base/clutch"),
    "unreachable fit": (
        changed("/base/clutch", {"data": [[0.01, 1], [0.02, 5], [0.03, 2], [0.04, 9]], "accuracy": 1e-9}),
        "/base/clutch",
    ),
    "no JSON": ("{", "line 1"),
    "a list": ("[]", "object"),
    "nothing": ("", "JSON"),
    "field twice": ('{"sprag": 1, "sprag": 1}', "/sprag"),
    "half a character": ('{"sprag": 1, "name": "\\ud800"}', "/name"),
}


@pytest.fixture(params=WRONG)
def wrong(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Path, str]:
    text, named = WRONG[request.param]
    path = tmp_path / "spec.json"
    path.write_text(text)
    return path, named


@pytest.mark.parametrize("command", [["validate"], ["preview"], ["run"], ["trajectory", "--case", "0"], ["submit"]])
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
    done = sprag("validate", path, "--json")
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
    lines = sprag("validate", path).err.splitlines()
    for pointer in ("/base/shaft/load", "/base/excitation/frequency", "/bse"):
        assert sum(line.strip().startswith(pointer + ":") for line in lines) == 1
    assert any("-25" in line and "allowed: > 0 Hz" in line for line in lines)


def test_a_weak_spring_is_allowed_but_said(sprag: Sprag, tmp_path: Path) -> None:
    path = tmp_path / "spec.json"
    path.write_text(changed("/base/pendulums/0/spring_rate", "1 N/m"))
    done = sprag("validate", path)
    assert done.code == 0
    assert done.err.startswith("warning: ")
    assert sprag("validate", path, "--json").data["warnings"]


@pytest.mark.parametrize("command", [["validate"], ["run"], ["submit"], ["fit", "--accuracy", "1"]])
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
    done = sprag("validate", path)
    assert done.code == 2
    assert done.err == f"sprag: {path}: permission denied\n"


def test_a_file_beyond_the_limit(sprag: Sprag, tmp_path: Path) -> None:
    path = tmp_path / "spec.json"
    path.write_bytes(b" " * (1024 * 1024 + 1))
    done = sprag("validate", path)
    assert done.code == 2
    assert "larger than the allowed" in done.err


def test_toml_json_and_a_name_without_ending_are_told_apart(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    for source in ("one_pendulum.json", "two_pendulums.toml"):
        path = tmp_path / "spec"
        path.write_bytes((examples / source).read_bytes())
        assert sprag("validate", path).code == 0
    path = tmp_path / "spec.toml"
    path.write_text("sprag = = 1")
    assert "TOML" in sprag("validate", path).err


@pytest.mark.parametrize("target", ["", "/nowhere/rows.csv", "rows.csv/below"])
def test_a_file_that_cannot_be_written(sprag: Sprag, examples: Path, tmp_path: Path, target: str) -> None:
    (tmp_path / "rows.csv").write_text("")
    file = target if target.startswith("/") else tmp_path / target
    done = sprag("trajectory", examples / "one_pendulum.json", "--points", "2", "-o", file)
    assert done.code == 2
    assert done.out == ""


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
