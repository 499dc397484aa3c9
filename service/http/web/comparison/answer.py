"""The answer of a comparison: how the studies differ in a sentence or two, their numbers, and a chart."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np
from markupsafe import Markup
from starlette.datastructures import QueryParams

from sprag_study.sentences import Amount, Whole
from sprag_study.service.faults import FaultError, SelectionError
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.read import read_figure
from sprag_study.service.http.web.comparison.chosen import (
    Comparison,
    chosen_studies,
    comparison,
    curve_names,
    drawn,
    short_names,
    told_apart_by,
)
from sprag_study.service.http.web.figures.drawn import drawn as drawn_figure
from sprag_study.service.http.web.view_forms import EMPTY, Fact, fact_of
from sprag_study.service.languages import gettext
from sprag_study.service.reading.part_names import lower_first
from sprag_study.service.reading.reader import Phrase, joined, model_title, plural
from sprag_study.service.results.headlines.along import curve_words
from sprag_study.service.results.headlines.headline import NOTHING
from sprag_study.service.results.refined import curve_plan
from sprag_study.service.views.headline import headline_of, usual_query
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.relatives import asked_by
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.faults import Fault
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Choice, Reading
    from sprag_study.service.results.curves import Curve, CurveQuery, Curves
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.service.views.headline import Headline, KeyNumber
    from sprag_study.service.views.library import Library

#: Curves of a chart at most.
MOST_DRAWN: Final = 5
#: Values that are named where they have no curve; of more, their number is.
_NAMED: Final = 4
#: Largest ratio that is said in per cent, and that is said at all.
_TIMES, _FAR = 3.0, 100.0


@dataclass(frozen=True, slots=True)
class Row:
    """A number of the headlines: what it is, where it holds in all studies, each study's, and which are the best."""

    title: str
    where: str
    cells: list[Fact | None]
    best: list[bool]


@dataclass(frozen=True, slots=True)
class Answer:
    """What a page shows of a comparison.

    Attributes
    ----------
    names : what tells the studies apart
    say : the sentences about all of them
    each : of studies that ask different things, the answer of each
    rows : the numbers of their headlines
    figure, title : the chart, empty for none; ``left`` says what has no curve there
    held : what is held in it, by the name of its study; by "" where that is the same in all
    faults : why there is no chart
    """

    names: list[str]
    say: list[str]
    each: list[tuple[str, str]]
    rows: list[Row]
    figure: Markup = EMPTY
    title: str = ""
    left: str = ""
    held: Sequence[tuple[str, str]] = ()
    faults: tuple[Fault, ...] = ()


def answer_of(library: Library, given: Sequence[tuple[str, str]], choice: Choice) -> Answer:
    """The answer of a comparison for the parameters of its address. Raises SelectionError, StudyNotFoundError."""
    params = QueryParams(list(given))
    store = library.store
    records = chosen_studies(store, params)
    studies = [store.studies.study(record.id) for record in records]
    reading = reading_of(store, records[0].id, choice)
    names = short_names(studies, records, reading)
    if len({study.model for study in studies}) > 1:
        titles = dict.fromkeys(model_title(study.model) for study in studies)
        text = Phrase(
            "These studies are of different models ({models}): their answers cannot be compared, only what is given.",
            models=", ".join(titles),
        )
        return Answer(names, [reading.say(text)], [], [])
    chosen: Comparison | None = None
    faults: tuple[Fault, ...] = ()
    try:
        found = comparison(store, params, records)
        for position in range(len(records)):
            found.query(position)
        chosen = found
    except SelectionError as error:
        faults = error.faults
    asked = any(params.get(name) for name in ("x", "by", "at"))
    headlines = _headlines(library, records, chosen, asked=asked)
    rows = _rows(headlines, reading)
    say, each = _sentences(headlines, names, reading)
    answer = partial(Answer, names, say, each, rows)
    if chosen is None:
        return answer(faults=faults)
    try:
        curves = drawn(store, chosen, curve_names(chosen.studies, records, reading))
    except SelectionError as error:
        return answer(faults=error.faults)
    kept, left = charted(chosen, curves)
    title = _title(chosen, reading)
    described = curves_figure(kept, 2, apart=told_apart_by(studies))
    if not params.get("y"):
        described = without_empty(described)
    figure = drawn_figure(read_figure(described, reading), title)
    return answer(figure, title, _left(left, reading), _held(chosen.held(), names, reading))


def without_empty(figure: Figure) -> Figure:
    """The figure without panels whose lines have no number; as it is where none has one."""
    panels = tuple(each for each in figure.panels if any(np.isfinite(line.y).any() for line in each.lines))
    return replace(figure, panels=panels or figure.panels)


def _held(held: Sequence[tuple[str, ...]], names: Sequence[str], reading: Reading) -> list[tuple[str, str]]:
    """What is held, as of `Answer`."""
    said = [", ".join(map(reading.say, texts)) for texts in held]
    if len(set(said)) == 1:
        return [("", said[0])] if said[0] else []
    return [(name, text) for name, text in zip(names, said, strict=True) if text]


def _headlines(
    library: Library,
    records: Sequence[StudyRecord],
    chosen: Comparison | None,
    *,
    asked: bool,
) -> list[Headline | None]:
    """The headline of each study at the place of the first one's, where it has a case there; None where it has none."""
    found: list[Headline | None] = []
    place: tuple[str, float] | None = None
    for position, record in enumerate(records):
        query = None if chosen is None else _asked_of(library, chosen, position, asked=asked)
        headline = _headline(library, record.id, query, None)
        if headline is not None and place is not None and headline.at is not None and not _same(headline.at, place):
            other = _headline(library, record.id, query, repr(place[1])) if headline.at[0] == place[0] else None
            if other is not None and other.gap is None and other.at is not None and _same(other.at, place):
                headline = other
        if place is None and headline is not None:
            place = headline.at
        found.append(headline)
    return found


def _same(one: tuple[str, float], other: tuple[str, float]) -> bool:
    return one[0] == other[0] and math.isclose(one[1], other[1], rel_tol=SAME_VALUE)


def _asked_of(library: Library, chosen: Comparison, position: int, *, asked: bool) -> CurveQuery | None:
    """The curves that the headline of a study is about; None for those that it is about anyway."""
    record, study = chosen.records[position], chosen.studies[position]
    plan = curve_plan(study)
    if asked_by(study) != "along" or (study.plan is not None and plan is None):
        return None
    usual = usual_query(library, record.id)
    if not asked and usual is not None and usual.x == chosen.x:
        return None
    query = chosen.query(position)
    return query if plan is None else CurveQuery(query.x, plan.results, query.by, query.at)


def _headline(library: Library, study_id: str, query: CurveQuery | None, point: str | None) -> Headline | None:
    try:
        return headline_of(library, study_id, query, point)
    except FaultError:
        return None


def _numbers(headline: Headline | None, reading: Reading) -> dict[str, KeyNumber]:
    """The numbers of a headline by their titles, first what its cases are judged by."""
    if headline is None:
        return {}
    numbers = {one.title(reading): one for one in headline.numbers}
    found = numbers | {one.title(reading): one for one in headline.dimensions if one.title(reading) not in numbers}
    judged = headline.judged
    if judged is not None and judged.title(reading) not in found:
        found = {judged.title(reading): judged, **found}
    return found


def _rows(headlines: Sequence[Headline | None], reading: Reading) -> list[Row]:
    every = [_numbers(headline, reading) for headline in headlines]
    rows = []
    for title in dict.fromkeys(title for numbers in every for title in numbers):
        numbers = [own.get(title) for own in every]
        known = [one for one in numbers if one is not None]
        wheres = {reading.say(one.where) for one in known}
        where = wheres.pop() if len(wheres) == 1 and len(known) == len(numbers) > 1 else ""
        cells = [None if one is None else _cell(one, where, reading) for one in numbers]
        at_points = all(
            one is None or (headline is not None and one.case == headline.case)
            for headline, one in zip(headlines, numbers, strict=True)
        )
        # What is read at working points is compared where these are the same.
        best = [False] * len(cells) if at_points and not where else _best(numbers, cells)
        rows.append(Row(title, where, cells, best))
    return rows


def _cell(one: KeyNumber, where: str, reading: Reading) -> Fact:
    """A number as it is shown; the place is left out that all have in common."""
    return fact_of(replace(one, where=NOTHING) if where else one, reading)


def _best(numbers: Sequence[KeyNumber | None], cells: Sequence[Fact | None]) -> list[bool]:
    """Which numbers are better than others, where the model says what is better."""
    ways = {one.better for one in numbers if one is not None}
    better = ways.pop() if len(ways) == 1 else ""
    known = [one.value for one in numbers if one is not None and isinstance(one.value, float) and not one.above]
    shown = {cell.value for cell in cells if cell is not None}
    if not better or len(known) < 2 or len(shown) < 2:
        return [False] * len(numbers)
    most = max(known) if better == "larger" else min(known)
    best = next(
        cell.value
        for one, cell in zip(numbers, cells, strict=True)
        if one is not None and cell is not None and one.value == most
    )
    return [cell is not None and cell.value == best for cell in cells]


def _sentences(
    headlines: Sequence[Headline | None], names: Sequence[str], reading: Reading
) -> tuple[list[str], list[tuple[str, str]]]:
    """How the first number of the studies differs; of studies that have no such number in common, each one's answer."""
    if len(headlines) == 1:
        return ([] if headlines[0] is None else [headlines[0].said(reading)]), []
    firsts = [next(iter(_numbers(headline, reading).items()), None) for headline in headlines]
    title = next((first[0] for first in firsts if first is not None), "")
    known = [
        (name, first[1], first[1].value)
        for name, first in zip(names, firsts, strict=True)
        if first is not None and first[0] == title and isinstance(first[1].value, float)
    ]
    titles = {first[0] for first in firsts if first is not None}
    if len(titles) > 1 or len(known) < 2:
        told = [(name, headline.said(reading)) for name, headline in zip(names, headlines, strict=True) if headline]
        different = Phrase("These studies ask different things, so each has an answer of its own.")
        return ([reading.say(different)] if len(titles) > 1 else []), told
    return [reading.say(one) for one in _difference(title, known, reading)], []


def _difference(title: str, known: Sequence[tuple[str, KeyNumber, float]], reading: Reading) -> list[Phrase]:
    wheres = {reading.say(one.where) for _, one, _ in known}
    where = wheres.pop() if len(wheres) == 1 else ""
    name = lower_first(title)

    def said(one: KeyNumber) -> str:
        return one.said(reading) if not where else replace(one, where=NOTHING).said(reading)

    most, least = max(known, key=lambda item: item[2]), min(known, key=lambda item: item[2])
    same = replace(most[1], where=NOTHING).said(reading)
    if same == replace(least[1], where=NOTHING).said(reading):
        return [_placed(where, Phrase("the {name} is the same in all of them: {value}", name=name, value=same))]
    clause = Phrase(
        "the {name} is largest, {most}, with {first}, and smallest, {least}, with {last}",
        name=name,
        most=said(most[1]),
        first=joined(", ", (_quoted(own) for own, one, _ in known if said(one) == said(most[1]))),
        least=said(least[1]),
        last=joined(", ", (_quoted(own) for own, one, _ in known if said(one) == said(least[1]))),
    )
    return [_placed(where, clause), *_ratio(most[2], least[2])]


def _placed(where: str, clause: Phrase) -> Phrase:
    return joined("", [Whole(joined(" ", filter(None, (where, clause))))])


def _quoted(name: str) -> Phrase:
    return Phrase("“{name}”", name=name)


def _ratio(most: float, least: float) -> list[Phrase]:
    """How much the largest is above the smallest; nothing where their ratio says nothing."""
    if least <= 0.0:
        return []
    ratio = most / least
    if ratio > _FAR:
        return []
    if ratio > _TIMES:
        return [Phrase("The largest is {factor} times the smallest.", factor=Amount(ratio, "1", 2))]
    return [Phrase("The largest is {share} above the smallest.", share=Amount(100.0 * (ratio - 1.0), "%", 2))]


def _title(chosen: Comparison, reading: Reading) -> str:
    """What the chart shows, for those who do not see it."""
    names = ", ".join([reading.caption(chosen.y[0]), *map(reading.within, chosen.y[1:])])
    return reading.say(
        plural(
            "{names} against {x}, {count} study", "{names} against {x}, {count} studies", len(chosen.records),
            names=names, x=reading.within(chosen.x),
        )
    )  # fmt: skip


def curves_each(chosen: Comparison) -> int:
    """Curves of each study in a chart at most."""
    ids = [record.id for record in chosen.records if record.id != chosen.less]
    shown = [study_id for study_id in ids if study_id in chosen.shown] or ids
    return max(MOST_DRAWN // len(shown), 1)


def charted(chosen: Comparison, curves: Sequence[tuple[str, Curves]]) -> tuple[list[tuple[str, Curves]], list[Phrase]]:
    """The curves of a chart, at most `MOST_DRAWN`, and what has none there: of the shown studies, and of their values.

    Every shown study has as many curves. Both directions of a sweep count as one.
    """
    ids = [record.id for record in chosen.records if record.id != chosen.less]
    wanted = [pair for study_id, pair in zip(ids, curves, strict=True) if not chosen.shown or study_id in chosen.shown]
    wanted = wanted or list(curves)
    kept, each = wanted[:MOST_DRAWN], curves_each(chosen)
    left = [Phrase("“{name}”", name=name) for name, _ in wanted[MOST_DRAWN:]]
    values: dict[str, Phrase] = {}
    found = []
    for name, own in kept:
        groups = list(dict.fromkeys(_group(curve) for curve in own.curves))
        drawn_groups = set(groups[:each])
        found.append((name, replace(own, curves=tuple(c for c in own.curves if _group(c) in drawn_groups))))
        for curve in own.curves:
            if _group(curve) not in drawn_groups:
                text = curve_words(chosen.studies[0], dict(_group(curve)))
                values.setdefault(str(text), text)
    some = list(values.values())
    if len(some) > _NAMED:
        some = [plural("{count} further value", "{count} further values", len(some))]
    return found, [*left, *some]


def _group(curve: Curve) -> tuple[tuple[str, float], ...]:
    return tuple(sorted((path, value) for path, value in curve.line.by.items() if path != SWEEP))


def _left(left: Sequence[Phrase], reading: Reading) -> str:
    if not left:
        return ""
    text = Phrase(
        "A chart has at most {count} curves. Without one here: {names}. Choose others under “{where}”.",
        count=MOST_DRAWN, where=gettext("Other curves"), names=joined("; ", left),
    )  # fmt: skip
    return reading.say(text)
