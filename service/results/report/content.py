"""The content of a report as plain values, independent of its format."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag.service.results.curve_cases import draw, draw_map, select
from sprag.service.results.curves import Curves, Fetch, Map
from sprag.service.results.defaults import main_query
from sprag.service.results.directions import ends_in_words
from sprag.service.results.exports.inputs import Input, inputs, run_inputs
from sprag.service.results.exports.source import given_texts
from sprag.service.results.pictures.curves import require_drawable
from sprag.service.results.refined_maps import map_plan
from sprag.service.results.regimes import counted
from sprag.service.results.report.calibration import calibration_part
from sprag.service.results.report.drives import DrivesPart, drives_part
from sprag.service.results.rounds import sentence
from sprag.service.results.selection import SelectionError
from sprag.service.spec.catalogue import axes_json
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.storage.records import RowBlock, StudyRecord
    from sprag.service.storage.store import Store
    from sprag.worker.models import ResultInfo
    from sprag.worker.study import Study

#: Half widths of means appear in the table beside their means.
_HALF_WIDTH: Final = ".half_width"
_RESULTS_A_PICTURE: Final = 3
_MOST_PICTURES: Final = 24
_LONGEST_GIVEN: Final = 1000


@dataclass(frozen=True, slots=True)
class AxisRow:
    """One axis as a line of a table."""

    paths: str
    unit: str
    values: int
    first: float | str
    last: float | str


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
    """The content of a report."""

    title: str
    facts: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]
    axes: tuple[AxisRow, ...]
    run: tuple[Input, ...]
    endings: tuple[tuple[str, int, str], ...]
    inputs: tuple[Input, ...]
    given: dict[str, str]
    ranges: tuple[Range, ...]
    pictures: tuple[Curves, ...]
    maps: tuple[Map, ...]
    note: str
    drives: DrivesPart | None
    calibration: DrivesPart | None = None


def report_of(store: Store, study_id: str) -> Report:
    """The report of a stored study; raises StudyNotFoundError."""
    record, progress = store.look(study_id)
    report = make_report(
        record,
        store.study(study_id),
        progress.endings,
        store.iter_rows(study_id),
        partial(store.rows_for_cases, study_id),
        store.spec(study_id),
        store.kinds(study_id).regimes,
    )
    if progress.rounds is None:
        return report
    study, rows = store.study(study_id), partial(store.rows_for_cases, study_id)
    return replace(
        report,
        facts=(*report.facts, ("rounds", sentence(progress.rounds))),
        calibration=calibration_part(study, store.rounds(study_id), rows),
    )


def make_report(
    record: StudyRecord,
    study: Study,
    endings: dict[str, int],
    blocks: Iterable[RowBlock],
    fetch: Fetch,
    spec: Mapping[str, Any],
    regimes: Mapping[str, int],
) -> Report:
    """The report of a study in its current state; reads all its rows once. ``spec`` is the user's own.

    ``regimes`` counts the cases of each regime, the most frequent first.
    """
    infos = models.study_results(study)
    pictures, note = _pictures(study, infos, fetch)
    return Report(
        record.name or record.model,
        _facts(record, study) + ((("motions", counted(regimes)),) if regimes else ()),
        record.warnings,
        tuple(AxisRow(", ".join(a["paths"]), a["unit"], a["values"], *ends_in_words(a)) for a in axes_json(study)),
        run_inputs(study, spec),
        tuple((name, count, models.ENDING_SENTENCES.get(name, "")) for name, count in endings.items()),
        inputs(study, spec),
        {path: _shortened(text) for path, text in given_texts(spec).items()},
        ranges(infos, blocks),
        pictures,
        _maps(study, infos, fetch),
        note,
        drives_part(study, infos, fetch),
    )


def _shortened(text: str) -> str:
    """Truncate a long table; the exports contain all of it."""
    return text if len(text) <= _LONGEST_GIVEN else f"{text[:_LONGEST_GIVEN]} ... ({len(text)} characters in all)"


def _facts(record: StudyRecord, study: Study) -> tuple[tuple[str, str], ...]:
    ended = record.finished_at
    return (
        ("study", record.id),
        ("model", record.model),
        ("state", f"{record.state.value}: {record.state.sentence}"),
        ("cases", f"{record.cases:,}, of which {record.done:,} are done and {record.ok:,} ended ok"),
        ("axes", _combined(study)),
        ("submitted", f"{record.created_at:%Y-%m-%d %H:%M} UTC"),
        ("ended", "not yet" if ended is None else f"{ended:%Y-%m-%d %H:%M} UTC"),
        ("engine", record.engine_version),
        ("hash of the physics", record.physics_hash),
    )


def _combined(study: Study) -> str:
    if study.plan is not None:
        return "cases chosen in rounds"
    return {"grid": "every combination", "zip": "side by side"}[study.combine] if study.axes else "none"


def ranges(infos: Sequence[ResultInfo], blocks: Iterable[RowBlock]) -> tuple[Range, ...]:
    """Least, mean and largest of every result over the rows, with the first case that has the extreme."""
    columns = [index for index, info in enumerate(infos) if info.kind != "category"]
    every = np.arange(len(columns))
    known, total = np.zeros(every.size, dtype=np.int64), np.zeros(every.size)
    # Value and case of the least and largest value of each result.
    value = {np.less: np.full(every.size, np.inf), np.greater: np.full(every.size, -np.inf)}
    case = {better: np.zeros(every.size, dtype=np.int64) for better in value}
    for block in blocks:
        values = block.values[:, columns]
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


def _pictures(study: Study, infos: tuple[ResultInfo, ...], fetch: Fetch) -> tuple[tuple[Curves, ...], str]:
    """The study's main curve for each group of related results; or why there is none."""
    query = main_query(study, infos)
    if query is None:
        return (), "Nothing varies in this study, so there is no curve."
    if map_plan(study) is not None:
        return (), ""
    groups = list(_groups(infos, models.presentation_of(study).checks))
    chosen = [info for group in groups for info in group]
    try:
        whole = draw(select(study, infos, replace(query, y=tuple(info.name for info in chosen))), fetch)
        require_drawable([_part(whole, groups[0])])
    except SelectionError as error:
        return (), f"There are no curves here: {error}."
    return tuple(_part(whole, group) for group in groups), ""


def _maps(study: Study, infos: tuple[ResultInfo, ...], fetch: Fetch) -> tuple[Map, ...]:
    """The refined maps of a study: one for each result that was asked for and each combination of the other axes."""
    plan = map_plan(study)
    if plan is None:
        return ()
    y, x = (axis.paths[0] for axis in plan.adaptive)
    held = product(*([(axis.paths[0], repr(value)) for value in axis.values] for axis in plan.fixed))
    every = [(name, at) for at in held for name in plan.results][:_MOST_PICTURES]
    return tuple(draw_map(study, infos, x, y, name, at, fetch) for name, at in every)


def _groups(infos: Sequence[ResultInfo], checks: tuple[str, ...]) -> Iterator[tuple[ResultInfo, ...]]:
    """Results of one unit and one part of the machine, a few at a time."""
    found: dict[tuple[str, ...], list[ResultInfo]] = {}
    for info in infos:
        first, *rest = info.name.split(".")
        if first in checks or info.kind != "real" or info.name.endswith(_HALF_WIDTH):
            continue
        part = f"{first}.{rest[0]}" if rest and rest[0].isdigit() else first
        found.setdefault((part, info.unit), []).append(info)
    every = (
        tuple(group[start : start + _RESULTS_A_PICTURE])
        for group in found.values()
        for start in range(0, len(group), _RESULTS_A_PICTURE)
    )
    yield from list(every)[:_MOST_PICTURES]


def _part(whole: Curves, group: tuple[ResultInfo, ...]) -> Curves:
    return replace(whole, selection=replace(whole.selection, results=group))
