"""The command `sprag show ID branch`."""

from __future__ import annotations

import csv
import io
import json
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import Finished

Sprag = Callable[..., Finished]


def test_the_example_of_the_guide(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    guide = (examples.parent / "docs" / "branches.md").read_text(encoding="utf-8")
    command = next(line for line in guide.splitlines() if line.startswith("    sprag show "))
    words = shlex.split(command)[1:]
    words[1], words[-1] = str(examples / Path(words[1]).name), str(tmp_path / words[-1])
    done = sprag(*words)
    assert done.code == 0
    (told,) = (block.split("```")[0] for block in guide.split("```text\n")[1:])
    assert done.err.replace(f"{tmp_path}/", "").splitlines() == told.splitlines()
    rows = list(csv.DictReader(io.StringIO(Path(words[-1]).read_text(encoding="utf-8"))))
    assert [row["special"] for row in rows if row["special"]] == ["doubling", "grazing", "grazing", "grazing"]
    loads = [float(row["shaft.load"]) for row in rows]
    assert (loads[0], loads[-1]) == (0.1, 0.5)
    assert all((row["stable"] == "true") == (load > 0.22299) for row, load in zip(rows, loads, strict=True))


def test_json(sprag: Sprag, examples: Path) -> None:
    words = ("--case", 178, "--along", "shaft.load", "--from", "0.19 N*m", "--to", 0.23, "--json")
    made = json.loads(sprag("show", examples / "one_pendulum.json", "branch", *words).out)
    assert (made["order"], made["value"], made["low"]) == (2, 0.2, 0.19)
    assert [special["kind"] for special in made["specials"]] == ["grazing", "doubling"]
    assert made["ends"][1] == "the orbit has half the order there, where its period doubles"


@pytest.mark.parametrize(
    ("spec", "words", "told"),
    [
        ("one_pendulum.json", ("--case", 10**6), "there is no such case"),
        ("one_pendulum.json", ("--case", 1, "--to", 0.05), "must contain the value of the case"),
        ("press.toml", (), "has no strobes"),
    ],
)
def test_what_cannot_be_followed_is_refused(
    sprag: Sprag, examples: Path, spec: str, words: tuple[object, ...], told: str
) -> None:
    done = sprag("show", "branch", examples / spec, "--along", "shaft.load", *words)
    assert done.code == 2
    assert told in done.err
