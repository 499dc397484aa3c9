"""The axes that are held in a picture or a table: what can be chosen, and what was."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from starlette.datastructures import QueryParams

from sprag_study.service.faults import SelectionError
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.results.defaults import MOST_CHOICES
from sprag_study.service.results.selection import value_of
from sprag_study.worker.directions import DIRECTIONS, SWEEP

if TYPE_CHECKING:
    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.study import Study

#: Beginning of the name of a field with the value of an axis that has too many to choose from.
_FIELD: Final = "at:"


def with_held(given: QueryParams, study: Study, reading: Reading) -> QueryParams:
    """The parameters of a page, with its fields ``at:shaft.load=100`` as ``at=shaft.load=100 N*mm``.

    Bare numbers in them are in the units that the page shows.
    """
    pairs = []
    for key, value in given.multi_items():
        path = key.removeprefix(_FIELD)
        if path == key:
            pairs.append((key, value))
        elif value.strip():
            unit = unit_of(study, path) if study.axis_of(path) is not None else "1"
            pairs.append(("at", f"{path}={reading.typed(value.strip(), unit)}"))
    return QueryParams(pairs)


def fixed_choices(
    study: Study, drawn: tuple[str, ...], at: tuple[tuple[str, str], ...], reading: Reading
) -> list[dict[str, Any]]:
    """For each held axis of a picture: its values, or none of too many, and the selected one."""
    chosen = dict(at)
    found = []
    for axis in study.axes:
        if len(axis) < 2 or any(path in axis.paths for path in drawn):
            continue
        path = next((path for path in axis.paths if path in chosen), axis.paths[0])
        unit = unit_of(study, axis.paths[0])
        text = chosen.get(path)
        value = _number(path, text, unit)
        found.append(
            {
                "path": axis.paths[0],
                "paths": axis.paths,
                "unit": unit,
                "values": [] if len(axis) > MOST_CHOICES else sorted(set(axis.values)),
                "number": value,
                "shown": text or "" if value is None else f"{reading.value(value, unit):.10g}",
                "names": dict(enumerate(DIRECTIONS)) if axis.paths == (SWEEP,) else {},
            }
        )
    return found


def _number(path: str, text: str | None, unit: str) -> float | None:
    """The held value (SI); None where none is given, or none that can be read."""
    try:
        return None if text is None else value_of(path, text, unit)
    except SelectionError:
        return None
