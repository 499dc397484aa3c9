"""The machine of a form as blocks of fields, made from the form of its model (`sprag_study.worker.models.form`).

Which fields a block has follows from the choices made so far. The name of a field is the JSON Pointer of its value in
the spec; that of a choice of the form's own is where its object would be.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, Final, Literal

from sprag_study.service.http.web.form.entries import count_in
from sprag_study.service.http.web.form.fields import FORM_MODEL, Choice, Field, Groups, described, field_for
from sprag_study.service.languages import _, current
from sprag_study.service.reading.reader import Reading, part_label, shown
from sprag_study.service.reading.wording import words
from sprag_study.service.spec.described import Described, below
from sprag_study.service.spec.fields import base_path
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.worker import models
from sprag_study.worker.models import Parameter
from sprag_study.worker.models import form as data
from sprag_study.worker.models.parameters import general_path, model_parameter

BASE: Final = "/base"
#: What the form of a model says of a field instead of its catalogue.
_GIVEN: Final = ("label", "symbol", "unit", "range", "default", "example", "required")


@dataclass(frozen=True, slots=True)
class Entry:
    """A field with its control.

    Attributes
    ----------
    place : pointer of the base, or of the row of a list, below which its item has its name
    item : the field or choice of the model's form
    shape : whether it decides about other fields
    tolerant : whether drives can differ in it: it is a number of the machine
    groups : of a switch, the fields of each of its options
    unseen : whether the page leaves it out, as it decides nothing
    """

    field: Field
    place: str
    item: data.FormField | data.FormChoice
    shape: bool = False
    tolerant: bool = False
    groups: tuple[tuple[str, tuple[Entry, ...]], ...] = ()
    unseen: bool = False

    @property
    def name(self) -> str:
        """The field's name."""
        return self.field.name

    @property
    def pointer(self) -> str:
        """The pointer of the object that it is in."""
        return self.name.rpartition("/")[0]

    @property
    def control(self) -> Literal["line", "lines", "select", "radio", "switch", "tick"]:
        """What it is on the page."""
        if isinstance(self.item, data.FormChoice):
            return self.item.control
        if self.item.kind == "tick":
            return "tick"
        return "select" if self.field.choices else "lines" if self.item.lines else "line"

    @property
    def kind_of(self) -> str:
        """Pointer of the object whose kind it says, so that the same names mean something else with another; "" for
        none.
        """
        if isinstance(self.item, data.FormChoice):
            at = next((option.at for option in self.item.options if option.is_kind), "")
            return f"{self.place}/{at}" if at else ""
        return self.pointer if self.field.choices and self.name.endswith("/kind") else ""

    @property
    def kinds(self) -> set[str]:
        """Of `kind_of`, the values that are kinds of that object."""
        if isinstance(self.item, data.FormChoice):
            return {option.value for option in self.item.options if option.is_kind}
        return {value for value, _label in self.field.choices}

    def chosen(self, values: Mapping[str, str]) -> str:
        """The value of a choice, by default the first one."""
        known = [value for value, _label in self.field.choices]
        return value if (value := values.get(self.name, "")) in known else known[0]

    def option(self, values: Mapping[str, str]) -> data.Option:
        """The chosen option of a choice of the form's own."""
        assert isinstance(self.item, data.FormChoice)
        return next(option for option in self.item.options if option.value == self.chosen(values))


@dataclass(frozen=True, slots=True)
class Block:
    """Fields under one heading.

    ``within`` are the blocks that continue it; ``drop`` is the list and the row that a button removes, ``adds`` the
    list to which one adds in it, ``ends`` the one that ends with it. ``part`` is the pointer of the part of the machine
    that it belongs to, in which it is called ``heading``; "" where the machine has no parts.
    """

    title: str
    entries: tuple[Entry, ...]
    within: tuple[Block, ...] = ()
    drop: tuple[str, int] | None = None
    adds: str = ""
    ends: str = ""
    part: str = ""
    heading: str = ""


def model_name(values: Mapping[str, str]) -> str:
    """The model of a form."""
    name = values.get("model", FORM_MODEL)
    return name if name in models.model_names() else FORM_MODEL


def form_of(values: Mapping[str, str]) -> data.Form:
    """What the model of a form shows in it."""
    return models.model_of(model_name(values)).presentation.form


def rows_of(values: Mapping[str, str], rows: data.Rows) -> int:
    """Number of rows of a list."""
    return count_in(values, rows.name, rows.least, rows.least, rows.most)


def blocks(values: Mapping[str, str]) -> list[Block]:
    """The blocks of the machine in their order."""
    known = models.parameter_catalogue(model_name(values))
    return list(_blocks(current(), known, frozenset(values.items())))


@lru_cache(maxsize=8)
def _blocks(_language: str, _known: tuple[Parameter, ...], values: frozenset[tuple[str, str]]) -> tuple[Block, ...]:
    """What `blocks` gives: a page asks ten times for the blocks of one form."""
    return tuple(_Machine(dict(values)).blocks())


def entries(values: Mapping[str, str], *, hidden: bool = False) -> Iterator[Entry]:
    """The fields of the machine that count; ``hidden``: also those of options of a switch that are not chosen."""

    def each(items: Iterable[Entry]) -> Iterator[Entry]:
        for entry in items:
            yield entry
            for value, group in entry.groups:
                if hidden or value == entry.chosen(values):
                    yield from each(group)

    for block in blocks(values):
        for own in (block, *block.within):
            yield from each(own.entries)


def places(values: Mapping[str, str], kind: data.FieldKind) -> list[str]:
    """Pointers of the objects with a field of that kind."""
    return [entry.pointer for entry in entries(values) if getattr(entry.item, "kind", None) == kind]


@dataclass(slots=True)
class _Machine:
    """The blocks of a filled form."""

    values: Mapping[str, str]
    model: str = field(init=False)
    form: data.Form = field(init=False)
    deciding: frozenset[str] = field(init=False)
    named: frozenset[str] = field(init=False)
    chosen: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.model, self.form = model_name(self.values), form_of(self.values)
        fields = [item for part in self.form.parts for item in _items(part)]
        self.deciding = frozenset(hidden.by for item in fields for hidden in item.hidden)
        self.named = frozenset(item.name for item in fields)

    def blocks(self) -> Iterator[Block]:
        made: list[Block] = []
        for part in (*self.form.parts, *_others(self.model, self.form)):
            if isinstance(part, data.Rows):
                rows = list(self._rows(part))
                made += [*rows[:-1], *(replace(last, ends=part.name) for last in rows[-1:])]
            elif part.within:
                made[-1] = _continued(made[-1], self._block(part, BASE))
            else:
                made.append(self._block(part, BASE))
        yield from made

    def _rows(self, rows: data.Rows) -> Iterator[Block]:
        count = rows_of(self.values, rows)
        for index in range(count):
            place = f"{BASE}/{rows.at}/{index}"
            made: list[Block] = []
            for block in rows.blocks:
                if block.only is None or self.values.get(f"{BASE}/{block.only[0]}") == block.only[1]:
                    own = self._block(block, place, () if made else rows.fields)
                    own = replace(own, part=place if rows.alone else "", heading=block.title)
                    title = _(rows.title, number=index + 1, label=_(block.title).lower())
                    if block.within:
                        made[-1] = _continued(made[-1], own)
                    else:
                        drop = None if made or rows.only_last else (rows.name, index)
                        made.append(replace(own, title=title, drop=drop))
            yield from made
        if not count and rows.alone:
            yield from (self._block(block, BASE) for block in rows.blocks)

    def _block(self, block: data.Block, place: str, before: Sequence[data.FormField] = ()) -> Block:
        return Block(block.title, tuple(self._entries((*before, *block.items), place)), adds=block.adds)

    def _entries(self, items: Iterable[data.FormField | data.FormChoice], place: str) -> Iterator[Entry]:
        for item in items:
            if isinstance(item, data.FormChoice):
                yield from self._choice(item, place)
            elif item.name.rpartition("/")[2] != "*":
                if not self._is_hidden(item, place, ""):
                    yield self._field(item, place)
            else:
                for name in _numbers(self.model, f"{place}/{item.name}".removeprefix(f"{BASE}/")[:-1]):
                    named = item.name[:-1] + name in self.named
                    if not named and not self._is_hidden(item, place, name):
                        yield self._field(replace(item, name=item.name[:-1] + name), place)

    def _choice(self, item: data.FormChoice, place: str) -> Iterator[Entry]:
        choices = tuple((option.value, option.label or words(option.value)) for option in item.options)
        entry = Entry(Field(f"{place}/{item.name}", item.label, item.help, choices=choices), place, item, shape=True)
        option = entry.option(self.values)
        self.chosen[entry.name] = option.value
        if item.control == "switch":
            groups = tuple((option.value, tuple(self._entries(option.items, place))) for option in item.options)
            yield replace(entry, groups=groups)
            return
        plain = item.several and option == item.options[0] and count_in(self.values, item.several, 1, 1, 2) == 1
        yield replace(entry, unseen=bool(plain))
        yield from self._entries(option.items, place)

    def _is_hidden(self, item: data.FormField, place: str, number: str) -> bool:
        def value(by: str) -> str:
            name = f"{place}/{by}"
            return self.chosen.get(name) or self.values.get(name, "")

        return any(value(own.by) in own.values and (not own.numbers or number in own.numbers) for own in item.hidden)

    def _field(self, item: data.FormField, place: str) -> Entry:
        name = f"{place}/{item.name}"
        path = base_path(name)
        entry = None if item.kind else model_parameter(self.model, path) or _described(self.model, path)
        if entry is None:
            own = Field(name, item.label, item.help)
        elif isinstance(entry, Parameter):
            own = field_for(entry, path, self.model)
        else:
            own = described(entry, name.rpartition("/")[0])
            blank = (("", item.default),) if item.without else ()
            choices = (*blank, *(pair for pair in own.choices if pair[0] not in item.without))
            own = replace(own, choices=choices, default="" if choices else own.default)
        given: dict[str, Any] = {name: getattr(item, name) for name in _GIVEN if getattr(item, name)}
        own = replace(own, **given)
        made = Entry(own, place, item, shape=item.name in self.deciding, tolerant=isinstance(entry, Parameter))
        if own.choices:
            self.chosen[name] = made.chosen(self.values)
        return made


def _continued(block: Block, inner: Block) -> Block:
    return replace(block, within=(*block.within, inner))


def _items(part: data.Block | data.Rows) -> Iterator[data.FormField]:
    """Every field of a part of a form."""

    def each(items: Iterable[data.FormField | data.FormChoice]) -> Iterator[data.FormField]:
        for item in items:
            if isinstance(item, data.FormField):
                yield item
            else:
                for option in item.options:
                    yield from each(option.items)

    for block in (part,) if isinstance(part, data.Block) else part.blocks:
        yield from each(block.items)


def _root(path: str) -> str:
    """The part of the machine that a path belongs to; "" for the machine itself."""
    return path.partition("/")[0] if "/" in path else ""


def _others(model: str, form: data.Form) -> list[data.Block]:
    """A block for each part of the machine that the form does not mention, titled by its name."""
    known = {_root(item.name) for part in form.parts if isinstance(part, data.Block) or part.alone
             for item in _items(part)}  # fmt: skip
    paths = (entry.path.split(".") for entry in models.parameter_catalogue(model))
    roots = dict.fromkeys(_root("/".join(path)) for path in paths if not {"N", "K", "NAME"} & set(path))
    return [
        data.Block(words(root or "other parameters"), (data.FormField(f"{root}/*".removeprefix("/")),))
        for root in roots
        if root not in known
    ]


def _numbers(model: str, prefix: str) -> list[str]:
    """Names of the numbers directly below a path with slashes, in the order of the catalogue."""
    general = general_path(f"{prefix.replace('/', '.')}*").removesuffix("*")
    # The parts of a list may have the numbers of a machine that has only one of them.
    for start in (general, general.rpartition(".N.")[2]):
        below = [entry.path.removeprefix(start) for entry in models.parameter_catalogue(model)
                 if entry.path.startswith(start)]  # fmt: skip
        names = [name for name in below if "." not in name]
        if names:
            return names
    return []


def _described(model: str, path: str) -> Described | Parameter | None:
    """What the spec says about an entry of the base that is no number of the catalogue."""
    found = below(part_of(model).base(), path)
    return found if isinstance(found, Described | Parameter) else None


def _general(path: str) -> str:
    """The path of an entry of the base that no catalogue of numbers has, without the parts that it may be in."""
    return general_path(path).removeprefix("parts.N.").removeprefix("pendulums.N.")


def choices_of(values: Mapping[str, str], base: Mapping[str, Any]) -> Groups:
    """The parameters of a machine that can vary, by group; none while its structure cannot be read."""
    model = model_name(values)
    known = part_of(model).read_base(Node(Report(), BASE, base)).parameters
    return grouped(model, {path: entry.unit for path, entry in known.items()})


def grouped(model: str, units: Mapping[str, str]) -> Groups:
    """Parameters with their units as choices, by group."""
    form = models.model_of(model).presentation.form
    groups: dict[str, list[Choice]] = {}
    for path, unit in units.items():
        group, known = group_of(model, path), form.labels.get(_general(path))
        number = int(path.rpartition(".")[2]) + 1 if known else 0
        label = _(known, part=group, number=number) if known else Reading(model).caption(path)
        groups.setdefault(group, []).append(Choice(path, label, unit))
    return list(groups.items())


def row_of(model: str, path: str) -> tuple[data.Rows | None, int, str]:
    """The list of machines that ``path`` belongs to, or None, the number of its row, and the path within it."""
    for rows in models.model_of(model).presentation.form.lists:
        found = re.fullmatch(rf"{re.escape(rows.at)}\.(\d+)\.(.*)", path) if rows.alone else None
        if found is not None:
            return rows, int(found[1]) + 1, found[2]
    return None, 0, path


def group_of(model: str, path: str) -> str:
    """Heading under which a number stands."""
    form, (rows, number, own) = models.model_of(model).presentation.form, row_of(model, path)
    title = next((title for prefix, title in form.groups if own.startswith(prefix)), "")
    if form.labels.get(_general(path)):
        return shown(part_label(words(path.rsplit(".", 2)[0])))
    if not title:
        rest = (part.title for part in form.parts if isinstance(part, data.Block) for item in part.items
                if item.name == "*")  # fmt: skip
        return shown(part_label(words(path.rpartition(".")[0]) or next(rest, words("other parameters"))))
    return _(title) if rows is None else _(rows.title, number=number, label=_(title).lower())
