"""The conditions of a study on a sheet: what varies and what was given, in the reader's units, with tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount
from sprag_study.service.languages import _, gettext
from sprag_study.service.reading.catalogue import axes_json
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.report.blocks import Section, Table, Text
from sprag_study.service.results.fronts import goals_of, limits_of
from sprag_study.service.results.selection import with_tolerance
from sprag_study.service.results.varied import ends, formula_text, varied, with_distribution
from sprag_study.worker import models
from sprag_study.worker.models.vocabulary import bare_caption

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.exports.inputs import Input
    from sprag_study.service.report.blocks import Words
    from sprag_study.service.report.content import Report

#: Most rows of both columns together.
_ROWS: Final = 26
#: Digits of what was given, and in the drawing.
_DIGITS: Final = 5
_SHORT: Final = 4
#: What a number is called, and its value.
_Row = tuple["Words", ...]


def conditions(report: Report) -> Iterator[Section]:
    """The section with both columns, and how many inputs are in the appendix only."""
    given, alike = _given(report)
    rows = [*_varied(report), *given]
    shown = rows[:_ROWS]
    half = -(-len(shown) // 2)
    columns = [shown[:half], shown[half:]]
    tables = [Table(("", ""), tuple(part), (1,), look="half") for part in columns if part]
    more = len(report.inputs) - len(shown) - sum(alike.get(row, 0) for row in shown)
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
        value = ends(axis["least"], axis["largest"], axis["unit"], _SHORT)
        known |= dict.fromkeys(axis["paths"], with_tolerance(report.study, axis["paths"][0], value))
    for item in report.inputs:
        found = report.meant.get(item.path)
        if item.unit and isinstance(found, float):
            known[item.path] = Amount(found, item.unit, _SHORT)
        elif item.unit and isinstance(item.value, float | int):
            known[item.path] = with_tolerance(report.study, item.path, Amount(item.value, item.unit, _SHORT))
    return known


def _varied(report: Report) -> Iterator[tuple[Words, ...]]:
    """What a search is asked for; each axis: from where to where, and its values; what is searched, the same."""
    if report.designs is not None:
        for title, said in ((_("Goals"), goals_of(report.study)), (_("Limits"), limits_of(report.study))):
            if said:
                yield title, joined("; ", said)
    for paths, value in varied(report.study):
        yield report.reading.caption(" = ".join(paths)), with_distribution(report.study, paths[0], value)


def _given(report: Report) -> tuple[list[_Row], dict[_Row, int]]:
    """Each number that was given, fitted or derived, and of one with a tolerance that too.

    Numbers that are alike in all rows of a list are one row. The second value is how many more inputs a row stands for.
    """
    given = {
        item.path: (report.reading.caption(item.path), _value(report, item)) for item in report.inputs
        if item.origin in ("given", "fitted", "tolerance", "derived") and item.unit and not _of_no_effect(item)
    }  # fmt: skip
    alike = dict[_Row, int]()
    for rows in models.model_of(report.study.model).presentation.form.lists:
        by_name = dict[str, list[str]]()
        for path in given:
            if rows.every and path.startswith(f"{rows.at}."):
                by_name.setdefault(path.split(".", 2)[2], []).append(path)
        count = len({item.path.split(".")[1] for item in report.inputs if item.path.startswith(f"{rows.at}.")})
        for first, *others in by_name.values():
            if others and len(others) == count - 1 and {given[path][1] for path in others} == {given[first][1]}:
                bare = bare_caption(report.study.model, first, gettext)
                given[first] = row = (f"{bare}, {_(rows.every)}", given[first][1])
                alike[row] = len(others)
                for path in others:
                    del given[path]
    return list(given.values()), alike


def _of_no_effect(item: Input) -> bool:
    """Whether it is the coefficient of a power that a polynomial has not."""
    return item.value == 0.0 and "coefficients" in item.path


def _value(report: Report, item: Input) -> Words:
    if item.origin == "derived":
        return Phrase("= {formula}", formula=formula_text(item, report.reading))
    value = Amount(item.value, item.unit, _DIGITS) if isinstance(item.value, float | int) else str(item.value)
    return with_distribution(report.study, item.path, value)
