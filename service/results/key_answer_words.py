"""What is said beside an answer: among which cases, between which neighbours, why there is none; and files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount, Name
from sprag_study.service import exports
from sprag_study.service.answers import filled
from sprag_study.service.answers.key import AnswerFacts, AnswerReport, AnswerValue, CurveAnswer, OverallAnswer
from sprag_study.service.languages import available, language
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.directions import case_values, in_words
from sprag_study.service.reading.reader import Phrase, joined, plural, shown, term
from sprag_study.service.reading.wording import percent
from sprag_study.service.results.selection import axis_name
from sprag_study.worker.directions import SWEEP, direction

if TYPE_CHECKING:
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.key_answers import CurveAnswers, ReadAnswer, StudyAnswers
    from sprag_study.worker.study import Study

_EXTREMES: Final = ("largest", "smallest")


def note_of(found: AnswerFacts, x_unit: str) -> Phrase:
    """How far an answer can be trusted, or why there is none: a few words."""
    if found["why"] is not None:
        return _missing(found, x_unit)
    parts: list[str] = [part for part in (_how(found, x_unit), _interval(found)) if part]
    if found["regime"] is not None and found["regime"] != "periodic":
        parts.append(term(found["regime"]))
    parts += [term(name) for name in found["flags"] if name != found["regime"]]
    return joined("; ", parts)


def _missing(found: AnswerFacts, x_unit: str) -> Phrase:
    why = found["why"] or "no-result"
    if why == "not-joined":
        return Phrase("not interpolated: the motion changes between {places}", places=_between(found, x_unit))
    if why == "unsettled":
        return Phrase("not settled there: a missing value") if found["cases"] else Phrase("no case had settled")
    if why == "no-result":
        return Phrase("no case has this result")
    if found["x"] is None:
        return Phrase("no case there") if why == "no-case" else Phrase("0 in all cases")
    x = Amount(found["x"], x_unit)
    return (
        Phrase("no case at {x}", x=x)
        if why == "no-case"
        else Phrase("{x} is outside the cases that have this result", x=x)
    )


def _between(found: AnswerFacts, x_unit: str) -> Phrase:
    """The neighbours of a place; "" where they are not known."""
    if found["low"] is None or found["high"] is None:
        return Phrase("")
    return Phrase("{low} and {high}", low=Amount(found["low"], x_unit, bare=True), high=Amount(found["high"], x_unit))


def _how(found: AnswerFacts, x_unit: str) -> Phrase:
    kind, there = found["kind"], found["there"] or 0.0
    if kind == "until_zero":
        if found["above"]:
            name, value = Name(found["result"], within=True), Amount(there, found["result_unit"])
            return Phrase("more: there the {name} is still {value}", name=name, value=value)
        return Phrase("0 in the case at {x}", x=Amount(found["high"] or 0.0, x_unit))
    if kind in _EXTREMES:
        among = (
            plural("largest of {count} case", "largest of {count} cases", found["of_cases"])
            if kind == "largest"
            else plural("smallest of {count} case", "smallest of {count} cases", found["of_cases"])
        )
        if found["edge"]:
            return Phrase("{among}, at the end of the axis", among=among)
        between = _between(found, x_unit)
        return Phrase("{among}; neighbours at {places}", among=among, places=between) if between else among
    between = _between(found, x_unit) if found["interpolated"] else Phrase("")
    return Phrase("interpolated between the cases at {places}", places=between) if between else Phrase("")


def _interval(found: AnswerFacts) -> Phrase:
    if found["half_width"]:
        return Phrase("± {width} (95 %)", width=Amount(found["half_width"], found["result_unit"]))
    if found["error"] is not None:
        return Phrase("curve within {share} of its range", share=percent(found["error"]))
    return Phrase("")


def report(study_id: str, study: Study, found: StudyAnswers) -> AnswerReport:
    """The answers as the API gives them."""
    x = None if found.query is None else found.query.x
    units = _units_of(study, found)
    curves = [_curve(one, found, units) for one in found.curves]
    units |= {path: unit_of(study, path) for path in study.axis_paths} if found.overall else {}
    return {
        "study": study_id,
        "x": x,
        "unit": None if x is None else found.unit,
        "point": found.point,
        "units": units,
        "curves": curves,
        "overall": [_overall(study, one) for one in found.overall],
    }


def _units_of(study: Study, found: StudyAnswers) -> dict[str, str]:
    """SI units of what curves are told apart by and held at."""
    return {path: unit_of(study, path) for one in found.curves for path in (*one.line.by, *one.line.at)}


def _curve(one: CurveAnswers, found: StudyAnswers, units: Mapping[str, str]) -> CurveAnswer:
    return {
        "by": in_words(one.line.by, units),
        "at": in_words(one.line.at, units),
        "answers": [answer_json(item, found.unit) for item in one.answers],
        "working_point": [answer_json(item, found.unit) for item in one.working_point],
    }


def answer_json(found: ReadAnswer, x_unit: str) -> AnswerValue:
    """One answer."""
    facts = answer_facts(found)
    return {**facts, "note": note_of(facts, x_unit)}


def answer_facts(found: ReadAnswer) -> AnswerFacts:
    """What is known of one answer."""
    return filled(
        AnswerFacts,
        found,
        name=found.answer.name,
        title=found.answer.title,
        kind=found.answer.kind,
        result=found.info.name,
        result_unit=found.info.unit,
        description=found.info.description,
        cases=[case for case in (found.case, found.other) if case is not None],
        of_cases=found.cases,
    )


def _overall(study: Study, found: ReadAnswer) -> OverallAnswer:
    parameters = {} if found.case is None else case_values(study, found.case)
    return {**answer_json(found, "1"), "parameters": parameters}


def answers_csv(study: Study, found: StudyAnswers, reading: Reading) -> bytes:
    """A row for each answer of each curve, in a reader's units: of the value that in the column ``unit``."""
    columns = exports.stacked({name: [value] for name, value in row.items()} for row in _rows(study, found, reading))
    return exports.table_csv(columns, columns.values())


def _rows(study: Study, found: StudyAnswers, reading: Reading) -> Iterator[dict[str, Any]]:
    units = _units_of(study, found)
    for one in found.curves:
        for part, items in (("curve", one.answers), ("working point", one.working_point)):
            for item in items:
                place = in_words({**one.line.by, **one.line.at}, units)
                yield {"of": part, **_place(study, place, reading), **_shown(item, found.unit, reading)}
    for item in found.overall:
        place = {} if item.case is None else case_values(study, item.case)
        yield {"of": "all cases", **_place(study, place, reading), **_shown(item, "1", reading)}


def _place(study: Study, values: Mapping[str, Any], reading: Reading) -> dict[str, Any]:
    """The parameters of a row; the name of one that is not in SI says its unit."""
    found = {}
    for path, value in values.items():
        si = unit_of(study, path)
        found[path if reading.unit(si) == si else f"{path} [{reading.unit(si)}]"] = reading.value(value, si)
    return found


def _shown(item: ReadAnswer, x_unit: str, reading: Reading) -> dict[str, Any]:
    """The other columns of a row."""
    fields = answer_facts(item)
    return {
        "name": fields["name"],
        "result": fields["result"],
        "unit": reading.unit(item.unit),
        "value": reading.value(item.value, item.unit),
        **{name: reading.value(getattr(item, name), x_unit) for name in ("x", "low", "high")},
        **({} if reading.unit(x_unit) == x_unit else {"unit of x": reading.unit(x_unit)}),
        **{name: getattr(item, name) for name in ("above", "edge", "interpolated", "regime")},
        "note": note_of(fields, x_unit).said(reading),
    }


def said_title(title: str, reading: Reading) -> str:
    """The title of an answer for a reader: a phrase, or a text of the model."""
    return reading.say(title if isinstance(title, Phrase) else Phrase(title))


def curve_name(one: CurveAnswers, study: Study) -> Phrase:
    """What distinguishes a curve of a family, for people; "" for a single one."""
    return joined(
        ", ",
        (
            term(direction(value)) if path == SWEEP else Amount(value, unit_of(study, path))
            for path, value in one.line.by.items()
        ),
    )


def curve_named(names: Sequence[Phrase], text: str) -> int | None:
    """The place of the curve that a text names, by its name in any language; None where there is none."""
    for code in available():
        with language(code):
            said = list(map(shown, names))
        if text in said:
            return said.index(text)
    return None


def place_text(study: Study, case: int) -> Phrase:
    """The parameters of a case, for people."""
    values = case_values(study, case)
    shown = [path for axis in study.axes for path in axis.paths[:1]] or list(values)
    return joined(
        ", ",
        (
            Phrase(
                "{name} = {value}",
                name=Name(axis_name(study, path), within=True),
                value=term(value) if isinstance(value, str) else Amount(value, unit_of(study, path)),
            )
            for path in shown
            if (value := values.get(path)) is not None
        ),
    )
