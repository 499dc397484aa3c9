"""The check of initial values that vary on the pages and in the pictures of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.faults import parameter_error
from sprag.worker.models.start_states import impossible_starts, is_state

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


def refuse_impossible(
    names: Mapping[str, str], machine: Mapping[str, float], corners: Iterable[Mapping[str, float]]
) -> None:
    """Raise FaultError where a clutch of a case cannot begin at some values.

    Parameters
    ----------
    names : mapping
        Parameter of the request for each path that varies.
    machine : mapping
        Every parameter of the case, SI.
    corners : iterable of mapping
        The values (SI) that vary, by path, at the corners of their ranges.
    """
    for corner in corners:
        for path in filter(is_state, corner):
            message = "is the state of a clutch, whose numbers have nothing in between"
            raise parameter_error(names[path], "conflict", message, path, "the path of another number")
        for found in impossible_starts({**machine, **corner}):
            name = names.get(found.path, next(iter(names.values())))
            raise parameter_error(name, found.code, f"{found.path} {found.message}", found.value, found.allowed)
