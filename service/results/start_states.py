"""The checks of what a request says of the starts of a case."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.faults import parameter_error
from sprag_study.service.reading.limits import span
from sprag_study.service.results.selection import of_name
from sprag_study.worker.models.starts import count_of
from sprag_study.worker.models.vibration_drive.start_states import impossible_starts, is_state

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from sprag_study.worker.study import Study


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
            raise parameter_error(
                names[path], "conflict", "is the state of a clutch, whose numbers have nothing in between", path,
                "the path of another number",
            )  # fmt: skip
        for found in impossible_starts({**machine, **corner}):
            name = names.get(found.path, next(iter(names.values())))
            raise parameter_error(name, found.code, of_name(found.path, found.message), found.value, found.allowed)


def check_start(study: Study, start: int | None) -> None:
    """Refuse a number of a start that the cases of the study do not have."""
    count = count_of(study.run)
    if start is not None and start >= count:
        raise parameter_error("start", "out-of-range", "there is no such start", start, span("0", str(count - 1)))
