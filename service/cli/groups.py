"""Commands in groups, each loaded when it is used; help lists them under their titles."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from importlib import import_module
from typing import Any, Final, NamedTuple, cast

import typer
from typer.core import TyperCommand, TyperGroup
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
        _let_share(source)
        command = get_group_from_info(
            TyperInfo(source, name=name), suggest_commands=True, pretty_exceptions_short=False, rich_markup_mode=None
        )
        _share(command, name, command.params)
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


def _let_share(group: typer.Typer) -> None:
    """Let the commands of a group take options from it."""
    for info in group.registered_commands:
        info.cls = Sharing
    for inner in group.registered_groups:
        _let_share(cast("typer.Typer", inner.typer_instance))


def _share(group: Any, name: str, options: Sequence[Any]) -> None:
    """Give the commands of a group the options that it has, in the place of what they say of these themselves."""
    for command in group.commands.values():
        if hasattr(command, "commands"):
            _share(command, name, options)
            continue
        said = {_parsed_as(option) for option in command.params}
        command.shared = [option for option in options if _parsed_as(option) in said]
        command.group = name
        taken = set(map(_parsed_as, command.shared))
        command.params = [option for option in command.params if _parsed_as(option) not in taken]


def _parsed_as(option: Any) -> tuple[object, ...]:
    """What tells options from each other that are read alike, apart from their help."""
    return option.name, *option.opts, option.multiple if option.param_type_name == "option" else None


class Sharing(TyperCommand):
    """A command with options of its group, which may stand before the command or behind."""

    shared: Sequence[Any] = ()
    group = ""

    def get_params(self, ctx: Any) -> list[Any]:
        """The arguments and options of the command, then those of its group."""
        return [*self.params, *self.shared, *super().get_params(ctx)[len(self.params) :]]

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the options of the command with their help, and a line for each of its group."""
        alone = copy(self)
        alone.shared = ()
        super(Sharing, alone).format_options(ctx, formatter)
        if self.shared:
            with formatter.section(_("More, which `sprag {group} -h` explains", group=self.group)):
                formatter.write_dl(
                    [(option.get_help_record(ctx)[0], _first_part(option.help)) for option in self.shared]
                )


def _first_part(text: str) -> str:
    """The first part of the help of an option, which says what it is."""
    return _PART.split(" ".join(text.split()), maxsplit=1)[0]


class Groups(TyperGroup):
    """A command with commands; help is plain text, because rich would take as long to load as everything else.

    The options of a group are those of its commands, listed once: in a command line they belong to the command.
    """

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put options before the command behind it, except for those of every command, which come first."""
        if ctx.parent is None:  # in a line that is completed they may stand anywhere, too
            front, rest = common_first(args)
            return super().parse_args(ctx, [*front, *rest])
        place = self.place(args) or 0
        return super().parse_args(ctx, [*args[place:], *args[:place]])

    def place(self, args: Sequence[str]) -> int | None:
        """Where the first command stands that is no value of an option before it; None where there is none."""
        valued = {text for option in cast("Any", self).params if not option.is_flag for text in option.opts}
        places = (place for place, word in enumerate(args) if word in self.commands)
        return next((place for place in places if not place or args[place - 1] not in valued), None)

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
