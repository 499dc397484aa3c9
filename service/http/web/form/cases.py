"""Cases that are no axes: a sample over ranges, points of a table, and combinations that are left out."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from sprag_study.service.http.web.form.entries import (
    Faults,
    Values,
    list_of,
    plain,
    text_of,
    unclear,
)
from sprag_study.service.http.web.form.parts import PARTS
from sprag_study.service.http.web.form.rows import field_of_row, filled, items_of_part, values_of_part
from sprag_study.service.languages import N_, _
from sprag_study.service.spec.axes.exclude import LIMITS
from sprag_study.service.spec.axes.sample import SAMPLE

#: Field with the points, as the text of a CSV file.
POINTS: Final = "/points"
_SAMPLE: Final = "/sample"
_KINDS: Final = tuple(LIMITS.fields)
_NUMBERS: Final = ("count", "seed")
_WORDS: Final = {
    "above": N_("above"),
    "below": N_("below"),
    "at_least": N_("at least"),
    "at_most": N_("at most"),
    "is": N_("equal to (one of a list)"),
}
_METHODS: Final = {
    "latin_hypercube": N_("Latin hypercube"),
    "sobol": N_("Sobol sequence"),
    "random": N_("independent points"),
    "saltelli": N_("Saltelli, for Sobol indices"),
    "morris": N_("Morris, for elementary effects"),
}
_TWICE: Final = N_("this parameter already has a limit of this kind; choose another kind, or leave this part empty")
#: Beginnings of the two parts of a condition: both must hold.
_BOTH: Final = ("", "and/")


def methods() -> list[tuple[str, str]]:
    """The kinds of samples and their labels."""
    return [(name, _(_METHODS[name])) for name in SAMPLE.described["sample"].values]


def kinds() -> list[tuple[str, str]]:
    """The kinds of conditions and their labels."""
    return [(name, _(_WORDS[name])) for name in _KINDS]


def blocks_of(values: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    """The sample and the points of a form, by their names in a spec; those that are not filled in are left out."""
    found: dict[str, dict[str, Any]] = {}
    ranges = items_of_part(values, "ranges")
    numbers = {name: plain(text) for name in _NUMBERS if (text := values.get(f"{_SAMPLE}/{name}", "").strip())}
    if ranges or "count" in numbers:
        second = {"second_order": True} if values.get(f"{_SAMPLE}/second_order") == "on" else {}
        method = values.get(f"{_SAMPLE}/sample", SAMPLE.described["sample"].values[0])
        found["sample"] = {"sample": method, **numbers, **second, "ranges": ranges}
    if values.get(POINTS, "").strip():
        found["points"] = {"points": values[POINTS].replace("\r\n", "\n")}
    return found


def exclusions_of(values: Mapping[str, str]) -> list[dict[str, Any]]:
    """The conditions of a form; cases that meet one of them are left out."""
    return [_condition(values, index) for index in filled(values, "exclude")]


def repeated_limits(values: Mapping[str, str]) -> Faults:
    """Faults, by field, of conditions whose two parts give one parameter two limits of a kind: a spec has one."""
    faults: Faults = {}
    for index in filled(values, "exclude"):
        parts = _parts(values, index)
        limits = [(values.get(f"{part}path", ""), values.get(f"{part}kind", _KINDS[0])) for part in parts]
        if len(set(limits)) < len(limits):
            faults[f"{parts[1]}value"] = [_(_TWICE)]
    return faults


def _condition(values: Mapping[str, str], index: int) -> dict[str, Any]:
    found: dict[str, dict[str, Any]] = {}
    for part in _parts(values, index):
        kind, text = values.get(f"{part}kind", _KINDS[0]), values.get(f"{part}value", "")
        items = list_of(text) if kind == "is" else []
        several = len(items) > 1 or unclear(items)
        found.setdefault(values.get(f"{part}path", ""), {})[kind] = items if several else plain(text)
    return found


def _parts(values: Mapping[str, str], index: int) -> list[str]:
    """Beginnings of the fields of the parts of a condition that are filled in."""
    row = f"{PARTS['exclude'].pointer}/{index}/"
    return [f"{row}{part}" for part in _BOTH if any(values.get(f"{row}{part}{name}") for name in ("path", "value"))]


def field_of_block(place: int, rest: str, values: Mapping[str, str]) -> str:
    """The field for a fault at ``rest`` of the block of number ``place`` behind the axes."""
    names = list(blocks_of(values))
    if place >= len(names) or names[place] == "points":
        return POINTS
    match = re.match(r"ranges/(\d+)(?:/(.*))?", rest)
    if match is None:
        return f"{_SAMPLE}/{rest if rest in SAMPLE.described else 'count'}"
    return field_of_row("ranges", int(match[1]), match[2] or "", values)


def field_of_exclusion(pointer: str, values: Mapping[str, str]) -> str:
    """The field for a fault at ``pointer``, which begins with ``/exclude``."""
    match = re.match(r"/exclude/(\d+)(?:/([^/]*))?(/.*)?", pointer)
    rows = filled(values, "exclude")
    if match is None or int(match[1]) >= len(rows):
        return "/exclude"
    parts = _parts(values, rows[int(match[1])])
    own = [part for part in parts if values.get(f"{part}path", "") == (match[2] or "")]
    kind = (match[3] or "").strip("/").partition("/")[0]
    part = next((part for part in own if values.get(f"{part}kind", _KINDS[0]) == kind), (own or parts)[0])
    return f"{part}{'value' if kind else 'path'}"


def case_values(blocks: Sequence[Mapping[str, Any]], conditions: Sequence[Mapping[str, Any]]) -> Values:
    """The form's values for the blocks behind the axes of a spec and for its conditions; raises ValueError where the
    form cannot show them.
    """
    names = ["sample" if "sample" in block else "points" for block in blocks]
    if names not in (["sample"], ["points"], ["sample", "points"], []):
        raise ValueError("the form has one sample and one table of points, behind the axes")
    values: Values = {}
    for name, block in zip(names, blocks, strict=True):
        values |= _sample_values(block) if name == "sample" else {POINTS: str(block["points"])}
    values["exclude"] = str(len(conditions))
    for index, condition in enumerate(conditions):
        given = [(path, kind, value) for path, parts in condition.items() for kind, value in parts.items()]
        if not 1 <= len(given) <= len(_BOTH) or len(conditions) > PARTS["exclude"].most:
            raise ValueError("the form has no fields for all of these conditions")
        for part, (path, kind, value) in zip(_BOTH, given, strict=False):
            text = "; ".join(map(text_of, value)) if isinstance(value, list) else text_of(value)
            row = f"{PARTS['exclude'].pointer}/{index}/{part}"
            values |= {f"{row}path": path, f"{row}kind": kind, f"{row}value": text}
    return values


def _sample_values(block: Mapping[str, Any]) -> Values:
    if not set(block) <= {*SAMPLE.described, "ranges"}:
        raise ValueError("the form has no fields for all of this sample")
    values: Values = {f"{_SAMPLE}/sample": str(block["sample"])}
    values |= {f"{_SAMPLE}/{name}": text_of(block[name]) for name in _NUMBERS if name in block}
    values |= {f"{_SAMPLE}/second_order": "on"} if block.get("second_order") else {}
    return values | values_of_part("ranges", block.get("ranges", ()))
