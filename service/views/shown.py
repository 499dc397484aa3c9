"""What people read of a view beside its figure: sentences, and tables of amounts; a reading says them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag_study.service.reading.wording import unit_text

if TYPE_CHECKING:
    from sprag_study.service.reading.reader import Reading

#: A number in SI (None for none), or a text, of which a phrase is said in the reader's language.
Cell = float | int | str | None


@dataclass(frozen=True, slots=True)
class Column:
    """A column: a phrase or the name of a quantity, and the SI unit of its numbers, which are shown with ``digits``."""

    title: str
    unit: str = "1"
    digits: int = 5

    def heading(self, reading: Reading) -> str:
        """Its title with the reader's unit."""
        title, unit = reading.say_name(self.title), unit_text(reading.unit(self.unit))
        return f"{title} ({unit})" if unit else title


@dataclass(frozen=True, slots=True)
class ShownTable:
    """A table; ``cases`` are the cases to which the first cells of its rows lead, () where they lead nowhere."""

    title: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    cases: Sequence[int | None] = ()


@dataclass(frozen=True, slots=True)
class Shown:
    """Sentences, tables that are folded where there are several, and tables that are open in any case."""

    sentences: Sequence[str] = ()
    tables: Sequence[ShownTable] = ()
    opened: Sequence[ShownTable] = ()


#: Nothing beside the figure.
NOTHING: Final = Shown()
