"""What a document shows of a study, as plain values independent of its form; each part is read when it is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import chain, product
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.exports.inputs import Input, inputs
from sprag_study.service.exports.source import StoredRows, given_texts
from sprag_study.service.faults import SelectionError
from sprag_study.service.figures.clutch import clutch_figure
from sprag_study.service.figures.pictures import MOST_RESULTS, require_drawable
from sprag_study.service.languages import _
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.directions import case_values
from sprag_study.service.reading.quantities import TYPED
from sprag_study.service.reading.reader import Choice, Reading, model_title, reading_for
from sprag_study.service.report.chosen_figures import ChosenFigure, chosen_figures
from sprag_study.service.report.drives import DrivesPart, calibration_part, drives_part
from sprag_study.service.results.curve_cases import draw, draw_map, select
from sprag_study.service.results.curves import Curves, Map
from sprag_study.service.results.defaults import drawn_results, main_query, no_curves, varying_axes
from sprag_study.service.results.key_answer_words import curve_name, curve_named
from sprag_study.service.results.key_answers import answers_query, usual_curve
from sprag_study.service.results.refined import curve_plan
from sprag_study.service.results.refined_maps import map_plan
from sprag_study.service.results.sensitivity import Sensitivity, sensitivity
from sprag_study.service.results.varied import names_in_files
from sprag_study.service.views.answers import answers_in
from sprag_study.service.views.curves import completed_query
from sprag_study.service.views.headline import headline_of
from sprag_study.service.views.study_questions import ReportQuestion
from sprag_study.worker import models
from sprag_study.worker.planning.calibrate.plan import CALIBRATE
from sprag_study.worker.planning.goals.plan import GOAL

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.report.office import Office
    from sprag_study.service.results.calibration import Calibration
    from sprag_study.service.results.curves import CurveQuery, Fetch
    from sprag_study.service.results.fronts import Designs
    from sprag_study.service.results.key_answers import StudyAnswers
    from sprag_study.service.storage.studies.records import Kinds, RowBlock
    from sprag_study.service.views.headline import Headline
    from sprag_study.service.views.library import Library
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

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
class Range:
    """The range of one result over all cases that have it; ``least`` and the others are None where no case has it."""

    info: ResultInfo
    known: int
    least: float | None
    least_case: int | None
    mean: float | None
    largest: float | None
    largest_case: int | None


class Report:
    """A study in its current state as a document shows it, in SI and code names; ``reading`` says how it is read.

    ``question`` has the curves, the working point and what its author wrote, ``office`` is whose document it is. The
    figures that are saved with the study for its report stand in the place of its curves, unless the question names
    results.
    """

    def __init__(
        self, library: Library, study_id: str, choice: Choice, question: ReportQuestion, office: Office
    ) -> None:
        store = library.store
        store.digests.require_undamaged(study_id, anew=True)
        self.library, self.study_id = library, study_id
        self.choice, self.question, self.office = choice, question, office
        self.record, self.progress = store.studies.look(study_id)
        self.spec = store.studies.spec(study_id)
        self.study: Study = store.studies.study(study_id)
        self.infos = models.study_results(self.study)
        self.reading: Reading = reading_for(self.study, self.spec, choice)
        self.fetch: Fetch = partial(store.rows.for_cases, study_id)
        self.title = self.record.name or model_title(self.record.model)
        curves = question.x, question.y, question.by, question.at, question.of
        self.chosen: CurveQuery | None = completed_query(self.study, *curves) if any(curves) else None

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What should be known of the study, for the reader."""
        return tuple(map(self.reading.warning, self.record.warnings))

    @cached_property
    def kinds(self) -> Kinds:
        """How many cases have which regime and which flags."""
        return self.library.store.rows.kinds(self.study_id)

    @cached_property
    def figures(self) -> tuple[ChosenFigure, ...]:
        """The figures that somebody chose for the report."""
        return () if self.question.y else chosen_figures(self.library.store, self.study_id, self.choice)

    @cached_property
    def answers(self) -> StudyAnswers | None:
        """The answers of the chosen curves, otherwise of those that its page shows first; None where they lie on none.

        Raises SelectionError for chosen curves and for a working point that cannot be shown.
        """
        query = answers_query(self.study, self.chosen)
        point = self.question.point or self._place_of_batch(query)
        if query is None and self.study.cases > 1 and not point:
            return None
        try:
            found = answers_in(self.library, self.study_id, self.chosen or query, point)
            if found.drawn is not None:
                require_drawable([found.drawn])
        except SelectionError:
            if self.chosen is not None or self.question.point:
                raise
            return None
        return found

    def _place_of_batch(self, query: CurveQuery | None) -> str | None:
        """The value of the axis at which the answer of a batch holds, which has a case of every drive."""
        at = self.headline.at
        if not self.study.batched or self.chosen is not None or query is None or at is None or at[0] != query.x:
            return None
        unit = unit_of(self.study, query.x)
        return f"{at[1]!r} {'' if unit == '1' else unit}"

    @cached_property
    def curve(self) -> int | None:
        """The place of the curve that is meant: the one that is named, otherwise that of the nominal machine."""
        found = self.answers
        if found is None or not found.curves:
            return None
        named = curve_named([curve_name(one, self.study) for one in found.curves], self.question.curve)
        return usual_curve(self.study, found) if named is None else named

    @cached_property
    def headline(self) -> Headline:
        """The answer in a sentence or two, and its numbers."""
        return headline_of(self.library, self.study_id, self.chosen, self.question.point, self.question.curve)

    @property
    def compares(self) -> bool:
        """Whether it can be told which of several parameters matters most."""
        return self.study.plan is None and len(varying_axes(self.study)) > 1

    @cached_property
    def effects(self) -> tuple[Sensitivity, ...]:
        """What the main results depend on; none where a single axis varies, which is all of it."""
        if not self.compares:
            return ()
        try:
            found = sensitivity(self.study, self.spec, drawn_results(self.study)[:MOST_RESULTS], self.fetch)
        except SelectionError:  # too large a study
            return ()
        return tuple(item for item in found if item.cases)

    @cached_property
    def ranges(self) -> tuple[Range, ...]:
        """The range of each result; reads all rows once."""
        return ranges(self.study.model, self.infos, StoredRows(self.library.store, self.study_id))

    @property
    def left_out(self) -> int:
        """Cases that the ranges leave out because their motion is not settled."""
        flags = self.kinds.flags.items()
        return sum(count for name, count in flags if models.unsettled(self.study.model, [name])[0])

    @cached_property
    def clutch(self) -> Figure | None:
        """The law of the clutch up to the largest windup of any case; None for a machine without one."""
        largest = max((row.largest or 0.0 for row in self.ranges if row.info.name.endswith("windup.max")), default=0.0)
        return clutch_figure(self.study, self.spec, largest)

    @cached_property
    def drives(self) -> DrivesPart | None:
        """What tolerances do; None for a study without them."""
        return drives_part(self.study, self.fetch)

    @cached_property
    def designs(self) -> Designs | None:
        """The designs of a search, ranked; None for another study."""
        return self.library.fronts.of(self.study_id, exact=False) if self.study.kind == GOAL else None

    @cached_property
    def best(self) -> list[int]:
        """The places of the feasible designs of a search, the best first."""
        found = self.designs
        return [] if found is None else [place for place in found.order.tolist() if found.front.feasible[place]]

    @cached_property
    def meant(self) -> dict[str, float | str]:
        """The parameters that a study has found, by their paths: of the best design, or of the fit."""
        if self.designs is not None and self.best:
            return case_values(self.study, int(self.designs.front.cases[self.best[0]][0]))
        if self.calibrated is not None and self.calibrated.answer is not None:
            unknown = self.calibrated.plan.unknown  # gains and offsets come after these values
            values = self.calibrated.answer.values.tolist()
            return {one.paths[0]: value for one, value in zip(unknown, values, strict=False)}
        return {}

    @cached_property
    def calibrated(self) -> Calibration | None:
        """The calibration as far as it has come; None for another study."""
        return self.library.calibrations.of(self.study_id) if self.study.kind == CALIBRATE else None

    @cached_property
    def calibration(self) -> DrivesPart | None:
        """What a calibration has found; None for another study."""
        return None if self.calibrated is None else calibration_part(self.calibrated)

    @cached_property
    def inputs(self) -> tuple[Input, ...]:
        """Every input, defaults included."""
        return inputs(self.study, self.spec)

    @cached_property
    def names(self) -> frozenset[str]:
        """The names of parameters and results in files, those of all parts with ``*`` too."""
        return names_in_files([*(item.path for item in self.inputs), *(info.name for info in self.infos)])

    @property
    def given(self) -> dict[str, str]:
        """The texts of the machine and of its run as they were given, long ones without their ends."""
        return {path: _shortened(text) for path, text in given_texts(self.spec).items()}

    @cached_property
    def further(self) -> tuple[tuple[Curves, ...], str]:
        """The curves of all results that the sheets do not draw, a page each; or why there are none."""
        drawn = None if self.answers is None else self.answers.drawn
        already = frozenset(() if drawn is None else (info.name for info in drawn.selection.results))
        return _pictures(self.study, already, self.fetch)

    @cached_property
    def maps(self) -> tuple[Map, ...]:
        """The refined maps of a study."""
        return _maps(self.study, self.fetch)


def _shortened(text: str) -> str:
    """Truncate a long table; the exports contain all of it."""
    return (
        text
        if len(text) <= _LONGEST_GIVEN
        else _("{text} ... ({count} characters in all)", text=text[:_LONGEST_GIVEN], count=len(text))
    )


def ranges(model: str, infos: Sequence[ResultInfo], blocks: Iterable[RowBlock]) -> tuple[Range, ...]:
    """Least, mean and largest of every result over the rows, with the first case that has the extreme.

    Rows that are not usable (`sprag_study.worker.models.usable`) are left out: a case that failed keeps what could be
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


def _pictures(study: Study, already: frozenset[str], fetch: Fetch) -> tuple[tuple[Curves, ...], str]:
    """The study's main curves of all results but those ``already`` drawn, a page each; or why there are none."""
    query = main_query(study)
    if query is None:
        return (), "" if study.plan is not None else _(no_curves(study))
    if study.plan is not None and curve_plan(study) is None:  # its cases lie on no curves
        return (), ""
    checks = models.presentation_of(study).checks
    chosen = _in_groups([info for info in models.study_results(study) if info.name not in already], checks)
    if not chosen:
        return (), ""
    try:
        whole = draw(select(study, replace(query, y=tuple(info.name for info in chosen))), fetch)
        shown = [info for info in chosen if varies(whole, info)][:_MOST_RESULTS]
        groups = [shown[start : start + _RESULTS_A_PICTURE] for start in range(0, len(shown), _RESULTS_A_PICTURE)]
        parts = tuple(replace(whole, selection=replace(whole.selection, results=tuple(group))) for group in groups)
        for part in parts:
            require_drawable([part])
    except SelectionError as error:
        return (), _("There are no curves here: {why}.", why=error)
    return parts, ""


def varies(drawn: Curves, info: ResultInfo) -> bool:
    """Whether curves show more of a result than its value in the table of ranges."""
    values = np.concatenate([curve.y[info.name] for curve in drawn.curves])
    known = values[np.isfinite(values)]
    return bool(known.size and np.ptp(known) > _SAME * np.abs(known).max())


def _maps(study: Study, fetch: Fetch) -> tuple[Map, ...]:
    """The refined maps of a study: one for each result that was asked for and each combination of the other axes."""
    plan = map_plan(study)
    if plan is None:
        return ()
    y, x = (axis.paths[0] for axis in plan.adaptive)
    held = product(*([(axis.paths[0], repr(value)) for value in axis.values] for axis in plan.fixed))
    every = [(name, at) for at in held for name in plan.results][:_MOST_MAPS]
    return tuple(draw_map(study, x, y, name, at, fetch) for name, at in every)


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
