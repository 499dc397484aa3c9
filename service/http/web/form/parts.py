"""Parts of the form that users add and remove: axes, and the variables, goals, limits and points of a search."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from sprag_study.service.http.web.form.entries import Values, count_in
from sprag_study.service.http.web.form.machine import BASE, entries, form_of
from sprag_study.service.http.web.form.tolerances import OWN
from sprag_study.service.reading.numbers import whole_number
from sprag_study.service.spec.kinds.goal import GOAL
from sprag_study.worker.limits import MAX_AXES
from sprag_study.worker.models.form import Rows


@dataclass(frozen=True, slots=True)
class Part:
    """A list of rows.

    Attributes
    ----------
    pointer : JSON Pointer of the list; the fields of row 0 begin with ``{pointer}/0/``
    most : largest number of rows
    entries : fields of which at least one has a text in a row that is filled in, where `rows` does not say it
    new : initial values of a new row
    rows : of a list of the machine, what its model says about it
    """

    pointer: str
    most: int
    entries: tuple[str, ...] = ()
    new: Values = field(default_factory=dict)
    rows: Rows | None = None


#: Correlations that the form shows; a spec may have more.
_MOST_CORRELATIONS: Final = 20

#: Conditions that the form shows; a spec may have more.
_MOST_CONDITIONS: Final = 20

#: By the name of the field with the number of rows.
PARTS: Final = {
    "axes": Part("/axes", MAX_AXES, new={"way": "linspace"}),
    "vary": Part("/goal/vary", GOAL.listed["vary"].high, new={"way": "from"}),
    "best": Part("/goal/best", GOAL.listed["best"].high, new={"toward": "max"}),
    "subject_to": Part("/goal/subject_to", GOAL.listed["subject_to"].high, new={"kind": "at_most"}),
    "at": Part("/goal/at", MAX_AXES, ("path", "values")),
    "ranges": Part("/sample/ranges", MAX_AXES),
    "exclude": Part("/exclude", _MOST_CONDITIONS, ("path", "value", "and/path", "and/value")),
    "correlations": Part("/correlations", _MOST_CORRELATIONS),
}


def parts_of(values: Mapping[str, str]) -> dict[str, Part]:
    """Every list of a form, by the name of the field with the number of its rows."""
    lists = form_of(values).lists
    return PARTS | {rows.name: Part(f"{BASE}/{rows.at}", rows.most, rows=rows) for rows in lists}


def count_of(values: Mapping[str, str], name: str) -> int:
    """Number of rows of a part; 0 where the form has no such list."""
    part = parts_of(values).get(name, Part("", 0))
    least = part.rows.least if part.rows else 0
    return count_in(values, name, least, least, part.most)


def reshape(values: Values, wanted: str) -> None:
    """Add or remove a row of a part, as the pressed button requests; the other fields are kept."""
    action, _, index = wanted.partition(" ")
    verb, _, name = action.partition("-")
    part = parts_of(values).get(name)
    if part is not None and verb == "add":
        _add_row(values, name, part)
    elif part is not None and verb == "drop" and (place := whole_number(index, part.most)) is not None:
        _drop_row(values, name, part, place)


def _add_row(values: Values, name: str, part: Part) -> None:
    """Add a row, unless there are as many as there may be."""
    rows, count = part.rows, count_of(values, name)
    if rows is not None and rows.alone and not count:
        _enclose(values, rows)
        count = 1
    if count < part.most:
        values |= {f"{part.pointer}/{count}/{entry}": text for entry, text in part.new.items()}
        if rows is not None and rows.copies:
            counts = {entry.name for entry in entries(values | {name: str(count)}, hidden=True)}
            for pointer in with_tolerances(part.pointer):
                _copy_row(values, pointer, count - 1, count)
            # What is kept of other choices of that row is not copied.
            for own in [own for own in values if own.startswith(f"{part.pointer}/{count}/")]:
                if own.replace(f"/{count}/", f"/{count - 1}/", 1) not in counts:
                    del values[own]
        values[name] = str(count + 1)


def _enclose(values: Values, rows: Rows) -> None:
    """Make what stands alone the first row of its list; paths that vary or are in formulas follow."""
    for root in dict.fromkeys(item.name.partition("/")[0] for block in rows.blocks for item in block.items):
        inside = f"{rows.at}/0/{root}"
        for old in with_tolerances(f"{BASE}/{root}"):
            copy(values, old, old.replace(root, inside, 1))
            drop(values, old)
        for name, text in values.items():
            if name.endswith(("/path", "/tied", "/with")) or text.startswith("="):
                values[name] = re.sub(rf"(?<![\w.]){root}\.", f"{inside.replace('/', '.')}.", text)


def _copy_row(values: Values, pointer: str, source: int, target: int) -> None:
    """Copy the fields of a row; what follows from numbers of it, or shares their draws, does so in the same row."""
    copy(values, f"{pointer}/{source}/", f"{pointer}/{target}/")
    paths = pointer.removeprefix(OWN).removeprefix(f"{BASE}/").replace("/", ".")
    for name in [name for name in values if name.startswith(f"{pointer}/{target}/")]:
        if name.endswith("/with") or "=" in values[name]:
            values[name] = values[name].replace(f"{paths}.{source}.", f"{paths}.{target}.")


def share(values: Values) -> None:
    """Initialise what each row has of its own from what is common, and that from the first row, so that no input is
    lost.
    """
    for rows in form_of(values).lists:
        if rows.shared is None:
            continue
        common, rowed = f"{BASE}/{rows.shared[1]}/", [
            f"{BASE}/{rows.at}/{index}/{rows.shared[1]}/" for index in range(count_of(values, rows.name))
        ]  # fmt: skip
        given = any(name.startswith(common) for name in values)
        if values.get(f"{BASE}/{rows.shared[0]}") == "own":
            if given:
                for own in rowed:
                    copy(values, common, own)
                drop(values, common)
        elif not given:
            copy(values, rowed[0], common)
            for own in rowed:
                drop(values, own)


def unshared(values: Values) -> Values:
    """The form before `share`: what it moves is undone together with the choice that moved it."""
    before = dict(values)
    for rows in form_of(values).lists:
        if rows.shared is not None:
            choice, common = f"{BASE}/{rows.shared[0]}", f"{BASE}/{rows.shared[1]}/"
            own = values.get(choice) == "own"
            if own == any(name.startswith(common) for name in values):
                before[choice] = "common" if own else "own"
    return before


def _drop_row(values: Values, name: str, part: Part, index: int) -> None:
    """Remove a row, unless there must be as many; those behind it move up."""
    count = count_of(values, name)
    if index >= count or (part.rows is not None and count <= part.rows.least):
        return
    for pointer in with_tolerances(part.pointer):
        for row in range(index, count):
            drop(values, f"{pointer}/{row}/")
            _copy_row(values, pointer, row + 1, row)
    values[name] = str(count - 1)


def with_tolerances(pointer: str) -> tuple[str, ...]:
    """The beginning of names of fields, and that of the fields of their tolerances."""
    return (pointer, pointer.replace("/base/", OWN, 1)) if pointer.startswith("/base/") else (pointer,)


def copy(values: Values, source: str, target: str) -> None:
    """Copy the fields that begin with ``source``."""
    values |= {
        target + name.removeprefix(source): text for name, text in list(values.items()) if name.startswith(source)
    }


def drop(values: Values, prefix: str) -> None:
    """Remove the fields that begin with ``prefix``."""
    for name in [name for name in values if name.startswith(prefix)]:
        del values[name]
