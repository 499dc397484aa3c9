"""Commands in groups, each loaded when it is used; help lists them under their titles."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from typing import Any, Final, NamedTuple

import typer
from typer.core import TyperGroup
from typer.main import get_command_from_info, get_group_from_info
from typer.models import CommandInfo, TyperInfo

from sprag_study.service.languages import _

#: Longest first sentence of a help text.
_SENTENCE: Final = 400
#: What ends the first part of a help text.
_PART: Final = re.compile(r"[;:.](?: |$)")
#: Options of every command, which may stand anywhere in the line, and how many values each has.
ANYWHERE: Final = {"--json": 0, "--server": 1, "--token": 1, "--language": 1}


class Word(NamedTuple):
    """A command: its heading in the help, where it is (``module:name`` below this package), and what it does."""

    title: str
    place: str
    summary: str


class LazyCommands(Mapping[str, Any]):
    """Commands by name, each loaded when it is asked for and completed by ``finish``."""

    def __init__(self, words: Mapping[str, Word], finish: Callable[[Any], None]) -> None:
        self.words, self._finish = words, finish
        self._loaded: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        """A command; KeyError where there is none."""
        if name not in self._loaded:
            word = self.words[name]
            module, _colon, attribute = word.place.partition(":")
            self._loaded[name] = command_of(name, getattr(import_module(f"{__package__}.{module}"), attribute))
            self._finish(self._loaded[name])
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        """The names in their order."""
        return iter(self.words)

    def __len__(self) -> int:
        """How many there are."""
        return len(self.words)


def command_of(name: str, source: Callable[..., None] | typer.Typer) -> Any:
    """The command of a function, or the group of an application of typer."""
    command: Any
    if isinstance(source, typer.Typer):
        command = get_group_from_info(
            TyperInfo(source, name=name), suggest_commands=True, pretty_exceptions_short=False, rich_markup_mode=None
        )
        _list_once(command, name, command.params)
    else:
        command = get_command_from_info(
            CommandInfo(name, callback=source), pretty_exceptions_short=False, rich_markup_mode=None
        )
    _with_numbers(command)
    _pointing(command)
    return command


def _pointing(command: Any) -> None:
    """Let the help of a command say where the options of all commands are explained."""
    options = ", ".join(ANYWHERE)
    everywhere = _("`sprag -h` explains {options}, which every command has.", options=options)
    command.epilog = "\n\n".join(filter(None, (command.epilog, everywhere)))
    for inner in getattr(command, "commands", {}).values():
        _pointing(inner)


def _with_numbers(command: Any) -> None:
    """Let N stand for a number in help, where nothing else does."""
    for option in command.params:
        if option.metavar is None and str(getattr(option.type, "name", "")).startswith(("int", "float")):
            option.metavar = "N"
    for inner in getattr(command, "commands", {}).values():
        _with_numbers(inner)


def _list_once(group: Any, name: str, options: Sequence[Any]) -> None:
    """Hide options of commands that their group lists; the help of a command has a line for each."""
    listed = {(option.name, *option.opts) for option in options}
    for command in group.commands.values():
        hidden = [option for option in command.params if (option.name, *option.opts) in listed]
        for option in hidden:
            option.hidden = True
        if hidden and not command.epilog:
            names = [" ".join([", ".join(option.opts), option.metavar or ""]).rstrip() for option in hidden]
            width = max(map(len, names)) + 2
            lines = [f"{text:{width}}{_short(option)}" for text, option in zip(names, hidden, strict=True)]
            command.epilog = "\n".join(["\b", _("More, which `sprag {group} -h` explains:", group=name), *lines])
        if hasattr(command, "commands"):
            _list_once(command, name, options)


def _short(option: Any) -> str:
    """The first part of the help of an option, which says what it is."""
    text = _(" ".join((option.help or "").split()))
    return _PART.split(text, maxsplit=1)[0]


class Groups(TyperGroup):
    """A command with commands; help is plain text, because rich would take as long to load as everything else.

    The options of a group are those of its commands, listed once: in a command line they belong to the command.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put options before the command behind it, except for those of every command, which come first."""
        if ctx.parent is None:  # in a line that is completed they may stand anywhere, too
            front, rest = common_first(args)
            return super().parse_args(ctx, [*front, *rest])
        place = next((place for place, word in enumerate(args) if word in self.commands), 0)
        return super().parse_args(ctx, [*args[place:], *args[:place]])

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 - typer's signature
        """Write the name and the first sentence of each command."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for title, name, summary in self.listed():
            groups.setdefault(title, []).append((name, summary))
        for title, rows in groups.items():
            with formatter.section(title):
                formatter.write_dl(rows)

    def listed(self) -> Iterator[tuple[str, str, str]]:
        """Heading, name and summary of each command; those of words that are not loaded stay so."""
        words = self.commands.words if isinstance(self.commands, LazyCommands) else {}
        for name in self.commands:
            if name in words:
                yield words[name].title, name, words[name].summary
            else:
                own = self.commands[name]
                yield getattr(own, "rich_help_panel", None) or "Commands", name, own.get_short_help_str(limit=_SENTENCE)


def common_first(line: Sequence[str]) -> tuple[list[str], list[str]]:
    """A command line as the options that every command has, wherever they stand, and the command with its own.

    Where the last word is such an option that needs a value, there is no command: what reads the options refuses it.
    """
    front: list[str] = []
    rest: list[str] = []
    words = iter(line)
    for word in words:
        name, equals, _value = word.partition("=")
        if word == "--":
            rest += [word, *words]
        elif name in ANYWHERE or (not rest and word.startswith("-")):
            front.append(word)
            if not equals and ANYWHERE.get(name):
                value = next(words, None)
                if value is None:
                    return front, []
                front.append(value)
        else:
            rest.append(word)
    return front, rest
