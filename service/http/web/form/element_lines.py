"""The elements of a planar linkage as lines of text, one each: ``RRR C; from = A; to = B; first = 200 mm``."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from sprag_study.service.http.web.form.entries import plain, text_of
from sprag_study.service.languages import _

_NUMBERLESS = frozenset({"from", "to", "guide", "guide_2", "on", "branch"})


def elements_of(text: str, faults: list[str]) -> list[dict[str, Any]]:
    """The elements of the lines; ``faults`` gets what is no element. The reader of the spec reports what is missing."""
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]
    return [_element(number, line, faults) for number, line in lines]


def _element(number: int, line: str, faults: list[str]) -> dict[str, Any]:
    head, *fields = (part.strip() for part in line.split(";"))
    kind, _blank, name = head.partition(" ")
    element: dict[str, Any] = {"kind": kind, **({"name": name.strip()} if name.strip() else {})}
    for field in filter(None, fields):
        key, equals, value = (part.strip() for part in field.partition("="))
        if not equals or key in element:
            faults.append(
                _(
                    "line {number} cannot be read at {field}; allowed: lines such as {example}",
                    number=number, field=field, example="RRR C; from = A; to = B; first = 200 mm",
                )
            )  # fmt: skip
        else:
            element[key] = value if key in _NUMBERLESS else plain(value)
    return element


def lines_of(elements: Sequence[Any]) -> str:
    """The lines of elements; raises ValueError for one that is not an object."""
    if not all(isinstance(element, Mapping) for element in elements):
        raise ValueError("the form has no line for an element that is not an object")
    return "\n".join(map(_line, elements))


def _line(element: Mapping[str, Any]) -> str:
    head = " ".join(str(element[name]) for name in ("kind", "name") if name in element)
    fields = (f"{name} = {text_of(value)}" for name, value in element.items() if name not in {"kind", "name"})
    return "; ".join((head, *fields))


def element_of(pointer: str) -> str:
    """What is at fault within a field of elements, for its message: ``element 2, from: ``; "" elsewhere."""
    place = re.fullmatch(r".*/linkage/elements/(\d+)(?:/(\w+))?", pointer)
    if place is None:
        return ""
    element = _("element {number}", number=int(place[1]) + 1)
    return f"{element}, {place[2]}: " if place[2] else f"{element}: "
