"""The sheet of a machine: its drawing with a field at each dimension, what varies, and the rest in a drawer."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from markupsafe import Markup

from sprag_study.service.figures.drawing import (
    Dimension,
    Drawing,
    Side,
    balanced,
    field_places,
    rows_of,
    svg,
    uncrossed,
    with_leaders,
)
from sprag_study.service.figures.drawings import BETWEEN_FIELDS
from sprag_study.service.figures.painter.elements import text_width
from sprag_study.service.http.web.form.entries import Values, names_of, plain
from sprag_study.service.http.web.form.machine import BASE, Block, Entry, blocks, form_of, model_name
from sprag_study.service.http.web.form.parts import count_of
from sprag_study.service.http.web.form.sent import part_of, varied
from sprag_study.service.http.web.form.spec import PARTS
from sprag_study.service.languages import _, gettext
from sprag_study.service.reading.cyrillic import latin
from sprag_study.service.reading.numbers import parse_number
from sprag_study.service.reading.part_names import lower_first
from sprag_study.service.reading.quantities import offered, preferred
from sprag_study.service.reading.ranges import typed_range
from sprag_study.service.reading.together import split_list, typed_unit, with_last_unit
from sprag_study.service.reading.units import QuantityError, parse_quantity, plain_signs
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.service.spec.fields import base_path, base_pointer
from sprag_study.worker.models.form import FormChoice
from sprag_study.worker.models.parameters import model_parameter
from sprag_study.worker.models.vocabulary import bare_caption

if TYPE_CHECKING:
    from sprag_study.service.http.web.form.fields import Groups

#: Fields at both sides of a drawing: their distance from it and from each other, the latter also of a mechanism, what
#: tolerances and a label of two lines add to it, and the place of a line's end in a field (px).
_GAP, _STEP, _STEP_MECHANISM, _TOLERANT, _LINE, _AT = 8.0, 76.0, 84.0, 28.0, 16.0, 36.0
#: Size of a label, and its room without and with the tick of a number that can vary (px).
_SIZE, _ROOM, _ROOM_VARY = 12.2, 140.0, 90.0
#: Beginning of the name of the fields at both sides of a drawing, so that they stay where they are.
_SIDES: Final = "sides:"
_NUMBER: Final = re.compile(r"\s*([-+\u2212]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)\s*(.*)", re.DOTALL)
_LONGEST: Final = 9
#: Controls that leave the drawer where they differ from the example.
_MOVED: Final = ("line", "lines", "select", "tick")


@dataclass(frozen=True, slots=True)
class Quantity:
    """The text of a field with its unit beside it.

    Attributes
    ----------
    text : as the field shows it
    unit, units : the chosen one, and those offered; none where plain numbers have no unit
    """

    text: str
    unit: str = ""
    units: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Spot:
    """A number of the machine on the sheet.

    Attributes
    ----------
    entry, label : its field, and what it is called there
    path : of the number
    quantity : its text with its unit; ``whole`` the text with that unit in it
    may_vary, row : whether it has a tick, and the row that says how it varies, if it does
    span : its values in that row, in words
    was : what it is in the study that this one is a variant of, where it differs
    """

    entry: Entry
    label: str
    path: str
    quantity: Quantity
    whole: str
    may_vary: bool
    row: int | None = None
    span: str = ""
    was: str | None = None

    @property
    def name(self) -> str:
        """Name of its field."""
        return self.entry.name


@dataclass(frozen=True, slots=True)
class Plan:
    """A drawing with the numbers whose fields stand at its sides.

    Attributes
    ----------
    left, right : those numbers; ``tall`` where one of their labels takes two lines
    sides : name and value of the field that keeps them at their sides
    name : of the choice of the part that is drawn; "" for the whole machine
    """

    drawing: Drawing
    picture: Markup
    left: tuple[Spot, ...] = ()
    right: tuple[Spot, ...] = ()
    tall: bool = False
    sides: tuple[str, str] = ("", "")

    @property
    def name(self) -> str:
        """Name of the choice of the part that is drawn; "" for the whole machine."""
        return base_pointer(self.drawing.at) if self.drawing.at else ""


@dataclass(frozen=True, slots=True)
class Group:
    """Blocks that are one part of the machine, behind a line that says what it is, or a block that is always in sight.

    Attributes
    ----------
    part : pointer of the part; "" for none
    title, line : of the part, and what it is and what varies in it
    opened : whether it is open
    """

    blocks: tuple[Block, ...]
    part: str = ""
    title: str = ""
    line: str = ""
    opened: bool = False


@dataclass(frozen=True, slots=True)
class Row:
    """A row of what varies: its place, label, values with their unit, and the numbers that could vary alike."""

    index: int
    pointer: str
    path: str
    label: str
    quantity: Quantity
    alikes: tuple[str, ...] = ()
    alike: bool = False
    tied: str = ""


@dataclass(frozen=True, slots=True)
class Sheet:
    """The sheet of a filled form.

    ``spots`` are all numbers by the name of their field, ``placed`` those beside a drawing, ``front`` those of fields
    that are always in sight; ``opened`` is whether something in the drawer differs or is wrong, ``filled`` are the
    fields with a text, an axis, a difference from the study they began with, or a fault.
    """

    plans: tuple[Plan, ...]
    blocks: tuple[Block, ...]
    groups: tuple[Group, ...]
    spots: Mapping[str, Spot]
    placed: frozenset[str]
    front: frozenset[str]
    rows: tuple[Row, ...]
    ticks: str
    opened: bool
    filled: frozenset[str]

    def drawn(self, block: Block | None = None) -> tuple[Plan, ...]:
        """The drawings of a block, or those of the whole machine."""
        names = {""} if block is None else {entry.name for entry in block.entries}
        return tuple(plan for plan in self.plans if plan.name in names)

    def spot_of(self, path: str) -> Spot | None:
        """The number of a path; None where the sheet does not have it."""
        return self.spots.get(base_pointer(path))

    @property
    def pictures(self) -> list[Markup]:
        """The drawings in the order of the page."""
        return [plan.picture for block in (None, *self.blocks) for plan in self.drawn(block)]

    @property
    def spans(self) -> dict[str, str]:
        """The values of what varies in words, by the name of its field."""
        return {name: spot.span for name, spot in self.spots.items() if spot.row is not None}

    def opens(self, block: Block) -> bool:
        """Whether a block within another one is open, as something in it is filled in or wrong."""
        return any(
            entry.name in self.filled and not isinstance(entry.item, FormChoice) for entry in _all(block.entries)
        )

    def shown(self, block: Block, *, front: bool) -> tuple[Entry, ...]:
        """The fields of a block in sight, or in the drawer."""
        seen = (entry for entry in block.entries if not entry.unseen and entry.name not in self.placed)
        return tuple(entry for entry in seen if (entry.name in self.front) == front)


def sheet_of(
    values: Mapping[str, str],
    drawings: Sequence[Drawing],
    choices: Groups,
    units: str,
    *,
    tolerant: bool = False,
    faulty: Iterable[str] = (),
    before: Values | None = None,
    begun: Values | None = None,
    wanted: str = "",
) -> Sheet:
    """The sheet of a form.

    Parameters
    ----------
    drawings : of the machine, if it can be drawn
    choices : numbers that can vary
    units : choice of the reader, as `read_units` takes it
    tolerant : whether numbers have a tolerance beside them
    faulty : fields that something is wrong with
    before : the form of the study of which this one is a variant
    begun : the form with which an empty one begins
    wanted : a field of the part of the machine that is open
    """
    made = _Making(
        values,
        {choice.path: choice.label for _group, own in choices for choice in own},
        preferred(units, model_name(values)),
        before,
    )
    every, form = blocks(values), form_of(values)
    found = [entry for block in every for own in (block, *block.within) for entry in _all(own.entries)]
    labels = [entry.field.label for block in every if not block.part for own in (block, *block.within)
              for entry in _all(own.entries)]  # fmt: skip
    repeated = {label for label in labels if labels.count(label) > 1}
    spots = {entry.name: made.spot(entry, repeated) for entry in found if entry.control == "line"}
    alone = {entry.name for block in every for own in (block, *block.within) for entry in own.entries}
    front = frozenset(
        entry.name for entry in found if form.in_sight(base_path(entry.name))
        or (entry.name in alone and entry.control in _MOVED and _differs(values, begun, (entry,)))
    )  # fmt: skip
    by_path = {spot.path: spot for spot in spots.values() if spot.name in front}
    links = {spot.path: f"#{name}" for name, spot in spots.items()}
    plans = [_plan(drawing, by_path, links, values, tolerant=tolerant) for drawing in drawings]
    placed = frozenset(spot.name for plan in plans for spot in (*plan.left, *plan.right))
    faulty = frozenset(faulty)
    groups = tuple(_groups(every, spots, values, faulty, wanted))
    inside = {entry.name for entry in found} - front
    opened = (
        any(name in inside for name in faulty)
        or _differs(values, begun, (entry for entry in found if entry.name in inside and not entry.unseen))
        or any(values.get(name) != text for name, text in (begun or {}).items() if name.startswith("/run/"))
    )
    return Sheet(
        tuple(plans), tuple(every), groups, spots, placed, front, tuple(made.rows()),
        " ".join(spot.path for spot in spots.values() if spot.may_vary), opened,
        faulty | {name for name, text in values.items() if text.strip()}
        | {name for name, spot in spots.items() if spot.row is not None or spot.was is not None},
    )  # fmt: skip


def _plan(
    drawing: Drawing, by_path: Mapping[str, Spot], links: Mapping[str, str], values: Mapping[str, str], *,
    tolerant: bool,
) -> Plan:  # fmt: skip
    """A drawing with the fields of its numbers in sight at both sides, where there is room."""
    own = {each.path: each for each in drawing.dimensions if each.path in by_path}
    if not own or (drawing.at and not drawing.frames):
        return Plan(drawing, Markup(svg(drawing, links=links)))  # noqa: S704 - its texts are escaped where it is made
    rows = balanced(tuple(own.values())) if drawing.at else tuple(
        tuple(each for each in rows_of(drawing, side) if each.path in own) for side in ("left", "right")
    )  # fmt: skip
    name = f"{_SIDES}{drawing.at}"
    before = [names_of(text) for text in values.get(name, "").split(";")]
    stay = sorted(path for side in before for path in side) == sorted(own)
    if stay:
        rows = tuple(tuple(own[path] for path in side) for side in before)
    sided: dict[str, Side] = dict.fromkeys((each.path for each in rows[0]), "left")
    sided |= dict.fromkeys((each.path for each in rows[1]), "right")
    drawing = replace(drawing, dimensions=tuple(
        replace(each, side=sided.get(each.path, each.side)) for each in drawing.dimensions
    ))  # fmt: skip
    tall = any(
        text_width(f"{spot.label} {spot.entry.field.symbol}", _SIZE) > (_ROOM_VARY if spot.may_vary else _ROOM)
        for spot in (by_path[path] for path in own)
    )
    more = _LINE if tall else 0.0
    step = (_STEP_MECHANISM if drawing.at else _STEP) + (_TOLERANT if tolerant else 0.0) + more
    gap = _GAP + (max(BETWEEN_FIELDS - drawing.width, 0.0) / 2 if drawing.at else 0.0)
    if not stay:
        places = field_places(drawing, rows, step, _AT + more)
        rows = tuple(map(uncrossed, rows, (-gap, drawing.width + gap), places))
    left, right = (tuple(by_path[each.path] for each in side) for side in rows)
    picture = Markup(with_leaders(drawing, step, gap, _AT + more, rows, links))  # noqa: S704 - as above
    return Plan(drawing, picture, left, right, tall, (name, ";".join(map(_paths, rows))))


def _paths(dimensions: Iterable[Dimension]) -> str:
    return " ".join(each.path for each in dimensions)


def _groups(
    every: Sequence[Block], spots: Mapping[str, Spot], values: Mapping[str, str], faulty: frozenset[str], wanted: str
) -> Iterable[Group]:
    """Blocks by part of the machine. Open are the parts with something wrong or wanted, or the first one."""
    parts = list(dict.fromkeys(block.part for block in every if block.part))
    opened = {part for part in parts if any(f"{name}/".startswith(f"{part}/") for name in (*faulty, wanted))}
    seen = set[str]()
    for block in every:
        if not block.part:
            yield Group((block,))
        elif block.part not in seen:
            seen.add(block.part)
            own = tuple(each for each in every if each.part == block.part)
            shown = block.part in (opened or parts[:1])
            yield Group(own, block.part, *_described(own, spots, values), shown)


def _described(blocks: Sequence[Block], spots: Mapping[str, Spot], values: Mapping[str, str]) -> tuple[str, str]:
    """Title of a part, by its first choice, and a line of its other choices and of what varies in it."""
    chosen = {entry.field.label: _(dict(entry.field.choices)[entry.chosen(values)]) for block in blocks
              for entry in block.entries if isinstance(entry.item, FormChoice)}  # fmt: skip
    kind, *others = chosen.items()
    at, _slash, index = blocks[0].part.rpartition("/")
    rows = next(rows for rows in form_of(values).lists if at == f"{BASE}/{rows.at}")
    title = _(rows.title, number=int(index) + 1, label=lower_first(kind[1]))
    before = [spots[entry.name] for entry in blocks[0].entries if entry.item in rows.fields]
    texts = [f"{lower_first(_(label))}: {lower_first(text)}" for label, text in others]
    texts += [f"{lower_first(spot.label)} {_numeral(spot.quantity.text)} {unit_text(spot.quantity.unit)}"
              for spot in before if spot.quantity.text and spot.row is None]  # fmt: skip
    varying = [spots[entry.name] for block in blocks for entry in _all(block.entries)
               if entry.name in spots and spots[entry.name].row is not None]  # fmt: skip
    texts += [_("{label} varies", label=lower_first(spot.label)) for spot in varying]
    return title, ", ".join(texts)


def _numeral(text: str) -> str:
    """The text of a field as it is printed, where it is a number."""
    value = parse_number(text)
    return text if value is None else number(value, _LONGEST)


def _differs(values: Mapping[str, str], begun: Values | None, entries: Iterable[Entry]) -> bool:
    """Whether some fields have something else than those of an example that has them."""
    return begun is not None and any(
        not _same(values.get(entry.name, ""), begun[entry.name], entry.field.unit)
        for entry in entries if entry.name in begun
    )  # fmt: skip


def _all(entries: Iterable[Entry]) -> list[Entry]:
    """Entries with those of their groups."""
    return [own for entry in entries for own in (entry, *_all(inner for _, group in entry.groups for inner in group))]


def _same(first: str, second: str, si: str) -> bool:
    """Whether two texts are the same, or the same quantity."""
    try:
        return first.strip() == second.strip() or (
            parse_quantity(plain(first), si or "1") == parse_quantity(plain(second), si or "1")
        )
    except QuantityError:
        return False


@dataclass(slots=True)
class _Making:
    """What the parts of a sheet are made from."""

    values: Mapping[str, str]
    numbers: Mapping[str, str]
    units: Mapping[str, str]
    before: Values | None

    def spot(self, entry: Entry, repeated: set[str]) -> Spot:
        field, path, text = entry.field, base_path(entry.name), self.values.get(entry.name, "")
        label = _(field.label)
        if field.label in repeated and path in self.numbers:
            label = bare_caption(model_name(self.values), path, gettext)
        was = None if self.before is None else self.before.get(entry.name, "")
        row = varied(self.values).get(path)
        plain = not getattr(entry.item, "lines", 0) and getattr(entry.item, "kind", "") in ("", "number")
        quantity = quantity_of(text, field.unit if plain else "", self.units)
        return Spot(
            entry, label, path, quantity, text, path in self.numbers, row, self._span(row) if row is not None else "",
            was if was is not None and not _same(was, text, field.unit) else None,
        )  # fmt: skip

    def _span(self, row: int) -> str:
        """The values of a row in words: ``0 … 1.6 N·m``."""
        own = self._row(row)
        texts = _several(own.quantity.text)
        ends = texts[:2] if typed_range(own.quantity.text) else [*texts[:1], *texts[1:][-1:]]
        known = not own.quantity.unit or any(typed_unit(text) for text in ends)
        unit = "" if known else f" {unit_text(own.quantity.unit)}"
        return " … ".join(ends or ["?"]) + unit

    def rows(self) -> Iterable[Row]:
        return (self._row(index) for index in range(count_of(self.values, part_of(self.values))))

    def _row(self, index: int) -> Row:
        pointer = f"{PARTS[part_of(self.values)].pointer}/{index}"
        path = self.values.get(f"{pointer}/path", "").strip()
        tied = names_of(self.values.get(f"{pointer}/tied", ""))
        alikes = tuple(other for other in self.numbers if other != path and path and _alike(path) == _alike(other))
        alike = bool(alikes) and set(alikes) <= set(tied)
        entry = model_parameter(model_name(self.values), path) if path else None
        rest = ", ".join(own for own in tied if not alike or own not in alikes)
        text, si = self.values.get(f"{pointer}/values", ""), entry.unit if entry else ""
        quantity = quantity_of(text, si, self.units, listed=True)
        return Row(index, pointer, path, self.numbers.get(path, path), quantity, alikes, alike, rest)


def _alike(path: str) -> str:
    """What numbers have in common that can vary alike: those of both directions, or of several rows of a list."""
    return re.sub(r"\.\d+\.", ".*.", re.sub(r"_[xy]$", "", path))


def quantity_of(text: str, si: str, wanted_units: Mapping[str, str], *, listed: bool = False) -> Quantity:
    """A text with the unit of its numbers beside it, or as it is, where they have none in common.

    Plain numbers are in the SI unit ``si``; they are shown in the unit that is wanted where that has them exactly.
    ``listed``: the text can be a list or a range.
    """
    units = offered(si)
    if not units:
        return Quantity(text)
    wanted = wanted_units.get(si, si)
    parts = [_NUMBER.fullmatch(item) for item in (_several(text) if listed else [text]) if item.strip()]
    numbers = [(part[1], part[2].strip()) for part in parts if part]
    given = {unit for _number, unit in numbers}
    if len(numbers) < len(parts) or len(given) > 1:
        return Quantity(text, si, units)
    unit = next(iter(given), None)
    if unit is None:
        return Quantity(text, wanted, units)
    if unit:
        own = next((own for own in units if own == latin(plain_signs(unit))), None)
        if own is None:  # one that is not offered, or a mistake, stays with its number
            return Quantity(text, si, units)
        return Quantity(_with_numbers(text, [number for number, _unit in numbers]), own, units)
    converted = [_converted(number, wanted, si) for number, _unit in numbers] if wanted != si else [None]
    if all(converted):
        return Quantity(_with_numbers(text, [number or "" for number in converted]), wanted, units)
    return Quantity(text, si, units)


def _several(text: str) -> list[str]:
    """The quantities of a text with a list or a range, each with its unit."""
    written = typed_range(text)
    if written is None:
        return with_last_unit(split_list(text))
    return list(written.numbers)


def _with_numbers(text: str, numbers: Sequence[str]) -> str:
    """The text with other quantities, in their order."""
    written = typed_range(text)
    return "; ".join(numbers) if written is None else written.with_numbers(*numbers).text


def _converted(text: str, unit: str, si: str) -> str | None:
    """A plain number in another unit; None where that has no short exact text for it."""
    number = parse_number(text)
    if number is None:
        return None
    try:
        shown = f"{number / parse_quantity(f'1 {unit}', si):.10g}"
        exact = len(shown) <= _LONGEST and parse_quantity(f"{shown} {unit}", si) == number
    except QuantityError:
        return None
    return shown if exact else None
