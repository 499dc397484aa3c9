"""The answer of a batch of drives: what half of them reach, what 9 of 10 lie between, and the yield."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Name, Whole
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.results.defaults import drawn_results, usual_value
from sprag_study.service.results.headlines.along import curve_of, judged_by
from sprag_study.service.results.headlines.headline import (
    NOTHING,
    Gap,
    Headline,
    KeyNumber,
    Trace,
    amount,
    beyond,
    digits,
    trace_of,
)
from sprag_study.service.results.key_answers import OF_PLACES, from_base, place_of, same_places
from sprag_study.service.results.tolerances.batch import Asked
from sprag_study.service.results.tolerances.conditions import first_condition
from sprag_study.service.results.tolerances.ribbons import QUANTILES, ribbon
from sprag_study.service.results.tolerances.yields import yields
from sprag_study.worker import models
from sprag_study.worker.spread import DRIVE

if TYPE_CHECKING:
    from sprag_study.service.results.curves import CurveQuery, Fetch
    from sprag_study.service.results.refined import Line
    from sprag_study.service.results.tolerances.batch import Places
    from sprag_study.service.results.tolerances.ribbons import Ribbon, RibbonLine
    from sprag_study.service.results.tolerances.yields import Yield, YieldLine
    from sprag_study.worker.study import Study

_YIELD: Final = Phrase("Yield")
_LOW, _MIDDLE, _HIGH = range(len(QUANTILES))


def asked_like(query: CurveQuery | None) -> Asked:
    """The places of a batch that curves of its nominal drive go through."""
    if query is None:
        return Asked()
    at = tuple(pair for pair in query.at if pair[0] != DRIVE)
    return Asked(query.x, tuple(path for path in query.by if path != DRIVE), at)


def batch_headline(study: Study, asked: Asked, point: str | None, fetch: Fetch) -> Headline:
    """The answer of a batch at a value of its axis, the usual one unless a ``point`` is given.

    Raises SelectionError about ``point`` where it is no value of the axis.
    """
    name = judged_by(study, drawn_results(study))
    found = ribbon(study, (name,), asked, QUANTILES, fetch)
    line, place = min(found.lines, key=lambda one: from_base(study, one.line.by)), 0
    gap, off = None, NOTHING
    if found.places.x is not None:
        x = _point(study, found.places.x, point)
        place, gap = _place(found.places.x, line, x, asked=bool(point))
        if point and gap is None and line.line.x[place] != x:
            off = beyond(study, found.places.x, x, line.line.x[place])
    if not line.spreads[name].quantiles.drives[place]:
        return Headline(gap=gap)
    reached = yields(study, (first_condition(study, name),), asked, 0, fetch)
    return Headline(
        tuple(filter(None, (off, *_sentences(found, line, name, place, gap)))),
        _numbers(found, line, name, place, reached),
        trace=trace_of(line.line.x, line.spreads[name].nominal, place) if found.places.x else _spread(line, name),
        of=curve_of(study, line.line),
        gap=gap,
        case=int(line.line.cases[place]),
        at=None if found.places.x is None else (found.places.x, float(line.line.x[place])),
    )


def _point(study: Study, path: str, text: str | None) -> float:
    if text:
        return place_of(study, path, text)
    return usual_value(study, study.axis_with(path))


def _place(path: str, line: RibbonLine, x: float, *, asked: bool) -> tuple[int, Gap | None]:
    """The place nearest to ``x``, and the neighbours where that was ``asked`` for and is none of them."""
    values = np.asarray(line.line.x)
    place = int(np.argmin(np.abs(values - x)))
    if not asked or same_places(values, x).size:
        return place, None
    below, above = values[values < x], values[values > x]
    return place, Gap(path, x, float(below.max()), float(above.min())) if below.size and above.size else None


def _sentences(found: Ribbon, line: RibbonLine, name: str, place: int, gap: Gap | None) -> tuple[Phrase, ...]:
    if gap is None:
        return (_sentence(found, line, name, place),)
    x = list(line.line.x)
    missing = Phrase("No case was run at {place}.", place=Amount(gap.value, found.places.units[gap.path], OF_PLACES))
    return missing, *(_sentence(found, line, name, x.index(end)) for end in (gap.low, gap.high))


def _sentence(found: Ribbon, line: RibbonLine, name: str, place: int) -> Phrase:
    study, info = found.places.study, found.results[0]
    low, middle, high = (amount(info, float(value)) for value in line.spreads[name].quantiles.values[:, place])
    low = replace(low, bare=True)
    clauses = models.presentation_of(study).clauses
    clause = Phrase("half of the drives have a {name} above {middle}, 9 of 10 between {low} and {high}",
                    name=Name(name, within=True), middle=middle, low=low, high=high)  # fmt: skip
    if clauses.batch and next(iter(clauses.results.values())) == name:
        clause = Phrase(clauses.batch, middle=middle, low=low, high=high)
    if found.places.x is None:
        return joined("", [Whole(clause)])
    at = Amount(line.line.x[place], found.places.units[found.places.x], OF_PLACES)
    if found.places.x in models.presentation_of(study).along[:1]:
        return Phrase("At {place} {clause}.", place=at, clause=clause)
    return Phrase("{name} = {place}: {clause}.", name=Name(found.places.x), place=at, clause=clause)


def _numbers(found: Ribbon, line: RibbonLine, name: str, place: int, reached: Yield) -> tuple[KeyNumber, ...]:
    info, quantiles = found.results[0], line.spreads[name].quantiles
    low, middle, high = (float(value) for value in quantiles.values[:, place])
    unit, where = info.unit, _where(found.places, line.line, place)
    half = _half_width(float(quantiles.low[_MIDDLE, place]), float(quantiles.high[_MIDDLE, place]))
    nominal = float(line.spreads[name].nominal[place])
    count = digits(high)
    numbers = [
        KeyNumber(Phrase("Median of the drives"), middle, unit, digits(middle, half), where=where),
        KeyNumber(Phrase("9 of 10 between"), None, unit, count, low, high, where=where),
    ]
    if np.isfinite(nominal):
        case = int(line.line.cases[place])
        numbers.append(KeyNumber(Phrase("As drawn"), nominal, unit, digits(nominal), where=where, case=case))
    good = next((one for one in reached.lines if one.line.by == line.line.by), None)
    return (*numbers, *(_yield(good, place, reached) if good is not None else ()))


def with_yield(head: Headline, reached: Yield) -> Headline:
    """The headline with the yield of these conditions at its place, where they have that place."""
    for line in reached.lines:
        for place in np.flatnonzero(line.line.cases == head.case).tolist():
            others = [one for one in head.numbers if one.label != _YIELD]
            return replace(head, numbers=(*others, *_yield(line, place, reached)))
    return head


def _where(places: Places, line: Line, place: int) -> Phrase:
    """At which value of the axis of a batch; nothing for a single place."""
    if places.x is None:
        return NOTHING
    return Phrase("at {place}", place=Amount(line.x[place], places.units[places.x], OF_PLACES))


def _half_width(low: float, high: float) -> float | None:
    return 0.5 * (high - low) if np.isfinite(low + high) else None


def _yield(own: YieldLine, place: int, reached: Yield) -> list[KeyNumber]:
    """The share of the drives that reach the conditions at the place."""
    if not np.isfinite(own.each.value[place]):
        return []
    share, low, high = (float(ends[place]) for ends in (own.each.value, own.each.low, own.each.high))
    count = digits(share, 0.5 * (high - low))
    at = _where(reached.places, own.line, place)
    where = joined(", ", [*(one.text for one in reached.conditions), *([at] if at else [])])
    return [KeyNumber(_YIELD, share, models.SHARE, count, low, high, where=where)]


def _spread(line: RibbonLine, name: str) -> Trace | None:
    """The distribution at a single place as a thumbnail."""
    distribution = line.spreads[name].distribution
    return None if distribution is None else trace_of(range(len(distribution)), distribution)
