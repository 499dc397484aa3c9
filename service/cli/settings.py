"""``sprag settings``: every setting, its value, and where it comes from."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Final

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import WrongInputError, show_table, table_words, write_json
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_, _
from sprag_study.service.login import DEFAULT_SERVER, profile, profile_file

if TYPE_CHECKING:
    from sprag_study.service.settings import EffectiveSetting

#: Environment variables that are not settings of the service, each with its meaning.
VARIABLES: Final = {
    "SPRAG_SETTINGS": "path of a TOML file with settings",
    "SPRAG_SERVER": "address of the service that commands ask; that of `sprag login`, or "
    f"`{DEFAULT_SERVER}`, unless set",
    "SPRAG_KERNEL_CACHE": "folder of the compiled kernels; the user's cache folder unless set",
    "SPRAG_COMPILER": "`plain` compiles kernels by numba's documented interface alone, for a minute instead of "
    "seconds, with the same results ([porting-numba.md](porting-numba.md)); `programs` unless set",
    "SPRAG_LANGUAGE": "language of help and messages of commands, such as `uk`; that of the system (`LC_ALL`, "
    "`LC_MESSAGES`, `LANG`) unless set",
    "SPRAG_DEBUG": "set to anything: a fault of the program shows where it lies",
}


def _cells(row: EffectiveSetting) -> tuple[str, ...]:
    """Name, value and origin of a setting for a table."""
    from sprag_study.service.settings import DEFAULT_ORIGIN, HIDDEN

    value = _("(secret)") if row.value == HIDDEN else row.value
    return row.name, value, _("default") if row.origin == DEFAULT_ORIGIN else row.origin


def settings() -> None:
    """Show the settings that apply here, each with its origin: a variable of the environment, a file, the default.

    The variable of a setting is its name in capitals after SPRAG_, such as SPRAG_PORT; SPRAG_SETTINGS names a file.
    """
    found = read_settings()
    from sprag_study.service.settings import effective

    rows = [*effective(found), *_of_commands()]
    if wants_json():
        write_json({"settings": [asdict(row) for row in rows]})
    else:
        with table_words():
            show_table("", ((_("setting"), False, True), (_("value"), False), (_("origin"), False)), map(_cells, rows))


def _of_commands() -> Iterator[EffectiveSetting]:
    """Every other variable, by its own name."""
    from sprag_study.service.settings import DEFAULT_ORIGIN, EffectiveSetting, shown

    try:
        from sprag_study.worker import models
    except ValueError as error:  # the engine refuses an unknown SPRAG_COMPILER
        where = "SPRAG_COMPILER"
        fault = Fault(where, "invalid-choice", N_("is not a way to compile"), os.environ.get(where), "programs, plain")
        raise WrongInputError("invalid-settings", _("invalid setting"), [fault]) from error
    login = profile().get("server")
    defaults = {
        "SPRAG_SERVER": login or DEFAULT_SERVER,
        "SPRAG_KERNEL_CACHE": str(models.cache_folder()),
        "SPRAG_COMPILER": "programs",
    }
    for name in VARIABLES:
        value = os.environ.get(name, "")
        other = str(profile_file()) if name == "SPRAG_SERVER" and login else DEFAULT_ORIGIN
        yield EffectiveSetting(name, shown(value or defaults.get(name, "")), name if value else other)
