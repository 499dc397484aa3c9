"""All commands, and the only place where failures become exit codes."""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from typing import Annotated, Any, Final, cast

import typer
from typer.core import TyperGroup
from typer.main import get_command

from sprag_study.service import languages
from sprag_study.service.actor import Door, act_as, of_machine
from sprag_study.service.cli.common import CURRENT, Common, wants_json
from sprag_study.service.cli.completion import COMPLETION_VARIABLE
from sprag_study.service.cli.console import (
    BugError,
    CommandFailureError,
    ExitCode,
    TroubleError,
    WrongInputError,
    say,
    write_text,
    wrong_option,
)
from sprag_study.service.cli.groups import Groups, LazyCommands, Word, common_first
from sprag_study.service.cli.language import OPTION, VARIABLE, chosen, code_of, refusal, translate
from sprag_study.service.cli.old_words import forwarded, without_gone
from sprag_study.service.extras import MissingExtraError, command_for
from sprag_study.service.faults import FaultError, Kind
from sprag_study.service.languages import N_, _

#: Environment variable that shows the traceback of a bug.
DEBUG_VARIABLE = "SPRAG_DEBUG"

app = typer.Typer(
    name="sprag",
    cls=Groups,
    help="Design studies of vibration drives with freewheel clutches and of main shafts of machines.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        write_text(f"sprag {version('sprag-study')}\n")
        raise typer.Exit


def _known_language(code: str | None) -> str | None:
    if code is not None and code_of(code) not in languages.available():
        raise wrong_option(
            OPTION,
            "invalid-choice",
            N_("is not a language of this program"),
            code,
            allowed=", ".join(languages.available()),
        )
    return None if code is None else code_of(code)


@app.callback()
def _every_command(
    context: typer.Context,
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    language: Annotated[
        str | None,
        typer.Option(
            OPTION,
            envvar=VARIABLE,
            metavar="CODE",
            callback=_known_language,
            show_envvar=False,
            help="Language, such as uk; default: that of the system, for pictures English.",
        ),
    ] = None,
    server: Annotated[
        str | None,
        typer.Option("--server", metavar="URL", help="Address of the service; default: SPRAG_SERVER, or the login."),
    ] = None,
    token: Annotated[
        str | None,
        typer.Option("--token", metavar="SECRET", help="Token of the service; default: SPRAG_TOKEN, or the login."),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="Answer in JSON, in English; failures as JSON on standard error.")
    ] = False,
) -> None:
    """Options of every command; typer shows the application's own help instead of this text."""
    source = context.get_parameter_source("language")
    typed = source is not None and source.name == "COMMANDLINE"
    CURRENT.set(Common(server, token, as_json, language if typed else None))


_HERE, _SERVICE, _OPERATE = N_("Studies"), N_("A service"), N_("Administration")
#: The words of the command line.
WORDS: Final = {
    "run": Word(_HERE, "local:run", N_("Run a study here, without a service.")),
    "check": Word(_HERE, "local:check", N_("Check a spec; show cases, time and size.")),
    "submit": Word(_HERE, "remote:submit", N_("Submit a study to a service.")),
    "list": Word(_HERE, "studies:list_studies", N_("List the studies of a service.")),
    "show": Word(_HERE, "show:app", N_("Show curves, maps, cases, motions and more.")),
    "study": Word(_HERE, "study:app", N_("Watch, pause, extend or delete a study.")),
    "compare": Word(_HERE, "compare:compare", N_("Compare studies.")),
    "export": Word(_HERE, "export:export", N_("Write all rows of a study, or its report.")),
    "fit": Word(_HERE, "fit:fit", N_("Fit a clutch to measured data.")),
    "presets": Word(_HERE, "local:presets", N_("List or print example studies.")),
    "login": Word(_SERVICE, "login:login", N_("Keep address and token of a service.")),
    "logout": Word(_SERVICE, "login:logout", N_("Forget them.")),
    "schedule": Word(_SERVICE, "schedule:app", N_("Studies that run on a schedule.")),
    "view": Word(_SERVICE, "saved_views:app", N_("Saved views and figures of reports.")),
    "component": Word(_SERVICE, "components:app", N_("Springs, clutches and motors of the office.")),
    "models": Word(_SERVICE, "catalogue:models", N_("List models, their parameters and results.")),
    "serve": Word(_OPERATE, "processes:serve", N_("Start a service.")),
    "demo": Word(_OPERATE, "demo:demo", N_("Run the example study end to end.")),
    "settings": Word(_OPERATE, "settings:settings", N_("Show settings with their origin.")),
    "admin": Word(_OPERATE, "admin:app", N_("Users, tokens, database, workers, doctor.")),
}  # fmt: skip


@cache
def command_line(language: str = languages.ENGLISH) -> TyperGroup:
    """All commands with their options, which typer reads from the signatures of functions; help is in ``language``."""
    tree = cast("TyperGroup", get_command(app))
    for option in cast("Any", tree).params:
        option.hidden = option.hidden or (option.name or "").endswith("_completion")
    foreign = language != languages.ENGLISH
    if foreign:
        translate(tree)
    tree.commands = cast("Any", LazyCommands(WORDS, translate if foreign else lambda _command: None))
    return tree


def execute(arguments: Sequence[str]) -> int:
    """Run one command; returns the exit code. Every failure is reported on standard error."""
    common, words = common_first(arguments)
    before = CURRENT.set(Common(json="--json" in common))
    try:
        with languages.language(chosen(common, os.environ)):
            return _executed(common, words)
    finally:
        CURRENT.reset(before)


def _executed(common: Sequence[str], typed: Sequence[str]) -> int:
    for stream in (sys.stdout, sys.stderr):
        # A terminal with another character set shows an escape instead of ending the command.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        words, new = forwarded(typed)
        if new and not wants_json():
            old = "admin db audit" if typed[0] == "admin" else typed[0]
            say(_("`sprag {old}` is called `sprag {new}` from now on", old=old, new=new))
        words, settings, gone = without_gone(words)
        if not wants_json():
            say(*(_("`{old}` is `{new}` from now on", old=old, new=instead) for old, instead in gone))
        with act_as(of_machine(Door.COMMAND)), _environment(settings):
            code = _invoke([*common, *words])
        sys.stdout.flush()
    except (BrokenPipeError, _PipeClosedError):
        _drop_output()
        code = ExitCode.PIPE_CLOSED
    except OSError as error:  # a full disk, or no permission to write temporary files
        _drop_output()
        place = error.filename or _("standard output")
        code = _report(TroubleError("write-failed", f"{place}: {(error.strerror or str(error)).lower()}"))
    return int(code)


@contextmanager
def _environment(settings: Mapping[str, str]) -> Iterator[None]:
    """Settings of the environment within the block."""
    before = {name: os.environ.get(name) for name in settings}
    os.environ.update(settings)
    try:
        yield
    finally:
        os.environ.update({name: value for name, value in before.items() if value is not None})
        for name in (name for name, value in before.items() if value is None):
            del os.environ[name]


class _PipeClosedError(Exception):
    """The reader of standard output went away."""


def _invoke(arguments: list[str]) -> int:
    try:
        code = command_line(languages.current())(arguments, prog_name="sprag", standalone_mode=False) or ExitCode.DONE
        if code == ExitCode.INTERRUPTED:  # as typer returns Ctrl-C
            say(_("interrupted"))
        return int(code)
    except CommandFailureError as failure:
        return _report(failure)
    except FaultError as error:
        return _report(TroubleError(cast("Kind", error.code), error.detail, error.faults))
    except MissingExtraError as error:
        return _report(TroubleError("missing-extra", str(error)))
    except typer.TyperException as error:
        return _usage(error)
    except typer.Abort:
        return ExitCode.INTERRUPTED
    except OSError:
        raise
    except SystemExit as stop:
        if stop.code == 0 or COMPLETION_VARIABLE in os.environ:  # what completion ends with
            return cast("int", stop.code)
        # typer turns a broken pipe into exit code 1, which here means a fault of the program.
        raise _PipeClosedError from stop
    except Exception as error:
        from sprag_study.worker.ports import ExecutorError, StoreError

        if isinstance(error, StoreError | ExecutorError):
            return _report(TroubleError(cast("Kind", error.code), str(error)))
        command = command_for(error) if isinstance(error, ModuleNotFoundError) else None
        if command is not None:
            return _report(
                TroubleError(
                    "missing-extra", _("this command needs a package that is not installed: {command}", command=command)
                )
            )
        if os.environ.get(DEBUG_VARIABLE):
            traceback.print_exc()
        what = f"{type(error).__name__}: {error}"
        sentence = _("This is a bug in Sprag: {what}. {variable}=1 shows where.", what=what, variable=DEBUG_VARIABLE)
        return _report(BugError("internal", sentence))


def _usage(error: typer.TyperException) -> int:
    """Report an invalid command line."""
    context = getattr(error, "ctx", None)
    message = error.format_message().replace(": Value error, ", ": ")
    if context is not None and message == context.get_help():  # a group without a command
        say(message)
    elif wants_json():
        say(json.dumps(WrongInputError("invalid-parameter", message).document(), ensure_ascii=False))
    elif message:
        say(f"sprag: {refusal(message)}")
        if context is not None:
            say(_("`{command} --help` shows how it is called.", command=context.command_path))
    return ExitCode.WRONG_INPUT


def _report(failure: CommandFailureError) -> int:
    if wants_json():
        say(json.dumps(failure.document(), ensure_ascii=False))
    else:
        say(*(f"sprag: {line}" if index == 0 else line for index, line in enumerate(failure.lines())))
    return failure.exit_code


def _drop_output() -> None:
    """Discard output buffered for a closed pipe, so that the interpreter exits silently."""
    with suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
