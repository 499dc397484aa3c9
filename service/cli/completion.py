"""What the shell completes beside commands, options and their choices: names, and what only a running service knows."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Final, TypeVar

import typer

from sprag.service.languages import _
from sprag.worker.codes import ENDING_CODES, FLAG_MASKS, PENDING, REGIME_CODES

if TYPE_CHECKING:
    from sprag.service.client import ServiceClient

#: Variable in which typer's scripts ask for completions, or people for such a script.
COMPLETION_VARIABLE: Final = "_SPRAG_COMPLETE"
#: Longest wait for the service, s: somebody waits at the keyboard.
_TIMEOUT: Final = 1.0
#: Studies that are offered, the newest.
_OFFERED: Final = "100"
#: Names that need no quotes in any shell.
_PLAIN: Final = re.compile(r"[\w.-]+")
Offered = TypeVar("Offered", str, tuple[str, str])


def studies(context: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Ids of the newest studies, each with its name and state, and names; nothing where no service answers."""
    return _asked(context, lambda client: _studies(client, incomplete))


def _studies(client: ServiceClient, incomplete: str) -> list[tuple[str, str]]:
    found = client.request("GET", "/studies", params={"page_size": _OFFERED})["studies"]
    ids = [(study["id"], f"{study['name'] or study['model']}, {study['state']}") for study in found]
    names = [(study["name"], study["id"]) for study in found if _PLAIN.fullmatch(study["name"] or "")]
    from sprag.service.client.synchronous.naming import LATEST

    newest = [(LATEST, ids[0][1])] if ids else []
    return [*newest, *ids, *(names if incomplete else ())]


def endings() -> list[str]:
    """Endings of cases."""
    return [name for name in ENDING_CODES if name != PENDING]


def regimes() -> list[str]:
    """Regimes of settled motion."""
    return [name for name, code in REGIME_CODES.items() if code]


def flags() -> list[str]:
    """Flags of cases."""
    return list(FLAG_MASKS)


def presets() -> list[tuple[str, str]]:
    """Studies that come with the program, each with what it shows."""
    from sprag.service.presets import ABOUT, preset_names

    return [(name, _(ABOUT[name].shows)) for name in preset_names()]


def models(context: typer.Context) -> list[str]:
    """Models of the service."""
    return _asked(context, lambda client: [model["name"] for model in client.models()["models"]])


def parameters(context: typer.Context) -> list[tuple[str, str]]:
    """Parameters that vary in the study of the command, each with its unit."""
    return _of_study(context, ("parameters",))


def results(context: typer.Context) -> list[tuple[str, str]]:
    """Results of the study of the command, each with its unit."""
    return _of_study(context, ("results",))


def quantities(context: typer.Context) -> list[tuple[str, str]]:
    """Parameters and results of the study of the command, each with its unit."""
    return _of_study(context, ("parameters", "results"))


def sortings(context: typer.Context) -> list[tuple[str, str]]:
    """What the cases of the study of the command are sorted by."""
    return [("case", _("number of the case")), ("ending", _("how it ended")), *quantities(context)]


def _of_study(context: typer.Context, parts: Sequence[str]) -> list[tuple[str, str]]:
    # A word after an option without its value is not yet the value of an argument.
    named = [context.params.get("study_id"), *(context.params.get("studies") or ()), *context.args]
    study = next((name for name in named if name), None)
    if study is None:
        return []

    def names(client: ServiceClient) -> list[tuple[str, str]]:
        from sprag.service.cli.names import study_of

        case = client.of_case(study_of(client, study), 0, "", ())
        return [(name, case["units"].get(name, "")) for part in parts for name in case[part]]

    return _asked(context, names)


def _asked(context: typer.Context, ask: Callable[[ServiceClient], list[Offered]]) -> list[Offered]:
    """What the service of the command answers; nothing where none answers."""
    from sprag.service.cli.console import CommandFailureError
    from sprag.service.client import RefusedError, ServiceClient, UnreachableError

    given: dict[str, Any] = context.params
    try:
        with ServiceClient(given.get("server"), given.get("token"), retry=0.0, timeout=_TIMEOUT) as client:
            return ask(client)
    except (CommandFailureError, RefusedError, UnreachableError, ValueError):  # ValueError: the address of the service
        return []
