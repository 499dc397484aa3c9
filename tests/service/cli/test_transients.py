"""The command `sprag show ID transient`."""

from __future__ import annotations

import csv
import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import Finished

Sprag = Callable[..., Finished]


def test_the_example_of_the_guide(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    guide = (examples.parent / "docs" / "guide-machine-shaft.md").read_text(encoding="utf-8")
    commands = [
        line.split()
        for line in guide.splitlines()
        if line.startswith("    sprag show examples/slotter.toml transient ")
    ]
    (shown,) = (block.split("```")[0] for block in guide.split("```text\n")[1:] if block.startswith("case 9"))
    for words, line in zip(commands, shown.splitlines(), strict=True):
        own = shlex.split(" ".join(words[1:]))
        own[1], own[-1] = str(examples / Path(own[1]).name), str(tmp_path / own[-1])
        done = sprag(*own)
        assert done.code == 0
        assert done.err.splitlines()[0] == line
        rows = list(csv.DictReader(Path(own[-1]).read_text(encoding="utf-8").splitlines()))
        assert (len(rows), float(rows[0]["time"])) == (1000, 0.0)


def test_json_and_the_exit_code_of_a_stall(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    """Case 27 cuts with 40 kN, which stalls the motor wherever the shaft starts."""
    done = sprag("show", examples / "slotter.toml", "transient", "--case", 27, "--kind", "run-up", "--json")
    made = json.loads(done.out)
    assert done.code == 4
    assert (made["outcome"], made["ending"], made["results"]["time"]) == ("stopped", "motor_stalled", None)
    assert "the mean resisting torque" in made["cause"]
    file = tmp_path / "motion.csv"
    words = ("--case", 27, "--kind", "run-up", "--json", "-o", file)
    short = json.loads(sprag("show", examples / "slotter.toml", "transient", *words).out)
    assert (short["file"], short["results"]) == (str(file), made["results"])
    assert float(next(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))["omega"]) == 0.0


@pytest.mark.parametrize(
    ("spec", "words", "said"),
    [
        ("slotter.toml", ("--kind", "load-step"), "a load step needs the factor on the load after it"),
        ("slotter.toml", ("--kind", "coasting", "--case", 10**6), "there is no such case"),
        ("one_pendulum.json", ("--kind", "coasting"), "has no transients"),
    ],
)
def test_refusals(sprag: Sprag, examples: Path, spec: str, words: tuple[object, ...], said: str) -> None:
    done = sprag("show", "transient", examples / spec, *words)
    assert done.code == 2
    assert said in done.err


def test_points_and_tables_of_files(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    (tmp_path / "cut.csv").write_text("x,force [kN]\n0,4\n1,4\n", encoding="utf-8")
    words = ("transient", examples / "slotter.toml", "--case", 9, "--kind", "coasting", "--points", 3)
    done = sprag(*words)
    assert done.code == 0
    assert len(done.out.splitlines()) == 1 + 3
    wrong = sprag(*words, "--file", f"nowhere={tmp_path / 'cut.csv'}")
    assert wrong.code == 2
    assert "nowhere" in wrong.err


def test_a_row_for_each_case_of_a_study(sprag: Sprag, tmp_path: Path) -> None:
    """A constant torque runs up an unloaded inertia: t = I omega/M, and a smaller motor torque than the load stalls."""
    base = {"mean_speed": "10 rad/s", "drive": {"inertia": 1}, "operation": {"quantity": "torque", "value": "5 N*m"}}
    axes = [{"path": "drive.inertia", "values": [2, 4, 8]}]
    spec = tmp_path / "spec.json"
    spec.write_text(json.dumps({"sprag": 1, "model": "machine-shaft", "base": base, "axes": axes}), encoding="utf-8")
    words = ("transient", spec, "--kind", "run-up", "--load", 0, "--torque", "20 N*m", "--all")
    done = sprag(*words)
    assert done.code == 0
    assert done.err.splitlines()[-1] == "3 cases: 3 reached"
    rows = list(csv.DictReader(done.out.splitlines()))
    assert [float(row["drive.inertia"]) for row in rows] == [2.0, 4.0, 8.0]
    assert [float(row["time"]) for row in rows] == pytest.approx([1.0, 2.0, 4.0], rel=1e-12)
    lines = [json.loads(line) for line in sprag(*words, "--json").out.splitlines()]
    assert [line["time"] for line in lines] == [float(row["time"]) for row in rows]
    stalled = sprag("show", spec, "transient", "--kind", "run-up", "--torque", "2 N*m", "--all")
    assert stalled.code == 4
    assert stalled.err.splitlines()[-1] == "3 cases: 3 not_started"
    assert {row["time"] for row in csv.DictReader(stalled.out.splitlines())} == {""}
    both = sprag(*words, "--case", 1)
    assert both.code == 2
    assert "--all" in both.err
