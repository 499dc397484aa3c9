"""All cases of a study at once: chosen by ranges of inputs and results and by kind, sorted, counted in histograms."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Sentence, joined, plural
from sprag_study.service import exports
from sprag_study.service.answers.explore import Exploration, ExploredCase, Histogram
from sprag_study.service.faults import refused
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import result_of, unit_of
from sprag_study.service.reading.directions import case_values
from sprag_study.service.reading.limits import at_most
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.reading.units import plain_signs
from sprag_study.service.results.regimes import kind_columns
from sprag_study.service.results.selection import listed, locate_axes, own_paths, refuse_mixed_texts, value_of
from sprag_study.worker import models
from sprag_study.worker.codes import FLAG_MASKS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.storage.rows.columns import RowColumns
    from sprag_study.worker.arrays import Bools, Floats, Ints
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

#: What a range may look like.
EXAMPLES: Final = N_("for instance shaft.load <= 2 N*m or efficiency >= 0.5")
#: Most ranges and quantities of one question.
MOST_RANGES, MOST_SHOWN = 40, 12
ROWS: Final = 50
BINS: Final = 24

#: What every case can be sorted by.
_ALWAYS: Final = ("case", "ending", "flags")
_FORM: Final = re.compile(r"\s*([A-Za-z][\w.]*|[A-Za-z][^<>≥≤]*\))\s*(>=|<=|≥|≤)\s*(.+?)\s*")


@dataclass(frozen=True, slots=True)
class ExploreQuery:
    """Which cases: ``where`` are texts such as ``shaft.load <= 2 N*m``, all of which must hold.

    ``at`` holds axes at a value: pairs of path and text. ``ending``, ``regime`` and ``flag`` keep one kind, "" any.
    Rows are ordered by ``sort``, a parameter, a result, "case", "ending", "flags" (none first) or the regime, with "-"
    before it from the largest down; cases without it come last, and equal ones in the order of their numbers. Only
    those ``after`` a case are ordered. ``show`` are the quantities of histograms and rows, by default the axes and the
    model's own columns; values are found of those ``also``. Where there is ``only`` some, other cases are left out, and
    those ``without`` which the rest is wanted.
    """

    where: tuple[str, ...] = ()
    ending: str = ""
    regime: str = ""
    flag: str = ""
    sort: str = "case"
    limit: int = ROWS
    show: tuple[str, ...] = ()
    at: tuple[tuple[str, str], ...] = ()
    after: After | None = None
    also: tuple[str, ...] = ()
    only: tuple[int, ...] = ()
    without: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class After:
    """The last case of the rows before, and the value (SI; NaN: none) by which it was sorted."""

    value: float
    case: int


@dataclass(frozen=True, slots=True)
class Range:
    """One condition: a limit (SI) from below or above."""

    name: str
    at_least: bool
    limit: float


@dataclass(frozen=True, slots=True)
class Further:
    """What is known of some cases beyond their rows: those of the designs of a search, which has no others then.

    Attributes
    ----------
    infos : tuple of ResultInfo
        What it is called; a result of this name is that of the case no more.
    cases : int64 array, shape (m,)
        Ascending.
    values : dict of float64 arrays, each shape (m,)
        SI, by name.
    keys : dict of float64 arrays, each shape (m,)
        What cases are sorted by in the place of a value.
    """

    infos: tuple[ResultInfo, ...]
    cases: Ints
    values: dict[str, Floats]
    keys: dict[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Condition:
    """What one condition does: ``kept`` cases are within it alone, and ``left_out`` ones miss no other one.

    ``name`` is the quantity of ranges, or a parameter of the address such as "ending".
    """

    name: str
    kept: int
    left_out: int


@dataclass(frozen=True, slots=True)
class Plan:
    """A question whose names and values have been checked; ``results`` are those that it needs of the rows.

    ``fixed`` are axes that are held, by their place, and the index of the value; ``units`` those of all that can be
    asked about.
    """

    query: ExploreQuery
    ranges: tuple[Range, ...]
    fixed: dict[int, int]
    shown: tuple[str, ...]
    sort: str
    descending: bool
    regime: ResultInfo | None
    results: tuple[str, ...]
    units: dict[str, str]


@dataclass(frozen=True, slots=True)
class Explored:
    """The cases that a question selects.

    Attributes
    ----------
    known : number of finished cases
    selected : bool array, shape (known,)
    order : int64 array
        Places of the first rows in their order, at most as many as asked for.
    keys : float64 array, shape (known,)
        What they are sorted by.
    values : columns of the quantities that are shown, or wanted also, over all finished cases
    conditions : what each condition of the question does alone
    """

    study: Study
    plan: Plan
    rows: RowColumns
    known: int
    selected: Bools
    order: Ints
    keys: Floats
    values: dict[str, Floats] = field(default_factory=dict)
    conditions: tuple[Condition, ...] = ()

    @property
    def count(self) -> int:
        """Number of selected cases."""
        return int(np.count_nonzero(self.selected))

    @property
    def infos(self) -> tuple[ResultInfo, ...]:
        """All results of the study."""
        return tuple(models.study_results(self.study))


def plan_of(study: Study, query: ExploreQuery, further: Sequence[ResultInfo] = ()) -> Plan:
    """Check a question; raises SelectionError for unknown names, categories and values that cannot be read.

    ``further`` is what can be asked about beyond the results of cases, as in `Further`.
    """
    own = {info.name for info in further}
    infos = [*further, *(info for info in models.study_results(study) if info.name not in own)]
    units, regime = _quantities(study, infos), models.regime_info(infos)
    if len(query.where) > MOST_RANGES:
        raise refused(
            "where",
            "too-many",
            plural("{count} range is given", "{count} ranges are given", len(query.where)),
            allowed=at_most(MOST_RANGES),
        )
    if len(query.show) > MOST_SHOWN:
        raise refused(
            "show",
            "too-many",
            plural("{count} quantity is given", "{count} quantities are given", len(query.show)),
            allowed=at_most(MOST_SHOWN),
        )
    pairs = [(parts[1], parts[3]) for text in query.where if (parts := _FORM.fullmatch(plain_signs(text)))]
    if pairs:
        refuse_mixed_texts("where", pairs, units)
    ranges = tuple(_range(study, infos, units, text) for text in query.where)
    if query.regime and (regime is None or query.regime not in regime.categories):
        allowed = Sentence("no regime: this study has none") if regime is None else listed(regime.categories)
        raise refused("regime", "invalid-choice", "is not a regime", query.regime, allowed=allowed)
    _kind("ending", query.ending, models.endings_of(study.model))
    _kind("flag", query.flag, models.flags_of(study.model))
    fixed = {axis: index for axis, (_, index) in locate_axes(study, query.at).items()}
    descending, sort = query.sort.startswith("-"), query.sort.removeprefix("-")
    kinds = _ALWAYS if regime is None else (*_ALWAYS, regime.name)
    if sort not in kinds:
        _require(study, infos, "sort", sort, kinds)
    shown = tuple(dict.fromkeys(query.show)) or usual_quantities(study, infos)
    for name in (*shown, *query.also):
        _require(study, infos, "show", name)
    named = dict.fromkeys([*shown, *query.also, *(one.name for one in ranges), sort])
    needed = [name for name in named if name not in own and result_of(infos, name)]
    needed += [regime.name] if regime is not None and regime.name not in needed else []
    return Plan(query, ranges, fixed, shown, sort, descending, regime, tuple(needed), units)


def usual_quantities(study: Study, infos: Sequence[ResultInfo]) -> tuple[str, ...]:
    """What is shown first: the parameters that vary, the study's quantities, and numbers of the model's table."""
    asked = [one.name for one in study.quantities]
    columns = [name for name in models.presentation_of(study).columns if _numeric(infos, name)]
    results = columns or [info.name for info in infos if info.kind != "category" and info.name not in asked][:5]
    return (*own_paths(study), *asked, *results)[:MOST_SHOWN]


def _quantities(study: Study, infos: Sequence[ResultInfo]) -> dict[str, str]:
    """Units of everything that ranges, order and histograms can be about, by name."""
    units = {path: unit_of(study, path) for path in study.column_paths}
    return units | {info.name: info.unit for info in infos if info.kind != "category"}


def explore(study: Study, plan: Plan, rows: RowColumns, further: Further | None = None) -> Explored:
    """The cases that a checked question selects, of a study whose finished cases have these ``rows``."""
    if further is not None:
        rows = _of_cases(rows, further.cases)
    known = len(rows.cases)
    parameters = study.columns(rows.cases) if known else {}
    endings, flags = [ending for ending, _ in rows.kinds], [own for _, own in rows.kinds]
    kinds = kind_columns(plan.regime)
    results = {
        name: values
        if name in kinds or not known
        else np.where(models.usable(study.model, endings, flags, name)[rows.kind], values, np.nan)
        for name, values in rows.values.items()
    }
    every = {**results, **(further.values if further else {}), **parameters}
    empty = np.empty(0)
    masks = _masks(study, plan, rows, every)
    selected = np.logical_and.reduce(list(masks.values())) if masks else np.ones(known, dtype=np.bool_)
    places = np.flatnonzero(selected).astype(np.int64)
    keys = rows.cases.astype(np.float64) if plan.sort == "case" else every.get(plan.sort, empty)
    if plan.sort in ("ending", "flags") and known:
        keys = np.array(_kind_keys(plan.sort, rows.kinds))[rows.kind]
    elif further is not None:
        keys = further.keys.get(plan.sort, keys)
    query = plan.query
    if query.after is not None:
        places = _beyond(places, keys, rows.cases, query.after, descending=plan.descending)
    order = _first(places, keys, query.limit, descending=plan.descending)
    shown = {name: every.get(name, empty) for name in (*plan.shown, *query.also)}
    return Explored(study, plan, rows, known, selected, order, keys, shown, tuple(_alone(masks)))


def _of_cases(rows: RowColumns, cases: Ints) -> RowColumns:
    """The rows of these cases, all of which have one."""
    at = np.searchsorted(rows.cases, cases)
    return replace(
        rows, cases=cases, kind=rows.kind[at], values={name: values[at] for name, values in rows.values.items()}
    )


def _masks(study: Study, plan: Plan, rows: RowColumns, every: Mapping[str, Floats]) -> dict[str, Bools]:
    """Which cases are within each condition: bool arrays, shape (known,)."""
    query, empty = plan.query, np.empty(0)
    found: dict[str, Bools] = {}
    for one in plan.ranges:
        values = every.get(one.name, empty)
        within = values >= one.limit if one.at_least else values <= one.limit
        found[one.name] = found[one.name] & within if one.name in found else within
    if plan.fixed:
        held = study.cases_at({study.axes[i].paths[0]: study.axes[i].value(index) for i, index in plan.fixed.items()})
        found["at"] = np.isin(rows.cases, held)
    of_kind = {
        "ending": [not query.ending or ending == query.ending for ending, _ in rows.kinds],
        "flag": [not query.flag or query.flag in flags.split(",") for _, flags in rows.kinds],
    }
    found |= {name: np.array(kept, dtype=np.bool_)[rows.kind] for name, kept in of_kind.items() if not all(kept)}
    if query.regime and plan.regime is not None:
        found["regime"] = rows.values[plan.regime.name] == plan.regime.categories.index(query.regime)
    if query.only:
        found["only"] = np.isin(rows.cases, query.only)
    if query.without:
        found["without"] = ~np.isin(rows.cases, query.without)
    return found


def _alone(masks: Mapping[str, Bools]) -> Iterator[Condition]:
    """What each condition does alone."""
    missed = sum((~mask for mask in masks.values()), np.zeros(1, dtype=np.int64))
    for name, mask in masks.items():
        yield Condition(name, int(np.count_nonzero(mask)), int(np.count_nonzero(~mask & (missed == 1))))


def _kind_keys(sort: str, kinds: Sequence[tuple[str, str]]) -> list[float]:
    """The keys of pairs of ending and flags, by all that there are: more occur while a reader turns pages."""
    if sort == "flags":
        return [float(sum(FLAG_MASKS[name] for name in flags.split(",") if name)) for _, flags in kinds]
    ranks = {ending: float(rank) for rank, ending in enumerate(sorted(models.ENDING_SENTENCES))}
    return [ranks[ending] for ending, _ in kinds]


def _upwards(keys: Floats, *, descending: bool) -> Floats:
    """Keys by which rows are sorted upwards, NaN last."""
    return np.where(np.isnan(keys), np.inf, -keys if descending else keys)


def _beyond(
    places: Ints,
    keys: Floats,
    cases: Ints,
    after: After,
    *,
    descending: bool,
) -> Ints:
    """Those of ``places`` that come after a case in their order."""
    own = _upwards(keys[places], descending=descending)
    last = _upwards(np.array([after.value]), descending=descending)[0]
    beyond: Ints = places[(own > last) | ((own == last) & (cases[places] > after.case))]
    return beyond


def _first(places: Ints, keys: Floats, count: int, *, descending: bool) -> Ints:
    """The first ``count`` of ``places`` in the order of their keys; NaN last, equal keys in their own order."""
    own = _upwards(keys[places] if places.size else keys[:0], descending=descending)
    if count < places.size:
        limit = np.partition(own, count - 1)[count - 1]
        below = np.flatnonzero(own < limit)
        near = np.concatenate([below, np.flatnonzero(own == limit)[: count - below.size]])
    else:
        near = np.arange(places.size)
    chosen: Ints = places[near[np.lexsort((near, own[near]))]]
    return chosen


def _numeric(infos: Sequence[ResultInfo], name: str) -> bool:
    info = result_of(infos, name)
    return info is not None and info.kind != "category"


def _require(study: Study, infos: Sequence[ResultInfo], parameter: str, name: str, others: Sequence[str] = ()) -> None:
    if name not in study.column_paths and not _numeric(infos, name):
        names = [*others, *study.column_paths, *(info.name for info in infos if info.kind != "category")]
        hint = did_you_mean(name, names)
        message = Sentence("is neither a parameter that varies nor a numeric result{hint}", hint=hint)
        raise refused(parameter, "unknown-name", message, name, allowed=listed(names))


def _kind(parameter: str, name: str, known: dict[str, str]) -> None:
    if name and name not in known:
        raise refused(
            parameter, "invalid-choice", "is not an ending" if parameter == "ending" else "is not a flag", name,
            allowed=listed(known) if known else "none",
        )  # fmt: skip


def _range(study: Study, infos: Sequence[ResultInfo], units: Mapping[str, str], text: str) -> Range:
    parts = _FORM.fullmatch(plain_signs(text))
    if parts is None:
        raise refused(
            "where", "invalid-text", "is not a range", text, allowed=joined(", ", ("NAME >= VALUE", Sentence(EXAMPLES)))
        )
    name, sign, value = parts.groups()
    _require(study, infos, "where", name)
    return Range(name, sign in (">=", "≥"), value_of(name, value, units[name], "where"))


def histogram(values: Floats, selected: Bools, bins: int = BINS) -> Histogram | None:
    """Numbers of cases in equal intervals of their range; None where no case has a number."""
    known = np.isfinite(values)
    if not known.any():
        return None
    low, high = float(values[known].min()), float(values[known].max())
    # Values closer than this are one number but for rounding, and edges between them would not differ.
    least = float(4 * bins * np.spacing(max(abs(low), abs(high))))
    if high - low <= least:
        low, high = low - max(0.5, least), high + max(0.5, least)
    every, edges = np.histogram(values[known], bins=bins, range=(low, high))
    # Equal intervals by their ends, not as a list of edges: that would be searched for each value.
    own, _ = np.histogram(values[known & selected], bins=bins, range=(edges[0], edges[-1]))
    return {"edges": edges.tolist(), "all": every.tolist(), "selected": own.tolist()}


def explored_json(study_id: str, found: Explored) -> Exploration:
    """The answer of the API."""
    study, units = found.study, found.plan.units
    return {
        "study": study_id,
        "known": found.known,
        "selected": found.count,
        "quantities": [
            {"name": name, "unit": units.get(name, "1"), "histogram": histogram(found.values[name], found.selected)}
            for name in found.plan.shown
        ],
        "cases": list(explored_rows(study, found)),
    }


def explored_rows(study: Study, found: Explored) -> Iterator[ExploredCase]:
    """The first rows in their order."""
    paths = set(study.column_paths)
    results = [name for name in found.plan.shown if name not in paths]
    regime = found.plan.regime
    for place in found.order.tolist():
        case = int(found.rows.cases[place])
        ending, flags = found.rows.kinds[found.rows.kind[place]]
        own = None if regime is None else regime.cell(float(found.rows.values[regime.name][place]))
        values = {name: float(found.values[name][place]) for name in results}
        yield {
            "case": case,
            "ending": ending,
            "flags": [name for name in flags.split(",") if name],
            "regime": None if own is None else str(own),
            "parameters": case_values(study, case),
            "results": {name: value if np.isfinite(value) else None for name, value in values.items()},
        }


def explored_csv(study: Study, found: Explored, reading: Reading) -> bytes:
    """The first rows in their order as a table, in a reader's units."""
    rows = list(explored_rows(study, found))
    names = ("case", "ending", "regime") if found.plan.regime is not None else ("case", "ending")
    columns = {name: [row[name] for row in rows] for name in names}  # type: ignore[literal-required]
    columns["flags"] = [" ".join(row["flags"]) for row in rows]
    for path in own_paths(study):
        columns[path] = [row["parameters"][path] for row in rows]
    for name in found.plan.shown:
        if name not in study.column_paths:
            columns[name] = [row["results"][name] for row in rows]
    return exports.read_table(columns, found.plan.units, reading.units)
