"""The conditions of a study on a sheet: what varies and what was given, in the reader's units, with tolerances."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from sprag.sentences import Amount
from sprag.service.languages import _
from sprag.service.reading.catalogue import axes_json, unit_of
from sprag.service.reading.reader import Phrase, plural
from sprag.service.reading.wording import typed_text
from sprag.service.report.blocks import Section, Table, Text
from sprag.worker.models import NO_PARAMETERS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sprag.service.answers.studies import AxisInfo
    from sprag.service.exports.inputs import Input
    from sprag.service.report.blocks import Words
    from sprag.service.report.content import Report

#: Most rows of both columns together.
_ROWS: Final = 26
#: Digits of what was given, and in the drawing.
_DIGITS: Final = 5
_SHORT: Final = 4
#: A name of a parameter or of a result in a formula.
_CODE: Final = re.compile(r"[a-z_]+(?:\.(?:[a-z_0-9]+|\*))+")


def conditions(report: Report) -> Iterator[Section]:
    """The section with both columns, and how many inputs are in the appendix only."""
    rows = [*_varied(report), *_given(report)]
    shown = rows[:_ROWS]
    half = -(-len(shown) // 2)
    columns = [shown[:half], shown[half:]]
    tables = [Table(("", ""), tuple(part), (1,), look="half") for part in columns if part]
    more = len(report.inputs) - len(shown)
    rest = (
        plural(
            "{count} further input is in the appendix on inputs, most of them with their defaults.",
            "{count} further inputs are in the appendix on inputs, most of them with their defaults.",
            more,
        ),
    ) if more > 0 else ()  # fmt: skip
    yield Section(_("Conditions"), (*tables, *map(Text, rest)), 2)


def values_of(report: Report) -> dict[str, Words]:
    """The value of each number of the machine by its path, as it stands at its place in the drawing.

    Of a search it is that of the best design, of a calibration that of the fit.
    """
    known: dict[str, Words] = {}
    for axis in axes_json(report.study):
        value = _with(_ends(axis["least"], axis["largest"], axis["unit"], _SHORT), _tolerance(report, axis["paths"][0]))
        known |= dict.fromkeys(axis["paths"], value)
    for item in report.inputs:
        found = report.meant.get(item.path)
        if item.unit and isinstance(found, float):
            known[item.path] = Amount(found, item.unit, _SHORT)
        elif item.unit and isinstance(item.value, float | int):
            known[item.path] = _with(Amount(item.value, item.unit, _SHORT), _tolerance(report, item.path))
    return known


def _varied(report: Report) -> Iterator[tuple[Words, ...]]:
    """Each axis: from where to where, and its number of values; what a search or a calibration chooses, the same."""
    searched = [(one.paths, one.low, one.high) for one in (() if report.designs is None else report.designs.plan.vary)]
    if report.calibrated is not None:
        searched += [(one.paths, one.low, one.high) for one in report.calibrated.plan.unknown]
    paths = {path for own, _low, _high in searched for path in own}
    for own, low, high in searched:
        ends = _ends(low, high, unit_of(report.study, own[0]))
        yield _caption(report, own), Phrase("{ends}, searched", ends=ends)
    for axis in axes_json(report.study):
        if NO_PARAMETERS.isdisjoint(axis["paths"]) and paths.isdisjoint(axis["paths"]):
            value = _span(axis, counted=report.study.plan is None)
            yield _caption(report, axis["paths"]), _with(value, _tolerance(report, axis["paths"][0]))


def _caption(report: Report, paths: Sequence[str]) -> str:
    return report.reading.caption(" = ".join(paths))


def _span(axis: AxisInfo, *, counted: bool) -> Words:
    ends = _ends(axis["least"], axis["largest"], axis["unit"])
    if axis["least"] == axis["largest"] or not counted:
        return ends
    return plural("{ends}, {count} value", "{ends}, {count} values", axis["values"], ends=ends)


def _ends(low: float, high: float, unit: str, digits: int = _DIGITS) -> Words:
    if low == high:
        return Amount(low, unit, digits)
    return Phrase("{low} to {high}", low=Amount(low, unit, digits, bare=True), high=Amount(high, unit, digits))


def _given(report: Report) -> Iterator[tuple[Words, ...]]:
    """Each number that was given, fitted or derived, and of one with a tolerance that too."""
    for item in report.inputs:
        if item.origin in ("given", "fitted", "tolerance", "derived") and item.unit and not _of_no_effect(item):
            yield report.reading.caption(item.path), _value(report, item)


def _of_no_effect(item: Input) -> bool:
    """Whether it is the coefficient of a power that a polynomial has not."""
    return item.value == 0.0 and "coefficients" in item.path


def _value(report: Report, item: Input) -> Words:
    if item.origin == "derived":
        return Phrase("= {formula}", formula=in_captions(report, str(item.value)))
    value = Amount(item.value, item.unit, _DIGITS) if isinstance(item.value, float | int) else str(item.value)
    return _with(value, _tolerance(report, item.path))


def _with(value: Words, tolerance: str) -> Words:
    return Phrase("{value} ± {tolerance}", value=value, tolerance=tolerance) if tolerance else value


def _tolerance(report: Report, path: str) -> str:
    """The tolerance of a parameter as it was written; "" without one."""
    for one in () if report.study.spread is None else report.study.spread.tolerances:
        if path in one.paths and "plus_minus" in one.about:
            return typed_text(str(one.about["plus_minus"]))
    return ""


def in_captions(report: Report, text: str) -> str:
    """A formula with what parameters are called instead of their names in files."""
    return _CODE.sub(lambda name: report.reading.within(name[0]) if name[0] in report.names else name[0], text)
