"""Output of commands: data on standard output, progress and messages on standard error.

Colours and bars appear only on a terminal. With ``--json`` the data are JSON and a failure is one JSON object on
standard error, so that programs never have to parse prose.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final

from sprag.service.faults import Code, Fault, FaultError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

#: Width of tables that do not go to a terminal: wide enough that no number is cut.
_PLAIN_WIDTH = 160
_WIDEST = 100_000
#: Name of the normal ending of a case; asking the models would load the engine.
OK: Final = "ok"


class ExitCode(IntEnum):
    """Exit codes of every command."""

    DONE = 0
    NOT_ALL_OK = 1
    WRONG_INPUT = 2
    TROUBLE = 3
    INTERRUPTED = 130
    PIPE_CLOSED = 141


class CommandFailureError(FaultError):
    """A command failed; carries the exit code and all messages."""

    exit_code = ExitCode.TROUBLE

    def lines(self) -> Iterator[str]:
        """The message and every fault, one per line."""
        yield self.detail
        for fault in self.faults:
            yield f"  {fault}"

    def document(self) -> dict[str, object]:
        """The same as plain JSON data."""
        document: dict[str, object] = {"error": self.detail, "code": self.code, "exit_code": int(self.exit_code)}
        if self.faults:
            document["problems"] = [fault.to_json() for fault in self.faults]
        return document


class WrongInputError(CommandFailureError):
    """The input is wrong: exit code 2."""

    exit_code = ExitCode.WRONG_INPUT


class TroubleError(CommandFailureError):
    """The service or the storage has a problem: exit code 3."""


def wrong_option(
    option: str,
    code: Code,
    message: str,
    value: object = None,
    *,
    allowed: str | None = None,
    unit: str | None = None,
    detail: str = "invalid option",
) -> WrongInputError:
    """The failure that one option of the command means."""
    return WrongInputError("invalid-parameter", detail, [Fault(option, code, message, value, allowed, unit)])


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


def console() -> Console:
    """The console of standard output: colours on a terminal only."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else _PLAIN_WIDTH, soft_wrap=False, highlight=False)


#: A heading, whether the column holds numbers, and (False where it is left out) whether its texts are never cut.
Column = tuple[str, bool] | tuple[str, bool, bool]


def table(title: str, columns: Iterable[Column], rows: Iterable[Sequence[object]]) -> Table:
    """A table for people.

    None becomes a dash: a value that could not be computed.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    made = Table(title=Text(title) if title else None, title_justify="left", box=SIMPLE_HEAD, header_style="bold")
    texts = [[cell_text(cell) for cell in row] for row in rows]
    for index, (heading, numeric, *whole) in enumerate(columns):
        # Truncated numbers or ids would be worse than a wide table.
        longest = max((len(row[index]) for row in texts), default=0) if numeric or any(whole) else None
        made.add_column(Text(heading), justify="right" if numeric else "left", min_width=longest)
    for row in texts:
        made.add_row(*map(Text, row))
    return made


def show_table(title: str, columns: Iterable[Column], rows: Iterable[Sequence[object]]) -> None:
    """Print a table on standard output, as wide as its numbers need."""
    from rich.measure import Measurement

    out, made = console(), table(title, columns, rows)
    out.width = max(out.width, Measurement.get(out, out.options.update(max_width=_WIDEST), made).minimum)
    out.print(made)


def cell_text(cell: object) -> str:
    """The text of a cell: six significant digits, a dash for None."""
    if cell is None:
        return "-"
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, float):
        return f"{cell:.6g}" if math.isfinite(cell) else "-"
    return str(cell)


def ending_lines(endings: Mapping[str, int]) -> Iterator[str]:
    """A line for each ending except ok: its number of cases and its meaning."""
    from sprag.worker.models import ENDING_SENTENCES

    for name, count in endings.items():
        if name != OK:
            yield f"  {count} {name}: {ENDING_SENTENCES[name]}"


def duration_text(seconds: float) -> str:
    """A duration for display: "0.4 s", "12 s", "3 min 20 s", "2 h 05 min"."""
    if seconds < 10:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def progress_text(
    state: str,
    rate: float | None,
    seconds_left: tuple[float, float] | None,
    finish_by: str | None = None,
    in_time: str | None = None,
    rounds: str | None = None,
) -> str:
    """Text beside a progress bar: state, round, cases per second, time left, and whether the deadline will be met."""
    parts = [str(state)]
    if rounds is not None:
        parts.append(rounds)
    if rate:
        parts.append(f"{rate:.3g} cases/s")
    if seconds_left is not None:
        low, high = map(duration_text, seconds_left)
        parts.append(f"{low} left" if low == high else f"{low} to {high} left")
    if finish_by is not None and in_time is not None:
        word = {"yes": "in time", "no": "not in time", "unsure": "perhaps in time"}[in_time]
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
