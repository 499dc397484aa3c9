"""The command `sprag show ID forces`."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.conftest import Finished

Sprag = Callable[..., Finished]
_DRIVE = "one_pendulum.json"


def test_forces_of_one_case(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    file = tmp_path / "forces.csv"
    done = sprag("show", "forces", examples / _DRIVE, "--case", 178, "--load-rating", "12 kN", "-o", file)
    assert done.code == 0
    rows = {row["result"]: row for row in csv.DictReader(io.StringIO(file.read_text(encoding="utf-8")))}
    assert float(rows["table.force_y.mean"]["value"]) == pytest.approx(-0.5 * 9.80665, rel=1e-9)
    assert rows["bearing.rating_life.time"]["unit"] == "s"
    assert "The largest force on the table is 72.455 N. The vibration gives 7.5205 W on average." in done.err
    table = sprag("show", "forces", examples / _DRIVE, "--case", 178, "--table", "forces", "--points", 5)
    assert len(list(csv.DictReader(io.StringIO(table.out)))) == 5


@pytest.mark.parametrize(
    ("spec", "options", "told"),
    [(_DRIVE, ("--share", 2), "above 0 to 1"), ("press.toml", (), "has no vibrating table")],
)
def test_what_cannot_be_told_is_refused(
    sprag: Sprag, examples: Path, spec: str, options: tuple[object, ...], told: str
) -> None:
    done = sprag("show", "forces", examples / spec, *options)
    assert done.code == 2
    assert told in done.err
