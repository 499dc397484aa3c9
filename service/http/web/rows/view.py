"""What the page of rows shows, found in the process that reads the rows: plain data, of many rows the drawn ones."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.http.web.rows.asked import Asked, read_asked
from sprag_study.service.http.web.rows.lines import Lines, lines_of, shades_of
from sprag_study.service.http.web.rows.points import points_of
from sprag_study.service.results.explore import explored_rows
from sprag_study.service.results.headlines.along import wanted_of
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.rows import PLACES, rows_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.answers.explore import ExploredCase
    from sprag_study.service.reading.reader import Choice
    from sprag_study.service.results.explore import Condition, Explored, Range
    from sprag_study.service.views.library import Library


#: Orders of rows that have no shades.
_NO_NUMBERS: Final = frozenset({"case", "ending", "flags", "regime"})


@dataclass(frozen=True, slots=True)
class Chosen:
    """The row in the pane.

    Attributes
    ----------
    main : its main quantity, "" for none; ``wanted`` is the wanted value of it (SI)
    place : from 1 within the conditions; None where it is on no page that was read
    before, after : its neighbours: numbers, and before which row their pages begin
    """

    row: ExploredCase
    main: str
    wanted: float | None
    place: int | None
    before: tuple[int, int] | None
    after: tuple[int, int] | None


@dataclass(frozen=True, slots=True)
class RowsPage:
    """The page of a study.

    Attributes
    ----------
    known, selected : numbers of rows
    conditions, ranges : what conditions do, and the checked ranges
    shown, units : names of the shown quantities, and units of all by name
    rows : those of the page, with the shade of each
    before : number of the last row of the page before; None on the first one
    lines, points : the plot, one of both; points are their two quantities and their picture
    colour : what shades stand for: name and ends (SI), the palest first; None where it has no numbers
    """

    asked: Asked
    known: int
    selected: int
    conditions: tuple[Condition, ...]
    ranges: tuple[Range, ...]
    shown: tuple[str, ...]
    units: dict[str, str]
    rows: tuple[tuple[ExploredCase, int], ...]
    colour: tuple[str, float, float] | None
    lines: Lines | None
    points: tuple[tuple[str, str], str] | None
    chosen: Chosen | None
    before: int | None


def rows_view(library: Library, study_id: str, pairs: Sequence[tuple[str, str]], choice: Choice) -> RowsPage:
    """The page of an address; where that asks for what there is not, the rest of it, with what is wrong."""
    study = library.store.studies.study(study_id)
    reading = reading_of(library.store, study_id, choice)
    asked = read_asked(pairs, study, reading)
    query = asked.query
    colour = asked.colour or query.sort.removeprefix("-")
    colour = "" if colour in _NO_NUMBERS else colour
    also = tuple(filter(None, (colour, *((asked.x, asked.y) if asked.plot == "points" else ()))))
    found = rows_of(library, study_id, replace(query, limit=asked.skip + query.limit + 1, also=also))
    chosen = _chosen(found, asked)
    before = int(found.rows.cases[found.order[asked.skip - 1]]) if 0 < asked.skip <= found.order.size else None
    found = replace(found, order=found.order[asked.skip : asked.skip + query.limit])
    shades, ends = _shades(found, colour, asked)
    rows = tuple(zip(explored_rows(study, found), shades[found.order].tolist(), strict=True))
    lines, points = None, None
    if asked.plot == "lines":
        lines = lines_of(found, asked.log, asked.flip, shades, outside=asked.outside)
    elif found.known:
        points = points_of(found, asked, shades, None if chosen is None else chosen.row["case"], reading)
    return RowsPage(
        asked,
        found.known,
        found.count,
        found.conditions,
        found.plan.ranges,
        found.plan.shown,
        found.plan.units,
        rows,
        ends,
        lines,
        points,
        chosen,
        before,
    )


def _shades(found: Explored, colour: str, asked: Asked) -> tuple[np.ndarray, tuple[str, float, float] | None]:
    values = found.values.get(colour)
    if values is None:
        return np.ones(found.known, dtype=np.int64), None
    falling = asked.query.sort == colour  # the first is the strongest
    known = values[found.selected & np.isfinite(values)]
    ends = (colour, float(known.min()), float(known.max())) if known.size else None
    if ends is not None and falling:
        ends = (colour, ends[2], ends[1])
    return shades_of(values, found.selected, falling=falling), ends


def _chosen(found: Explored, asked: Asked) -> Chosen | None:
    """The chosen row, or the first one of the page; ``found`` has the rows up to the one behind the page."""
    order, study = found.order[asked.skip :], found.study
    if asked.row is not None:
        place = int(np.searchsorted(found.rows.cases, asked.row))
        if place < found.known and found.rows.cases[place] == asked.row:
            order = np.array([place])
    if not order.size:
        return None
    row = next(explored_rows(study, replace(found, order=order[:1])))
    names = [name for name in row["results"] if name not in PLACES]
    main = found.plan.sort if found.plan.sort in names else next(iter(names), "")
    wanted = wanted_of(study, main, row["parameters"])
    at = np.flatnonzero(found.order == order[0])
    if not at.size:
        return Chosen(row, main, wanted, None, None, None)
    own = int(at[0])

    def neighbour(place: int) -> tuple[int, int] | None:
        if not 0 <= place < found.order.size:
            return None
        page = asked.query.limit * (place // asked.query.limit)
        on_page = asked.skip <= place < asked.skip + asked.query.limit
        return int(found.rows.cases[found.order[place]]), asked.skip if on_page else page

    return Chosen(row, main, wanted, own + 1, neighbour(own - 1), neighbour(own + 1))
