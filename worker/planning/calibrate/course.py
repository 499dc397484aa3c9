"""The course of a calibration: scan, fit, refits, curve, as one generator that asks for sets of cases."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.batches import normal, solved, total
from sprag_study.worker.planning.calibrate.candidates import candidates
from sprag_study.worker.planning.calibrate.data import Data, first_data, scaled_data
from sprag_study.worker.planning.calibrate.fit import Lanes, around, differences, fit, quadratic
from sprag_study.worker.planning.calibrate.plan import CURVES, RESTARTS, SEARCHES, STARTS, TRIALS
from sprag_study.worker.planning.calibrate.refits import Refits, drawn, refit
from sprag_study.worker.planning.goals.draws import Draws, exponential
from sprag_study.worker.planning.goals.linear import cholesky

if TYPE_CHECKING:
    from collections.abc import Generator

    from sprag_study.worker.planning.calibrate.plan import CalibratePlan
    from sprag_study.worker.planning.calibrate.space import Space

Floats = NDArray[np.float64]
T = TypeVar("T")

SCAN_PHASE, FIT_PHASE, REFITS_PHASE, CURVE_PHASE, ENDED = "scan", "fit", "intervals", "curve", "ended"
#: Distance of the differences that refits begin with, at most, in widths of the ranges.
_WIDE: Final = 0.05
#: Starts of the fit are farther from each other than this in at least one coordinate.
_DISTINCT: Final = 0.1
#: Largest scatter of a scan around the fit, in widths of the ranges; logarithm of the factor by which it reaches beyond
#: the scatter of the fit; shells of distances, from each of which it is fitted again; standard deviations of chi-square
#: that are improbable.
_WIDEST, _FARTHEST, _SHELLS, _IMPROBABLE = 0.5, 3.0, 3, 2.0
#: By how much (in squares of standard deviations) another set must be better than the fit to begin again from there.
_BEGIN_AGAIN: Final = 0.02
#: Times that standard deviations beside priors follow from the residuals at most, and the relative change that ends it.
_SCALED, _STEADY = 20, 1e-3
#: Streams of random numbers of each scan of the ranges and the searches that follow it.
_STREAMS: Final = 10


@dataclass(frozen=True)
class Request:
    """Sets of parameters, coordinates of shape (sets, parameters), to be run at the measured or other conditions."""

    phase: str
    places: Floats
    others: Floats | None = None


@dataclass
class State:
    """What is known so far.

    Attributes
    ----------
    phase : str
    round : int
        Rounds of the phase.
    data : Data
        With the weights that hold now.
    space : Space
        Of what is fitted.
    best : Lanes, optional
        The best fit so far, alone.
    leverage : array, shape (measured,)
    refits : Refits, optional
    others : array, shape (others, conditions)
        Conditions of the curve.
    curve, curves : arrays, shapes (others, results) and (refits, others, results)
        Modelled results there: of the fit, and of the refits.
    """

    data: Data
    space: Space
    phase: str = SCAN_PHASE
    round: int = 0
    best: Lanes | None = None
    refits: Refits | None = None
    others: Floats | None = None
    curve: Floats | None = None
    curves: Floats | None = None
    library: list[tuple[Floats, Floats]] = field(default_factory=list)


def course(plan: CalibratePlan, space: Space, state: State) -> Generator[Request, Floats, None]:
    """Everything that a calibration runs, in order; ``state`` is kept up to date."""
    state.best = yield from _anywhere(plan, space, state, SCAN_PHASE, Draws(plan.seed, 0))
    yield from _scaled(plan, state)
    if plan.refits:
        yield from _around_best(plan, state, 0)
        for attempt in range(1, 1 + RESTARTS):
            if not _improbable(plan, state) or _left(plan, state) < plan.scan + plan.least_fit:
                break
            another = yield from _anywhere(plan, space, state, FIT_PHASE, Draws(plan.seed, _STREAMS * attempt))
            yield from _taken(plan, state, another)
            yield from _around_best(plan, state, attempt)
    for attempt in range(2 if plan.refits else 0):
        yield from _refitted(plan, state, attempt)
        places, found = (np.concatenate(parts) for parts in zip(*state.library, strict=True))
        costs = state.data.costs(found)
        best = int(costs.argmin())
        if attempt or costs[best] > state.best.costs[0] - _BEGIN_AGAIN:
            break
        again = fit(state.data, places[best : best + 1], found[best : best + 1], plan.places_of(plan.fit_sets))
        state.best = _least((yield from _through(plan, state, FIT_PHASE, again)))
        yield from _scaled(plan, state)
    yield from _curves(plan, state)


def _anywhere(
    plan: CalibratePlan, space: Space, state: State, phase: str, draws: Draws
) -> Generator[Request, Floats, Lanes]:
    """Scan the ranges and fit from the best places: the best of these fits."""
    scan = space.scan(plan.scan, draws)
    modelled = yield from _run(plan, state, phase, scan)
    if len(plan.fitted) > len(plan.unknown):
        scan, modelled = _levelled(plan, space, state, scan, modelled)
    first = phase == SCAN_PHASE
    starts = _starts(scan, state.data.costs(modelled), STARTS if first else 2 * STARTS)
    sets = plan.fit_sets if first else min(plan.fit_sets, _left(plan, state))
    again = fit(state.data, scan[starts], modelled[starts], plan.places_of(sets))
    return _least((yield from _through(plan, state, FIT_PHASE, again)))


def _levelled(
    plan: CalibratePlan, space: Space, state: State, places: Floats, modelled: Floats
) -> tuple[Floats, Floats]:
    """Sets of parameters with the gains and offsets that fit each best, and their modelled values, without a case.

    They are those of a weighted regression of the measured on the modelled values, within their ranges.
    """
    places, read, place = places.copy(), modelled.copy(), len(plan.unknown)
    for one in plan.sensors:
        rows = np.flatnonzero(plan.places[1] == plan.results.index(one.result))
        gains, offsets = one.gain[0] < one.gain[1], one.offset[0] < one.offset[1]
        values = space.values(places)
        gain = values[:, place] if gains else np.full(len(values), one.gain[0])
        offset = values[:, place + gains] if offsets else np.full(len(values), one.offset[0])
        plain = (modelled[:, rows] - offset[:, None]) / gain[:, None]
        share = np.where(np.isnan(plain), 0.0, state.data.weights[rows] ** 2)
        share /= np.maximum(total(share), 1e-300)[:, None]
        known, measured = np.nan_to_num(plain), state.data.values[rows]
        centre, middle = total(share * known) * offsets, np.where(offsets, total(share * measured), offset)
        if gains:
            about = known - centre[:, None]
            slope = total(share * about * (measured - middle[:, None]))
            gain = np.clip(slope / np.maximum(total(share * about**2), 1e-300), *one.gain)
            places[:, place] = space.coordinates(place, gain)
        if offsets:
            places[:, place + gains] = space.coordinates(place + gains, np.clip(middle - gain * centre, *one.offset))
        values = space.values(places)
        gain = values[:, place] if gains else gain
        offset = values[:, place + gains] if offsets else offset
        read[:, rows] = gain[:, None] * plain + offset[:, None]
        place += gains + offsets
    state.library.append((places, read))
    return places, read


def _around_best(plan: CalibratePlan, state: State, attempt: int) -> Generator[Request, Floats, None]:
    """Search around the fit until that lowers its cost no more, and further where the cost is improbable."""
    for step in range(SEARCHES):
        assert state.best is not None
        before = float(state.best.costs[0])
        if attempt and _left(plan, state) < plan.scan + plan.fit_sets // 4:
            break
        yield from _searched(plan, state, Draws(plan.seed, _STREAMS * attempt + 2 + step))
        if state.best.costs[0] > before - _BEGIN_AGAIN and (attempt or not _improbable(plan, state)):
            break


def _left(plan: CalibratePlan, state: State) -> int:
    """Sets of parameters that are left if the refits and the curve are to have theirs."""
    run = sum(len(places) for places, _ in state.library)
    if plan.sensors:  # sets that differ by gains and offsets only are run once
        every = np.concatenate([places for places, _ in state.library])
        run = len(np.unique(every[:, : len(plan.unknown)], axis=0))
    return plan.sets_before_refits - run


def _taken(plan: CalibratePlan, state: State, found: Lanes) -> Generator[Request, Floats, None]:
    """Go on from a fit that is better than the best."""
    assert state.best is not None
    if found.costs[0] < state.best.costs[0]:
        state.best = found
        yield from _scaled(plan, state)


def _run(plan: CalibratePlan, state: State, phase: str, places: Floats) -> Generator[Request, Floats, Floats]:
    """Modelled values of sets of parameters, then those parameters that have a prior, shape (sets, measured)."""
    state.phase, state.round = phase, state.round + 1 if phase == state.phase else 1
    conditions, columns = plan.places
    rows = yield Request(phase, places)
    found = np.hstack([rows[:, conditions, columns], state.space.values(places)[:, plan.priors]])
    state.library.append((places, found))
    return found


def _through(
    plan: CalibratePlan, state: State, phase: str, steps: Generator[Floats, Floats, T]
) -> Generator[Request, Floats, T]:
    """Run what a fit asks for, to its end."""
    try:
        places = next(steps)
        while True:
            places = steps.send((yield from _run(plan, state, phase, places)))
    except StopIteration as end:
        result: T = end.value
        return result


def _starts(places: Floats, costs: Floats, most: int) -> list[int]:
    """The best places that are not close to each other, at most so many."""
    chosen: list[int] = []
    for index in np.argsort(costs, kind="stable").tolist():
        if all(np.abs(places[index] - places[other]).max() > _DISTINCT for other in chosen):
            chosen.append(index)
        if len(chosen) == most:
            break
    return chosen


def _least(lanes: Lanes) -> Lanes:
    best = int(lanes.costs.argmin())
    one = slice(best, best + 1)
    return Lanes(lanes.places[one], lanes.modelled[one], lanes.derivatives[one], lanes.costs[one], lanes.apart[one])


def _scaled(plan: CalibratePlan, state: State) -> Generator[Request, Floats, None]:
    """Take standard deviations that are not given from the residuals; where that changes the fit, fit again."""
    assert state.best is not None
    priors, alone = bool(len(plan.priors)), len(plan.measured) == 1 and plan.loss == "linear"
    rounds = 0 if plan.known_sigma else 3 if not priors and not alone else _SCALED if priors else 1
    for number in range(rounds):
        scaled, before = scaled_data(plan, state.best.modelled[0]), state.data.weights
        if priors and number and np.all(np.abs(scaled.weights - before) <= _STEADY * before):
            break
        state.data = scaled
        if rounds > 1:
            again = fit(state.data, state.best.places, state.best.modelled, plan.places_of(plan.fit_sets))
            state.best = _least((yield from _through(plan, state, FIT_PHASE, again)))
    data = first_data(plan) if plan.known_sigma else state.data
    state.data = data.without(np.isnan(state.best.modelled[0]))
    state.best.costs = state.data.costs(state.best.modelled)


def _searched(plan: CalibratePlan, state: State, draws: Draws) -> Generator[Request, Floats, None]:
    """Scan around the fit, farthest where it is least determined, and fit again from the best place at each distance.

    On a rough surface the first fit often ends in a side valley.
    """
    best = state.best
    assert best is not None
    p = len(plan.fitted)
    curvature = quadratic(state.data, best.modelled, best.derivatives)[1][0]
    factor = cholesky(curvature + np.eye(p) / _WIDEST**2)
    far = draws.uniforms(plan.scan)
    steps = draws.normals(plan.scan, p) * exponential(_FARTHEST * far)[:, None]
    for j in reversed(range(p)):  # the inverse of the factor's transpose gives them the scatter of the fit
        steps[:, j] /= factor[j, j]
        steps[:, :j] -= steps[:, j : j + 1] * factor[j, :j]
    places = np.clip(best.places + steps, 0.0, 1.0)
    modelled = yield from _run(plan, state, FIT_PHASE, places)
    order = np.argsort(state.data.costs(modelled), kind="stable")
    shells = [order[np.floor(_SHELLS * far[order]) == shell][:1] for shell in range(_SHELLS)]
    chosen = np.concatenate(shells)
    again = fit(state.data, places[chosen], modelled[chosen], plan.places_of(plan.fit_sets // 4))
    yield from _taken(plan, state, _least((yield from _through(plan, state, FIT_PHASE, again))))


def _improbable(plan: CalibratePlan, state: State) -> bool:
    """Whether the residuals are larger than given standard deviations explain."""
    assert state.best is not None
    freedom = max(plan.freedom, 1)
    return plan.known_sigma and bool(2.0 * state.best.costs[0] > freedom + _IMPROBABLE * np.sqrt(2.0 * freedom))


def leverages(data: Data, best: Lanes) -> Floats:
    """Diagonal of the hat matrix of a fit, shape (measured,)."""
    weights = data.weights
    scaled = best.derivatives[0] * weights[:, None]
    square = normal(best.derivatives, (weights * weights)[None, :])
    hold = np.eye(scaled.shape[1]) * 1e-12 * np.maximum(np.diagonal(square[0]).max(), 1e-300)
    inner = solved(np.repeat(square + hold, len(scaled), axis=0), scaled)
    return np.clip(total(scaled * inner), 0.0, 1.0)


def _refitted(plan: CalibratePlan, state: State, attempt: int) -> Generator[Request, Floats, None]:
    best = state.best
    assert best is not None
    values = drawn(
        state.data, np.nan_to_num(best.modelled[0]), leverages(state.data, best), plan.refits, plan.scales,
        plan.places[1], Draws(plan.seed, 1),
    )  # fmt: skip
    wide = yield from _widely(plan, state, best)
    sets = tuple(np.concatenate(parts) for parts in zip(*state.library, strict=True))
    steps = refit(state.data, values, (sets[0], sets[1]), wide, TRIALS if attempt == 0 else TRIALS // 2)
    state.refits = yield from _through(plan, state, REFITS_PHASE, steps)


def _widely(plan: CalibratePlan, state: State, best: Lanes) -> Generator[Request, Floats, Lanes]:
    """The fit with differences over the distance that the data can tell, which is how far refits go."""
    curvature = quadratic(state.data, best.modelled, best.derivatives)[1]
    apart = np.sqrt(1.0 / np.maximum(np.diagonal(curvature, axis1=1, axis2=2), 1e-300))
    apart = np.minimum(np.maximum(apart, best.apart), _WIDE)
    beside = yield from _run(plan, state, REFITS_PHASE, around(best.places, apart))
    return replace(best, derivatives=differences(state.data, best.places, best.modelled, apart, beside)[0])


def _curves(plan: CalibratePlan, state: State) -> Generator[Request, Floats, None]:
    """Run the fit and the refits at conditions between and around the measured ones."""
    assert state.best is not None
    others = candidates(plan)
    state.others = others
    if len(others):
        places = state.best.places
        if state.refits is not None:
            places = np.concatenate([places, state.refits.places[:CURVES]])
        state.phase, state.round = CURVE_PHASE, 1
        rows = yield Request(CURVE_PHASE, places, others)
        state.curve, state.curves = rows[0], rows[1:]
    state.phase = ENDED
