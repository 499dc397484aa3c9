"""What commands show: the study of a spec, which is run here, or a study of a running service."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.console import wrong_option
from sprag_study.service.cli.files import is_preset
from sprag_study.service.languages import N_

SpecOrStudy = Annotated[
    str,
    typer.Argument(
        metavar="SPEC|ID",
        help="Study spec, JSON or TOML, or a preset, which is run here (- reads standard input); or a study of a "
        "running service.",
        autocompletion=completion.studies,
    ),
]


def is_study(spec: str) -> bool:
    """Whether an argument names a study of a service: it is neither a file nor a preset, and not called like a spec."""
    path = Path(spec)
    return not (spec == "-" or path.suffix.lower() in (".json", ".toml") or path.is_file() or is_preset(spec))


def refuse_here(**given: Any) -> None:
    """Refuse options of a command that runs here where a service answers; WrongInputError."""
    for name, value in given.items():
        if value is not None:
            raise wrong_option(f"--{name}", "not-used", N_("belongs to this machine, and --server names a service"))


def refuse_local(**given: Any) -> None:
    """Refuse what only a spec has; WrongInputError."""
    options = {"every": "--all", "points_file": "--points", "tables": "--file"}
    for name, value in given.items():
        if value is not None and value not in (False, [], ()):
            reason = N_("belongs to a spec that is run here, not to a study of a service")
            raise wrong_option(
                options.get(name, f"--{name}"), "not-used", reason, value if isinstance(value, str) else None
            )
