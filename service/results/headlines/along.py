"""The answer of cases along an axis, of a single case, and of cases that lie on no curve."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Name, Whole
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, term
from sprag_study.service.results.headlines.headline import (
    MOST,
    NOTHING,
    Gap,
    Headline,
    KeyNumber,
    amount,
    beyond,
    digits,
    trace_of,
)
from sprag_study.service.results.key_answer_words import answer_facts, curve_name, curve_named, note_of, place_text
from sprag_study.service.results.key_answers import OF_PLACES, answers_at, same_places, usual_curve
from sprag_study.service.results.selection import axis_name
from sprag_study.worker import models
from sprag_study.worker.directions import SWEEP, direction
from sprag_study.worker.models import NO_PARAMETERS
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.sentences import Part
    from sprag_study.service.results.curves import Curve
    from sprag_study.service.results.key_answers import CurveAnswers, ReadAnswer, StudyAnswers
    from sprag_study.service.results.refined import Line
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

#: What is less than this share of its neighbour is worth a sentence.
_LEFT: Final = 0.5
#: The end of the name of a half width.
_WIDTH: Final = models.half_width("")


@dataclass(frozen=True, slots=True)
class Along:
    """A curve of a study and the place on it that is told about.

    Attributes
    ----------
    curve : with all results that its answers need
    path : of its axis
    x : the place, SI
    places : of the case at ``x``, or of its two neighbours
    """

    study: Study
    curve: Curve
    path: str
    x: float
    places: tuple[int, ...]

    @property
    def first(self) -> ResultInfo:
        """The result that a case is judged by."""
        return models.results_by_name(self.study)[judged_by(self.study, self.curve.y)]

    def value(self, place: int, name: str) -> float:
        """A result that counts; NaN where there is none."""
        return float(self.curve.known(name)[place])

    def at(self, place: int) -> Amount:
        """The place of a case on the axis."""
        return Amount(float(self.curve.line.x[place]), unit_of(self.study, self.path), OF_PLACES)


def judged_by(study: Study, known: Sequence[str] | Mapping[str, object]) -> str:
    """The result that a case of a study is judged by, of those that are known."""
    shown = models.presentation_of(study)
    wanted = (*shown.clauses.results.values(), *shown.drawn)
    return next((name for name in wanted if name in known), next(iter(known)))


def wanted_of(study: Study, name: str, parameters: Mapping[str, float | str] | None = None) -> float | None:
    """The value (SI) of a result that is wanted, of a case with such ``parameters``; None where there is not one."""
    path = models.presentation_of(study).wanted.get(name)
    if path is None or (parameters is None and path in study.column_paths):
        return None
    value = (parameters or {}).get(path, study.base.get(path))
    return value if isinstance(value, float) and np.isfinite(value) else None


def case_clause(study: Study, values: Mapping[str, float], widths: Mapping[str, float]) -> Phrase:
    """The clause about a case with these results; "" where none can be said."""
    clauses, infos = models.presentation_of(study).clauses, models.results_by_name(study)
    names = {place: name for place, name in clauses.results.items() if name in infos}
    parts: dict[str, Part] = {
        place: amount(infos[name], values[name], widths.get(name))
        for place, name in names.items()
        if np.isfinite(values.get(name, np.nan))
    }
    first = next(iter(names.values()), None)
    if first is not None and values.get(first) == 0.0 and clauses.still:
        return Phrase(clauses.still)
    for text in clauses.here:
        wanted = [place for place in clauses.results if f"{{{place}}}" in text]
        if all(place in parts and values[names[place]] != 0.0 for place in wanted):
            return Phrase(text, **{place: parts[place] for place in wanted})
    name = next((name for name in values if name in infos and np.isfinite(values[name])), None)
    if name is None:
        return NOTHING
    value = amount(infos[name], values[name], widths.get(name))
    return Phrase("{name} is {value}", name=Name(name, within=True), value=value)


def place_on(curve: Curve, name: str, x: float | None, *, asked: bool) -> tuple[float, tuple[int, ...]] | None:
    """A place of a curve with its case, or its two neighbours; None where the curve has no case, or none around it.

    Unless it was ``asked`` for, it is that of the nearest case with the result ``name``, of two the farther one.
    """
    run = curve.run()
    if not run.size or x is None:
        return None
    values = np.asarray(curve.line.x)[run]
    scale = max(float(np.abs(values).max()), abs(x))
    exact = same_places(values, x)
    if exact.size:
        return x, (int(run[exact[0]]),)
    below, above = np.flatnonzero(values < x), np.flatnonzero(values > x)
    if asked and below.size and above.size:
        low, high = below[np.argmax(values[below])], above[np.argmin(values[above])]
        return x, (int(run[low]), int(run[high]))
    known = np.flatnonzero(np.isfinite(curve.known(name)[run])).tolist()
    nearest = min(
        known or range(run.size), key=lambda place: (round(abs(float(values[place]) - x) / scale, 9), -values[place])
    )
    return float(values[nearest]), (int(run[nearest]),)


def along_headline(study: Study, found: StudyAnswers, name: str = "", *, asked: bool = False) -> Headline:
    """The answer of a curve at the point of ``found``, the nearest case of it unless that was ``asked`` for.

    The curve with the ``name`` that it has in pictures; by default it is that nearest to the machine of the base.
    """
    if found.query is None or found.drawn is None or not found.curves:
        return _no_curve(study, found)
    place = curve_place(study, found, name)
    curve = found.drawn.curves[place]
    spot = place_on(curve, judged_by(study, curve.y), found.point, asked=asked)
    of = curve_of(study, curve.line)
    if spot is None:
        return Headline(of=of)
    own = Along(study, curve, found.query.x, *spot)
    answers = answers_at(study, found.query, curve, spot[0])
    gap = None
    if len(spot[1]) == 2:
        low, high = (float(curve.line.x[at]) for at in spot[1])
        gap = Gap(found.query.x, spot[0], low, high)
    y = curve.known(own.first.name)
    off = beyond(study, found.query.x, found.point or 0.0, spot[0]) if asked and spot[0] != found.point else NOTHING
    return Headline(
        sentence=tuple(filter(None, (off, *_sentences(own), _next(own, answers)))),
        numbers=_numbers(own, answers, found.unit),
        of=of,
        trace=trace_of(curve.line.x, y, spot[1][0]),
        gap=gap,
        case=int(curve.line.cases[spot[1][0]]),
        at=(found.query.x, spot[0]),
        judged=_judged(own),
    )


def _judged(own: Along) -> KeyNumber | None:
    """What the case at the place is judged by; None between two cases, or without a result that counts."""
    place, name = own.places[0], own.first.name
    value = own.value(place, name)
    if len(own.places) > 1 or not np.isfinite(value):
        return None
    case, where = int(own.curve.line.cases[place]), Phrase("at {place}", place=own.at(place))
    return KeyNumber(name, value, own.first.unit, digits(value, _width(own, place, name)), where=where, case=case)


def curve_place(study: Study, found: StudyAnswers, name: str) -> int:
    """The place of a curve by its name in any language; without one, or for an unknown one, that of the usual curve."""
    named = curve_named([curve_name(one, study) for one in found.curves], name) if name else None
    return usual_curve(study, found) if named is None else named


def curve_of(study: Study, line: Line) -> Phrase:
    """What tells a curve apart and what it is held at, with its names; "" for the only curve of a study."""
    held = {path: value for path, value in line.at.items() if path not in NO_PARAMETERS}
    return curve_words(study, {**line.by, **held})


def curve_words(study: Study, by: Mapping[str, float]) -> Phrase:
    """What tells a curve apart, with its names: ``vertical amplitude 2 mm``."""
    return joined(
        ", ",
        (
            term(direction(value))
            if path == SWEEP
            else Phrase(
                "{name} = {value}", name=Name(path, within=True), value=Amount(value, unit_of(study, path), OF_PLACES)
            )
            for path, value in by.items()
        ),
    )


def _sentences(own: Along) -> list[Phrase]:
    """What is said of the place: of its case, or that it has none and what its neighbours have."""
    if len(own.places) == 1:
        return [case_sentence(own, own.places[0])]
    wanted = Amount(own.x, unit_of(own.study, own.path), OF_PLACES)
    missing = Phrase("No case was run at {place}.", place=wanted)
    return [missing, *(case_sentence(own, place) for place in own.places)]


def case_sentence(own: Along, place: int) -> Phrase:
    """The sentence about the case at a place of a curve."""
    clause = _clause(own, place)
    if not clause:
        clause = _without(own, place)
    along = models.presentation_of(own.study).along[:1]
    if own.path in along:
        return Phrase("At {place} {clause}.", place=own.at(place), clause=clause)
    name = Name(axis_name(own.study, own.path).partition(" = ")[0])
    return Phrase("{name} = {place}: {clause}.", name=name, place=own.at(place), clause=clause)


def _clause(own: Along, place: int) -> Phrase:
    values = {name: own.value(place, name) for name in own.curve.y if not name.endswith(_WIDTH)}
    widths = {name: width for name in values if (width := _width(own, place, name)) is not None}
    first = own.first.name
    values = {first: values[first], **values}
    return NOTHING if not np.isfinite(values[first]) else case_clause(own.study, values, widths)


def _width(own: Along, place: int, name: str) -> float | None:
    widths = own.curve.y.get(models.half_width(name))
    return None if widths is None or not np.isfinite(widths[place]) else float(widths[place])


def _without(own: Along, place: int) -> Phrase:
    """Why a case has no result that counts."""
    ending, kind = own.curve.endings[place], None if own.curve.regimes is None else own.curve.regimes[place]
    flags = [] if own.curve.flags is None else own.curve.flags[place].split(",")
    why = ending if ending != models.OK else models.NOT_SETTLED if models.NOT_SETTLED in flags else kind or ending
    return Phrase("there is no result: {why}", why=term(why))


def _next(own: Along, answers: CurveAnswers) -> Phrase:
    """What comes behind the place: how little is left at the next case, or where nothing is."""
    if len(own.places) == 2:
        return NOTHING
    clauses, name = models.presentation_of(own.study).clauses, own.first.name
    here = own.value(own.places[0], name)
    x = np.asarray(own.curve.line.x)
    after = [place for place in own.curve.run().tolist() if x[place] > own.x * (1.0 + SAME_VALUE)]
    following = min(after, key=lambda place: x[place], default=None)
    if following is not None and clauses.left and here > 0.0:
        value = own.value(following, name)
        if 0.0 < value < _LEFT * here:
            place = next(iter(clauses.results))
            left = Phrase(clauses.left, **{place: amount(own.first, value)})
            return Phrase("At {place} {clause}.", place=own.at(following), clause=left)
    stall = next((one for one in answers.answers if one.answer.kind == "until_zero" and one.value is not None), None)
    if stall is None or not clauses.stalls:
        return NOTHING
    if stall.high is None:
        there = stall.there or 0.0
        if not clauses.left or not 0.0 < there < _LEFT * here:
            return NOTHING
        left = Phrase(clauses.left, **{next(iter(clauses.results)): amount(own.first, there)})
        return Phrase("At {place} {clause}.", place=Amount(stall.value, stall.unit, OF_PLACES), clause=left)
    ends = {
        "low": Amount(stall.low, stall.unit, OF_PLACES, bare=True),
        "high": Amount(stall.high, stall.unit, OF_PLACES),
    }
    return joined("", [Whole(Phrase(clauses.stalls, **ends))])


def _numbers(own: Along, answers: CurveAnswers, x_unit: str) -> tuple[KeyNumber, ...]:
    for items in (answers.answers, answers.working_point):
        found = [_number(one, x_unit, own) for one in items if one.value is not None]
        if found:
            return tuple(found[:MOST])
    return ()


def curve_numbers(answers: CurveAnswers, x_unit: str) -> list[KeyNumber]:
    """Every answer of a curve; those that lie between two of its cases have no value."""
    return [_number(one, x_unit, None) for one in answers.answers or answers.working_point]


def _number(found: ReadAnswer, x_unit: str, own: Along | None) -> KeyNumber:
    """An answer as a key number; between two cases of its ``own`` curve what both of them have."""
    if found.answer.kind == "until_zero" and found.value is not None:
        return _stall(found)
    made = _key(found, _doubt(found))
    if found.value is None:
        return made
    made = replace(made, where=_where(found, x_unit))
    if found.other is None:
        return made
    if own is None:
        return replace(made, value=None)
    ends = sorted(own.value(place, found.info.name) for place in own.places)
    return replace(made, value=None, low=ends[0], high=ends[-1])


def _key(found: ReadAnswer, note: Phrase) -> KeyNumber:
    """The value of an answer as a key number."""
    answer, count = found.answer, digits(found.value or 0.0, found.half_width)
    return KeyNumber(
        answer.title, found.value, found.info.unit, count, note=note, case=found.case, better=answer.better
    )


def _where(found: ReadAnswer, x_unit: str) -> Phrase:
    if found.other is not None and found.low is not None and found.high is not None:
        ends = Amount(found.low, x_unit, OF_PLACES, bare=True), Amount(found.high, x_unit, OF_PLACES)
        return Phrase("between {low} and {high}", low=ends[0], high=ends[1])
    return NOTHING if found.x is None else Phrase("at {place}", place=Amount(found.x, x_unit, OF_PLACES))


def _doubt(found: ReadAnswer) -> Phrase:
    """What should make one careful: the end of an axis, an irregular motion."""
    parts: list[Phrase] = [Phrase("at the end of the axis")] if found.edge and found.x else []
    if found.regime not in (None, "periodic", "coasting"):
        parts.append(term(found.regime or ""))
    return joined(", ", parts)


def _stall(found: ReadAnswer) -> KeyNumber:
    there = NOTHING
    if found.above and found.there is not None:
        there = Phrase("there {value}", value=amount(found.info, found.there))
    elif found.high is not None:
        there = Phrase("below {place}", place=Amount(found.high, found.unit, OF_PLACES))
    return KeyNumber(found.answer.title, found.value, found.unit, OF_PLACES, above=True, where=there, case=found.case)


def _no_curve(study: Study, found: StudyAnswers) -> Headline:
    """The answer of a single case, or the extremes among cases that lie on no curve."""
    if found.curves:
        one = found.curves[0]
        values = {item.info.name: item.value for item in (*one.working_point, *one.answers) if item.value is not None}
        widths = {item.info.name: item.half_width for item in one.working_point if item.half_width}
        clause = case_clause(study, values, widths)
        numbers = [_plain(item) for item in (*one.answers, *one.working_point) if item.value is not None]
        numbers = list({number.label: number for number in numbers}.values())
        says = (joined("", [Whole(clause)]),) if clause else ()
        return Headline(says, tuple(numbers[:MOST]))
    best = [item for item in found.overall if item.value is not None]
    numbers = [replace(_plain(item), where=place_text(study, item.case or 0)) for item in best]
    says = ()
    if best:
        title = best[0].answer.title
        says = (
            Phrase(
                "{title}: {value}, {place}.",
                title=title if isinstance(title, Phrase) else Phrase(title),
                value=amount(best[0].info, best[0].value or 0.0, best[0].half_width),
                place=place_text(study, best[0].case or 0),
            ),
        )
    return Headline(says, tuple(numbers[:MOST]))


def _plain(item: ReadAnswer) -> KeyNumber:
    return _key(item, note_of(answer_facts(item), "1") if item.flags or item.regime else NOTHING)
