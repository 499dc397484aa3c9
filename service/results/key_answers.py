"""The answers of a study: what is read off its curves first, such as the largest useful power and the load of it.

The model says which answers there are (`Presentation.answers`); here they are read from the cases of curves, exactly
where a case stands, and otherwise from the straight line between two neighbours that a picture joins.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from sprag_study.sentences import Name
from sprag_study.service.faults import refused
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase
from sprag_study.service.results.curve_cases import draw, select
from sprag_study.service.results.curves import Curve
from sprag_study.service.results.defaults import drawn_results, main_query, main_results, usual_value
from sprag_study.service.results.joined import joined_points
from sprag_study.service.results.refined import Line, curve_plan
from sprag_study.service.results.regimes import kind_columns
from sprag_study.service.results.selection import require_axis, value_of
from sprag_study.worker import models
from sprag_study.worker.codes import PENDING
from sprag_study.worker.models.presentation import Answer
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from sprag_study.service.results.curves import CurveQuery, Curves, Fetch
    from sprag_study.service.storage.studies.records import CaseColumns
    from sprag_study.worker.arrays import Floats, Ints
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

#: Why there is no value: no case there, beyond the ends of the axis, between points that no line joins, no result, or
#: only results of motions that had not settled.
Why = Literal["no-case", "outside", "not-joined", "no-result", "unsettled"]
#: Digits of a place of an axis in print.
OF_PLACES: Final = 5
#: Results of all cases by their names, in order of the cases.
Whole = Callable[[Sequence[str]], "CaseColumns"]


@dataclass(frozen=True, slots=True)
class ReadAnswer:
    """An answer of one curve, or of all cases of a study. Numbers are SI.

    Attributes
    ----------
    answer, info : what it is, and the result that it is read from; ``unit`` is that of the value
    value : None where there is none; ``why`` says why
    x : value of the axis of the curve at which it holds; None where there is no such axis
    low, high : neighbouring values of the axis: between them lies an extreme of the curve, or the x of the answer
    above : whether no case shows its upper end; ``there`` is the result at x then
    case, other : the case it was read from, and the second one where it is between two
    cases : cases that were compared for it
    edge : whether an extreme is at the end of the axis, so that it may go on beyond it
    regime, flags : of the cases it was read from
    half_width : of the interval of a mean of irregular motion
    error : of a refined curve, relative to its range
    """

    answer: Answer
    info: ResultInfo
    unit: str
    value: float | None = None
    why: Why | None = None
    x: float | None = None
    low: float | None = None
    high: float | None = None
    above: bool = False
    there: float | None = None
    case: int | None = None
    other: int | None = None
    cases: int = 0
    edge: bool = False
    regime: str | None = None
    flags: tuple[str, ...] = ()
    half_width: float | None = None
    error: float | None = None

    @property
    def interpolated(self) -> bool:
        """Whether the value was computed from two cases."""
        return self.other is not None and self.answer.kind != "until_zero"


@dataclass(frozen=True, slots=True)
class CurveAnswers:
    """The answers of one curve, and its main results at the working point."""

    line: Line
    answers: tuple[ReadAnswer, ...]
    working_point: tuple[ReadAnswer, ...]


@dataclass(frozen=True, slots=True)
class StudyAnswers:
    """The answers of a study.

    Attributes
    ----------
    query : the curves that they are read from; None for a study of one machine, which has one case
    point : value of x (SI) of the working point; None where there is no curve, or none can be read there
    unit : of x
    curves : one or several; empty for a study whose cases lie on no curves
    overall : extremes among all cases of the study, with the parameters of their cases
    drawn : the curves of the main results, for a picture
    """

    query: CurveQuery | None
    point: float | None
    unit: str
    curves: tuple[CurveAnswers, ...]
    overall: tuple[ReadAnswer, ...]
    drawn: Curves | None


def answers_of_model(study: Study) -> tuple[Answer, ...]:
    """The answers that the model names and the study has; extremes of the drawn results of a model that names none.

    Behind them are the extremes of each quantity of the study.
    """
    names = models.results_by_name(study)
    named = tuple(one for one in models.presentation_of(study).answers if one.result in names)
    drawn = [] if named else [name for name in drawn_results(study) if name in names][:2]
    return (*named, *(one for name in (*drawn, *(one.name for one in study.quantities)) for one in _extremes(name)))


def _extremes(name: str) -> tuple[Answer, ...]:
    """The largest and the smallest value of a result as answers."""
    kinds: tuple[tuple[Literal["largest", "smallest"], str], ...] = (
        ("largest", N_("Largest {name}")),
        ("smallest", N_("Smallest {name}")),
    )
    return tuple(
        Answer(f"{kind}_{name}", Phrase(text, name=Name(name, within=True)), name, kind) for kind, text in kinds
    )


def answers_query(study: Study, chosen: CurveQuery | None = None) -> CurveQuery | None:
    """The curves of the main results that answers are read from: those of the page, or of the ``chosen`` ones.

    None where the cases of the study lie on no curves: nothing varies, it chooses its own cases, or each is a machine
    of its own.
    """
    if study.plan is not None and curve_plan(study) is None:
        return None
    query = chosen or main_query(study)
    if query is None:
        return None
    y = query.y if curve_plan(study) is not None else main_results(study)
    return replace(query, y=y)


def read_point(study: Study, query: CurveQuery, text: str | None) -> float | None:
    """The working point: the text with or without a unit, otherwise the base's value, or the middle one of the axis.

    A text that is a value of the axis as it is printed is that value.

    Raises SelectionError about ``point`` for a text that is no quantity of the axis, and about ``x`` for no axis.
    """
    axis = study.axes[require_axis(study, "x", query.x)]
    if text is not None and text.strip():
        return place_of(study, query.x, text)
    base = study.base.get(query.x)
    between = base is not None and axis.array.min() <= base <= axis.array.max()
    return base if between else usual_value(study, axis)


def place_of(study: Study, path: str, text: str) -> float:
    """A value (SI) of the axis of ``path`` in a text; of two that are printed alike, the one of the axis.

    Raises SelectionError about ``point``.
    """
    value = value_of(path, text.strip(), unit_of(study, path), "point")
    axis = study.axis_with(path).array
    nearest = float(axis[np.argmin(np.abs(axis - value))])
    return nearest if math.isclose(nearest, value, rel_tol=0.5 * 10.0 ** (1 - OF_PLACES)) else value


def find_answers(
    study: Study,
    query: CurveQuery | None,
    point: str | None,
    fetch: Fetch,
) -> StudyAnswers:
    """The answers of the curves of ``query``, as `answers_query` gives it, without the extremes among all cases.

    Raises
    ------
    SelectionError
        As `select` does; and where ``point`` is given although there is no axis for it.
    """
    answers, by_name = answers_of_model(study), models.results_by_name(study)
    if query is None:
        if point:
            raise refused("point", "not-used", "the cases of this study lie on no curves", point, allowed="no point")
        single = (_single(study, answers, by_name, fetch),) if study.cases == 1 else ()
        return StudyAnswers(None, None, "1", single, (), None)
    x = read_point(study, query, point)
    names = dict.fromkeys([*query.y, *(one.result for one in answers)])
    drawn = draw(select(study, replace(query, y=tuple(models.with_half_widths(names, by_name)))), fetch)
    curves = tuple(answers_at(study, query, curve, x) for curve in drawn.curves)
    shown_only = replace(drawn.selection, results=tuple(by_name[name] for name in query.y))
    return StudyAnswers(query, x, unit_of(study, query.x), curves, (), replace(drawn, selection=shown_only))


def answers_at(study: Study, query: CurveQuery, curve: Curve, x: float | None) -> CurveAnswers:
    """The answers of a curve at a working point of it."""
    reader, by_name = _Reader(study, curve, query.x, x), models.results_by_name(study)
    fitting = (one for one in answers_of_model(study) if _fits(study, one, query.x))
    answers, here = (
        tuple(reader.read(one, by_name[one.result]) for one in every) for every in (fitting, map(_here, query.y))
    )
    return CurveAnswers(curve.line, answers, here)


def same_places(x: Floats, point: float) -> Ints:
    """Where the values of an axis are a point, apart from rounding."""
    scale = max(float(np.abs(x).max(initial=0.0)), abs(point))
    return np.flatnonzero(np.abs(x - point) <= SAME_VALUE * scale)


def _here(name: str) -> Answer:
    """The answer that a result is at the working point."""
    return Answer(name, name, name, "here")


def usual_curve(study: Study, found: StudyAnswers) -> int:
    """The place of the curve nearest to the machine of the base; that of the first of several."""
    lines = [one.line for one in found.curves]
    return min(range(len(lines)), key=lambda place: from_base(study, lines[place].by), default=0)


def from_base(study: Study, by: Mapping[str, float]) -> float:
    """How far what tells a curve apart lies from the machine of the base."""
    return sum(abs(value - study.base.get(path, value)) / (abs(value) or 1.0) for path, value in by.items())


def _fits(study: Study, answer: Answer, x: str) -> bool:
    """Whether an answer has a meaning along the axis of ``x``."""
    return not answer.along or study.axis_of(answer.along) == study.axis_of(x)


def _single(
    study: Study,
    answers: Sequence[Answer],
    by_name: dict[str, ResultInfo],
    fetch: Fetch,
) -> CurveAnswers:
    """The main results of the only case."""
    main = list(map(_here, main_results(study)))
    here = [one for one in answers if one.kind == "here"]
    names = dict.fromkeys(one.result for one in (*main, *here))
    columns = fetch(np.zeros(1, dtype=np.int64), models.with_half_widths(names, by_name))
    line = Line({}, {}, (0.0,), np.zeros(1, dtype=np.int64))

    def one(answer: Answer) -> ReadAnswer:
        info, value = by_name[answer.result], columns.values[answer.result]
        if math.isfinite(value[0]) and models.usable(study.model, columns.endings, columns.flags, info.name)[0]:
            return _of_case(answer, info, columns, 0, cases=1)
        why = _why(value, columns.endings)
        return ReadAnswer(answer, info, info.unit, why=why, case=0, cases=1, flags=_split(columns.flags, [0]))

    return CurveAnswers(line, tuple(map(one, here)), tuple(map(one, main)))


def find_overall(study: Study, whole: Whole) -> Iterator[ReadAnswer]:
    """The extremes among all cases of a study; none of one that chooses its own cases, or has one.

    ``whole`` gives results of all cases by their names.
    """
    answers, by_name = answers_of_model(study), models.results_by_name(study)
    extremes = [one for one in answers if one.kind in ("largest", "smallest")]
    if not extremes or study.cases == 1 or study.plan is not None:
        return
    regime = models.regime_info(tuple(by_name.values()))
    names = [*(one.result for one in extremes), *kind_columns(regime)[:1]]
    columns = whole(models.with_half_widths(names, by_name))
    for answer in extremes:
        info, values = by_name[answer.result], columns.values[answer.result]
        usable = models.usable(study.model, columns.endings, columns.flags, info.name)
        kept = np.flatnonzero(np.isfinite(values) & usable)
        if not kept.size:
            yield ReadAnswer(answer, info, info.unit, why=_why(values, columns.endings))
            continue
        place = int(kept[_best(values[kept], answer)])
        kind = None if regime is None else regime.cell(float(columns.values[regime.name][place]))
        found = _of_case(answer, info, columns, place, cases=kept.size)
        yield found if kind is None else replace(found, regime=str(kind))


def _of_case(answer: Answer, info: ResultInfo, columns: CaseColumns, place: int, cases: int) -> ReadAnswer:
    """The value that the case at a place of the columns has, the best of so many cases."""
    width = columns.values.get(models.half_width(info.name), np.full(place + 1, np.nan))[place]
    return ReadAnswer(
        answer, info, info.unit, float(columns.values[info.name][place]),
        case=int(columns.cases[place]),
        cases=cases,
        flags=_split(columns.flags, [place]),
        half_width=float(width) if np.isfinite(width) else None,
    )  # fmt: skip


def _why(values: Floats, endings: Sequence[str | None]) -> Why:
    """Why none of these results counts: a case that did not end ok has none, whatever could still be computed."""
    return "unsettled" if np.isfinite(values[np.array(endings) == models.OK]).any() else "no-result"


def _best(values: Floats, answer: Answer) -> int:
    return int(np.argmax(values) if answer.kind == "largest" else np.argmin(values))


def _split(flags: Sequence[str], places: Sequence[int]) -> tuple[str, ...]:
    """The flags of some cases, each once."""
    return tuple(dict.fromkeys(name for place in places if flags for name in flags[place].split(",") if name))


class _Reader:
    """Reads answers off one curve."""

    def __init__(self, study: Study, curve: Curve, path: str, point: float | None) -> None:
        self._curve, self._unit, self._point = curve, unit_of(study, path), point
        self._x = np.asarray(curve.line.x, dtype=np.float64)
        self._flags = curve.flags or []

    def read(self, answer: Answer, info: ResultInfo) -> ReadAnswer:
        """One answer."""
        way: dict[str, Callable[[Answer, ResultInfo], ReadAnswer]] = {
            "at_zero": self._at_zero,
            "until_zero": self._until_zero,
            "here": lambda one, own: self._at(one, own, self._point),
        }
        found = way.get(answer.kind, self._extreme)(answer, info)
        if answer.kind == "until_zero":
            found = replace(found, unit=self._unit)
        refined = self._curve.refined
        exact = found.answer.kind in ("here", "at_zero", "until_zero") and not found.interpolated
        return found if refined is None or exact else replace(found, error=refined.errors.get(info.name))

    def _of(self, answer: Answer, info: ResultInfo, places: Sequence[int], value: float, **more: object) -> ReadAnswer:
        """A value that was read from the cases at these places of the curve."""
        curve, x = self._curve, self._x
        regimes = {curve.regimes[place] for place in places} if curve.regimes is not None else {None}
        cases = curve.line.cases[list(places)].tolist()
        found = ReadAnswer(
            answer, info, info.unit, value,
            x=float(x[places[0]]),
            case=cases[0],
            other=cases[1] if len(cases) > 1 else None,
            regime=regimes.pop() if len(regimes) == 1 else None,
            flags=_split(self._flags, places),
            half_width=self._half_width(info, places),
        )  # fmt: skip
        return replace(found, **more)  # type: ignore[arg-type]

    def _half_width(self, info: ResultInfo, places: Sequence[int]) -> float | None:
        widths = self._curve.y.get(models.half_width(info.name))
        known = [] if widths is None else [float(widths[place]) for place in places if np.isfinite(widths[place])]
        return max(known, default=None)

    def _band(self, info: ResultInfo, part: int) -> tuple[float, float] | None:
        """The half widths at the ends of a part of a refined curve in which the result scatters; None elsewhere."""
        refined = self._curve.refined
        if refined is None or info.name not in refined.scattered or not refined.scattered[info.name][part]:
            return None
        widths = refined.half_widths[info.name]
        return float(widths[part]), float(widths[part + 1])

    def _at_zero(self, answer: Answer, info: ResultInfo) -> ReadAnswer:
        places = np.flatnonzero(self._x == 0.0)
        if not places.size:
            return ReadAnswer(answer, info, info.unit, why="no-case", x=0.0)
        return self._at(answer, info, 0.0)

    def _extreme(self, answer: Answer, info: ResultInfo) -> ReadAnswer:
        values = self._curve.known(info.name)
        kept = np.flatnonzero(np.isfinite(values))
        if not kept.size:
            return ReadAnswer(answer, info, info.unit, why=_why(self._curve.y[info.name], self._curve.endings))
        place = int(kept[_best(values[kept], answer)])
        around = np.unique(self._x[np.isfinite(values)]) if np.all(np.diff(self._x) > 0.0) else self._x[[place]]
        own = int(np.searchsorted(around, self._x[place]))
        low = float(around[own - 1]) if own > 0 else None
        high = float(around[own + 1]) if own + 1 < around.size else None
        edge = around.size > 1 and (low is None or high is None)
        return self._of(answer, info, [place], float(values[place]), low=low, high=high, cases=kept.size, edge=edge)

    def _until_zero(self, answer: Answer, info: ResultInfo) -> ReadAnswer:
        """The last x with a value above 0, and the next one with a case at 0."""
        values = self._curve.known(info.name)
        moving = np.flatnonzero(np.nan_to_num(values) > 0.0)
        at_rest = np.flatnonzero(values == 0.0)
        count = int(np.isfinite(values).sum())
        if not moving.size:
            why: Why = "outside" if at_rest.size else _why(self._curve.y[info.name], self._curve.endings)
            return ReadAnswer(answer, info, info.unit, why=why, cases=count)
        last = int(moving[np.argmax(self._x[moving])])
        after = at_rest[self._x[at_rest] > self._x[last]]
        at = float(self._x[last])
        found = self._of(answer, info, [last], at, low=at, cases=count, half_width=None)
        if not after.size:
            return replace(found, above=True, there=float(values[last]))
        first = int(after[np.argmin(self._x[after])])
        other = int(self._curve.line.cases[first])
        return replace(found, high=float(self._x[first]), other=other)

    def _at(self, answer: Answer, info: ResultInfo, point: float | None) -> ReadAnswer:
        """The value at a point of the axis."""
        nothing = ReadAnswer(answer, info, info.unit, x=point)
        if point is None or not self._x.size:
            return replace(nothing, why="no-case")
        run, values = self._curve.run(), self._curve.known(info.name)
        exact = run[same_places(self._x[run], point)]
        if exact.size:
            place = int(exact[0])
            if not np.isfinite(values[place]):
                kinds = self._curve.regimes
                return replace(
                    nothing,
                    why=_why(self._curve.y[info.name][[place]], [self._curve.endings[place]]),
                    case=int(self._curve.line.cases[place]),
                    regime=None if kinds is None else kinds[place],
                    flags=_split(self._flags, [place]),
                )
            return self._of(answer, info, [place], float(values[place]), cases=1)
        x = self._x[run]
        known = x[np.isfinite(values[run])]
        if not known.size or not known.min() <= point <= known.max():
            pending = any(ending == PENDING for ending in self._curve.endings)
            return replace(nothing, why="no-case" if pending else "outside")
        low, high = float(known[known < point].max()), float(known[known > point].min())
        for stretch in joined_points(self._curve, info.name) or (np.arange(run.size),):
            own = x[stretch]
            if own.size < 2 or not np.all(np.diff(own) > 0.0) or not own[0] < point < own[-1]:
                continue
            after = int(np.searchsorted(own, point))
            places = [int(run[stretch[after - 1]]), int(run[stretch[after]])]
            first, last = float(values[places[0]]), float(values[places[1]])
            if not np.isfinite(first + last):
                continue
            share = (point - self._x[places[0]]) / (self._x[places[1]] - self._x[places[0]])
            found = self._of(
                answer, info, places, first + share * (last - first), cases=2, x=point,
                low=float(self._x[places[0]]), high=float(self._x[places[1]]),
            )  # fmt: skip
            widths = self._band(info, stretch[after - 1])
            return found if widths is None else replace(found, half_width=widths[0] + share * (widths[1] - widths[0]))
        return replace(nothing, why="not-joined", low=low, high=high)
