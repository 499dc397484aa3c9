"""The commands `sprag show ID regimes`, `basin`, `diagram` and `section`, and `sprag run` from the end of a case."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import Finished
from tests.service.spec_sample import changed

Sprag = Callable[..., Finished]
SPEED = "shaft.initial_speed"


@pytest.mark.usefixtures("terminal")
def test_the_example_of_the_guide(sprag: Sprag, examples: Path) -> None:
    guide = (examples.parent / "docs" / "starts.md").read_text(encoding="utf-8")
    command = next(line for line in guide.splitlines() if line.startswith("    sprag show "))
    words = shlex.split(command)[1:]
    words[1] = str(examples / Path(words[1]).name)
    done = sprag(*words)
    assert done.code == 0, done.err
    (shown,) = (block.split("```")[0] for block in guide.split("```text\n")[1:])
    assert done.out.replace("─", "").split() == shown.replace("─", "").split()


def test_tables_of_one_case(sprag: Sprag, tmp_path: Path) -> None:
    spec = tmp_path / "spec.json"
    spec.write_text(json.dumps(changed({"/run": {}, "/axes": [{"path": "shaft.load", "values": [0.2, 0.3]}]})), "utf-8")
    diagram = json.loads(
        sprag("show", spec, "diagram", "--along", "shaft.load", "--values", 2, "--strobes", 4, "--json").out
    )
    assert (diagram["parameter"], diagram["order"]) == ([0.2, 0.3], [2, 1])
    section = sprag("show", spec, "section", "--strobes", 4).out.splitlines()
    assert [line.split(",")[:2] for line in section] == [["regime", "order"], *[["periodic", "2"]] * 2]
    ranges = ("--x-from", 0, "--x-to", "5 rad/s", "--y-from", -0.1, "--y-to", 0.1)
    grid = sprag("show", spec, "basin", "--x", SPEED, "--y", "pendulums.0.initial_angle", *ranges, "--grid", 2).out
    assert [line.split(",")[2] for line in grid.splitlines()] == ["regime.number", "0", "0", "0", "0"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("diagram", "one_pendulum.json", "--along", "shaft.lode"), "--along"),
        (("section", "one_pendulum.json", "--phase", "400 deg"), "--phase"),
        (("section", "coexisting_motions.json", "--start", 32), "0 to 31"),
        (("basin", "one_pendulum.json", "--x", SPEED), "--x-from"),
        (("regimes", "one_pendulum.json"), "/starts"),
        (("section", "press.toml"), "settle"),
    ],
)
def test_wrong_options_are_refused(sprag: Sprag, examples: Path, words: tuple[object, ...], sentence: str) -> None:
    command, spec, *options = words
    done = sprag(command, examples / str(spec), *options)
    assert done.code == 2
    assert sentence in done.err


def test_a_run_starts_from_the_end_of_a_case_in_its_database(sprag: Sprag, tmp_path: Path) -> None:
    first, second, database = (
        tmp_path / "first.json",
        tmp_path / "second.json",
        f"sqlite:///{tmp_path / 'kept.sqlite3'}",
    )
    first.write_text(json.dumps(changed({"/axes": []})), "utf-8")
    kept = json.loads(sprag("run", first, "--db", database, "-o", tmp_path / "rows.csv", "--json").out)["study"]
    spec = changed({"/axes": [], "/base/start": {"study": kept, "case": 0}})
    del spec["base"]["shaft"]["initial_speed"]
    for name in ("initial_angle", "initial_speed"):
        del spec["base"]["pendulums"][0][name]
    second.write_text(json.dumps(spec), "utf-8")
    alone = sprag("run", second)
    assert (alone.code, "sprag run --db" in alone.err) == (2, True)
    done = sprag("run", second, "--db", database, "--format", "json")
    assert done.code == 0, done.err
    # It turns at once, so it has no run-up.
    (row,) = json.loads(done.out)["rows"]
    assert row["results"]["runup.time"] is None
    for view in (
        ("trajectory", "--points", 5),
        ("settled", "--at-most", 200),
        ("case",),
        ("curves", "--x", "shaft.lode"),
    ):
        alone, here = (sprag("show", second, *view, *db) for db in ((), ("--db", database)))
        assert (alone.code, "sprag run --db" in alone.err) == (2, True), view
        assert (here.code in (0, 4), "shaft.lode" in here.err) == (view[0] != "curves", view[0] == "curves"), here.err
    missing = sprag("show", second, "trajectory", "--db", tmp_path / "missing.sqlite3")
    assert (missing.code, "there is no database" in missing.err) == (2, True)
