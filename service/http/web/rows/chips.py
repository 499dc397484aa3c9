"""The conditions of the page of rows in words: each can be taken away, and what they leave out is told."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from sprag_study.service.languages import _
from sprag_study.service.reading.reader import plural, shown, word
from sprag_study.service.reading.wording import number
from sprag_study.service.results.selection import value_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.http.web.rows.view import RowsPage
    from sprag_study.service.reading.reader import Reading


@dataclass(frozen=True, slots=True)
class Chip:
    """A condition: what it is about and what it demands, the address without it, and what it does alone.

    ``kept`` and ``left_out`` are as of `Condition`, None of one that leaves nothing out.
    """

    about: str
    demand: str
    without: str
    kept: int | None = None
    left_out: int = 0

    @property
    def text(self) -> str:
        """The condition within a sentence."""
        return f"{self.about} {self.demand}".strip()


def chips_of(view: RowsPage, reading: Reading) -> list[Chip]:
    """The conditions of a page, those of one quantity together."""
    counted = {one.name: one for one in view.conditions}
    found = []
    for name, chip in [*_ranges(view, reading), *_others(view, reading)]:
        own = counted.get(name)
        found.append(chip if own is None else replace(chip, kept=own.kept, left_out=own.left_out))
    return found


def _ranges(view: RowsPage, reading: Reading) -> Iterator[tuple[str, Chip]]:
    where = list(zip(view.asked.query.where, view.ranges, strict=True))
    for name in dict.fromkeys(one.name for _text, one in where):
        unit = view.units[name]
        own = [one for _text, one in where if one.name == name]
        least = max((one.limit for one in own if one.at_least), default=None)
        most = min((one.limit for one in own if not one.at_least), default=None)
        without = view.asked.link(where=tuple(text for text, one in where if one.name != name))
        about = reading.within(name)
        if (name, least, most) == ("violation", None, 0.0):
            yield name, Chip(_("within the limits"), "", without)
        elif least is not None and most is not None:
            text = reading.quantity(most, unit)
            low = number(reading.value(least, unit))
            yield name, Chip(about, f"= {text}" if least == most else _("{low} to {high}", low=low, high=text), without)
        elif least is not None:
            yield name, Chip(about, f"≥ {reading.quantity(least, unit)}", without)
        elif most is not None:
            yield name, Chip(about, f"≤ {reading.quantity(most, unit)}", without)


def _others(view: RowsPage, reading: Reading) -> Iterator[tuple[str, Chip]]:
    asked, query = view.asked, view.asked.query
    for path, value in query.at:
        at = tuple(pair for pair in query.at if pair != (path, value))
        number_ = value_of(path, value, view.units[path])
        yield "at", Chip(reading.within(path), f"= {reading.quantity(number_, view.units[path])}", asked.link(at=at))
    for name in ("ending", "regime", "flag"):
        if value := getattr(query, name):
            yield name, Chip("", word(value), asked.link(**{name: ""}))
    if query.without:
        count = plural("without {count} row", "without {count} rows", len(query.without))
        yield "without", Chip(shown(count), "", asked.link(without=()))
