"""Texts longer than a cell of a spreadsheet: all of them are in the file, and no number is cut."""

from __future__ import annotations

import copy
import random
from pathlib import Path
from typing import Any

import openpyxl
import pytest

from sprag_study.service.exports import xlsx
from sprag_study.service.exports.source import Source
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import models

LIMIT = 32_767
#: An indicator diagram with decimal commas, as an instrument writes it.
ROWS = [f"{angle / 5:.1f};{1.0 + angle % 37 / 7:.5f}".replace(".", ",") for angle in range(3601)]
DIAGRAM = "\n".join(["angle [deg];p [bar]", *ROWS])
SPEC: dict[str, Any] = {
    "sprag": 1, "model": "machine-shaft", "name": "engine",
    "base": {
        "mean_speed": "100 rad/s", "drive": {"inertia": "1 kg*m^2"},
        "operation": {"quantity": "torque", "value": "5 N*m"},
    },
    "axes": [{"path": "mean_speed", "values": ["100 rad/s"]}],
}  # fmt: skip


def sheet_of(tmp_path: Path, about: dict[str, Any], **given: str) -> list[tuple[Any, ...]]:
    """The sheet of inputs of a study whose spec also has these texts."""
    study = parse_spec(copy.deepcopy(SPEC)).study
    spec = copy.deepcopy(SPEC)
    spec["base"]["operation"] |= given
    source = Source(study, models.study_results(study), iter(()), about, spec)
    return list(openpyxl.load_workbook(xlsx._write(source, tmp_path))["inputs"].iter_rows(values_only=True))


def joined(rows: list[tuple[Any, ...]], name: str) -> str:
    first = next(k for k, row in enumerate(rows) if row[0] == name)
    parts = [str(rows[first][1])]
    for row in rows[first + 1 :]:
        if row[0] != f"{name} (continued)":
            break
        parts.append(str(row[1]))
    assert all(len(part.encode("utf-16-le")) <= 2 * LIMIT for part in parts)
    return "".join(parts)


def test_a_table_given_as_csv_is_there_to_its_last_number(tmp_path: Path) -> None:
    assert len(DIAGRAM) > LIMIT
    rows = sheet_of(tmp_path, {"name": "engine"}, csv=DIAGRAM)
    assert joined(rows, "base.operation.csv") == DIAGRAM
    pieces = xlsx.text_pieces(DIAGRAM)
    assert len(pieces) > 1
    assert all(piece.endswith("\n") for piece in pieces[:-1])


def test_every_long_text_of_the_sheet(tmp_path: Path) -> None:
    notes = "ω" * 70_000
    rows = sheet_of(tmp_path, {"name": "engine", "notes": notes, "computed_by": [{"host": "a" * 40_000, "of": "b"}]})
    assert joined(rows, "notes") == notes
    assert joined(rows, "computed_by") == "a" * 40_000
    # A list of numbers is one line.
    numbers = ",".join(str(k * 1.25) for k in range(8_000))
    assert joined(sheet_of(tmp_path, {"name": "engine"}, values=numbers), "base.operation.values") == numbers
    assert all(piece.endswith(",") for piece in xlsx.text_pieces(numbers)[:-1])


@pytest.mark.parametrize("length", [0, 1, LIMIT - 1, LIMIT, LIMIT + 1, 3 * LIMIT + 5])
@pytest.mark.parametrize("alphabet", ["a", "0,;\n", "\U0001d714x", "ї "])
def test_pieces_are_the_text(length: int, alphabet: str) -> None:
    text = "".join(random.Random(length).choices(alphabet, k=length))
    pieces = xlsx.text_pieces(text)
    assert "".join(pieces) == text
    assert all(len(piece.encode("utf-16-le")) <= 2 * LIMIT for piece in pieces)
