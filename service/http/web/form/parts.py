"""Parts of the form that users add and remove: axes, and the variables, goals, limits and points of a search."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from sprag.service.http.web.form.entries import Values, count_in
from sprag.service.http.web.form.tolerances import OWN
from sprag.service.spec.plan import goal
from sprag.worker.limits import MAX_AXES
from sprag.worker.models import machine_shaft


@dataclass(frozen=True, slots=True)
class Part:
    """A list of rows.

    Attributes
    ----------
    pointer : JSON Pointer of the list; the fields of row 0 begin with ``{pointer}/0/``
    most : largest number of rows
    entries : fields of which at least one has a text in a row that is filled in
    new : initial values of a new row
    """

    pointer: str
    most: int
    entries: tuple[str, ...]
    new: Values = field(default_factory=dict)


#: Correlations that the form shows; a spec may have more.
_MOST_CORRELATIONS: Final = 20

#: Conditions that the form shows; a spec may have more.
_MOST_CONDITIONS: Final = 20

#: By the name of the field with the number of rows.
PARTS: Final = {
    "axes": Part("/axes", MAX_AXES, ("path", "tied", "values", "from", "to", "count", "step"), {"way": "linspace"}),
    "vary": Part("/goal/vary", goal.VARY.high, ("path", "tied", "values", "from", "to"), {"way": "from"}),
    "best": Part("/goal/best", goal.BEST.high, ("result",), {"toward": "max"}),
    "subject_to": Part("/goal/subject_to", goal.SUBJECT_TO.high, ("result", "value"), {"kind": "at_most"}),
    "at": Part("/goal/at", MAX_AXES, ("path", "values")),
    "ranges": Part("/sample/ranges", MAX_AXES, ("path", "tied", "from", "to")),
    "exclude": Part("/exclude", _MOST_CONDITIONS, ("path", "value", "and/path", "and/value")),
    "correlations": Part("/correlations", _MOST_CORRELATIONS, ("between/0", "between/1", "coefficient")),
    "stages": Part("/base/drive/stages", machine_shaft.MAX_STAGES, ("kind",)),
    "parts": Part("/base/parts", machine_shaft.MAX_PARTS, ("mechanism",)),
}


def count_of(values: Mapping[str, str], name: str) -> int:
    """Number of rows of a part."""
    return count_in(values, name, 0, 0, PARTS[name].most)


def filled(values: Mapping[str, str], name: str) -> list[int]:
    """The rows of a part that are filled in."""
    part = PARTS[name]
    return [
        index
        for index in range(count_of(values, name))
        if any(values.get(f"{part.pointer}/{index}/{entry}", "").strip() for entry in part.entries)
    ]


def add_row(values: Values, name: str) -> None:
    """Add a row, unless there are as many as there may be."""
    part, count = PARTS[name], count_of(values, name)
    if count < part.most:
        values |= {f"{part.pointer}/{count}/{entry}": text for entry, text in part.new.items()}
        values[name] = str(count + 1)


def add_part(values: Values) -> None:
    """Add a part to a machine shaft, as a copy of its last one; its only mechanism becomes the first of them."""
    count = count_of(values, "parts")
    if not count:
        for name in ("mechanism", "operation"):
            for old in _with_tolerances(f"/base/{name}"):
                copy(values, old, old.replace(name, f"parts/0/{name}", 1))
                drop(values, old)
            _rename(values, f"{name}.", f"parts.0.{name}.")
        count = 1
    if count < PARTS["parts"].most:
        for pointer in _with_tolerances("/base/parts"):
            _copy_row(values, pointer, count - 1, count)
        values["parts"] = str(count + 1)


def _rename(values: Values, old: str, new: str) -> None:
    """Replace the beginning of paths that vary or are in formulas."""
    for name, text in values.items():
        if name.endswith(("/path", "/tied", "/with")) or text.startswith("="):
            values[name] = re.sub(rf"(?<![\w.]){re.escape(old)}", new, text)


def _copy_row(values: Values, pointer: str, source: int, target: int) -> None:
    """Copy the fields of a row; what shares the draw of a tolerance in it is in the same row."""
    copy(values, f"{pointer}/{source}/", f"{pointer}/{target}/")
    paths = pointer.removeprefix(OWN).replace("/", ".")
    for name in [name for name in values if name.startswith(f"{pointer}/{target}/") and name.endswith("/with")]:
        values[name] = values[name].replace(f"{paths}.{source}.", f"{paths}.{target}.")


def _with_tolerances(pointer: str) -> tuple[str, ...]:
    """The beginning of names of fields, and that of the fields of their tolerances."""
    return (pointer, pointer.replace("/base/", OWN, 1)) if pointer.startswith("/base/") else (pointer,)


def drop_row(values: Values, name: str, index: int) -> None:
    """Remove a row; those behind it move up."""
    part, count = PARTS[name], count_of(values, name)
    if index >= count:
        return
    for pointer in _with_tolerances(part.pointer):
        for row in range(index, count):
            drop(values, f"{pointer}/{row}/")
            _copy_row(values, pointer, row + 1, row)
    values[name] = str(count - 1)


def copy(values: Values, source: str, target: str) -> None:
    """Copy the fields that begin with ``source``."""
    values |= {
        target + name.removeprefix(source): text for name, text in list(values.items()) if name.startswith(source)
    }


def drop(values: Values, prefix: str) -> None:
    """Remove the fields that begin with ``prefix``."""
    for name in [name for name in values if name.startswith(prefix)]:
        del values[name]
