"""One walk over what a form shows of a spec, in both directions: fields into entries, and entries into fields.

A part of a spec is described once, by members that know their entries and the fields of these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from sprag_study.sentences import WarningText
from sprag_study.service.http.web.form.entries import (
    Faults,
    Values,
    count_in,
    doubtful,
    entries_of,
    items_of,
    plain,
    text_of,
)
from sprag_study.service.http.web.form.machine import BASE
from sprag_study.service.reading.numbers import in_language, settled
from sprag_study.service.reading.together import with_last_unit
from sprag_study.service.spec.described import Described
from sprag_study.worker.models import form as data


@dataclass(slots=True)
class Filled:
    """A form at an object of its spec.

    Attributes
    ----------
    values : all texts of the form, by name of their field
    at : beginning of the names of the fields of the object
    pointer : JSON Pointer of the object
    faults : by field, of what cannot be expressed as a spec
    fields : the field beside which a fault is shown, by its pointer; it is also that of what is inside
    doubts : points of bare numbers of lists and ranges that are taken as decimal; the spec warns of those with units
    """

    values: Values
    at: str = ""
    pointer: str = ""
    faults: Faults = field(default_factory=dict)
    fields: dict[str, str] = field(default_factory=dict)
    doubts: list[WarningText] = field(default_factory=list)

    def inside(self, at: str, pointer: str = "") -> Filled:
        """Another object of the same form."""
        return replace(self, at=at, pointer=pointer)

    def text(self, name: str, usual: str = "") -> str:
        """The text of a field."""
        return self.values.get(f"{self.at}/{name}", usual).strip()

    def listed(self, name: str) -> list[Any]:
        """The entries of a field with a list, as of `list_of`."""
        items = items_of(self.text(name))
        entries = entries_of(with_last_unit(items))
        self.doubts += doubtful(items, entries, [f"{self.at}/{name}"] * len(items), self.text("path"))
        return entries

    def ranged(self) -> dict[str, Any]:
        """The ends of a range that are filled in, by the names of their fields."""
        names = [name for name in ("from", "to") if self.text(name)]
        return dict(zip(names, self.together([self.text(name) for name in names], names), strict=True))

    def together(self, texts: Sequence[str], names: Sequence[str]) -> list[Any]:
        """The entries for the numbers of a range, each with its field; a unit at the end holds for the bare ones."""
        items = settled([in_language(text) for text in texts])
        entries = list(map(plain, with_last_unit(items)))
        self.doubts += doubtful(items, entries, [f"{self.at}/{name}" for name in names], self.text("path"))
        return entries

    def show(self, texts: Mapping[str, str]) -> None:
        """Set the texts of fields."""
        self.values |= {f"{self.at}/{name}": text for name, text in texts.items()}

    def field_of(self, pointer: str) -> str:
        """The field beside which a fault at ``pointer`` of the spec is shown; "" for the whole form."""
        known = pointer
        while known and known not in self.fields:
            known = known.rpartition("/")[0]
        if known:
            return self.fields[known]
        general = "" if pointer.startswith(BASE) else pointer
        inside = (name for known, name in self.fields.items() if known.startswith(f"{pointer}/"))
        return next(inside, general) if pointer.count("/") > 1 else general


class Member(Protocol):
    """Some entries of an object with their fields."""

    def entries(self, form: Filled) -> dict[str, Any]:
        """The entries that the fields give."""

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """Fill in the fields for an object; the names of the entries that they show, ValueError where they cannot."""


class Item(Protocol):
    """What each row of a list gives."""

    def filled(self, form: Filled) -> bool:
        """Whether a row is filled in."""

    def value(self, form: Filled) -> dict[str, Any]:
        """The item for a row."""

    def fill(self, item: Mapping[str, Any], form: Filled) -> None:
        """Fill in the fields for an item; ValueError where the form cannot show it."""


@dataclass(frozen=True, slots=True)
class Cell:
    """Entries that a few fields give.

    Attributes
    ----------
    keys, fields : names of the entries, and the field of each; several fields of one entry are those of its items
    read, write : the entries from the fields, and the fields from an object
    counts : whether a text in its fields makes the object one that is filled in
    """

    keys: tuple[str, ...]
    fields: tuple[str, ...]
    read: Callable[[Filled], dict[str, Any]]
    write: Callable[[Mapping[str, Any]], Values]
    counts: bool = True

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`."""
        first = self.keys[0]
        each = self.keys if len(self.keys) > 1 else tuple(f"{first}/{index}" for index in range(len(self.fields)))
        for key, name in zip((first, *each), (self.fields[0], *self.fields), strict=True):
            form.fields[f"{form.pointer}/{key}"] = f"{form.at}/{name}"
        return self.read(form)

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`."""
        form.show(self.write(item))
        return set(self.keys)


def typed(
    name: str, read: Callable[[str], Any] = plain, write: Callable[[Any], str] = text_of, *, always: bool = False
) -> Cell:
    """An entry with a field of its name, which is left out where that is empty, unless it is ``always`` there."""
    return Cell(
        (name,), (name,), lambda form: {name: read(form.text(name))} if always or form.text(name) else {},
        lambda item: {name: write(item[name])} if always or name in item else {},
    )  # fmt: skip


def chosen(name: str, usual: str = "", *, always: bool = False) -> Cell:
    """A choice, of which the usual one is left out, unless it is ``always`` there."""
    return Cell(
        (name,), (name,), lambda form: {name: text} if (text := form.text(name, usual)) != usual or always else {},
        lambda item: {name: str(item.get(name, usual))}, counts=False,
    )  # fmt: skip


def ticked(name: str, *, usual: bool = False) -> Cell:
    """Whether something is so, which is left out where it is as usual."""
    return Cell(
        (name,), (name,), lambda form: {name: on} if (on := form.text(name) == "on") != usual else {},
        lambda item: {name: "on"} if item.get(name, usual) else {}, counts=False,
    )  # fmt: skip


def described(entries: Iterable[Described]) -> list[Cell]:
    """Entries of a spec by their descriptions."""
    return [
        ticked(entry.name, usual=entry.default) if entry.kind == "flag"
        else chosen(entry.name, entry.default or entry.values[0], always=entry.default is None)
        if entry.kind == "choice" else typed(entry.name)
        for entry in entries
    ]  # fmt: skip


@dataclass(frozen=True, slots=True)
class Record:
    """An object: ``members``.

    Attributes
    ----------
    whole : ends the name of the field for faults of all of it; None for one that has none
    key : among the members of another object, its entry; "" where its members are those of that object
    when : whether a form has it, which shows it in every case
    new : the fields for none, by default those of an empty one
    """

    members: tuple[Member, ...]
    whole: str | None = None
    key: str = ""
    when: Callable[[Values], bool] = lambda _values: True
    new: Values | None = None

    def filled(self, form: Filled) -> bool:
        """As of an `Item`."""
        cells = (each for each in self.members if isinstance(each, Cell) and each.counts)
        return any(form.text(name) for cell in cells for name in cell.fields)

    def value(self, form: Filled) -> dict[str, Any]:
        """As of an `Item`."""
        if self.whole is not None:
            form.fields[form.pointer] = form.at + self.whole
        return {key: entry for member in self.members for key, entry in member.entries(form).items()}

    def fill(self, item: Mapping[str, Any], form: Filled) -> None:
        """As of an `Item`."""
        try:
            shown = {key for member in self.members for key in member.show(item, form)}
        except KeyError:
            shown = set()
        if not set(item) <= shown:
            raise ValueError(f"the form has no fields for all of {form.at or 'this spec'}")

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`."""
        if not self.when(form.values):
            return {}
        inside = f"/{self.key}" if self.key else ""
        value = self.value(form.inside(form.at + inside, form.pointer + inside))
        return {self.key: value} if self.key else value

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`."""
        if not self.key:
            return {key for member in self.members for key in member.show(item, form)}
        if self.key in item or (self.new is None and self.when(form.values)):
            self.fill(item.get(self.key, {}), form.inside(f"{form.at}/{self.key}"))
        else:
            form.values |= self.new or {}
        return {self.key}


@dataclass(frozen=True, slots=True)
class Rows:
    """A list with a row of fields for each item.

    Attributes
    ----------
    name : of the field with the number of rows
    pointer : beginning of the fields: those of row 0 begin with ``{pointer}/0/``, and its end is the entry
    most : largest number of rows
    item : what each row gives
    new : initial values of a new row
    always : whether the entry is there without rows
    whole : the field for faults of the list; "" for its pointer
    listed : of a list of the machine, what its model says about it
    """

    name: str
    pointer: str
    most: int
    item: Item = Record(())
    new: Values = field(default_factory=dict)
    always: bool = True
    whole: str = ""
    listed: data.Rows | None = None

    @property
    def key(self) -> str:
        """Name of the entry."""
        return self.pointer.rpartition("/")[2]

    def count(self, values: Mapping[str, str]) -> int:
        """Number of rows."""
        least = self.listed.least if self.listed else 0
        return count_in(values, self.name, least, least, self.most)

    def filled(self, values: Values) -> list[int]:
        """The rows that are filled in."""
        return [row for row in range(self.count(values)) if self.item.filled(Filled(values, f"{self.pointer}/{row}"))]

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`."""
        pointer = f"{form.pointer}/{self.key}"
        form.fields[pointer] = self.whole or self.pointer
        items = [
            self.item.value(form.inside(f"{self.pointer}/{row}", f"{pointer}/{index}"))
            for index, row in enumerate(self.filled(form.values))
        ]
        return {self.key: items} if items or self.always else {}

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`."""
        items = item.get(self.key, ())
        if len(items) > self.most or not all(isinstance(each, Mapping) for each in items):
            raise ValueError(f"the form has no fields for all of these {self.name}")
        form.values[self.name] = str(len(items))
        for row, each in enumerate(items):
            self.item.fill(each, form.inside(f"{self.pointer}/{row}"))
        return {self.key}
