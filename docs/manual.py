"""The manual pages of the commands in docs/man, made from their help; `python -m docs.reference` writes them."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import typer

from sprag_study.service.cli.app import command_line
from sprag_study.service.cli.console import ExitCode

FOLDER: Final = Path(__file__).parent / "man"
#: Of these sources; the installed one may be older.
VERSION: Final = tomllib.loads((FOLDER.parents[1] / "pyproject.toml").read_text("utf-8"))["project"]["version"]


def pages() -> dict[str, str]:
    """The text of every page by the name of its file: sprag.1, sprag-run.1, sprag-admin-db-upgrade.1, ..."""
    root = command_line()
    return {f"{name}.1": "\n".join(lines) + "\n" for name, lines in _pages(root, None, "sprag")}


def _pages(command: Any, parent: Any, name: str) -> Iterator[tuple[str, list[str]]]:
    context = typer.Context(command, parent=parent, info_name=name, **command.context_settings)
    yield context.command_path.replace(" ", "-"), list(_page(command, context, parent))
    for inner, own in getattr(command, "commands", {}).items():
        yield from _pages(own, context, inner)


def _page(command: Any, context: Any, parent: Any) -> Iterator[str]:
    title = context.command_path.replace(" ", "-")
    commands = getattr(command, "commands", {})
    yield '.\\" Made from the help of the command by python -m docs.reference.'
    yield f'.TH "{roff(title.upper())}" "1" "" "Sprag {VERSION}" "Sprag manual"'
    paragraphs = [" ".join(part.split()) for part in (command.help or "").split("\n\n")]
    yield from (".SH NAME", rf"{roff(title)} \- {roff(command.get_short_help_str(limit=400).rstrip('.'))}")
    yield from (".SH SYNOPSIS", f".B {roff(context.command_path)}")
    yield " ".join(roff(piece.strip("{}")) for piece in command.collect_usage_pieces(context))
    yield ".SH DESCRIPTION"
    for index, paragraph in enumerate(paragraphs):
        yield from ([] if index == 0 else [".PP"])
        yield roff(paragraph)
    records: dict[str, list[tuple[str, str]]] = {"argument": [], "option": []}
    for parameter in command.get_params(context):
        record = parameter.get_help_record(context)
        if record is not None:
            records[parameter.param_type_name].append(record)
    for kind, entries in records.items():
        yield from _list(f"{kind.upper()}S", entries)
    groups: dict[str, list[tuple[str, str]]] = {}
    for name, own in commands.items():
        entry = (f"{context.command_path} {name}", own.get_short_help_str(limit=400))
        groups.setdefault(getattr(own, "rich_help_panel", None) or "Commands", []).append(entry)
    for heading, entries in groups.items():
        yield from _list(heading.upper(), entries)
    if parent is None:
        yield from _list("EXIT STATUS", [(str(int(code)), code.sentence) for code in ExitCode])
    related = [] if parent is None else [parent.command_path.replace(" ", "-")]
    related += [f"{title}-{name}" for name in commands]
    yield ".SH SEE ALSO"
    yield ",\n".join(rf"\fB{roff(name)}\fR(1)" for name in related)


def _list(heading: str, entries: list[tuple[str, str]]) -> Iterator[str]:
    if entries:
        yield f".SH {roff(heading)}"
    for name, text in entries:
        yield from (".TP", rf"\fB{roff(name)}\fR", roff(" ".join(text.split())))


def roff(text: str) -> str:
    """Text as roff: no escapes, hyphens that can be copied, no line that begins with a request."""
    escaped = text.replace("\\", r"\e").replace("-", r"\-")
    return re.sub(r"^([.'])", r"\\&\1", escaped)
