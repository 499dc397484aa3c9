"""Curves and maps of a study as data: the request, the cases of each point, and their results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.service.answers import filled
from sprag_study.service.answers.results import Curve as CurveData
from sprag_study.service.answers.results import CurvesData, Jump, MapData, MapPoints, MapResult, ResultMeaning, Stretch
from sprag_study.service.json_text import numbers
from sprag_study.service.reading.directions import in_words
from sprag_study.service.results.refined import Line, RefinedMap, asked_errors, jumps_of
from sprag_study.worker.arrays import Bools, Floats, Ints
from sprag_study.worker.codes import PENDING
from sprag_study.worker.models import OK, WorkerEnding

if TYPE_CHECKING:
    from sprag_study.service.storage.studies.records import CaseColumns
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.planning.refine import Curve as Refined
    from sprag_study.worker.planning.refine_plan import RefinePlan

#: Results of cases, aligned with them: (case numbers, result names) -> columns.
Fetch = Callable[[Ints, Sequence[str]], "CaseColumns"]

#: Paths with values as text, with or without a unit.
Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class CurveQuery:
    """What to draw: paths and result names as in docs/reference.md; values of ``at`` as text with or without a unit.

    Of cases with several rows, one for each regime, that with the ``number``. ``of`` are the values of axes of ``by``
    that have a curve, pairs as those of ``at``; an axis that it does not name has one for each of its values. An axis
    that only ``of`` names is one of ``by``.
    """

    x: str
    y: tuple[str, ...]
    by: tuple[str, ...] = ()
    at: Pairs = ()
    number: int = 0
    of: Pairs = ()


@dataclass(frozen=True, slots=True)
class Selection:
    """The cases of all curves, selected from the study alone; ``units`` (SI) of every drawn or fixed path.

    For display: ``names`` of the drawn paths with those tied to them, and ``held``, the fixed ones with their values,
    including constant ones of the operating point. ``regime`` is the result that gives the kind of motion, where the
    study has one; ``plan`` is that of curves that were refined over x; ``swept``: x is the axis of a sweep. ``model``
    is named as in specs.
    """

    model: str
    x: str
    units: dict[str, str]
    names: dict[str, str]
    held: tuple[str, ...]
    x_values: tuple[float, ...]
    results: tuple[ResultInfo, ...]
    lines: tuple[Line, ...]
    regime: ResultInfo | None = None
    plan: RefinePlan | None = None
    swept: bool = False


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve: a line of cases with their results (NaN where there is none) and endings.

    Of a settled study also with their regimes, and the excitation periods after which their motions repeat;
    of a refined curve what its planner says of it, of a sweep its jumps. ``flags`` are those of each case, joined by
    commas, where they are known, and ``usable`` says which results count (`sprag_study.worker.models.usable`), by name:
    no line goes through others, and no answer is read from them.
    """

    line: Line
    y: dict[str, Floats]
    endings: list[str]
    regimes: list[str | None] | None = None
    orders: list[int | None] | None = None
    refined: Refined | None = None
    jumps: list[Jump] | None = None
    flags: list[str] | None = None
    usable: dict[str, Bools] | None = None

    def band(self, name: str) -> list[float | None]:
        """The half width around the lines of a refined result at each case; None where it does not scatter."""
        widths: list[float | None] = [None] * len(self.endings)
        if self.refined is not None:
            for place, width in zip(self.run().tolist(), self.refined.half_widths[name].tolist(), strict=True):
                widths[place] = width if np.isfinite(width) else None
        return widths

    def known(self, name: str) -> Floats:
        """A result of each case; NaN where there is none that counts."""
        return self.y[name] if self.usable is None else np.where(self.usable[name], self.y[name], np.nan)

    def shown(self, name: str) -> Floats:
        """A result of each case in pictures, where motions that had not settled are marked; NaN for failed cases."""
        ok = np.array([ending == OK for ending in self.endings], dtype=np.bool_)
        return np.where(ok if self.usable is None else ok | self.usable[name], self.y[name], np.nan)

    def run(self) -> NDArray[np.intp]:
        """Indices of the cases that were run, ascending, which a picture joins; of a coarser study, its own points."""
        return np.flatnonzero(~not_run(self.endings))

    def fixed(self, units: Mapping[str, str]) -> dict[str, list[Any]]:
        """Columns of a table with a row for each case: its fixed parameters in words, and its number.

        ``units`` are those of the paths.
        """
        given = in_words({**self.line.by, **self.line.at}, units)
        cases = self.line.cases.tolist()
        return {**{path: [value] * len(cases) for path, value in given.items()}, "case": cases}

    def ends(self) -> dict[str, list[Any]]:
        """The last columns of such a table: the flags of each case, and its ending."""
        flags = flag_names(self.flags or [""] * len(self.endings))
        return {"flags": [" ".join(names) for names in flags], "ending": self.endings}

    def to_json(self, results: Sequence[ResultInfo], units: Mapping[str, str]) -> CurveData:
        """The curve as JSON data; ``units`` are those of its paths."""
        data: CurveData = {
            "by": in_words(self.line.by, units),
            "at": in_words(self.line.at, units),
            "x": list(self.line.x),
            "cases": self.line.cases.tolist(),
            "y": {info.name: numbers(self.y[info.name], info.kind == "count") for info in results},
            "endings": self.endings,
            "flags": flag_names(self.flags or [""] * len(self.endings)),
        }
        if self.regimes is not None and self.orders is not None:
            data = {**data, "regime": self.regimes, "order": self.orders}
        if self.jumps is not None:
            data = {**data, "jumps": self.jumps}
        if self.refined is None:
            return data
        errors = {info.name: self.refined.errors[info.name] for info in results if info.name in self.refined.errors}
        jumps = jumps_of(self.refined, self.refined.errors)
        absolute = {
            name: None if error is None else error * self.refined.ranges[name] for name, error in errors.items()
        }
        irregular: list[Stretch] = [stretch.to_json() for stretch in self.refined.stretches]  # type: ignore[misc]
        return {
            **data,
            "error": errors,
            "error_absolute": absolute,
            "jumps": jumps,
            "irregular": irregular,
            "band": {info.name: self.band(info.name) for info in results if info.name in errors},
            "passed": self.refined.passed,
        }


@dataclass(frozen=True, slots=True)
class Curves:
    """Curves over one axis; ``further`` are those of the other motions of cases that have several, for pictures."""

    selection: Selection
    curves: tuple[Curve, ...]
    further: tuple[Curve, ...] = ()

    def to_json(self) -> CurvesData:
        """The document described in docs/http.md: null for a missing number, with the ending that explains it."""
        chosen = self.selection
        data: CurvesData = {
            "x": {"path": chosen.x, "unit": chosen.units[chosen.x], "values": list(chosen.x_values)},
            "units": chosen.units,
            "results": {info.name: filled(ResultMeaning, info) for info in chosen.results},
            "curves": [curve.to_json(chosen.results, chosen.units) for curve in self.curves],
        }
        if chosen.plan is None:
            return data
        errors = asked_errors(chosen.plan, (info.name for info in chosen.results))
        data = {**data, "error_asked": chosen.plan.error}
        return {**data, "errors_asked": errors} if errors else data


@dataclass(frozen=True, slots=True)
class Map:
    """One result over two axes; ``values``, ``endings`` and ``cases`` have the shape (y values, x values).

    ``names``, ``held`` and ``title`` (of the result, by default its name) are for display, as in `Selection`; ``units``
    and ``names`` belong to x and y. A refined map has the values in the middles of even squares, which are no cases.
    ``usable`` says which values count, as of `Curve`.
    """

    x: str
    y: str
    units: tuple[str, str]
    names: tuple[str, str]
    held: tuple[str, ...]
    x_values: tuple[float, ...]
    y_values: tuple[float, ...]
    at: dict[str, float]
    at_units: dict[str, str]
    result: ResultInfo
    cases: Ints
    values: Floats
    endings: list[list[str]]
    regimes: list[list[str | None]] | None = None
    orders: list[list[int | None]] | None = None
    refined: RefinedMap | None = None
    flags: list[list[str]] | None = None
    title: str = ""
    usable: Bools | None = None

    def known(self) -> Floats:
        """The values; NaN where there is none that counts, which pictures leave blank."""
        return self.values if self.usable is None else np.where(self.usable, self.values, np.nan)

    def to_json(self) -> MapData:
        """The map as JSON data; ``z.values[j][i]`` belongs to ``y.values[j]`` and ``x.values[i]``."""
        if self.refined is not None:
            return self._refined(self.refined)
        return self._grid()

    def _refined(self, known: RefinedMap) -> MapData:
        points: MapPoints = {
            "x": known.x.tolist(),
            "y": known.y.tolist(),
            "z": numbers(known.values),
            "cases": known.cases.tolist(),
        }
        data: MapData = {
            **self._grid(),
            "cases": [],
            "points": points,
            "error_asked": known.asked.value,
            "error": known.error,
            "error_absolute": known.absolute,
            "jumps_share": known.jumps_share,
            "passed": known.passed,
        }
        return {**data, "error_asked_absolute": True} if known.asked.absolute else data

    def _grid(self) -> MapData:
        data: MapData = {
            "x": {"path": self.x, "unit": self.units[0], "values": list(self.x_values)},
            "y": {"path": self.y, "unit": self.units[1], "values": list(self.y_values)},
            "z": filled(
                MapResult, self.result, values=[numbers(row, self.result.kind == "count") for row in self.values]
            ),
            "units": {self.x: self.units[0], self.y: self.units[1], **self.at_units},
            "at": in_words(self.at, self.at_units),
            "cases": self.cases.tolist(),
            "endings": self.endings,
        }
        if self.flags is not None:
            data = {**data, "flags": [flag_names(row) for row in self.flags]}
        if self.regimes is None or self.orders is None:
            return data
        return {**data, "regime": self.regimes, "order": self.orders}

    def run(self) -> Map:
        """The part of the map whose cases were all run; the map itself where none was.

        For a study that stopped between coarse and fine it is a coarser grid without holes.
        """
        missing = not_run(self.endings).reshape(self.values.shape)
        rows, columns = _complete(missing)
        if not missing.any() or not (rows.size and columns.size):
            return self
        return replace(
            self,
            x_values=tuple(self.x_values[index] for index in columns),
            y_values=tuple(self.y_values[index] for index in rows),
            cases=self.cases[np.ix_(rows, columns)],
            values=self.values[np.ix_(rows, columns)],
            endings=[[self.endings[row][column] for column in columns] for row in rows],
            regimes=self.regimes and [[self.regimes[row][column] for column in columns] for row in rows],
            orders=self.orders and [[self.orders[row][column] for column in columns] for row in rows],
            flags=self.flags and [[self.flags[row][column] for column in columns] for row in rows],
            usable=None if self.usable is None else self.usable[np.ix_(rows, columns)],
        )


def _complete(missing: Bools) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns that remain when the emptiest is removed repeatedly until nothing is missing."""
    rows, columns = np.ones(missing.shape[0], dtype=np.bool_), np.ones(missing.shape[1], dtype=np.bool_)
    in_rows, in_columns = missing.sum(axis=1), missing.sum(axis=0)
    while in_rows.any():
        row, column = int(in_rows.argmax()), int(in_columns.argmax())
        if in_rows[row] * rows.sum() >= in_columns[column] * columns.sum():
            rows[row], in_rows[row] = False, 0
            in_columns -= missing[row] & columns
        else:
            columns[column], in_columns[column] = False, 0
            in_rows -= missing[:, column] & rows
    return np.flatnonzero(rows), np.flatnonzero(columns)


def flag_names(flags: Sequence[str]) -> list[list[str]]:
    """The flags of each case, which are joined by commas, as lists."""
    return [[name for name in text.split(",") if name] for text in flags]


def not_run(endings: Sequence[str] | Sequence[Sequence[str]]) -> Bools:
    """Which cases have no ending of their own, either yet or ever; shape as ``endings``."""
    own = np.array(endings, dtype=object)
    return np.asarray((own == PENDING) | (own == WorkerEnding.CANCELLED.value), dtype=np.bool_)
