"""Output of commands: data on standard output, progress and messages on standard error.

Colours and bars appear only on a terminal. With ``--json`` the data are JSON and a failure is one JSON object on
standard error, so that programs never have to parse prose.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from enum import IntEnum
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, Final

import typer

from sprag_study.sentences import Sentence, WarningText
from sprag_study.service import languages
from sprag_study.service.cli.layout import Shape, blocks, broken, longest_piece, width_of
from sprag_study.service.faults import Code, Fault, FaultError
from sprag_study.service.languages import N_, _, decimal, pgettext

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from sprag_study.service.reading.quantities import Units

#: Units in which tables have quantities; SI where none are asked for.
_UNITS: ContextVar[Units | None] = ContextVar("units", default=None)
#: Width of titles that do not go to a terminal; tables are as wide as they need.
_PLAIN_WIDTH = 160
#: Fraction of the seconds of a time (RFC 3339).
_FRACTION: Final = re.compile(r"(?<=:\d\d)\.\d+")
#: Name of the normal ending of a case; asking the models would load the engine.
OK: Final = "ok"


class ExitCode(IntEnum):
    """Exit codes of every command."""

    DONE = 0
    FAULT = 1
    WRONG_INPUT = 2
    TROUBLE = 3
    NOT_ALL_OK = 4
    INTERRUPTED = 130
    PIPE_CLOSED = 141

    @property
    def sentence(self) -> str:
        """What it means."""
        return _(_EXIT_SENTENCES[self])


_EXIT_SENTENCES: Final = {
    ExitCode.DONE: N_("done"),
    ExitCode.FAULT: N_("a fault of this program"),
    ExitCode.WRONG_INPUT: N_("wrong input; every problem has its own line: where, what, the value, what is allowed"),
    ExitCode.TROUBLE: N_("the service does not answer, a disk is full or fails, or the database cannot be used"),
    ExitCode.NOT_ALL_OK: N_("some cases did not end ok, or something of a night needs attention"),
    ExitCode.INTERRUPTED: N_("interrupted with Ctrl-C"),
    ExitCode.PIPE_CLOSED: N_("the reader of standard output went away"),
}


def state_text(state: str) -> str:
    """The state of a study within a sentence; tables have its name, as options take it."""
    return _(state)


class CommandFailureError(FaultError):
    """A command failed; carries the exit code and all messages."""

    exit_code = ExitCode.TROUBLE

    def lines(self) -> Iterator[str]:
        """The message and every fault, one per line."""
        yield _translated(self.detail) if isinstance(self.detail, Sentence) else _(self.detail)
        for fault in self.faults:
            yield f"  {fault_line(fault)}"
            if languages.current() != languages.ENGLISH and not _is_translated(fault):
                yield f"    {fault.message}"

    def document(self) -> dict[str, object]:
        """The same as plain JSON data."""
        document: dict[str, object] = {"error": self.detail, "code": self.code, "exit_code": int(self.exit_code)}
        if self.faults:
            document["problems"] = [fault.to_json() for fault in self.faults]
        return document


def _is_translated(fault: Fault) -> bool:
    from sprag_study.service.reading.faults import is_translated

    return is_translated(fault)


def _translated(sentence: Sentence) -> str:
    from sprag_study.service.reading.faults import translated

    return translated(sentence)


def fault_line(fault: Fault) -> str:
    """A fault in one line: where it is, what it is, the value, and what is allowed.

    A sentence that has no translation is replaced by the meaning of its code.
    """
    if languages.current() == languages.ENGLISH:
        return str(fault)
    from sprag_study.service.reading.faults import allowed_text, fault_text, value_text
    from sprag_study.service.reading.wording import unit_text

    details = []
    if fault.value is not None:
        value = value_text(fault.value)
        details.append(_("got {value}", value=repr(value) if isinstance(value, str) else value))
    if fault.allowed is not None:
        details.append(_("allowed: {allowed}", allowed=allowed_text(fault.allowed)))
    if fault.unit_to_tell:
        details.append(_("unit {unit}", unit=unit_text(fault.unit_to_tell)))
    where = fault.where or _("(the whole spec)")
    return f"{where}: {fault_text(fault)}" + (f" ({'; '.join(details)})" if details else "")


class WrongInputError(CommandFailureError):
    """The input is wrong: exit code 2."""

    exit_code = ExitCode.WRONG_INPUT


class TroubleError(CommandFailureError):
    """The service or the storage has a problem: exit code 3."""


class BugError(CommandFailureError):
    """The program itself is wrong: exit code 1."""

    exit_code = ExitCode.FAULT


def wrong_option(
    option: str,
    code: Code,
    message: str,
    value: object = None,
    *,
    allowed: str | None = None,
    unit: str | None = None,
    detail: str | None = None,
) -> WrongInputError:
    """The failure that one option of the command means."""
    return WrongInputError(
        "invalid-parameter", detail or _("invalid option"), [Fault(option, code, message, value, allowed, unit)]
    )


def write_json(data: object) -> None:
    """Write one JSON document and a newline to standard output, in one piece."""
    sys.stdout.write(json.dumps(data, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(text: str) -> None:
    """Write text to standard output unchanged."""
    sys.stdout.write(text)


def say(*lines: str) -> None:
    """Write messages to standard error, one line each; never wrapped, never interpreted as markup."""
    for line in lines:
        sys.stderr.write(line + "\n")


def warning_lines(warnings: Iterable[str], codes: Iterable[str | None] = ()) -> Iterator[str]:
    """A line for each warning: its sentence, with code names and in SI units.

    ``codes`` are those of warnings of a service, which come in English only: in another language such a one has the
    meaning of its code before it. Other warnings know their sentences.
    """
    for text, code in zip_longest(warnings, codes):
        yield _("warning: {text}", text=_warning_text(text, code))


def _warning_text(text: str, code: str | None) -> str:
    if languages.current() == languages.ENGLISH:
        return text
    if isinstance(text, WarningText) and text.sentence is not None:
        from sprag_study.service.reading.reader import shown

        return shown(text)
    from sprag_study.service.fault_meanings import WARNING_MEANINGS

    meaning = dict[str, str](WARNING_MEANINGS.items()).get(str(code or getattr(text, "code", "")))
    return _(text) if meaning is None else f"{_(meaning)} ({text})"


def confirmed(question: str) -> bool:
    """Whether somebody at the terminal says yes to a question, in English or in the language of the task; an empty
    answer is no. Raises typer.Abort where the input ends.
    """
    answers = (pgettext("letters of yes", "y yes"), pgettext("letters of no", "n no"))
    yes, no = ({*english.split(), *own.split()} for english, own in zip(("y yes", "n no"), answers, strict=True))
    while True:
        sys.stderr.write(f"{question} [{answers[0].split()[0]}/{answers[1].split()[0].upper()}]: ")
        sys.stderr.flush()
        line = sys.stdin.readline()
        if not line:
            raise typer.Abort
        given = line.strip().casefold()
        if given in yes or given in no or not given:
            return given in yes


def agreed(question: str, *, yes: bool, needed: str | None = None) -> bool:
    """Whether a command goes on with what it asks about: with --yes, or where somebody at the terminal says yes.

    Where nobody can be asked it goes on, unless ``needed`` says what --yes is needed for there: results are deleted
    only on a word, and access is taken away in any case. WrongInputError then.
    """
    if yes:
        return True
    if sys.stdin.isatty():
        return confirmed(question)
    if needed is not None:
        raise wrong_option("--yes", "required", N_("is needed where nobody can be asked"), detail=needed)
    return True


def console() -> Console:
    """The console of standard output: colours on a terminal only."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else _PLAIN_WIDTH, soft_wrap=False, highlight=False)


def piped() -> bool:
    """Whether standard output is for a program rather than for people at a terminal."""
    return not sys.stdout.isatty()


@contextmanager
def table_words() -> Iterator[None]:
    """Words and numbers of tables within the block: those of the reader on a terminal, else English ones."""
    with languages.language(languages.ENGLISH if piped() else languages.current()):
        yield


@contextmanager
def tables_in(units: Units) -> Iterator[None]:
    """Quantities of tables within the block have these units."""
    before = _UNITS.set(units)
    try:
        yield
    finally:
        _UNITS.reset(before)


def in_unit(value: Any, si: str) -> Any:
    """A number in SI in the unit of tables; texts and missing numbers as they are."""
    units = _UNITS.get()
    return value if units is None else units.cell(value, si)


def unit_of(si: str) -> str:
    """The unit of tables for quantities of an SI unit; "" for numbers without one."""
    units = _UNITS.get()
    unit = si if units is None else units.unit(si)
    return "" if unit == "1" else unit


class Heading(str):
    """The heading of a column of quantities, whose numbers are in the unit ``si``."""

    __slots__ = ("si",)
    si: str

    def __new__(cls, text: str, si: str) -> Heading:
        made = super().__new__(cls, text)
        made.si = si
        return made


def heading(name: str, si: str) -> Heading:
    """The heading of a column of quantities: the name with the unit of tables."""
    return Heading(f"{name} [{unit}]" if (unit := unit_of(si)) else name, si)


#: A heading, whether the column holds numbers, and (False where it is left out) whether its texts are never cut.
Column = tuple[str, bool] | tuple[str, bool, bool]


def show_table(title: str, columns: Iterable[Column], rows: Iterable[Sequence[object]]) -> None:
    """Print a table on standard output: as `draw_table` on a terminal, elsewhere for programs, without its title."""
    headed, cells = _in_units(columns, rows)
    if piped():
        write_rows([head.replace(".\n", ".") for head, *_ in headed], cells)
    else:
        _draw(title, headed, cells)


def draw_table(title: str, columns: Iterable[Column], rows: Iterable[Sequence[object]]) -> None:
    """Print a table for people, wherever it goes; None becomes a dash: a value that could not be computed.

    It is as wide as the terminal: headings and texts are broken into lines, and columns for which there is no room go
    on below, each time beside the first one. Numbers and ids are never cut, and names with dots only after these.
    """
    _draw(title, *_in_units(columns, rows))


def _in_units(columns: Iterable[Column], rows: Iterable[Sequence[object]]) -> tuple[list[Column], list[list[object]]]:
    """The columns, and the cells in the units of the reader."""
    headed = list(columns)
    units = [head.si if isinstance(head, Heading) else "1" for head, *_ in headed]
    return headed, [list(map(in_unit, row, units)) for row in rows]


def _draw(title: str, headed: Sequence[Column], cells: Sequence[Sequence[object]]) -> None:
    texts = [[cell_text(cell) for cell in row] for row in cells]
    from rich.cells import cell_len

    out = console()
    shapes = []
    for index, (heading, numeric, *whole) in enumerate(headed):
        longest = max((cell_len(row[index]) for row in texts), default=0)
        piece = longest if numeric else max((longest_piece(row[index], cell_len) for row in texts), default=0)
        shapes.append(Shape(heading, longest, numeric or any(whole), piece))
    parts = blocks(shapes, out.width)
    out.width = max(out.width, *(width_of([*part.values()]) for part in parts))
    for number, part in enumerate(parts):
        out.print(_table(title if number == 0 else "", headed, part, texts))


def write_rows(headings: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a table for programs: lines with tabs between cells, whole numbers with decimal points, English words."""
    lines = ("\t".join(map(_flat, row)) for row in ([*headings], *rows))
    write_text("".join(f"{line}\n" for line in lines))


def write_table(content: bytes) -> None:
    """Write a table of CSV for programs, as `write_rows`."""
    headings, *rows = csv.reader(io.StringIO(content.decode("utf-8"), newline=""))
    write_rows(headings, rows)


def _flat(cell: object) -> str:
    """A cell without what separates cells and lines."""
    text = str(cell) if isinstance(cell, float) and math.isfinite(cell) else cell_text(cell)
    return " ".join(re.split(r"[\t\r\n]+", text))


def _table(title: str, columns: Sequence[Column], widths: Mapping[int, int], texts: Iterable[Sequence[str]]) -> Table:
    """Some columns of a table, in their widths."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    drawn = Table(title=Text(title) if title else None, title_justify="left", box=SIMPLE_HEAD, header_style="bold")
    for index, width in widths.items():
        heading, numeric, *_ = columns[index]
        drawn.add_column(
            Text(broken(heading, width)), justify="right" if numeric else "left", width=width, overflow="fold"
        )
    for row in texts:
        # A name such as a.b.c is broken after its dots, a text between words.
        cells = ((row[index], width) for index, width in widths.items())
        drawn.add_row(*(Text(cell if " " in cell else broken(cell, width)) for cell, width in cells))
    return drawn


def cell_text(cell: object) -> str:
    """The text of a cell: six significant digits, a dash for None."""
    if cell is None:
        return "-"
    if isinstance(cell, bool):
        return _("yes") if cell else _("no")
    if isinstance(cell, float):
        return decimal(f"{cell:.6g}") if math.isfinite(cell) else "-"
    return str(cell)


def time_text(time: str | None) -> str | None:
    """A time of an answer as people read it, in whole seconds; None where there is none."""
    return None if time is None else _FRACTION.sub("", time)


def ending_lines(endings: Mapping[str, int]) -> Iterator[str]:
    """A line for each ending except ok: its number of cases and its meaning."""
    from sprag_study.worker.models import ENDING_SENTENCES

    for name, count in endings.items():
        if name != OK:
            yield f"  {count} {name}: {_(ENDING_SENTENCES[name])}"


def duration_text(seconds: float) -> str:
    """A duration for display: "0.4 s", "12 s", "3 min 20 s", "2 h 05 min"."""
    if seconds < 10:
        return _("{seconds} s", seconds=decimal(f"{seconds:.1f}"))
    whole = round(seconds)
    if whole < 60:
        return _("{seconds} s", seconds=whole)
    if whole < 3600:
        return _("{minutes} min {seconds} s", minutes=whole // 60, seconds=f"{whole % 60:02d}")
    return _("{hours} h {minutes} min", hours=whole // 3600, minutes=f"{whole % 3600 // 60:02d}")


def progress_text(
    state: str,
    rate: float | None,
    seconds_left: tuple[float, float] | None,
    finish_by: str | None = None,
    in_time: str | None = None,
    rounds: str | None = None,
) -> str:
    """Text beside a progress bar: state, round, cases per second, time left, and whether the deadline will be met."""
    parts = [state_text(state)]
    if rounds is not None:
        parts.append(rounds)
    if rate:
        parts.append(_("{rate} cases/s", rate=decimal(f"{rate:.3g}")))
    if seconds_left is not None:
        low, high = map(duration_text, seconds_left)
        parts.append(
            _("{time} left", time=low) if low == high else _("{shortest} to {longest} left", shortest=low, longest=high)
        )
    if finish_by is not None and in_time is not None:
        word = {"yes": _("in time"), "no": _("not in time"), "unsure": _("perhaps in time")}[in_time]
        parts.append(f"{word} ({finish_by})")
    return ", ".join(parts)


@contextmanager
def progress_bar(description: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show a progress bar on standard error; nothing where standard error is not a terminal.

    Yields a function of (done, total, remark).
    """
    if not sys.stderr.isatty():
        yield lambda _done, _total, _remark: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns: tuple[Any, ...] = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[remark]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(description, total=None, remark="")

        def update(done: int, total: int, remark: str) -> None:
            progress.update(task, completed=done, total=total, remark=remark)

        yield update
