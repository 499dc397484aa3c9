"""The content of a report as plain values, independent of its format."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, product
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.service.exports.inputs import Input, inputs
from sprag.service.exports.source import StoredRows, given_texts
from sprag.service.faults import SelectionError
from sprag.service.figures.answers import answers_figure
from sprag.service.figures.clutch import clutch_figure
from sprag.service.figures.pictures.curves import require_drawable
from sprag.service.figures.pictures.sensitivity import MOST_RESULTS
from sprag.service.languages import _
from sprag.service.reading.catalogue import axes_json
from sprag.service.reading.directions import ends_in_words
from sprag.service.reading.quantities import TYPED
from sprag.service.reading.reader import Choice, Reading, model_title, reading_for, shown
from sprag.service.report.calibration import calibration_part
from sprag.service.report.chosen_figures import ChosenFigure, chosen_figures
from sprag.service.report.drives import DrivesPart, drives_part
from sprag.service.report.facts import facts_of
from sprag.service.results.curve_cases import draw, draw_map, select
from sprag.service.results.curves import Curves, Fetch, Map
from sprag.service.results.defaults import caption, drawn_results, main_query, no_curves, varying_axes
from sprag.service.results.fronts import goal_units
from sprag.service.results.key_answer_words import answer_facts, curve_name, note_of, said_title
from sprag.service.results.key_answers import answers_query, find_answers
from sprag.service.results.refined import curve_plan
from sprag.service.results.refined_maps import map_plan
from sprag.service.results.regimes import counted
from sprag.service.results.rounds import sentence
from sprag.service.results.sensitivity import Sensitivity, sensitivity
from sprag.service.results.shown_inputs import run_settings
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.figures.figure import Figure
    from sprag.service.results.curves import CurveQuery
    from sprag.service.results.key_answers import Found, StudyAnswers
    from sprag.service.storage.store import Store
    from sprag.service.storage.studies.records import Kinds, RowBlock, StudyRecord
    from sprag.worker.models import ResultInfo
    from sprag.worker.study import Study

#: Half widths of means appear in the table beside their means.
_HALF_WIDTH: Final = ".half_width"
#: Results in one picture of further results, which fills a page, and the most results that are drawn.
_RESULTS_A_PICTURE: Final = 12
_MOST_RESULTS: Final = 48
#: Difference of values, as a share of them, up to which a result is the same in all points.
_SAME: Final = 1e-9
_MOST_MAPS: Final = 24
_LONGEST_GIVEN: Final = 1000
#: How a document for people is read unless something else is asked for.
AS_TYPED: Final = Choice(TYPED)


@dataclass(frozen=True, slots=True)
class AxisRow:
    """One axis as a line of a table."""

    paths: str
    unit: str
    values: int
    least: float | str
    largest: float | str


@dataclass(frozen=True, slots=True)
class Range:
    """The range of one result over all cases that have it; ``least`` and the others are None where no case has it."""

    info: ResultInfo
    known: int
    least: float | None
    least_case: int | None
    mean: float | None
    largest: float | None
    largest_case: int | None


@dataclass(frozen=True, slots=True)
class Report:
    """The content of a report, in SI and code names; ``reading`` says how it is read.

    ``main`` are the curves of the answers, with these marked on them; ``answers`` the rows of their table.
    ``left_out`` are the cases that the ranges leave out because their motion is not settled. ``figures``
    are those that somebody chose for the report, in the place of ``main``, of ``pictures`` and of the maps.
    """

    title: str
    study: Study
    facts: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]
    axes: tuple[AxisRow, ...]
    run: list[tuple[str, str, Input]]
    endings: tuple[tuple[str, int, str], ...]
    inputs: tuple[Input, ...]
    given: dict[str, str]
    ranges: tuple[Range, ...]
    pictures: tuple[Curves, ...]
    maps: tuple[Map, ...]
    note: str
    drives: DrivesPart | None
    reading: Reading
    main: Figure | None
    main_caption: str
    answers: tuple[tuple[str, ...], ...]
    clutch: Figure | None
    left_out: int
    kinds: tuple[tuple[str, int, str], ...]
    calibration: DrivesPart | None = None
    figures: tuple[ChosenFigure, ...] = ()
    effects: tuple[Sensitivity, ...] = ()


def report_of(
    store: Store,
    study_id: str,
    choice: Choice = AS_TYPED,
    chosen: CurveQuery | None = None,
    point: str | None = None,
    *,
    saved: bool = True,
) -> Report:
    """The report of a stored study, with the figures that are ``saved`` with the study for it; without them, or where
    there are none, with the ``chosen`` curves, by default those of its page.

    Its answers are those of the chosen curves, and at the working ``point`` as typed.

    Raises StudyNotFoundError, SelectionError for curves, points and units that the study does not have, and
    DatabaseError where its rows are not those that were stored.
    """
    store.digests.require_undamaged(study_id, anew=True)
    record, progress = store.studies.look(study_id)
    spec, study = store.studies.spec(study_id), store.studies.study(study_id)
    report = make_report(
        record,
        study,
        progress.endings,
        StoredRows(store, study_id),
        partial(store.rows.for_cases, study_id),
        spec,
        store.rows.kinds(study_id),
        reading_for(study, spec, choice),
        chosen,
        chosen_figures(store, study_id, choice) if saved else (),
        point,
    )
    origins = "; ".join(origin.sentence for origin in store.rows.origins(study_id))
    report = replace(report, facts=(*report.facts, (_("computed by"), origins or _("no host yet"))))
    if progress.rounds is None:
        return report
    rows = partial(store.rows.for_cases, study_id)
    return replace(
        report,
        facts=(
            *report.facts,
            (_("rounds"), report.reading.say(sentence(progress.rounds, record.state, goal_units(study)))),
        ),
        calibration=calibration_part(study, store.studies.rounds(study_id), rows),
    )


def make_report(
    record: StudyRecord,
    study: Study,
    endings: dict[str, int],
    blocks: Iterable[RowBlock],
    fetch: Fetch,
    spec: Mapping[str, Any],
    kinds: Kinds,
    reading: Reading,
    chosen: CurveQuery | None = None,
    figures: tuple[ChosenFigure, ...] = (),
    point: str | None = None,
) -> Report:
    """The report of a study in its current state; reads all its rows once. ``spec`` is the user's own."""
    infos = models.study_results(study)
    left_out = sum(count for name, count in kinds.flags.items() if models.unsettled(study.model, [name])[0])
    every = ranges(study.model, infos, blocks)
    found = _answers_of(study, infos, chosen, point, fetch)
    drawn = None if found is None or figures else found.drawn
    already = frozenset(() if drawn is None else (info.name for info in drawn.selection.results))
    pictures, note = ((), "") if figures else _pictures(study, infos, already, fetch)
    main = None if found is None or drawn is None else answers_figure(found, 2)
    return Report(
        record.name or model_title(record.model),
        study,
        facts_of(record, study, spec) + (((_("motions"), shown(counted(kinds.regimes))),) if kinds.regimes else ()),
        record.warnings,
        tuple(AxisRow(" = ".join(a["paths"]), a["unit"], a["values"], *ends_in_words(a)) for a in axes_json(study)),
        run_settings(study, spec, reading),
        tuple((name, count, _(models.ENDING_SENTENCES.get(name, ""))) for name, count in endings.items()),
        inputs(study, spec),
        {path: _shortened(text) for path, text in given_texts(spec).items()},
        every,
        pictures,
        () if figures else _maps(study, infos, fetch),
        note,
        drives_part(study, infos, fetch),
        reading,
        main,
        "" if found is None or found.query is None else caption(study, found.query).said(reading),
        () if found is None else tuple(_answer_rows(found, study, reading)),
        clutch_figure(study, spec, _largest_windup(every)),
        left_out,
        (*_kind_rows(kinds.regimes, models.REGIME_SENTENCES), *_flag_rows(study, kinds)),
        figures=figures,
        effects=_effects(study, infos, spec, fetch),
    )


def _answers_of(
    study: Study, infos: tuple[ResultInfo, ...], chosen: CurveQuery | None, point: str | None, fetch: Fetch
) -> StudyAnswers | None:
    """The answers of the chosen curves, otherwise of those that the page shows first; None where they lie on none.

    Raises SelectionError for chosen curves and for a working point that cannot be shown.
    """
    query = answers_query(study, infos, chosen)
    if query is None and study.cases > 1 and not point:
        return None
    try:
        found = find_answers(study, infos, query if chosen is None else chosen, point, fetch)
        if found.drawn is not None:
            require_drawable([found.drawn])
    except SelectionError:
        if chosen is not None or point:
            raise
        return None
    return found


def _effects(
    study: Study, infos: tuple[ResultInfo, ...], spec: Mapping[str, Any], fetch: Fetch
) -> tuple[Sensitivity, ...]:
    """What the results of the page "Sensitivity" depend on; none where a single axis varies, which is all of it."""
    if len(varying_axes(study)) < 2 or study.plan is not None:
        return ()
    try:
        found = sensitivity(study, spec, drawn_results(study, infos)[:MOST_RESULTS], fetch)
    except SelectionError:  # too large a study
        return ()
    return tuple(item for item in found if item.cases)


def _answer_rows(found: StudyAnswers, study: Study, reading: Reading) -> Iterator[tuple[str, ...]]:
    """Title, value, place and note of each answer; a row with the curve before those of each of several."""
    for one in found.curves:
        name = curve_name(one, study).said(reading)
        if name and len(found.curves) > 1:
            yield (_("Curve {name}", name=name), "", "", "")
        # Answers of a model may be among the main results at the working point.
        yield from dict.fromkeys(_answer_row(item, found.unit, reading) for item in (*one.answers, *one.working_point))


def _answer_row(item: Found, unit: str, reading: Reading) -> tuple[str, str, str, str]:
    title = item.answer.title
    title = reading.say_name(title) if title == item.answer.result else said_title(title, reading)
    sign = "> " if item.above and item.value is not None else ""
    value = "–" if item.value is None else sign + reading.quantity(item.value, item.unit)
    place = "" if item.x is None else reading.quantity(item.x, unit)
    return (title, value, place, note_of(answer_facts(item), unit).said(reading))


def _largest_windup(every: Sequence[Range]) -> float:
    """The largest windup of a clutch in any case (rad); 0 where none is known."""
    return max((row.largest or 0.0 for row in every if row.info.name.endswith("windup.max")), default=0.0)


def _kind_rows(counts: Mapping[str, int], meanings: Mapping[str, str]) -> Iterator[tuple[str, int, str]]:
    return ((name, count, _(meanings.get(name, ""))) for name, count in counts.items())


def _flag_rows(study: Study, kinds: Kinds) -> Iterator[tuple[str, int, str]]:
    """The flags; those of regimes stand with the regimes."""
    flags = {name: count for name, count in kinds.flags.items() if name not in models.REGIME_SENTENCES}
    return _kind_rows(flags, models.flags_of(study.model))


def _shortened(text: str) -> str:
    """Truncate a long table; the exports contain all of it."""
    return (
        text
        if len(text) <= _LONGEST_GIVEN
        else _("{text} ... ({count} characters in all)", text=text[:_LONGEST_GIVEN], count=len(text))
    )


def ranges(model: str, infos: Sequence[ResultInfo], blocks: Iterable[RowBlock]) -> tuple[Range, ...]:
    """Least, mean and largest of every result over the rows, with the first case that has the extreme.

    Rows that are not usable (`sprag.worker.models.usable`) are left out: a case that failed keeps what could be
    computed, and that of an unstable motion is not the machine's.
    """
    columns = [index for index, info in enumerate(infos) if info.kind != "category"]
    names = [infos[index].name for index in columns]
    every = np.arange(len(columns))
    known, total = np.zeros(every.size, dtype=np.int64), np.zeros(every.size)
    # Value and case of the least and largest value of each result.
    value = {np.less: np.full(every.size, np.inf), np.greater: np.full(every.size, -np.inf)}
    case = {better: np.zeros(every.size, dtype=np.int64) for better in value}
    for block in blocks:
        usable = models.usable_each(model, block.endings, block.flags, names)
        counts = np.array([usable[name] for name in names]).reshape(len(names), len(block.endings)).T
        values = np.where(counts, block.values[:, columns], np.nan)
        there = ~np.isnan(values)
        known += there.sum(axis=0)
        total += np.where(there, values, 0.0).sum(axis=0)
        for better, best in value.items():
            filled = np.where(there, values, np.inf if better is np.less else -np.inf)
            at = filled.argmin(axis=0) if better is np.less else filled.argmax(axis=0)
            new = better(filled[at, every], best)
            best[new], case[better][new] = filled[at, every][new], block.cases[at[new]]
    found = zip(
        [infos[index] for index in columns],
        known.tolist(),
        value[np.less].tolist(),
        case[np.less].tolist(),
        (total / np.maximum(known, 1)).tolist(),
        value[np.greater].tolist(),
        case[np.greater].tolist(),
        strict=True,
    )
    return tuple(Range(*row) if row[1] else Range(row[0], 0, None, None, None, None, None) for row in found)


def _pictures(
    study: Study, infos: tuple[ResultInfo, ...], already: frozenset[str], fetch: Fetch
) -> tuple[tuple[Curves, ...], str]:
    """The study's main curves of all results but those ``already`` drawn, a page each; or why there are none."""
    query = main_query(study, infos)
    if query is None:
        return (), "" if study.plan is not None else _(no_curves(study))
    if study.plan is not None and curve_plan(study) is None:  # its cases lie on no curves
        return (), ""
    checks = models.presentation_of(study).checks
    chosen = _in_groups([info for info in infos if info.name not in already], checks)
    if not chosen:
        return (), ""
    try:
        whole = draw(select(study, infos, replace(query, y=tuple(info.name for info in chosen))), fetch)
        shown = [info for info in chosen if _varies(whole, info)][:_MOST_RESULTS]
        groups = [shown[start : start + _RESULTS_A_PICTURE] for start in range(0, len(shown), _RESULTS_A_PICTURE)]
        parts = tuple(replace(whole, selection=replace(whole.selection, results=tuple(group))) for group in groups)
        for part in parts:
            require_drawable([part])
    except SelectionError as error:
        return (), _("There are no curves here: {why}.", why=error)
    return parts, ""


def _varies(drawn: Curves, info: ResultInfo) -> bool:
    """Whether curves show more of a result than its value in the table of ranges."""
    values = np.concatenate([curve.y[info.name] for curve in drawn.curves])
    known = values[np.isfinite(values)]
    return bool(known.size and np.ptp(known) > _SAME * np.abs(known).max())


def _maps(study: Study, infos: tuple[ResultInfo, ...], fetch: Fetch) -> tuple[Map, ...]:
    """The refined maps of a study: one for each result that was asked for and each combination of the other axes."""
    plan = map_plan(study)
    if plan is None:
        return ()
    y, x = (axis.paths[0] for axis in plan.adaptive)
    held = product(*([(axis.paths[0], repr(value)) for value in axis.values] for axis in plan.fixed))
    every = [(name, at) for at in held for name in plan.results][:_MOST_MAPS]
    return tuple(draw_map(study, infos, x, y, name, at, fetch) for name, at in every)


def _in_groups(infos: Sequence[ResultInfo], checks: tuple[str, ...]) -> list[ResultInfo]:
    """The results that curves are drawn of, those of one part of the machine and of one unit side by side."""
    found: dict[tuple[str, ...], list[ResultInfo]] = {}
    for info in infos:
        first, *rest = info.name.split(".")
        if first in checks or info.kind != "real" or info.name.endswith(_HALF_WIDTH):
            continue
        part = f"{first}.{rest[0]}" if rest and rest[0].isdigit() else first
        found.setdefault((part, info.unit), []).append(info)
    return list(chain.from_iterable(found.values()))
