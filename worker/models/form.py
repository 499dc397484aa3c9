"""The form of a model's machine as data: blocks of fields, lists of rows, and choices that decide about other fields.

Names are paths with slashes below the base of a spec, or below a row of a list. What a catalogue describes (numbers,
choices of the spec) needs no more than its name here.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

#: How the text of a field is read: as a number or choice that a catalogue describes, a number, a text as it is, a list,
#: a table of two columns, measured rows, lines of names with numbers, lines of steps or of elements of a linkage; or
#: whether it is ticked.
FieldKind = Literal["", "number", "text", "list", "table", "measured", "constants", "steps", "elements", "tick"]


@dataclass(frozen=True, slots=True)
class Hidden:
    """Where the choice of the name ``by`` has one of ``values``, the field is not there; of many only ``numbers``."""

    by: str
    values: tuple[str, ...]
    numbers: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FormField:
    """A field that gives one entry of the base; a name that ends in ``*`` stands for all numbers directly there that no
    other field of the form names.

    Attributes
    ----------
    label, help, range, default, example, symbol, unit, required : of what no catalogue describes, or instead of its
    lines : height of its text; 0 for a line
    columns : of a table, or the choice (with ``@``) whose value is the column; of several quantities (``angle|time``)
        the one that a column has
    without : values of its choices that are not offered
    hidden : where it is not there
    """

    name: str
    kind: FieldKind = ""
    label: str = ""
    help: str = ""
    range: str = ""
    default: str = ""
    example: str = ""
    symbol: str = ""
    unit: str = ""
    required: bool = False
    lines: int = 0
    columns: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    hidden: tuple[Hidden, ...] = ()


@dataclass(frozen=True, slots=True)
class Option:
    """One way of a choice with its fields; ``label`` "" is the words of its value.

    A spec has chosen it where it has an entry ``at``, with ``is_kind`` one whose ``kind`` is the value; the first
    option of a choice, which needs none, is that of the others. ``implies`` are entries that hold with it without a
    field.
    """

    value: str
    label: str = ""
    items: tuple[FormField | FormChoice, ...] = ()
    at: str = ""
    is_kind: bool = False
    implies: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FormChoice:
    """A choice of the form's own, which the spec has by what else it has.

    Where its ``control`` is a switch, the page has the fields of all options. ``several``: a list; where it has one
    row, the page leaves the choice out while its first option is the chosen one.
    """

    name: str
    label: str
    options: tuple[Option, ...]
    help: str = ""
    control: Literal["select", "radio", "switch"] = "select"
    several: str = ""


@dataclass(frozen=True, slots=True)
class Block:
    """Fields under one heading; one that is ``within`` continues the block before it.

    ``only`` is a choice and the value with which it is there, ``adds`` the list to which its button adds.
    """

    title: str
    items: tuple[FormField | FormChoice, ...]
    within: bool = False
    only: tuple[str, str] | None = None
    adds: str = ""


@dataclass(frozen=True, slots=True)
class Rows:
    """A list of ``least`` to ``most`` rows, each with the same blocks.

    Attributes
    ----------
    name, at : of the field with the number of rows, and their place in the base
    title, first : of a row by its number, and the number of the first one
    add, drop : texts of the buttons; ``only_last`` removes no other row
    copies : whether a new row is a copy of the last one
    alone : whether the blocks stand once, outside of the list, where it has no rows
    fields : what only a row has, before the items of its first block
    shared : a choice, and the entry of each row that stands outside of the list where its value is not "own"
    every, one : all rows, and one of them by its number, as those for which a component is taken
    """

    name: str
    at: str
    least: int
    most: int
    title: str
    add: str
    drop: str
    blocks: tuple[Block, ...]
    only_last: bool = False
    copies: bool = True
    alone: bool = False
    fields: tuple[FormField, ...] = ()
    shared: tuple[str, str] | None = None
    every: str = ""
    one: str = ""


@dataclass(frozen=True, slots=True)
class ComponentKind:
    """A kind of components that a machine can have.

    Attributes
    ----------
    name, title : of the kind, and of many
    fields : field of a component -> name of a field of the form, with ``N`` for a row of a list
    required : fields that every one must have
    ways : values of its choice, if it has one, and the fields that each needs and no other has
    choice : the field with that choice
    titles : what the values of the choice are called
    twice, foreign, change, keep : what is said of one that is given twice, and of a field that it does not have; texts
        of its part of the page
    sets : further fields of the form that it fills in
    chosen : path of the choice in the base of a spec
    replaces : objects of the base that a component stands for as a whole
    """

    name: str
    title: str
    fields: Mapping[str, str]
    required: tuple[str, ...]
    twice: str
    foreign: str
    change: str
    keep: str
    choice: str = ""
    ways: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    titles: Mapping[str, str] = field(default_factory=dict)
    sets: Mapping[str, str] = field(default_factory=dict)
    chosen: str = ""
    replaces: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Form:
    """The form of a model.

    Attributes
    ----------
    parts : blocks and lists in their order; parameters elsewhere have blocks of their own
    components : kinds of components
    new : values of an empty form
    called : the model in a sentence, such as "a machine shaft"; "" for its title
    with_run : whether its studies have a run, so that cases can start from their neighbours
    with_loads : whether their run says only whether the cases have loads among their results
    examples : what fields of the study show while they are empty
    drawer : what the drawer with the other fields is about
    front : patterns of the paths, with N for numbers, whose fields are always in sight; none: all of them
    normal : what is said about a batch of machines that differ
    advice : what is said about axes
    groups : beginning of paths -> heading under which they are offered as axes; by default their first parts
    labels : path of the catalogue -> label of its axis, with {part} and {number}
    """

    parts: tuple[Block | Rows, ...] = ()
    components: tuple[ComponentKind, ...] = ()
    new: Mapping[str, str] = field(default_factory=dict)
    called: str = ""
    with_run: bool = False
    with_loads: bool = False
    examples: Mapping[str, str] = field(default_factory=dict)
    drawer: str = "More: rare numbers, cases, deadline"
    front: tuple[str, ...] = ()
    normal: str = (
        "Normal: ± is three standard deviations, so that nearly all machines are within it. Each place of the study is "
        "run with the nominal machine and with the drawn ones."
    )
    advice: str = ""
    groups: tuple[tuple[str, str], ...] = ()
    labels: Mapping[str, str] = field(default_factory=dict)

    def example(self, name: str) -> str:
        """An example; "" where there is none."""
        return self.examples.get(name, "")

    def in_sight(self, path: str) -> bool:
        """Whether the field of a number is always in sight."""
        general = re.sub(r"\.\d+(?=\.|$)", ".N", path)
        return not self.front or any(re.fullmatch(pattern, general) for pattern in self.front)

    @property
    def lists(self) -> tuple[Rows, ...]:
        """Its lists."""
        return tuple(part for part in self.parts if isinstance(part, Rows))
