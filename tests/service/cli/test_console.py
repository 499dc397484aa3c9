"""How commands talk to people and to programs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from sprag_study.service.cli.console import (
    ExitCode,
    TroubleError,
    WrongInputError,
    cell_text,
    duration_text,
    ending_lines,
    progress_text,
    say,
    show_table,
    write_json,
)
from sprag_study.service.cli.extend import _what_is_new
from sprag_study.service.cli.shown import show_calibration, show_curves, show_map
from sprag_study.service.faults import Fault


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.04, "0.0 s"),
        (9.94, "9.9 s"),
        (12.4, "12 s"),
        (59.7, "1 min 00 s"),
        (200.0, "3 min 20 s"),
        (7500.0, "2 h 05 min"),
    ],
)
def test_times_as_people_say_them(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


@pytest.mark.parametrize(
    ("cell", "text"),
    [(None, "-"), (float("nan"), "-"), (0.1 + 0.2, "0.3"), (1e-12, "1e-12"), (7, "7"), ("ok", "ok"), (True, "yes")],
)
def test_cells(cell: object, text: str) -> None:
    assert cell_text(cell) == text


def test_how_a_study_is_going() -> None:
    assert progress_text("queued", None, None) == "queued"
    assert progress_text("running", 1234.5, (2.0, 2.0)) == "running, 1.23e+03 cases/s, 2.0 s left"
    assert progress_text("running", 10.0, (2.0, 61.0)) == "running, 10 cases/s, 2.0 s to 1 min 01 s left"


def test_a_failure_for_people_and_for_programs() -> None:
    fault = Fault("/a", "out-of-range", "is wrong", -1, allowed="> 0 m", unit="m")
    failure = WrongInputError("invalid-spec", "spec.json: not valid", [fault])
    assert list(failure.lines()) == ["spec.json: not valid", "  /a: is wrong (got -1; allowed: > 0 m)"]
    assert failure.document() == {
        "error": "spec.json: not valid",
        "code": "invalid-spec",
        "exit_code": 2,
        "problems": [
            {
                "pointer": "/a",
                "code": "out-of-range",
                "message": "is wrong",
                "value": -1,
                "allowed": "> 0 m",
                "unit": "m",
            }
        ],
    }
    assert TroubleError("unavailable", "no").document() == {
        "error": "no", "code": "unavailable", "exit_code": ExitCode.TROUBLE,
    }  # fmt: skip


@pytest.mark.usefixtures("terminal")
def test_data_and_messages_go_apart(capsys: pytest.CaptureFixture[str]) -> None:
    write_json({"a": "ü"})
    say("a [bold]message[/bold]", "another")
    show_table("Title [x]", [("name [m]", False), ("value", True)], [("[red]", 1.5), ("b", None)])
    captured = capsys.readouterr()
    first, rest = captured.out.split("\n", 1)
    assert json.loads(first) == {"a": "ü"}
    assert captured.err == "a [bold]message[/bold]\nanother\n"
    for text in ("Title [x]", "name [m]", "[red]", "1.5"):
        assert text in rest
    assert "\x1b" not in captured.out


def test_a_wide_table_keeps_all_its_digits(capsys: pytest.CaptureFixture[str]) -> None:
    numbers = [0.0937412 + index for index in range(40)]
    columns = [("machine", False), *((f"column {index}", True) for index in range(40))]
    show_table("", columns, [("a drive", *numbers)])
    shown = capsys.readouterr().out
    assert all(f"{number:.6g}" in shown for number in numbers)
    assert "\N{HORIZONTAL ELLIPSIS}" not in shown


@pytest.mark.usefixtures("terminal")
def test_what_is_held_has_its_unit(capsys: pytest.CaptureFixture[str]) -> None:
    axis = {"path": "drive.inertia", "unit": "kg*m^2", "values": [1.0]}
    units = {"mean_speed": "rad/s", "wanted_irregularity": "1"}
    held = {"mean_speed": 6.283185307, "wanted_irregularity": 0.1}
    drawn = {"by": {}, "at": held, "x": [1.0], "y": {"irregularity": [0.2]}, "endings": ["ok"], "flags": [[]]}
    show_curves({"x": axis, "units": units, "results": {"irregularity": {"unit": "1"}}, "curves": [drawn]})
    assert "mean_speed = 6.28319 rad/s, wanted_irregularity = 0.1 " in " ".join(capsys.readouterr().out.split())


@pytest.mark.usefixtures("terminal")
def test_curves_have_the_flags_that_regimes_do_not_say(capsys: pytest.CaptureFixture[str]) -> None:
    found = {
        "x": {"path": "shaft.load", "unit": "N*m", "values": [0.0, 1.0]},
        "units": {},
        "results": {"efficiency": {"unit": "1"}},
    }
    drawn = {"by": {}, "at": {}, "x": [0.0, 1.0], "y": {"efficiency": [0.2, 0.3]}, "endings": ["ok", "ok"]}
    show_curves({**found, "curves": [{**drawn, "flags": [[], ["not_settled"]]}]})
    timed = capsys.readouterr().out
    assert [line.split() for line in timed.splitlines() if "0.3" in line] == [["1", "0.3", "not_settled"]]
    assert "flags" in timed
    kinds = {"regime": ["periodic", "unsettled"], "flags": [[], ["unsettled"]]}
    show_curves({**found, "curves": [{**drawn, **kinds}]})
    settled = capsys.readouterr().out
    assert [line.split() for line in settled.splitlines() if "0.3" in line] == [["1", "0.3", "unsettled"]]
    assert "flags" not in settled


def test_points_of_a_map_with_flags_are_marked(capsys: pytest.CaptureFixture[str]) -> None:
    x, y = ({"path": path, "unit": "1", "values": [1.0, 2.0]} for path in ("a", "b"))
    z = {"name": "efficiency", "unit": "1", "values": [[0.25, 0.5], [0.75, None]]}
    show_map({"x": x, "y": y, "z": z, "at": {}, "units": {}, "flags": [[[], ["not_settled"]], [[], ["not_settled"]]]})
    shown = capsys.readouterr()
    assert [line.split("\t")[1:] for line in shown.out.splitlines()[-2:]] == [["0.25", "0.5 *"], ["0.75", "- *"]]
    assert shown.err == "* flags: not_settled 2\n"
    show_map({"x": x, "y": y, "z": z, "at": {}, "units": {}})
    assert "*" not in capsys.readouterr().out


def test_sentences_of_a_calibration_are_beside_its_table(capsys: pytest.CaptureFixture[str]) -> None:
    one = {"name": "shaft.inertia", "unit": "kg*m^2", "value": 0.002, "interval": [0.001, 0.003], "deviation": 0.0005}
    show_calibration({"parameters": [one], "correlations": None, "sentences": ["Measure at 28 Hz."]})
    shown = capsys.readouterr()
    assert shown.out.splitlines()[1] == "shaft.inertia [kg*m^2]\t0.002\t0.001\t0.003\t0.0005"
    assert shown.err == "Measure at 28 Hz.\n"
    two = [one, {**one, "name": "damping", "unit": "1"}]
    show_calibration({"parameters": two, "correlations": [[1.0, -0.5], [-0.5, 1.0]], "sentences": []})
    head, first, second = (line.split("\t") for line in capsys.readouterr().out.splitlines())
    assert head[-2:] == ["correlation shaft.inertia", "correlation damping"]
    assert (first[-2:], second[-2:]) == (["1.0", "-0.5"], ["-0.5", "1.0"])


def test_what_an_extension_adds_is_told() -> None:
    old = {"id": "st_1", "cases": 12}
    assert _what_is_new(old, {"cases": 12}) == "nothing is new: st_1 has all of the 12 cases"
    assert _what_is_new(old, {"cases": 13}) == "1 of the 13 cases is new, the others are those of st_1"
    assert _what_is_new(old, {"cases": 15}) == "3 of the 15 cases are new, the others are those of st_1"


def test_a_bar_on_a_terminal_and_nothing_elsewhere() -> None:
    """Standard error is a terminal here; standard output is a pipe, which stays free of colours and bars."""
    code = (
        "from sprag_study.service.cli.console import progress_bar, say, show_table\n"
        "with progress_bar('study [x]') as update:\n"
        "    update(1, 4, 'running')\n"
        "    update(4, 4, '')\n"
        "show_table('', [('a', True)], [(1,)])\n"
    )
    ours, theirs = os.openpty()
    done = subprocess.run(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=theirs,
        env={**os.environ, "TERM": "xterm", "PYTHONPATH": str(Path(__file__).resolve().parents[3])},
        check=False,
        timeout=600,
    )
    os.close(theirs)
    with os.fdopen(ours, "rb") as terminal:
        shown = terminal.read1(100_000)
    assert done.returncode == 0, shown
    assert b"study [x]" in shown
    assert b"4/4" in shown
    assert b"\x1b" in shown
    assert b"\x1b" not in done.stdout


def test_an_id_is_never_cut(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "80")
    columns = (("id", False, True), ("state", False, True), ("done", True), ("created", False), ("name", False))
    rows = [("st_38b213f6175b1470", "finished", 10**6, "2026-11-22T02:22:59.079014Z", "Feeder motor: speed " * 4)]
    show_table("", columns, rows)
    assert "st_38b213f6175b1470 " in capsys.readouterr().out


def test_a_table_in_a_pipe_has_tabs_between_its_cells(capsys: pytest.CaptureFixture[str]) -> None:
    columns = (("shaft.\nload [N*m]", True), ("mean speed\n[rad/s]", True), ("note", False))
    show_table("Title", columns, [(0.25, None, "one\ttwo\nthree"), (12.0, 1e-9, "")])
    assert capsys.readouterr().out == (
        "shaft.load [N*m]\tmean speed [rad/s]\tnote\n0.25\t-\tone two three\n12.0\t1e-09\t\n"
    )


def test_endings_are_told_with_their_meaning() -> None:
    (line,) = ending_lines({"ok": 49, "inertia_insufficient": 3})
    assert line.startswith("  3 inertia_insufficient: The inertia is insufficient for the required mean speed")
