"""Studies named by people: ``latest``, the beginning of an id, or a name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.cli.console import WrongInputError, wrong_option
from sprag.service.languages import N_, _

if TYPE_CHECKING:
    from sprag.service.client import ServiceClient


def study_of(client: ServiceClient, text: str) -> str:
    """The id of the study that is meant, as the client finds it; WrongInputError where several fit or none is named."""
    from sprag.service.client import AmbiguousError
    from sprag.service.client.synchronous import naming

    if not text.strip():
        allowed = _("the id or name of a study, or latest")
        raise wrong_option("ID", "required", N_("must not be empty"), text, allowed=allowed)
    try:
        return naming.study_of(client, text)
    except AmbiguousError as error:
        raise WrongInputError("invalid-parameter", _("the study is not unique"), error.faults) from error
