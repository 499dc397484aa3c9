"""What the results of a study depend on: main effects of every axis, and shares of the variance (Sobol indices).

First-order index of an axis: the share of a result's variance that would vanish if only this axis were fixed. Total
index: the share that would remain if everything but this axis were fixed; it includes interactions. Second-order index
of two axes: the share by their interaction alone. (Saltelli et al., Computer Physics Communications 181 (2010) 259;
Tarantola et al., Reliability Engineering 91 (2006) 717.) Of trajectories, elementary effects instead (Morris,
Technometrics 33 (1991) 161; Campolongo et al., Environmental Modelling & Software 22 (2007) 1509).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from sprag_study.sentences import Sentence
from sprag_study.service.answers import filled
from sprag_study.service.answers.results import AxisEffect, PairEffect, ResultSensitivity
from sprag_study.service.faults import Fault, SelectionError, refused
from sprag_study.service.json_text import numbers
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, plural
from sprag_study.service.results.curves import Fetch
from sprag_study.service.results.regimes import counted, kind_columns, kinds_of, left_out
from sprag_study.service.results.selection import axis_name, numeric_results
from sprag_study.service.results.sensitivity_indices import (
    LEAST_CASES,
    Indices,
    Pair,
    factorial_table,
    going_together,
    grid_indices,
    is_factorial,
    is_sample,
    morris_indices,
    nothing,
    saltelli_indices,
    sample_indices,
    scattered,
    why_no_shares,
)
from sprag_study.service.results.tolerances.batch import nominal_only
from sprag_study.service.spec.draws.unit import LEVELS, cases_of
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Bools, Floats
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Axis, Study

#: Method of the indices: exact from a full grid, from the Saltelli design, elementary effects of trajectories, from a
#: sample, or none.
Method = Literal["grid", "saltelli", "morris", "rbd-fast", "none"]
#: Most cases that are used; more take seconds and add nothing.
MOST_CASES: Final = 1_000_000
#: Groups of values of an axis without a grid, for its main effect.
BINS: Final = 10


@dataclass(frozen=True, slots=True)
class Effect:
    """The effect of one axis on one result.

    Attributes
    ----------
    values, means : arrays of one length
        Values of the axis (SI), or middles of groups of them, and the mean of the result there; NaN for none.
    indices : Indices
    """

    paths: tuple[str, ...]
    unit: str
    values: Floats
    means: Floats
    indices: Indices

    def to_json(self) -> AxisEffect:
        """The same as JSON data."""
        given = {"paths": list(self.paths), "unit": self.unit}
        return filled(AxisEffect, self.indices, **given, values=numbers(self.values), means=numbers(self.means))


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """Effects of all varied axes on one result, over the ``cases`` that have it; ``missing`` cases do not."""

    info: ResultInfo
    method: Method
    cases: int
    missing: int
    mean: float | None
    variance: float | None
    effects: tuple[Effect, ...]
    pairs: tuple[Pair, ...]
    notes: tuple[str, ...]

    def to_json(self) -> ResultSensitivity:
        """The same as JSON data."""
        info, effects = self.info, [effect.to_json() for effect in self.effects]
        pairs = []
        for pair in self.pairs:
            first, second = (list(self.effects[at].paths) for at in (pair.first, pair.second))
            pairs.append(PairEffect(paths=first, other_paths=second, second_order=pair.index, error=pair.error))
        given = {"result": info.name, "unit": info.unit, "description": info.description}
        return filled(ResultSensitivity, self, **given, effects=effects, pairs=pairs)


def weight(effect: Effect) -> float:
    """How much an axis matters: its total index, its mean elementary effect, or how far the means along it reach."""
    own = effect.indices
    known = next((value for value in (own.total, own.mu_star, own.first_order) if value is not None), None)
    means = effect.means[np.isfinite(effect.means)]
    return known if known is not None else float(np.ptp(means)) if means.size else 0.0


def in_order(item: Sensitivity) -> list[Effect]:
    """The effects on a result, the largest first."""
    return sorted(item.effects, key=weight, reverse=True)


def per_tenth(effect: Effect, value: float) -> float | None:
    """By how much the mean of the result changes for 10 % more of the parameter than ``value``; None beyond its axis.

    It is the slope between the two neighbours of the value among the computed ones.
    """
    known = np.isfinite(effect.means)
    x, y = effect.values[known], effect.means[known]
    if x.size < 2 or not x[0] <= value <= x[-1] or value == 0.0:
        return None
    below = max(int(np.searchsorted(x, value, side="left")) - 1, 0)
    above = min(max(int(np.searchsorted(x, value, side="right")), below + 1), x.size - 1)
    return float((y[above] - y[below]) / (x[above] - x[below])) * 0.1 * value


def sensitivity(study: Study, spec: Mapping[str, Any], names: Sequence[str], fetch: Fetch) -> list[Sensitivity]:
    """Effects of the axes of ``study`` on the results ``names``.

    Of a study with tolerances those of the nominal drive. ``spec`` is the user's own: it shows whether the cases are a
    design for indices. Raises SelectionError for an unknown result, a study in which nothing varies, or one that is too
    large.
    """
    study, fetch = nominal_only(study, fetch)
    infos = models.study_results(study)
    results = numeric_results(infos, "y", names)
    varying = [axis for axis in study.axes if np.any(axis.array != axis.array[0])]
    if not varying:
        raise refused("y", "nothing-varies", "nothing varies in this study")
    if study.cases > MOST_CASES:
        allowed = Sentence("<= {count} cases", count=MOST_CASES)
        raise SelectionError([Fault(None, "too-many", "the study is too large for it", study.cases, allowed)])
    regime = models.regime_info(infos)
    kinds = kind_columns(regime)
    columns = fetch(np.arange(study.cases, dtype=np.int64), list(dict.fromkeys([*names, *kinds])))
    regimes, _ = kinds_of(columns.values, regime)
    sample = _design(study, spec)
    usable = models.usable_each(study.model, columns.endings, columns.flags, names)
    return [
        _of_result(study, varying, info, columns.values[info.name], usable[info.name], regimes, sample)
        for info in results
    ]


def _design(study: Study, spec: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The sample whose cases are those of the study, where it is a design for indices; None otherwise."""
    axes = spec.get("axes")
    if not (isinstance(axes, list) and len(axes) == 1 and isinstance(axes[0], Mapping)) or spec.get("exclude"):
        return None
    sample = axes[0]
    if sample.get("sample") not in {"saltelli", "morris"}:
        return None
    second = sample.get("second_order", False)
    cases = cases_of(sample["sample"], sample.get("count", 0), len(study.axes), second_order=second)
    return sample if cases == study.cases else None


def _settled_only(y: Floats, usable: Bools, regimes: list[str | None] | None, notes: list[str]) -> Floats:
    """The result without unsettled cases; remarks about regimes are added to ``notes``."""
    unsettled = ~usable & np.isfinite(y)
    if unsettled.any():
        notes.append(left_out(int(unsettled.sum())))
    y = np.where(unsettled, np.nan, y)
    if regimes is None:
        return y
    names = np.array([name or "" for name in regimes])
    counts = Counter(names[np.isfinite(y)].tolist())
    if len(counts) > 1:
        text = counted(dict(counts.most_common()))
        notes.append(
            Phrase(
                "cases of different regimes are combined ({regimes}): part of the variance lies between regimes",
                regimes=text,
            )
        )
    return y


def _of_result(
    study: Study,
    varying: list[Axis],
    info: ResultInfo,
    y: Floats,
    usable: Bools,
    regimes: list[str | None] | None,
    sample: Mapping[str, Any] | None,
) -> Sensitivity:
    kinds: list[str] = []
    without = int((~np.isfinite(y)).sum())
    y = _settled_only(y, usable, regimes, kinds)
    known = np.isfinite(y)
    cases, missing = int(known.sum()), int((~known).sum())
    values = y[known]
    mean = float(values.mean()) if cases else None
    variance = float(values.var()) if cases else None
    positions = [study.axes.index(axis) for axis in varying]
    every = study.indices(range(study.cases))
    columns = np.stack([axis.array[every[at]] for axis, at in zip(varying, positions, strict=True)], axis=1)
    notes: list[str] = []
    method: Method
    if without:
        notes.append(
            plural(
                "{count} case without this result is left out",
                "{count} cases without this result are left out",
                without,
            )
        )
    if not cases:
        notes = [Phrase("no case has this result")]
    method, indices, pairs = (
        _shares(study, varying, y, columns, sample, notes) if cases else ("none", *nothing(len(varying)))
    )
    if mean is not None and variance is not None and variance <= (1e-13 * mean) ** 2:
        notes.append(Phrase("the result is the same in every case"))
        indices, pairs = nothing(len(varying))
    drawn = sample is not None
    effects = tuple(
        Effect(axis.paths, unit_of(study, axis.paths[0]), *_main_effect(axis, column[known], values, drawn=drawn), own)
        for axis, column, own in zip(varying, columns.T, indices, strict=True)
    )
    remarks = (*kinds, *notes)
    return Sensitivity(info, method, cases, missing, mean, variance, effects, tuple(pairs), remarks)


def _shares(
    study: Study,
    varying: list[Axis],
    y: Floats,
    columns: Floats,
    sample: Mapping[str, Any] | None,
    notes: list[str],
) -> tuple[Method, list[Indices], list[Pair]]:
    """The indices by the method that the cases of the study allow; why there are none is noted."""
    known = np.isfinite(y)
    whole = bool(known.all())
    positions = [study.axes.index(axis) for axis in varying]
    method: Method = "none"
    indices, pairs = nothing(len(varying))
    if study.combine == "grid" and whole:
        method = "grid"
        indices, pairs = grid_indices(y.reshape(study.shape), positions)
    elif sample is not None and len(varying) == len(study.axes):
        method = sample["sample"]
        if method == "morris":
            indices, pairs = morris_indices(columns, y, LEVELS, notes)
        else:
            second = sample.get("second_order", False)
            indices, pairs = saltelli_indices(y, sample["count"], len(varying), notes, second_order=second)
    elif study.combine == "zip" and (scarce := _too_few(columns[known])):
        notes.append(scarce)
    elif study.combine == "zip" and is_sample(columns[known]):
        method = "rbd-fast"
        indices, pairs = sample_indices(columns[known], y[known], notes)
    elif whole and is_factorial(columns):
        method = "grid"
        indices, pairs = grid_indices(factorial_table(columns, y), list(range(len(varying))))
    else:
        notes.append(why_no_shares(columns, known, [axis_name(study, axis.paths[0]) for axis in varying]))
    return method, indices, pairs


def _main_effect(axis: Axis, column: Floats, y: Floats, *, drawn: bool) -> tuple[Floats, Floats]:
    """Mean of the result at each value of the axis, or over groups of about equally many values where it has many.

    Values that were ``drawn`` are always grouped. The cases of one value stay together: a group with only some of them
    would also reflect other axes.
    """
    values = np.unique(axis.array)
    if values.size > 2 * BINS and (drawn or column.size < 4 * values.size):
        there, count = np.unique(column, return_counts=True)
        ends = np.cumsum(count)
        bounds = [int(ends[part[-1]]) for part in np.array_split(np.arange(there.size), BINS) if part.size]
        parts = np.split(np.argsort(column, kind="stable"), bounds[:-1]) if bounds else []
        return np.array([column[part].mean() for part in parts]), np.array([y[part].mean() for part in parts])
    group = np.searchsorted(values, column)
    count = np.bincount(group, minlength=values.size)
    total = np.bincount(group, weights=y, minlength=values.size)
    with np.errstate(invalid="ignore"):
        return values, np.asarray(np.where(count > 0, total / np.maximum(count, 1), np.nan), dtype=np.float64)


def _too_few(x: Floats) -> str:
    """The sentence about too few cases of a sample, shape (cases, axes); "" where they suffice or are not a sample."""
    few = len(x) < LEAST_CASES and going_together(x) is None and all(scattered(column) for column in x.T)
    needed = Phrase("too few cases for indices: {count}, and {least} are needed", count=len(x), least=LEAST_CASES)
    return needed if few else ""
