"""Rows of the form that are items of a list of the spec: the same cells there and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from sprag_study.service.http.web.form.entries import (
    Values,
    list_of,
    list_text,
    path_values,
    paths_of,
    plain,
    range_of,
    text_of,
)
from sprag_study.service.http.web.form.parts import PARTS, count_of
from sprag_study.service.languages import N_
from sprag_study.service.reading.together import with_last_unit
from sprag_study.service.spec.axes.axes import SWEPT
from sprag_study.service.spec.axes.sample import SCALE

#: Fields of an axis for each way of giving its values.
WAYS: Final = {
    "values": ("values",),
    "linspace": ("from", "to", "count"),
    "geomspace": ("from", "to", "count"),
    "range": ("from", "to", "step"),
    "adaptive": ("from", "to"),
}
#: Kinds of limits with their labels.
LIMITS: Final = (("at_most", N_("at most")), ("at_least", N_("at least")), ("is", N_("equal to")))


@dataclass(frozen=True, slots=True)
class Cell:
    """Some entries of an item and the fields that have them.

    Attributes
    ----------
    keys, fields : names of the entries, and the field of each; several fields of one entry are those of its items
    read : the entries, from the values of a form and the pointer of the row
    write : the fields, from an item
    counts : whether a text in its fields makes the row one that is filled in
    """

    keys: tuple[str, ...]
    fields: tuple[str, ...]
    read: Callable[[Mapping[str, str], str], dict[str, Any]]
    write: Callable[[Mapping[str, Any]], Values]
    counts: bool = True


@dataclass(frozen=True, slots=True)
class Row:
    """What the rows of a part have: ``cells``, and behind the first one the cell of the way that its field "way" says.

    ``whole`` is the field for faults of a whole row; "" for the first one of its way.
    """

    cells: tuple[Cell, ...]
    ways: Mapping[str, Cell] = field(default_factory=dict)
    whole: str = ""

    def chosen(self, way: str | None) -> tuple[Cell, ...]:
        """The cells of a row that is given in a way, by default the first one."""
        first, *others = self.cells
        ways = (self.ways.get(way or "") or next(iter(self.ways.values())),) if self.ways else ()
        return (first, *ways, *others)


def _listed(way: str) -> Cell:
    """Values that a list under the name of the way gives: its ends, and their number or step."""
    names = WAYS[way]
    return Cell(
        (way,), names,
        lambda values, row: {way: list(range_of(values, f"{row}/", names).values())},
        lambda item: {name: text_of(own) for name, own in zip(names, item[way], strict=True)},
    )  # fmt: skip


def _chosen(name: str) -> Cell:
    """A choice, of which the first one, "", is left out."""
    return Cell(
        (name,), (name,),
        lambda values, row: {name: text} if (text := values.get(f"{row}/{name}", "")) else {},
        lambda item: {name: str(item.get(name, ""))}, counts=False,
    )  # fmt: skip


def _limit(values: Mapping[str, str], row: str) -> dict[str, Any]:
    kind = values.get(f"{row}/kind", "at_most")
    value, within = values.get(f"{row}/value", ""), values.get(f"{row}/within", "") if kind == "is" else ""
    value, within = (text.strip() for text in with_last_unit([value, within]))
    return {kind: plain(value), **({"within": plain(within)} if within else {})}


def _limit_fields(item: Mapping[str, Any]) -> Values:
    kind = next(kind for kind, _label in LIMITS if kind in item)
    return {"kind": kind, "value": text_of(item[kind]), **_given(item, "within")}


def _given(item: Mapping[str, Any], name: str) -> Values:
    return {name: text_of(item[name])} if name in item else {}


_ENDS: Final = ("from", "to")
_PATHS: Final = Cell(
    ("path",), ("path", "tied"), lambda values, row: {"path": paths_of(values, row)},
    lambda item: {name.removeprefix("/"): text for name, text in path_values("", item["path"]).items()},
)  # fmt: skip
_RANGE: Final = Cell(
    _ENDS, _ENDS, lambda values, row: range_of(values, f"{row}/"),
    lambda item: {name: text_of(item[name]) for name in _ENDS},
)  # fmt: skip
_VALUES: Final = Cell(
    ("values",), ("values",), lambda values, row: {"values": list_of(values.get(f"{row}/values", ""))},
    lambda item: {"values": list_text(item["values"])},
)  # fmt: skip
_RESULT: Final = Cell(
    ("result",), ("result",), lambda values, row: {"result": values.get(f"{row}/result", "") or None},
    lambda item: {"result": item["result"]},
)  # fmt: skip
_TOWARD: Final = Cell(
    ("max",), ("toward",), lambda values, row: {"max": True} if values.get(f"{row}/toward", "max") == "max" else {},
    lambda item: {"toward": "max" if item.get("max", False) else "min"}, counts=False,
)  # fmt: skip
_LIMIT: Final = Cell((*(kind for kind, _ in LIMITS), "within"), (*["value"] * 3, "within"), _limit, _limit_fields)
_BETWEEN: Final = ("between/0", "between/1")
_PAIR: Final = Cell(
    ("between",), _BETWEEN,
    lambda values, row: {"between": [values.get(f"{row}/{name}", "").strip() for name in _BETWEEN]},
    lambda item: dict(zip(_BETWEEN, item["between"], strict=True)),
)  # fmt: skip
_COEFFICIENT: Final = Cell(
    ("coefficient",), ("coefficient",),
    lambda values, row: {"coefficient": plain(text)} if (text := values.get(f"{row}/coefficient", "").strip()) else {},
    lambda item: _given(item, "coefficient"),
)  # fmt: skip
#: By the name of the part.
ROWS: Final = {
    "axes": Row(
        (_PATHS, _chosen(SWEPT.name)),
        {way: _VALUES if way == "values" else _listed(way) for way in WAYS}, whole="path",
    ),
    "vary": Row((_PATHS,), {"from": _RANGE, "values": _VALUES}),
    "best": Row((_RESULT, _TOWARD), whole="result"),
    "subject_to": Row((_RESULT, _LIMIT), whole="result"),
    "ranges": Row((_PATHS, _RANGE, _chosen(SCALE.name)), whole="from"),
    "correlations": Row((_PAIR, _COEFFICIENT), whole=_BETWEEN[0]),
}  # fmt: skip


def filled(values: Mapping[str, str], name: str) -> list[int]:
    """The rows of a part that are filled in."""

    def entries(row: str) -> Sequence[str]:
        if name not in ROWS:
            return PARTS[name].entries
        return [own for cell in ROWS[name].chosen(values.get(f"{row}/way")) if cell.counts for own in cell.fields]

    rows = {index: f"{PARTS[name].pointer}/{index}" for index in range(count_of(values, name))}
    return [index for index, row in rows.items() if any(values.get(f"{row}/{own}", "").strip() for own in entries(row))]


def items_of_part(values: Mapping[str, str], name: str) -> list[dict[str, Any]]:
    """The items of the spec for the rows of a part that are filled in."""
    found = []
    for index in filled(values, name):
        row = f"{PARTS[name].pointer}/{index}"
        item: dict[str, Any] = {}
        for cell in ROWS[name].chosen(values.get(f"{row}/way")):
            item |= cell.read(values, row)
        found.append(item)
    return found


def values_of_part(name: str, items: Sequence[Mapping[str, Any]]) -> Values:
    """The form's values for the items of a list of the spec; raises ValueError where the form cannot show them."""
    own, part = ROWS[name], PARTS[name]
    values: Values = {name: str(len(items))}
    for index, item in enumerate(items):
        way = next((way for way, cell in own.ways.items() if cell.keys[0] in item), "")
        cells = own.chosen(way)
        if len(items) > part.most or not set(item) <= {key for cell in cells for key in cell.keys}:
            raise ValueError(f"the form has no fields for all of these {name}")
        given: Values = {"way": way} if own.ways else {}
        for cell in cells:
            given |= cell.write(item)
        values |= {f"{part.pointer}/{index}/{field}": text for field, text in given.items()}
    return values


def field_of_row(name: str, place: int, rest: str, values: Mapping[str, str]) -> str:
    """The field for a fault at ``rest`` of the item of number ``place`` of a part."""
    rows, own = filled(values, name), ROWS[name]
    row = f"{PARTS[name].pointer}/{rows[place] if place < len(rows) else place}"
    cells = own.chosen(values.get(f"{row}/way"))
    key, _slash, inside = rest.partition("/")
    for cell in cells:
        if key in cell.keys:
            several = len(cell.keys) == 1 and inside.isdigit() and int(inside) < len(cell.fields)
            return f"{row}/{cell.fields[int(inside) if several else cell.keys.index(key)]}"
    return f"{row}/{own.whole or cells[1].fields[0]}"
