"""The settings of a command: from its options, the environment, the file of settings, the defaults, in this order."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.cli.console import WrongInputError
from sprag_study.service.faults import Fault
from sprag_study.service.languages import _
from sprag_study.service.reading.texts import shorten

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings


def read_settings(**options: object) -> Settings:
    """The settings, overridden by the given options.

    Raises WrongInputError with every invalid setting, named by its environment variable or option.
    """
    from pydantic import ValidationError

    from sprag_study.service.settings import ENV_PREFIX, Settings, SettingsFileError, is_secret

    given = {name: value for name, value in options.items() if value is not None}
    try:
        return Settings(**given)  # type: ignore[arg-type]
    except SettingsFileError as error:
        raise WrongInputError("invalid-settings", str(error)) from error
    except ValidationError as error:
        problems = []
        for item in error.errors(include_url=False):
            name = str(item["loc"][0])
            value = None if is_secret(name) else shorten(item.get("input"))
            problems.append(
                Fault(
                    ENV_PREFIX + name.upper(),
                    "wrong-type" if item["type"] == "missing" else "invalid-text",
                    item["msg"].removeprefix("Value error, "),
                    value,
                )
            )
        raise WrongInputError("invalid-settings", _("invalid setting"), problems) from error
