"""What is said beside an answer: among which cases, between which neighbours, why there is none; and files."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

from sprag.service.answers.key import AnswerReport, AnswerValue, CurveAnswer, OverallAnswer
from sprag.service.results import exports
from sprag.service.results.directions import case_values, in_words
from sprag.service.results.selection import axis_name
from sprag.service.results.wording import number, unit_text, words
from sprag.service.spec.catalogue import unit_of

if TYPE_CHECKING:
    from sprag.service.results.key_answers import CurveAnswers, Found, StudyAnswers
    from sprag.worker.study import Study

_EXTREMES: Final = ("largest", "smallest")


def quantity(value: float, unit: str) -> str:
    """A number with its unit."""
    return f"{number(value)} {unit_text(unit)}".strip()


def note_of(found: Found, x_unit: str) -> str:
    """How far an answer can be trusted, or why there is none: a few words."""
    if found.why is not None:
        return _missing(found, x_unit)
    parts = [part for part in (_how(found, x_unit), _interval(found)) if part]
    if found.regime is not None and found.regime != "periodic":
        parts.append(found.regime)
    parts += [name.replace("_", " ") for name in found.flags if name != found.regime]
    return "; ".join(parts)


def _missing(found: Found, x_unit: str) -> str:
    x = None if found.x is None else quantity(found.x, x_unit)
    between = f"{number(found.low)} and {quantity(found.high, x_unit)}" if found.low is not None and found.high else ""
    return {
        "no-case": "no case there" if x is None else f"no case at {x}",
        "outside": "0 in all cases" if x is None else f"{x} is outside the cases",
        "not-joined": f"not interpolated: the motion changes between {between}",
        "no-result": "no case has this result",
    }[found.why or "no-result"]


def _how(found: Found, x_unit: str) -> str:
    kind, there = found.answer.kind, found.there or 0.0
    if kind == "until_zero":
        if found.above:
            return f"more: there the {words(found.info.name).lower()} is still {quantity(there, found.info.unit)}"
        return f"0 in the case at {quantity(found.high or 0.0, x_unit)}"
    if kind in _EXTREMES:
        among = f"{kind} of {number(found.cases)} cases"
        if found.edge:
            return f"{among}, at the end of the axis"
        if found.low is not None and found.high is not None:
            return f"{among}; neighbours at {number(found.low)} and {quantity(found.high, x_unit)}"
        return among
    if found.interpolated and found.low is not None and found.high is not None:
        return f"interpolated between the cases at {number(found.low)} and {quantity(found.high, x_unit)}"
    return ""


def _interval(found: Found) -> str:
    if found.half_width:
        return f"± {quantity(found.half_width, found.info.unit)} (95 %)"
    if found.error is not None:
        return f"curve within {100.0 * found.error:.2g} % of its range"
    return ""


def report(study_id: str, study: Study, found: StudyAnswers) -> AnswerReport:
    """The answers as the API gives them."""
    x = None if found.query is None else found.query.x
    curves = [_curve(one, found) for one in found.curves]
    units = {path: unit_of(study, path) for one in curves for path in (*one["by"], *one["at"])}
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


def _curve(one: CurveAnswers, found: StudyAnswers) -> CurveAnswer:
    return {
        "by": in_words(one.line.by),
        "at": in_words(one.line.at),
        "answers": [answer_json(item, found.unit) for item in one.answers],
        "working_point": [answer_json(item, found.unit) for item in one.working_point],
    }


def answer_json(found: Found, x_unit: str) -> AnswerValue:
    """One answer."""
    return {
        "name": found.answer.name,
        "title": found.answer.title,
        "kind": found.answer.kind,
        "result": found.info.name,
        "unit": found.unit,
        "description": found.info.description,
        "value": found.value,
        "x": found.x,
        "low": found.low,
        "high": found.high,
        "above": found.above,
        "edge": found.edge,
        "interpolated": found.interpolated,
        "cases": [case for case in (found.case, found.other) if case is not None],
        "of_cases": found.cases,
        "half_width": found.half_width,
        "error": found.error,
        "regime": found.regime,
        "flags": list(found.flags),
        "why": found.why,
        "note": note_of(found, x_unit),
    }


def _overall(study: Study, found: Found) -> OverallAnswer:
    parameters = {} if found.case is None else case_values(study, found.case)
    return {**answer_json(found, "1"), "parameters": parameters}


def answers_csv(study: Study, found: StudyAnswers) -> bytes:
    """A row for each answer of each curve, SI."""
    columns: dict[str, list[Any]] = {}
    rows = list(_rows(study, found))
    for row in rows:
        for name in row:
            columns.setdefault(name, [])
    for row in rows:
        for name, column in columns.items():
            column.append(row.get(name))
    return exports.table_csv(list(columns), list(columns.values()))


def _rows(study: Study, found: StudyAnswers) -> Iterator[dict[str, Any]]:
    names = ("name", "result", "unit", "value", "x", "low", "high", "above", "edge", "interpolated", "regime", "note")
    for one in found.curves:
        for part, items in (("curve", one.answers), ("working point", one.working_point)):
            for item in items:
                told: dict[str, Any] = {**answer_json(item, found.unit)}
                yield {"of": part, **in_words({**one.line.by, **one.line.at}), **{name: told[name] for name in names}}
    for item in found.overall:
        told = {**answer_json(item, "1")}
        place = {} if item.case is None else case_values(study, item.case)
        yield {"of": "all cases", **place, **{name: told[name] for name in names}}


def curve_name(one: CurveAnswers, study: Study) -> str:
    """What distinguishes a curve of a family, for people; "" for a single one."""
    from sprag.service.results.sweeps import value_text

    return ", ".join(
        f"{value_text(path, value)} {unit_text(unit_of(study, path))}".strip() for path, value in one.line.by.items()
    )


def place_text(study: Study, case: int) -> str:
    """The parameters of a case, for people."""
    values = case_values(study, case)
    shown = [path for axis in study.axes for path in axis.paths[:1]] or list(values)
    return ", ".join(
        f"{axis_name(study, path)} = {value if isinstance(value, str) else quantity(value, unit_of(study, path))}"
        for path in shown
        if (value := values.get(path)) is not None
    )
