"""Swept studies: the jumps of their curves, the words of directions, and what up and down differ in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Name, Part
from sprag_study.service.reading.reader import Phrase, joined, plural, term
from sprag_study.service.reading.wording import percent
from sprag_study.worker.directions import DOWN, SWEEP, direction
from sprag_study.worker.models import JUMPED

if TYPE_CHECKING:
    from sprag_study.service.answers.results import Jump
    from sprag_study.service.results.curves import Curve, Curves
    from sprag_study.service.results.refined import Line
    from sprag_study.worker.arrays import Bools, Floats, Ints
    from sprag_study.worker.study import Study

#: Difference of up and down, relative to the range of both, from which on it is reported.
_DIFFERENT: Final = 0.01
#: Most intervals that are named.
_NAMED: Final = 4


def swept_along(study: Study, path: str) -> bool:
    """Whether ``path`` is on the swept axis of a study."""
    axis = None if study.sweep is None else study.axis_of(study.sweep)
    return axis is not None and axis == study.axis_of(path)


def values_text(values: Mapping[str, float], units: Mapping[str, str]) -> Phrase:
    """The values (SI) of the parameters that tell curves apart, without their units."""
    return joined(
        ", ",
        (
            term(direction(value)) if path == SWEEP else Amount(value, units[path], bare=True)
            for path, value in values.items()
        ),
    )


def direction_texts(study: Study, case: int) -> dict[str, str]:
    """The direction of a case of a sweep in words, by its path; {} for any other study."""
    return {} if study.sweep is None else {SWEEP: direction(study.case_parameters(case)[SWEEP])}


def jumps_of_line(
    line: Line, flags: Sequence[str], regimes: Sequence[str | None], orders: Sequence[int | None]
) -> list[Jump]:
    """The intervals in which the motion jumps along a line of a sweep: between a case and the one before it.

    All lists are aligned with the cases of the line, whose x ascends.
    """
    back = 1 if {**line.at, **line.by}[SWEEP] == DOWN else -1
    found: list[Jump] = []
    for place, own in enumerate(flags):
        before = place + back
        if JUMPED not in own.split(",") or not 0 <= before < len(flags):
            continue
        why = "regime" if regimes[place] != regimes[before] else "order"
        if why == "order" and orders[place] == orders[before]:
            why = "orbit"
        low, high = sorted((line.x[place], line.x[before]))
        found.append({"low": low, "high": high, "why": why, "results": []})
    return found


def broken_at(stretches: Sequence[Ints], x: Floats, jumps: Sequence[Jump]) -> tuple[Ints, ...]:
    """The stretches of points that a line joins, broken at jumps; ``x`` has the value of each point."""
    lows = [jump["low"] for jump in jumps]
    found: list[Ints] = []
    for part in stretches:
        found += np.split(part, np.flatnonzero(np.isin(x[part[:-1]], lows)) + 1)
    return tuple(found)


def _pairs(curves: Curves) -> list[tuple[Curve, Curve]]:
    """Each curve up with that down at the same values of all other axes."""
    by_place: dict[tuple[float, ...], dict[float, Curve]] = {}
    for curve in curves.curves:
        own = tuple(value for path, value in curve.line.by.items() if path != SWEEP)
        by_place.setdefault(own, {})[{**curve.line.at, **curve.line.by}[SWEEP]] = curve
    return [(pair[0.0], pair[1.0]) for pair in by_place.values() if len(pair) == 2]


def hysteresis(curves: Curves) -> str:
    """What the curves of a sweep up and down differ in, in a sentence about the first result; "" for other curves."""
    if not curves.selection.swept:
        return ""
    name, x = curves.selection.results[0].name, curves.selection.x
    unit = curves.selection.units[x]
    widths = [jump["high"] - jump["low"] for curve in curves.curves for jump in curve.jumps or ()]
    jumps = Phrase("no jumps")
    if widths:
        width = Amount(max(widths), unit)
        jumps = plural("{count} jump, within {width}", "{count} jumps, each within {width}", len(widths), width=width)
    pairs = _pairs(curves)
    if not pairs:
        return Phrase("Along the sweep {jumps}.", jumps=jumps)
    largest, at, wide = 0.0, 0.0, list[tuple[float, float]]()
    for up, down in pairs:
        both = np.array([up.y[name], down.y[name]])
        if not np.isfinite(both).any():
            continue
        span = float(np.nanmax(both) - np.nanmin(both)) or 1.0
        off = np.nan_to_num(np.abs(both[0] - both[1]) / span)
        place = int(np.argmax(off))
        if off[place] > largest:
            largest, at = float(off[place]), up.line.x[place]
        wide += _intervals(np.asarray(up.line.x), off > _DIFFERENT)
    if not wide:
        return Phrase(
            "Up and down agree within {share} of the range of {name}; {jumps}.",
            share=percent(_DIFFERENT),
            name=Name(name, within=True),
            jumps=jumps,
        )
    named = [_interval(low, high, unit) for low, high in sorted(set(wide))]
    places: Part = joined(", ", named[:_NAMED])
    if len(named) > _NAMED:
        places = plural("{places} and {count} more", "{places} and {count} more", len(named) - _NAMED, places=places)
    return Phrase(
        "Hysteresis: up and down differ at {places}, by up to {share} of the range of {name} (at {at}); {jumps}.",
        places=places,
        share=percent(largest),
        name=Name(name, within=True),
        at=Amount(at, unit),
        jumps=jumps,
    )


def _interval(low: float, high: float, unit: str) -> Phrase:
    """An interval of x, or a single place."""
    if low == high:
        return Phrase("{x}", x=Amount(low, unit))
    return Phrase("{low} to {high}", low=Amount(low, unit, bare=True), high=Amount(high, unit))


def _intervals(x: Floats, off: Bools) -> list[tuple[float, float]]:
    """The first and the last x of each run of points that are marked."""
    places = np.flatnonzero(off)
    runs = np.split(places, np.flatnonzero(np.diff(places) > 1) + 1) if places.size else []
    return [(float(x[run[0]]), float(x[run[-1]])) for run in runs]


def without_direction(by: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    """What tells curves apart beside their direction: curves with the same have one colour."""
    return tuple((path, value) for path, value in by.items() if path != SWEEP)
