"""One measured period of the base's motion in a spec, reduced to harmonics (docs/theory.md, "Measured base motion")."""

from __future__ import annotations

import csv
import math
import re
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Sentence, plural
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.units import QuantityError, is_known_unit, parse_exact, split_quantity, wrong_unit
from sprag_study.service.spec.described import Listed, Record
from sprag_study.service.spec.machine.shaft_tables import read_csv_rows, unit_of_heading
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.service.table_rows import heading_of, split
from sprag_study.worker.models import HARMONIC_PARAMETERS, Parameter, machine_shaft, reduce_motion, resolved_order

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from sprag_study.service.spec.node import Node
    from sprag_study.service.table_rows import CsvRow
    from sprag_study.worker.models import Reduction

_TURN: Final = 2.0 * math.pi
_FEWEST: Final = 8
#: Share of the period by which rounded times may exceed it.
_ROUNDED: Final = 1e-6
#: Cyrillic letters that look like x and y.
_LATIN: Final = str.maketrans("\N{CYRILLIC SMALL LETTER HA}\N{CYRILLIC SMALL LETTER U}", "xy")
#: The end of the period may be this many times the widest gap between rows behind the last row.
_WIDER: Final = 1.5
_ANGLE: Final = Parameter("angle", "", "rad", -1e3, 1e3, False, None, N_("angle of a row"))
_TIME: Final = Parameter("time", "", "s", -1e6, 1e6, False, None, N_("time of a row"))
_DISPLACEMENTS: Final = tuple(
    Parameter(axis, "", "m", -10.0, 10.0, False, None, N_("displacement of the base")) for axis in "xy"
)
_ACCELERATIONS: Final = tuple(
    Parameter(axis, "", "m/s^2", -1e6, 1e6, False, None, N_("acceleration of the base")) for axis in "xy"
)
_PERIOD: Final = Parameter(
    "period", "", "s", 0.0, 1e6, True, None, N_("period of the measured motion, of rows with times or accelerations")
)
_ACCURACY: Final = Parameter(
    "accuracy", "", "1", 0.0, 1.0, True, 0.01,
    N_("rms residual at which the reduction to harmonics ends, as a share of the amplitude"),
)  # fmt: skip
_ROWS: Final = Listed(
    "rows", _FEWEST, machine_shaft.MAX_ROWS, "rows of angle (rad), x and y (m); or of time (s), of accelerations "
    "(m/s^2), as texts with their units",
    item={"type": "array", "minItems": 3, "maxItems": 3, "items": QUANTITY},
)  # fmt: skip
#: A measured period of the base's motion.
MEASURED_BASE: Final = Record(
    {
        "table": _ROWS,
        "csv": {
            "type": "string",
            "description": "angle or time, and x, y or both, as displacements or accelerations, as the text of a CSV "
            "file, headings with units in brackets",
        },
        "period": _PERIOD,
        "accuracy": _ACCURACY,
    },
    "one period of the measured motion of the base, which is reduced to harmonics",
    either=("table", "csv"),
)


def read_measured_base(node: Node) -> list[list[float]]:
    """Rows of harmonics in the order of `HARMONIC_PARAMETERS`; none, and the faults recorded, where it is invalid."""
    form = node.one_of(MEASURED_BASE.either) if MEASURED_BASE.read(node) else None
    if form is None:
        return []
    data, accuracy = node[form], node["accuracy"].number_or_default(_ACCURACY)
    columns = _columns(data) if form == "csv" else _columns_of_rows(data)
    if form == "csv" and not _has_units(data, columns):
        return []
    rows = read_csv_rows(data, *columns) if form == "csv" else _ROWS.read_rows(data, *columns)
    sound = data.sound
    over, measured = columns[0], columns[1:]
    timed, accelerated = over is _TIME, measured[0].unit == _ACCELERATIONS[0].unit
    period: float | None = math.nan
    if timed or accelerated:
        period = node["period"].number_or_default(_PERIOD)
    elif sound and node["period"].given:
        node["period"].refuse("not-used", "is not used: the rows have angles and displacements")
    if not sound or period is None or accuracy is None or (form == "csv" and not _is_named(data, columns)):
        return []
    table = np.array(rows)
    if not _is_one_period(data, table[:, 0], over, period if timed else _TURN):
        return []
    motion = np.zeros((len(table), 2))
    for place, column in enumerate(measured, 1):
        motion[:, "xy".index(column.path)] = table[:, place]
    if not np.ptp(motion, axis=0).any():
        data.refuse("invalid-table", "does not move: all of its rows are alike", None)
        return []
    reduction = reduce_motion(table[:, 0] * (_TURN / period if timed else 1.0), motion, accuracy)
    if not _is_accurate(node, reduction, accuracy):
        return []
    _tell(data, reduction, measured[0].unit)
    return _harmonics(data, reduction, _TURN / period if accelerated else None)


def _columns(node: Node) -> list[Parameter]:
    """What the columns of a CSV text are by their headings and units: angle or time, then x, y or both."""
    rows = _rows_of(node)
    headings = [heading_of(cell) or ("", "") for cell in rows[0].cells] if rows else []

    def of_unit(place: int, *ways: Parameter) -> Parameter:
        cells = (row.cells[place] for row in rows[1:] if len(row.cells) > place)
        units = ((way, unit_of_heading(*headings[place], way)) for way in ways if place < len(headings))
        return next((way for way, unit in units if unit and _fits(f"1 {unit}", way)), None) or _of_cells(cells, *ways)

    over = of_unit(0, _ANGLE, _TIME)
    named = _axes_of(headings)
    axes = ["xy".index(name) for name in named] if named in (["x"], ["y"], ["y", "x"]) else [0, 1]
    kind = max((of_unit(place, *_kinds(0)) is _ACCELERATIONS[0] for place in range(1, len(axes) + 1)), default=False)
    return [over, *(_kinds(axis)[kind] for axis in axes)]


def _has_units(node: Node, columns: list[Parameter]) -> bool:
    """Whether no heading has the unit of another quantity than its column can have; faults say what it can have."""
    rows, before = _rows_of(node), node.report.found
    for cell, column in zip(rows[0].cells if rows else (), columns, strict=False):
        unit = (heading_of(cell) or ("", ""))[1]
        ways = (_ANGLE, _TIME) if column in (_ANGLE, _TIME) else _kinds(0)
        if is_known_unit(unit) and not any(_fits(f"1 {unit}", way) for way in ways):
            error = wrong_unit(unit, *(way.unit for way in ways)).message
            message = Sentence("the heading of column {column} {error}", column=column.path, error=error)
            node.refuse("wrong-unit", message, None)
    return node.report.found == before


def _rows_of(node: Node) -> list[CsvRow]:
    """The rows of a CSV text; none where it is none, which `read_csv_rows` refuses."""
    try:
        return split(node.value).rows if isinstance(node.value, str) else []
    except csv.Error:
        return []


def _axes_of(headings: list[tuple[str, str]]) -> list[str]:
    """What the headings behind the first one call their columns: x, y, or another name."""
    names = [name.lower().translate(_LATIN) for name, _unit in headings[1:]]
    return [found[0] if (found := re.match(r"[xy](?![^\W_])", name)) else name for name in names]


def _is_named(node: Node, columns: list[Parameter]) -> bool:
    """Whether no heading of a CSV text names another axis than its column is; otherwise a fault says so."""
    headings = [heading_of(cell) or ("", "") for cell in split(node.value).rows[0].cells]
    named = _axes_of(headings)
    if set(named) & {"x", "y"} and named != [column.path for column in columns[1:]]:
        node.refuse(
            "invalid-table", Sentence("has the headings {names}", names=", ".join(name for name, _ in headings)), None,
            allowed=Sentence("x and y, or one of them, behind the first column"),
        )  # fmt: skip
        return False
    return True


def _columns_of_rows(node: Node) -> list[Parameter]:
    """What the columns of rows are by the units of their texts."""
    rows = [row for row in node.value if isinstance(row, list)] if isinstance(node.value, list) else []

    def cells(*places: int) -> Iterator[object]:
        return (row[place] for row in rows for place in places if len(row) > place)

    accelerated = _of_cells(cells(1, 2), *_kinds(0)) is _ACCELERATIONS[0]
    return [_of_cells(cells(0), _ANGLE, _TIME), *(_kinds(axis)[accelerated] for axis in (0, 1))]


def _kinds(axis: int) -> tuple[Parameter, Parameter]:
    return _DISPLACEMENTS[axis], _ACCELERATIONS[axis]


def _of_cells(cells: Iterator[object], *ways: Parameter) -> Parameter:
    """Which of ``ways`` the first text with a unit of one of them fits, by default the first."""
    texts = (cell for cell in cells if isinstance(cell, str))
    return next((way for text in texts for way in ways if _fits(text, way)), ways[0])


def _fits(text: str, way: Parameter) -> bool:
    """Whether a text is a quantity with a unit of a parameter."""
    try:
        parse_exact(text, way.unit)
        return bool(split_quantity(text)[1])
    except QuantityError:
        return False


def _is_one_period(node: Node, over: NDArray[np.float64], column: Parameter, period: float) -> bool:
    """Whether rows at these angles (rad) or times (s) ascend over one period without a gap of half of it."""

    def amount(value: float) -> Amount:
        return Amount(math.degrees(value), "deg", 6) if column is _ANGLE else Amount(value, "s", 6)

    def refuse(message: Sentence, allowed: Sentence) -> bool:
        node.refuse("invalid-table", message, None, allowed=allowed)
        return False

    for k, (before, this) in enumerate(pairwise(over.tolist()), start=2):
        if not this > before:
            message = Sentence(
                "must ascend: row {row} is at {this}, and the one before at {before}",
                row=k, this=amount(this), before=amount(before),
            )  # fmt: skip
            return refuse(message, Sentence("more than {low}", low=amount(before)))
    if len(over) < _FEWEST:
        given = plural("has {count} row", "has {count} rows", len(over))
        return refuse(given, Sentence("at least {low} rows", low=_FEWEST))
    first, last, widest = float(over[0]), float(over[-1]), float(np.diff(over).max())
    missing = first + period - last
    whole = Sentence(
        "rows over one whole period, from {first} to {last}, without or with its end",
        first=amount(first), last=amount(first + period),
    )  # fmt: skip
    if missing < -_ROUNDED * period:
        lasts = {"period": amount(period), "last": amount(last)}
        if column is _ANGLE:
            longer = Sentence(
                "is longer than its period of {period}: the last row is at {last}; angles without a unit are in rad",
                **lasts,
            )
            return refuse(longer, whole)
        return refuse(Sentence("is longer than its period of {period}: the last row is at {last}", **lasts), whole)
    if missing > _WIDER * widest:
        ends = {"last": amount(last), "missing": amount(missing)}
        return refuse(
            Sentence("is not one whole period: the last row is at {last}, {missing} before its end", **ends), whole
        )
    if resolved_order(over * (_TURN / period)) < 1:
        text = Sentence("has a gap of {gap} between two rows", gap=amount(max(widest, missing)))
        return refuse(text, Sentence("less than half the period of {period}", period=amount(period)))
    return True


def _is_accurate(node: Node, reduction: Reduction, accuracy: float) -> bool:
    """Whether the harmonics leave no more than is accepted; otherwise a fault says what they leave."""
    reached = float(reduction.rms.max()) / reduction.amplitude
    if reached <= accuracy:
        return True
    message = plural(
        "is not reached: {count} harmonic of orders up to {order}, which the rows resolve, leaves {reached} (rms)",
        "is not reached: {count} harmonics of orders up to {order}, which the rows resolve, leave {reached} (rms)",
        len(reduction.orders), order=str(reduction.resolved), reached=Amount(100.0 * reached, "%", 3),
    )  # fmt: skip
    least = Amount(math.ceil(1e4 * reached) / 100.0, "%", 4)
    shown = str(Amount(100.0 * accuracy, "%", 3))
    node["accuracy"].refuse("out-of-range", message, shown, allowed=Sentence("at least {low}", low=least))
    return False


def _tell(node: Node, reduction: Reduction, unit: str) -> None:
    """Record, as a warning, which harmonics stand for the rows and what they leave."""
    left = (*reduction.rms, reduction.largest.max())
    x, y, largest = (Amount(100.0 * float(value) / reduction.amplitude, "%", 2) for value in left)
    text = plural(
        "{count} harmonic of order {order} stands for the measured motion and leaves {x} (rms) along x, {y} along y "
        "and {largest} at most of its amplitude of {amplitude}",
        "{count} harmonics of orders up to {order} stand for the measured motion and leave {x} (rms) along x, {y} "
        "along y and {largest} at most of its amplitude of {amplitude}",
        len(reduction.orders), order=str(int(reduction.orders[-1])), x=x, y=y, largest=largest,
        amplitude=Amount(reduction.amplitude, unit, 4),
    )  # fmt: skip
    node.report.warn("reduced-motion", node.pointer, text)


def _harmonics(node: Node, reduction: Reduction, nu: float | None) -> list[list[float]]:
    """The rows of a reduction of displacements, or of accelerations at ``nu`` (rad/s)."""
    # The second derivative of a wave is -(order nu)^2 times the wave.
    factor = np.ones(len(reduction.orders)) if nu is None else -1.0 / np.square(reduction.orders * nu)
    # Zeros without a sign: of -0.0 an arctangent is -pi.
    cosines, sines = (factor[:, None] * part + 0.0 for part in (reduction.cosines, reduction.sines))
    amplitudes = np.hypot(cosines, sines)
    phases = np.arctan2(-sines[:, 0], cosines[:, 0]) + 0.0, np.arctan2(cosines[:, 1], sines[:, 1]) + 0.0
    columns = reduction.orders, amplitudes[:, 0], phases[0], amplitudes[:, 1], phases[1]
    rows: list[list[float]] = np.column_stack(columns).tolist()
    for row in rows:
        for entry, value in zip(HARMONIC_PARAMETERS, row, strict=True):
            if not entry.accepts(value):
                text = Sentence("has a harmonic with an amplitude of {value}", value=Amount(value, "m", 4))
                node.refuse("out-of-range", text, None, allowed=range_sentence(entry))
                return []
    return rows
