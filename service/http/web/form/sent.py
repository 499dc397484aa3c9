"""What a browser sends of the sheet, as the fields of the form: units beside numbers, ticks at what varies.

Older drafts and other senders have neither: their fields stay as they are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from sprag_study.service.http.web.form.entries import Values, names_of
from sprag_study.service.http.web.form.machine import BASE, entries, form_of, model_name, row_of
from sprag_study.service.http.web.form.parts import count_of, drop, reshape, with_tolerances
from sprag_study.service.http.web.form.spec import PARTS, is_search, with_row_texts
from sprag_study.service.http.web.form.tolerances import BATCH, own_name
from sprag_study.service.languages import _
from sprag_study.service.reading.deviations import with_tolerance
from sprag_study.service.reading.numbers import parse_number
from sprag_study.service.reading.quantities import is_si
from sprag_study.service.reading.ranges import TypedRange, typed_range
from sprag_study.service.reading.together import split_list, with_last_unit
from sprag_study.service.reading.units import QuantityError, parse_quantity, split_quantity
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.service.spec.fields import base_path, base_pointer
from sprag_study.worker import models
from sprag_study.worker.models.form import FormChoice, Rows

#: Beginnings of the names of a unit beside a number, of the tick at a number that varies, of the one at numbers that
#: vary alike and of those that it is about; of the numbers that have a tick, by the list of what varies.
UNIT: Final = "unit:"
VARY: Final = "vary:"
ALIKE: Final = "alike:"
ALIKES: Final = "alikes:"
TICKS: Final = "ticks:"
#: Of the quantity that a field had when the page was made, by which a changed unit is noticed.
WAS: Final = "was:"
#: Of the kind that a choice had when the page was made: other kinds have other meanings of the same fields.
KIND: Final = "kind:"
_BARE: Final = re.compile(r"[-+/\d.,;\seE\u00a0\u202f\u2212'’]*\d[-+/\d.,;\seE\u00a0\u202f\u2212'’]*")
#: Values between the ends that are proposed for a number.
_VALUES: Final = 9
_SEVERAL: Final = 2


def settle(values: Values, *, with_ticks: bool = True) -> None:
    """Read units and ticks into the fields that they are about, and empty those whose meaning another kind has changed;
    without ticks only take them away.
    """
    kinds, whole = changed_kinds(values), with_row_texts(values)
    for name in values.keys() - whole.keys():
        del values[name]
    values |= whole
    for name in [name for name in values if name.startswith((KIND, WAS))]:
        del values[name]
    if with_ticks and kinds:
        _empty(values, kinds)
    _part_tolerances(values)
    for name in [name for name in values if name.startswith(UNIT)]:
        unit, field = values.pop(name), name.removeprefix(UNIT)
        for own in (field, f"{field}/values"):
            values |= {own: with_unit(values[own], unit)} if own in values else {}
    changed = set[str]()  # their own ticks still say what was before
    for name in [name for name in values if name.startswith(ALIKES)]:
        row, paths = name.removeprefix(ALIKES), names_of(values.pop(name))
        before, ticked = values.pop(f"{ALIKE}was:{row}", ""), values.pop(f"{ALIKE}{row}", "")
        others = [path for path in names_of(values.get(f"{row}/tied", "")) if path not in paths]
        changed |= set(paths) if bool(before) != bool(ticked) else set()
        values[f"{row}/tied"] = ", ".join([*(paths if ticked else ()), *others])
    varying = {name.removeprefix(VARY) for name in values if name.startswith(VARY)}
    known = [(part, names_of(values.pop(f"{TICKS}{part}", ""))) for part in PARTS]
    for name in [name for name in values if name.startswith(VARY)]:
        del values[name]
    for part, paths in known if with_ticks else ():
        for path in dict.fromkeys(paths):
            if path not in changed:
                _vary(values, part, path, wanted=path in varying)
            _take_values(values, part, path)


def with_first_values(values: Mapping[str, str]) -> Values:
    """The form with the first value of its axis for each required number that varies and has no value of its own."""
    found, rows = dict(values), varied(values)
    for entry in entries(values):
        row = rows.get(base_path(entry.name)) if entry.field.required else None
        if row is not None and not values.get(entry.name, "").strip():
            found[entry.name] = first_value(values, row)
    return found


def first_value(values: Mapping[str, str], row: int) -> str:
    """The first value of a row of what varies; "" for none."""
    text = values.get(f"{PARTS[part_of(values)].pointer}/{row}/values", "")
    written = typed_range(text)
    return with_last_unit(split_list(text) or [""])[0] if written is None else written.first


def _part_tolerances(values: Values) -> None:
    """Read a number with its tolerance, ``9 N/mm ± 10 %`` or ``30 +0.05/-0 mm``, into the fields of both."""
    typed = {name: with_tolerance(text) for name, text in values.items() if name.startswith(f"{BASE}/")}
    typed = {name: parts for name, parts in typed.items() if parts is not None}
    for name in typed and [entry.name for entry in entries(values) if entry.tolerant and entry.name in typed]:
        parts, field = typed[name], f"{own_name(name)}/plus_minus"
        if parts is not None and not values.get(field, "").strip():
            values |= {name: parts[0], field: parts[1], BATCH: "on"}
            if UNIT + name in values:  # the unit beside the field is that of both numbers
                values[UNIT + field] = values[UNIT + name]


def kept_numbers(values: Mapping[str, str]) -> dict[str, str]:
    """What is said beside each number that stayed as it was when another unit was chosen for it."""
    said = {}
    for entry in entries(values):
        before, unit = values.get(WAS + entry.name, ""), values.get(UNIT + entry.name, "")
        text, _blank, old = before.rpartition(" ")
        value = parse_number(text)
        if value is None or unit in ("", old) or values.get(entry.name, "").strip() != text:
            continue
        try:
            ratio = parse_quantity(f"1 {old}", entry.field.unit) / parse_quantity(f"1 {unit}", entry.field.unit)
        except QuantityError:
            continue
        said[entry.name] = _(
            "The number stays: {now} = {before}. The same value is {converted}.",
            now=f"{number(value)} {unit_text(unit)}",
            before=f"{number(value / ratio)} {unit_text(old)}",
            converted=f"{number(value * ratio)} {unit_text(unit)}",
        )
    return said


def changed_kinds(values: Mapping[str, str]) -> Values:
    """The choices that have another value than when the page was made, and their value then."""
    shown = {name.removeprefix(KIND): text for name, text in values.items() if name.startswith(KIND)}
    return {name: text for name, text in shown.items() if values.get(name, text) != text}


def _empty(values: Values, kinds: Mapping[str, str]) -> None:
    """Empty the object of each changed kind, and what a part with another mechanism has only as a copy of the part
    before it.
    """
    for entry in [entry for entry in entries(values, hidden=True) if entry.name in kinds]:
        wanted = values[entry.name]
        if entry.kind_of and {wanted, kinds[entry.name]} <= entry.kinds:
            for pointer in with_tolerances(entry.kind_of):
                drop(values, f"{pointer}/")
            values[entry.name] = wanted
        for rows in form_of(values).lists:
            _empty_copy(values, rows, entry.name)


def _empty_copy(values: Values, rows: Rows, name: str) -> None:
    """Empty the other choices of a row that are as in the row before it, where the first choice of the row changed."""
    choices = (item.name for block in rows.blocks for item in block.items if isinstance(item, FormChoice))
    first, *others = [*choices] or [""]
    found = re.fullmatch(rf"({BASE}/{rows.at})/(\d+)/{first}", name) if rows.alone and first else None
    if found is None or found[2] == "0":
        return
    for other in others:
        own, before = (f"{found[1]}/{row}/{other}" for row in (int(found[2]), int(found[2]) - 1))
        texts = [{key.removeprefix(at): text for key, text in values.items() if key == at or key.startswith(f"{at}/")}
                 for at in (own, before)]  # fmt: skip
        if all(texts[1].get(key, "") == text for key, text in texts[0].items()):
            for pointer in with_tolerances(own):
                drop(values, pointer)


def with_unit(text: str, unit: str) -> str:
    """A text of bare numbers with the unit beside it; one with a unit of its own, or a formula, as it is."""
    written = typed_range(text)
    if written is not None and unit and not is_si(unit):
        *others, last = written.numbers
        bare = all(map(_BARE.fullmatch, written.numbers))
        return written.with_numbers(*others, f"{last} {unit}").text if bare else text
    return f"{text.strip()} {unit}" if unit and not is_si(unit) and _BARE.fullmatch(text) else text


def varied(values: Mapping[str, str], part: str = "") -> dict[str, int]:
    """The numbers that vary, with those that do so together, and the row that says how."""
    found: dict[str, int] = {}
    part = part or part_of(values)
    for index in range(count_of(values, part)):
        row = f"{PARTS[part].pointer}/{index}"
        for path in (values.get(f"{row}/path", "").strip(), *names_of(values.get(f"{row}/tied", ""))):
            found |= {path: index} if path else {}
    return found


def part_of(values: Mapping[str, str]) -> str:
    """The list of what varies: axes, or the variables of a search."""
    return "vary" if is_search(values) else "axes"


def let_vary(values: Values, path: str) -> None:
    """Let a number vary."""
    _vary(values, part_of(values), path, wanted=True)


def _vary(values: Values, name: str, path: str, *, wanted: bool) -> None:
    """Let a number of a list vary, or no longer; nothing where it is so."""
    index = varied(values, name).get(path)
    if wanted == (index is not None):
        return
    if index is not None:
        row = f"{PARTS[name].pointer}/{index}"
        others = [own for own in names_of(values.get(f"{row}/tied", "")) if own != path]
        if values.get(f"{row}/path", "").strip() != path:
            values[f"{row}/tied"] = ", ".join(others)
        elif others:
            values |= {f"{row}/path": others[0], f"{row}/tied": ", ".join(others[1:])}
        else:
            reshape(values, f"drop-{name} {index}")
        return
    before = count_of(values, name)
    blank = (own for own in range(before) if not any(
        values.get(f"{PARTS[name].pointer}/{own}/{part}", "").strip() for part in ("path", "values")
    ))  # fmt: skip
    row_index = next(blank, before)
    if row_index == before:
        reshape(values, f"add-{name}")
    if count_of(values, name) > row_index:
        row = f"{PARTS[name].pointer}/{row_index}"
        ends = ends_of(values, path)
        text = "" if ends is None else TypedRange(*ends, count=_VALUES if name == "axes" else None).text
        values |= {f"{row}/path": path, f"{row}/values": text}


def _take_values(values: Values, name: str, path: str) -> None:
    """Let a number vary over the list or range that somebody has typed into its field, which keeps the first value."""
    field = base_pointer(path)
    text = values.get(field, "").strip()
    if text.startswith("=") or (typed_range(text) is None and len(split_list(text)) < _SEVERAL):
        return
    _vary(values, name, path, wanted=True)
    row = varied(values, name).get(path)
    if row is not None:
        values[f"{PARTS[name].pointer}/{row}/values"] = text
        values[field] = first_value(values, row)


def ends_of(values: Mapping[str, str], path: str) -> tuple[str, str] | None:
    """Ends proposed for a number: its value times the factors of its kind; None where it is 0 or unknown."""
    text = values.get(base_pointer(path), "").strip()
    try:
        number, unit = split_quantity(text)
    except QuantityError:
        return None
    kinds = models.model_of(model_name(values)).presentation.laboratory.sliders
    own = row_of(model_name(values), path)[2]
    low, high = next(((kind.low, kind.high) for kind in kinds if re.fullmatch(kind.path, own)), (0.5, 1.5))
    ends = sorted(float(f"{float(number) * factor:.2g}") for factor in (low, high))
    return None if ends[0] == ends[1] else (f"{ends[0]:g} {unit}".strip(), f"{ends[1]:g} {unit}".strip())
