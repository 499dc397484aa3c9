"""The answer of a calibration: the values that explain the measurement, with their intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Amount
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.results.calibration_words import doubts
from sprag_study.service.results.headlines.headline import MOST, NOTHING, Headline, KeyNumber, digits

if TYPE_CHECKING:
    from sprag_study.service.results.calibration import Calibration


def calibrated_headline(found: Calibration) -> Headline:
    """The answer of a calibration as far as it has come."""
    if found.answer is None:
        return Headline()
    every = tuple(_parameter(found, place) for place in range(len(found.plan.fitted)))
    amounts = (
        Amount(value, one.unit, one.digits) for one, value in zip(every, found.answer.values.tolist(), strict=True)
    )
    values = joined(
        "; ",
        (
            Phrase("{name} = {value}", name=found.called(place, within=place > 0), value=value)
            for place, value in enumerate(amounts)
        ),
    )
    count = len(found.plan.values)
    fits = plural(
        "{values}: that explains the {count} measured value best.",
        "{values}: that explains the {count} measured values best.",
        count, values=values,
    )  # fmt: skip
    told = (joined("", [one]) for one in doubts(found))
    return Headline((fits, *told), every[:MOST], every[MOST:] and every)


def _parameter(found: Calibration, place: int) -> KeyNumber:
    """An unknown parameter with its interval and what it was before."""
    known, path = found.answer, found.names[place]
    assert known is not None
    unit, value, before = found.unit(place), float(known.values[place]), found.study.base.get(path)
    low, high = (None, None) if known.intervals is None else known.intervals[place].tolist()
    count = digits(value, None if low is None else 0.5 * (high - low))
    where = NOTHING
    if low is not None:
        where = Phrase("{low} to {high}", low=Amount(low, unit, count, bare=True), high=Amount(high, unit, count))
    note = NOTHING if before is None else Phrase("{value} before", value=Amount(before, unit, 4))
    called = found.called(place, within=False)
    label = called if isinstance(called, Phrase) else path
    return KeyNumber(label, value, unit, count, low, high, where=where, note=note)
