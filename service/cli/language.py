"""The language of the command line: which one somebody reads, and its help and its refusals of options in it.

typer makes help and refusals of the signatures of commands, in English. Here their texts are replaced by those of the
catalogue: once in the tree of commands, then where the rest of a page of help is written.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, cast

import typer

from sprag_study.service import languages
from sprag_study.service.cli.groups import ANYWHERE
from sprag_study.service.languages import ENGLISH, N_, _

OPTION: Final = "--language"
VARIABLE: Final = "SPRAG_LANGUAGE"
#: Variables of the system, in their order of precedence.
_SYSTEM: Final = ("LC_ALL", "LC_MESSAGES", "LANG")
#: What typer writes behind the text of an option, and its own words.
_REMARKS: Final = re.compile(r"(?s)(.*?)(?:  )?\[((?:default: |env var: |required|[-\d.e]*x?[<>]=?)[^\[]*)\]")
_REMARK: Final = {"default": N_("default: {value}"), "env var": N_("variable: {value}")}
_WORDS: Final = (
    N_("Usage: "),
    N_("Arguments"),
    N_("Options"),
    N_("Commands"),
    N_("required"),
    N_("Show this message and exit."),
)
#: Refusals of typer, and the same for the catalogue.
_REFUSALS: Final = tuple(
    (re.compile(pattern, re.DOTALL), text)
    for pattern, text in (
        (r"Missing argument (?P<name>'.*?')\..*", N_("the argument {name} is missing")),
        (r"Missing option (?P<name>'.*?')\..*", N_("the option {name} is missing")),
        (r"Missing command\.", N_("the command is missing")),
        (r"No such command (?P<name>'.*?')\.", N_("there is no command {name}")),
        (
            r"No such command (?P<name>'.*?')\. Did you mean (?P<like>.*)\?",
            N_("there is no command {name}; similar ones: {like}"),
        ),
        (r"No such option: (?P<name>\S+)", N_("there is no option {name}")),
        (
            r"No such option: (?P<name>\S+) \((?:Possible options:|Did you mean) (?P<like>.*?)\??\)",
            N_("there is no option {name}; similar ones: {like}"),
        ),
        (r"Option (?P<name>'.*?') requires an argument\.", N_("the option {name} needs a value")),
        (r"Option (?P<name>'.*?') does not take a value\.", N_("the option {name} takes no value")),
        (r"Got unexpected extra argument\(s\) \((?P<text>.*)\)", N_("unexpected arguments: {text}")),
        (
            r"Invalid value for (?P<name>'.*?'): (?P<value>.*) is not in the range (?P<range>.*)\.",
            N_("{name}: {value} is not in the range {range}"),
        ),
        (
            r"Invalid value for (?P<name>'.*?'): (?P<value>.*) is not a valid int(?: range)?\.",
            N_("{name}: {value} is not a whole number"),
        ),
        (
            r"Invalid value for (?P<name>'.*?'): (?P<value>.*) is not a valid float(?: range)?\.",
            N_("{name}: {value} is not a number"),
        ),
        (
            r"Invalid value for (?P<name>'.*?'): (?P<value>.*) is not one of (?P<choices>.*)\.",
            N_("{name}: {value} is not one of {choices}"),
        ),
    )
)
#: How typer says that a text is no number.
_NUMBER: Final = re.compile(r"is not a valid (int|float)(?: range)?\.\Z")


def chosen(arguments: Sequence[str], environment: Mapping[str, str]) -> str:
    """The code of the language of a command line.

    It is that of ``--language`` before the command, of ``SPRAG_LANGUAGE``, or of the messages of the system; English
    for programs, which ask for JSON.
    """
    if "--json" in arguments:
        return ENGLISH
    system = next((environment[name] for name in _SYSTEM if environment.get(name)), "")
    asked = _asked(arguments) or environment.get(VARIABLE) or system
    return code_of(asked)


def code_of(text: str) -> str:
    """The code in the name of a language: ``uk`` of ``uk_UA.UTF-8``."""
    return re.split(r"[_.@-]", text.lower())[0]


def _asked(arguments: Sequence[str]) -> str:
    """The value of ``--language`` among what stands before the command."""
    rest = iter(arguments)
    for argument in rest:
        name, equals, value = argument.partition("=")
        if name == OPTION:
            return value if equals else next(rest, "")
        if not argument.startswith("-"):
            break
        if not equals and ANYWHERE.get(name):
            next(rest, None)
    return ""


def texts(command: Any) -> Iterator[str]:
    """Every text of the help of a command and of those below it."""
    for item in (command, *command.params):
        if getattr(item, "help", None):
            yield _flat(item.help)
    for inner in getattr(command, "commands", {}).values():
        yield from texts(inner)


def translate(command: Any) -> None:
    """Put a command, and those below it, into the language of the task."""
    command.context_class = _Context
    for item in (command, *command.params):
        if getattr(item, "help", None):
            item.help = _(_flat(item.help))
    for inner in getattr(command, "commands", {}).values():
        translate(inner)


def _flat(text: str) -> str:
    """A text of help with each paragraph on one line, as the catalogue has it."""
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))


_Writer: Any = typer.Context.formatter_class


class _Formatter(_Writer):  # type: ignore[misc]
    """The writer of a page of help in the language of the task."""

    def write_usage(self, prog: str, args: str = "", prefix: str | None = None) -> None:
        """Write how the command is called."""
        super().write_usage(prog, args, _("Usage: ") if prefix is None else prefix)

    def write_heading(self, heading: str) -> None:
        """Write the heading of a section."""
        super().write_heading(_(heading))

    def write_dl(self, rows: Any, col_max: int = 30, col_spacing: int = 2) -> None:
        """Write options or commands with their texts."""
        super().write_dl([(name, _with_remarks(text)) for name, text in rows], col_max, col_spacing)


class _Context(typer.Context):
    """The context of a command whose help is not in English."""

    formatter_class = _Formatter


def _with_remarks(text: str) -> str:
    """A text of help, and what typer writes behind it."""
    found = _REMARKS.fullmatch(text)
    if found is None:
        return _(text)
    remarks = []
    for remark in found[2].split("; "):
        name, colon, value = remark.partition(": ")
        remarks.append(_(_REMARK[name], value=value) if colon and name in _REMARK else _(remark))
    return f"{_(found[1])}  [{'; '.join(remarks)}]" if found[1] else f"[{'; '.join(remarks)}]"


def refusal(message: str) -> str:
    """A refusal of a command line by typer in the language of the task; in English that of a number is reworded."""
    if languages.current() == ENGLISH:
        return _NUMBER.sub(lambda kind: f"is not a {'whole ' if kind[1] == 'int' else ''}number.", message)
    for pattern, text in _REFUSALS:
        if found := pattern.fullmatch(message):
            return _(text, **cast("dict[str, object]", found.groupdict()))
    return message
