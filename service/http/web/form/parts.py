"""Parts of the form that users add and remove: axes, and the variables, goals, limits and points of a search."""

from __future__ import annotations

import re
from collections.abc import Mapping

from sprag_study.service.http.web.form.entries import Values
from sprag_study.service.http.web.form.machine import BASE, entries, form_of
from sprag_study.service.http.web.form.spec import PARTS
from sprag_study.service.http.web.form.tolerances import OWN
from sprag_study.service.http.web.form.walk import Rows
from sprag_study.service.reading.numbers import whole_number
from sprag_study.service.spec.fields import base_path
from sprag_study.worker.models import form as data


def parts_of(values: Mapping[str, str]) -> dict[str, Rows]:
    """Every list of a form, by the name of the field with the number of its rows."""
    lists = form_of(values).lists
    return PARTS | {rows.name: Rows(rows.name, f"{BASE}/{rows.at}", rows.most, listed=rows) for rows in lists}


def count_of(values: Mapping[str, str], name: str) -> int:
    """Number of rows of a part; 0 where the form has no such list."""
    part = parts_of(values).get(name)
    return 0 if part is None else part.count(values)


def reshape(values: Values, wanted: str, parts: Mapping[str, Rows] | None = None) -> None:
    """Add or remove a row of one of ``parts``, by default those of a study, as the pressed button requests; the other
    fields are kept.
    """
    action, _, index = wanted.partition(" ")
    verb, _, name = action.partition("-")
    part = (parts_of(values) if parts is None else parts).get(name)
    if part is not None and verb == "add":
        _add_row(values, name, part)
    elif part is not None and verb == "drop" and (place := whole_number(index, part.most)) is not None:
        _drop_row(values, name, part, place)


def _add_row(values: Values, name: str, part: Rows) -> None:
    """Add a row, unless there are as many as there may be."""
    rows, count = part.listed, part.count(values)
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


def _enclose(values: Values, rows: data.Rows) -> None:
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
    paths = base_path(pointer.removeprefix(OWN))
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


def _drop_row(values: Values, name: str, part: Rows, index: int) -> None:
    """Remove a row, unless there must be as many; those behind it move up."""
    count = part.count(values)
    if index >= count or (part.listed is not None and count <= part.listed.least):
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
