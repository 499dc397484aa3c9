"""Tables that fit terminals of 50 to 200 columns."""

from __future__ import annotations

import io
import re
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from sprag_study.service import languages
from sprag_study.service.cli.console import show_table
from sprag_study.service.cli.layout import Shape, blocks, broken, width_of

WIDTHS = (50, 64, 80, 100, 132, 200)
NAMES = ("excitation.frequency [Hz]", "shaft.load [N*m]", "shaft.speed.mean [rad/s]", "clutches.0.power.loss [W]")


class Terminal(io.StringIO):
    """Standard output that is a terminal."""

    def isatty(self) -> bool:
        """It is one."""
        return True


def shown(monkeypatch: pytest.MonkeyPatch, width: int, *table: object) -> list[str]:
    """The lines of a table on a terminal of that width, without colours."""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stdout", terminal)
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setenv("TERM", "xterm")
    show_table("A title of the table that is longer than the narrowest of the terminals", *table)  # type: ignore[arg-type]
    monkeypatch.undo()
    return re.sub(r"\x1b\[[0-9;]*m", "", terminal.getvalue()).splitlines()


#: Headings of the widest tables of commands: lists of studies, users, schedules, workers, tokens.
HEADS = (
    ("id", "state", "done", "cases", "created", "restorable until", "name", "tags"),
    ("name", "role", "cases waiting", "limit", "bytes", "limit", "checks", "removed"),
    ("id", "when", "window", "finish by", "last run", "next run", "name"),
    ("host", "workers", "usable", "busy", "idle threads", "refused", "cases/s"),
    ("id", "name", "user", "scope", "state", "created", "expires", "used", "revoked"),
    ("degree", "RMS [N*m]", "largest residual [N*m]", "rank", "condition number"),
)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("heads", HEADS, ids="-".join)
def test_headings_in_ukrainian_fit_the_terminal(
    monkeypatch: pytest.MonkeyPatch, width: int, heads: tuple[str, ...]
) -> None:
    with languages.language("uk"):
        headings = [languages.gettext(head) for head in heads]
        assert headings != list(heads)
        lines = shown(monkeypatch, width, [(head, True) for head in headings], [[0.123456789] * len(heads)])
    assert max(map(cell_len, lines)) <= width
    together = "".join("".join(lines).split())
    assert together.count("0,123457") >= len(heads), "numbers have a decimal comma and are never cut"
    assert all(word in together for heading in headings for word in heading.split())


@pytest.mark.parametrize("width", WIDTHS)
def test_a_wide_table_fits_the_terminal_and_loses_nothing(monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    columns = [("case", True), *((f"{name} {index}", True) for index in range(6) for name in NAMES)]
    columns += [("ending", False), ("flags", False)]
    numbers = [[0.0937412 + 1.37 * (place + 25 * row) for place in range(24)] for row in range(3)]
    texts = [("accuracy_not_reached", "windup_out_of_data, not_settled, \N{CJK UNIFIED IDEOGRAPH-6F22}" * 3)] * 3
    rows = [(row, *numbers[row], *texts[row]) for row in range(3)]
    lines = shown(monkeypatch, width, columns, rows)
    assert max(map(cell_len, lines)) <= width
    words = " ".join(lines).split()
    for row in numbers:
        assert [f"{number:.6g}" for number in row if f"{number:.6g}" not in words] == []
    together = "".join(words)
    for piece in ("excitation.", "frequency", "[rad/s]", "accuracy_not_reached", "windup_out_of_data,"):
        assert piece in together
    assert "\N{HORIZONTAL ELLIPSIS}" not in together
    tables = [line for line in lines if line.split()[:1] == ["case"]]
    assert len(tables) == sum(set(line) == {" ", "\N{BOX DRAWINGS LIGHT HORIZONTAL}"} for line in lines)
    assert len(tables) > 1, "the columns go on below, beside the number of the case"


def test_a_table_for_which_there_is_room_is_one(monkeypatch: pytest.MonkeyPatch) -> None:
    columns = [("id", False, True), ("state", False, True), ("done", True), ("name", False)]
    lines = shown(monkeypatch, 80, columns, [("st_0123456789abcdef", "running", 12, "a name")])
    assert [line.split() for line in lines if "id" in line.split()] == [["id", "state", "done", "name"]]


def test_a_table_that_is_piped_has_a_line_for_each_row(capsys: pytest.CaptureFixture[str]) -> None:
    text = "a text of many words " * 20
    show_table("", [("case", True), ("text", False)], [(1, text), (2, text)])
    lines = [line for line in capsys.readouterr().out.splitlines() if "many" in line]
    assert [line.strip().split(maxsplit=1) for line in lines] == [["1", text.strip()], ["2", text.strip()]]


PATHS = ("clutches.0.engagement.windup.longest", "shaft.load")


@pytest.mark.parametrize("width", WIDTHS)
def test_names_are_broken_after_dots_where_nothing_has_room_beside_them(
    monkeypatch: pytest.MonkeyPatch, width: int
) -> None:
    columns = [("path", False, True), ("range", False), ("", False)]
    lines = shown(monkeypatch, width, columns, [(path, "0 to 1, or none at all", "words " * 20) for path in PATHS])
    assert max(map(cell_len, lines)) <= width
    assert all(piece in " ".join(lines) for piece in ("clutches.", "engagement.", "longest", "shaft."))
    assert (PATHS[0] in " ".join(lines)) is (width > 50)


SHAPES = st.lists(
    st.builds(
        lambda heading, longest, whole, piece: Shape(heading, longest, whole, min(piece, longest)),
        *(st.sampled_from([*NAMES, "n", "two words"]), st.integers(0, 40), st.booleans(), st.integers(0, 24)),
    ),
    min_size=1,
)


@given(SHAPES, st.integers(50, 200))
def test_every_column_stands_once_and_each_table_fits(shapes: list[Shape], width: int) -> None:
    parts = blocks(shapes, width)
    assert [index for part in parts for index in part if index] == [*range(1, len(shapes))]
    for part in parts:
        assert next(iter(part)) == 0
        assert width_of([*part.values()]) <= width or len(part) <= 2
        for index, size in part.items():
            assert shapes[index].narrowest <= size <= shapes[index].natural
            lines = broken(shapes[index].heading, size).split("\n")
            assert max(map(len, lines)) <= size
            assert "".join(lines).replace(" ", "") == shapes[index].heading.replace(" ", "")
