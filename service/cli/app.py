"""All commands, and the only place where failures become exit codes."""

from __future__ import annotations

import json
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cache
from typing import Annotated, cast

import typer
from typer.core import TyperGroup
from typer.main import get_command

from sprag_study.service import languages
from sprag_study.service.actor import Door, act_as, of_machine
from sprag_study.service.cli import (
    calibrations,
    case_views,
    cases,
    catalogue,
    compare,
    components,
    database,
    demo,
    doctor,
    explore,
    extend,
    fit,
    local,
    processes,
    regimes,
    remote,
    saved_views,
    schedule,
    settings,
    settle,
    single_case,
    studies,
    study_views,
    token,
    user,
    workers,
)
from sprag_study.service.cli.completion import COMPLETION_VARIABLE
from sprag_study.service.cli.console import (
    CommandFailureError,
    ExitCode,
    TroubleError,
    WrongInputError,
    say,
    write_text,
    wrong_option,
)
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.language import OPTION, VARIABLE, chosen, code_of, refusal, translate
from sprag_study.service.extras import command_for
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


def _known_language(code: str | None) -> None:
    if code is not None and code_of(code) not in languages.available():
        raise wrong_option(
            OPTION,
            "invalid-choice",
            N_("is not a language of this program"),
            code,
            allowed=", ".join(languages.available()),
        )


@app.callback()
def _every_command(
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    _language: Annotated[
        str | None,
        typer.Option(
            OPTION,
            envvar=VARIABLE,
            metavar="CODE",
            callback=_known_language,
            help="Language of help and messages, such as uk; default: that of the system. JSON is always English.",
        ),
    ] = None,
) -> None:
    """Options before the name of a command; typer shows the application's own help instead of this text."""


_COMMANDS: dict[str, dict[str, Callable[..., None]]] = {
    N_("Run here"): {
        "run": local.run,
        "validate": local.validate,
        "preview": local.preview,
        "settle": settle.settle,
        "calibrate": calibrations.calibrate,
        **case_views.COMMANDS,
        "regimes": regimes.regimes,
        "fit": fit.fit,
        "presets": local.presets,
    },
    N_("Run a service"): {
        "demo": demo.demo,
        "serve": processes.serve,
        "worker": processes.worker,
        "doctor": doctor.doctor,
        "settings": settings.settings,
    },
    N_("Use a running service"): {
        "submit": remote.submit,
        "extend": extend.extend,
        "longer": extend.longer,
        "narrow": extend.narrow,
        "select": explore.select,
        "watch": remote.watch,
        "list": studies.list_studies,
        "edit": studies.edit,
        "delete": studies.delete,
        "restore": studies.restore,
        "pause": remote.pause,
        "resume": remote.resume,
        "cancel": remote.cancel,
        "retry": remote.retry,
        "prioritize": remote.prioritize,
        "case": single_case.case,
        "cases": cases.cases,
        "compare": compare.compare,
        "export": remote.export,
        "models": catalogue.models,
        "rounds": remote.rounds,
        "workers": workers.workers,
    },
    N_("See results"): study_views.COMMANDS,
}
for _title, _commands in _COMMANDS.items():
    for _name, _command in _commands.items():
        app.command(_name, rich_help_panel=_title)(_command)
app.add_typer(components.app, name="component", rich_help_panel="Use a running service")
app.add_typer(schedule.app, name="schedule", rich_help_panel="Use a running service")
app.add_typer(saved_views.app, name="view", rich_help_panel="Use a running service")
app.add_typer(token.app, name="token", rich_help_panel="Run a service")
app.add_typer(user.app, name="user", rich_help_panel="Run a service")
app.add_typer(database.app, name="db", rich_help_panel="Run a service")


@cache
def command_line(language: str) -> TyperGroup:
    """All commands with their options, which typer reads from the signatures of functions; help is in ``language``."""
    tree = cast("TyperGroup", get_command(app))
    if language != languages.ENGLISH:
        translate(tree)
    return tree


def execute(arguments: Sequence[str]) -> int:
    """Run one command; returns the exit code. Every failure is reported on standard error."""
    with languages.language(chosen(arguments, os.environ)):
        return _executed(arguments)


def _executed(arguments: Sequence[str]) -> int:
    for stream in (sys.stdout, sys.stderr):
        # A terminal with another character set shows an escape instead of ending the command.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    try:
        with act_as(of_machine(Door.COMMAND)):
            code = _invoke(arguments)
        sys.stdout.flush()
    except (BrokenPipeError, _PipeClosedError):
        _drop_output()
        code = ExitCode.PIPE_CLOSED
    except OSError as error:  # a full disk, or no permission to write temporary files
        _drop_output()
        place = error.filename or _("standard output")
        failure = TroubleError("write-failed", f"{place}: {(error.strerror or str(error)).lower()}")
        code = _report(failure, "--json" in arguments)
    return int(code)


class _PipeClosedError(Exception):
    """The reader of standard output went away."""


def _invoke(arguments: Sequence[str]) -> int:
    from sprag_study.worker.ports import ExecutorError, StoreError

    as_json = "--json" in arguments
    try:
        code = (
            command_line(languages.current())(list(arguments), prog_name="sprag", standalone_mode=False)
            or ExitCode.DONE
        )
        if code == ExitCode.INTERRUPTED:  # as typer returns Ctrl-C
            say(_("interrupted"))
        return int(code)
    except CommandFailureError as failure:
        return _report(failure, as_json)
    except FaultError as error:
        return _report(TroubleError(cast("Kind", error.code), error.detail, error.faults), as_json)
    except (StoreError, ExecutorError) as error:
        return _report(TroubleError(cast("Kind", error.code), str(error)), as_json)
    except typer.TyperException as error:
        return _usage(error, as_json)
    except typer.Abort:
        return ExitCode.INTERRUPTED
    except OSError:
        raise
    except SystemExit as stop:
        if stop.code == 0 or COMPLETION_VARIABLE in os.environ:  # what completion ends with
            return cast("int", stop.code)
        # typer turns a broken pipe into exit code 1, which here would mean that some cases failed.
        raise _PipeClosedError from stop
    except Exception as error:
        command = command_for(error) if isinstance(error, ModuleNotFoundError) else None
        if command is not None:
            return _report(
                TroubleError(
                    "missing-extra", _("this command needs a package that is not installed: {command}", command=command)
                ),
                as_json,
            )
        if os.environ.get(DEBUG_VARIABLE):
            traceback.print_exc()
        what = f"{type(error).__name__}: {error}"
        sentence = _("This is a bug in Sprag: {what}. {variable}=1 shows where.", what=what, variable=DEBUG_VARIABLE)
        return _report(TroubleError("internal", sentence), as_json)


def _usage(error: typer.TyperException, as_json: bool) -> int:
    """Report an invalid command line."""
    context = getattr(error, "ctx", None)
    message = error.format_message().replace(": Value error, ", ": ")
    if context is not None and message == context.get_help():  # a group without a command
        say(message)
    elif as_json:
        say(json.dumps(WrongInputError("invalid-parameter", message).document(), ensure_ascii=False))
    elif message:
        say(f"sprag: {refusal(message)}")
        if context is not None:
            say(_("`{command} --help` shows how it is called.", command=context.command_path))
    return ExitCode.WRONG_INPUT


def _report(failure: CommandFailureError, as_json: bool) -> int:
    if as_json:
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
