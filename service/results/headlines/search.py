"""The answer of a search: its best design and what that was before, the reserve of each limit, whether it converged."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Name, name_of
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, plural, term
from sprag_study.service.results.fresh import worst_point
from sprag_study.service.results.fronts import history, worst_of, worst_places
from sprag_study.service.results.headlines.headline import (
    DIMENSION_DIGITS,
    MOST,
    NOTHING,
    Headline,
    KeyNumber,
    Trace,
    amount,
    digits,
    trace_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.results.fresh import Fresh, Interval
    from sprag_study.service.results.fronts import Designs
    from sprag_study.worker.models.presentation import Better
    from sprag_study.worker.planning.goals import Goal, Limit

#: Relative change of the best value that counts as an improvement.
_BETTER: Final = 1e-3
#: Share of the generations without an improvement after which a search has converged, and the least number of them.
_WITHOUT, _LEAST = 0.15, 3
#: Most operating points that are named.
_LISTED: Final = 4
#: Reserves below this share are none.
_NONE: Final = 0.005


def search_headline(found: Designs, *, over: bool) -> Headline:
    """The answer of a search; ``over``: it runs no further."""
    if not len(found.numbers):
        return Headline()
    best, goals = int(found.order[0]), found.plan.best
    return Headline(
        sentence=tuple(filter(None, _sentences(found, best, over=over))),
        numbers=tuple(_goal(found, best, place) for place in range(len(goals)))[:MOST],
        dimensions=tuple(_dimensions(found, best)),
        limits=tuple(_limit(found, best, limit) for limit in found.plan.subject_to),
        trace=_trace(found),
        case=int(found.front.cases[best, 0]),
    )


def _sentences(found: Designs, best: int, *, over: bool) -> Iterator[Phrase]:
    """The best value, also with fresh drives; of one goal whether the search has converged, and which limits bind."""
    yield _best(found, best)
    for fresh in found.fresh:
        if fresh.design == found.numbers[best]:
            yield _with_fresh(found, fresh)
            yield NOTHING if fresh.feasible or not found.front.feasible[best] else _OUTSIDE
    if found.front.feasible[best] and len(found.plan.best) == 1:
        yield converged(found, over=over)
        yield _binding(found, best)


def _best(found: Designs, best: int) -> Phrase:
    """The value of the best design, or why none is within the limits."""
    count, goals = len(found.numbers), found.plan.best
    values = joined(
        ", ",
        (
            joined(" ", (Name(goal.name, within=True), _amount(found, goal.name, value)))
            for goal, value in zip(goals, found.front.goals[best].tolist(), strict=True)
            if np.isfinite(value)
        ),
    )
    if not found.front.feasible[best]:
        return plural("The {count} design is outside a limit.", "None of {count} designs is within all limits.", count)
    if not values:
        feasible = int(np.count_nonzero(found.front.feasible))
        return plural("{count} design is within all limits.", "{count} designs are within all limits.", feasible)
    first = int(np.count_nonzero(found.front.feasible & (found.front.rank == 0)))
    if len(goals) > 1 and first > 1:
        return plural(
            "{count} design is beaten by no other in every goal, for instance: {values}.",
            "{count} designs are beaten by no other in every goal, for instance: {values}.",
            first, values=values,
        )  # fmt: skip
    return plural("The only design: {values}.", "The best of {count} designs: {values}.", count, values=values)


#: What is said of a best design that fresh drives put outside a limit.
_OUTSIDE: Final = Phrase(
    "With them it is outside a limit: the search took the design that its own drives favour. More drives or a stricter "
    "limit leave it a reserve."
)


def _with_fresh(found: Designs, fresh: Fresh) -> Phrase:
    """What the best design is worth with drives that the search has not seen, with the intervals."""
    items = {item.name: item for item in found.plan.items}
    values = joined("; ", filter(None, (_fresh(found, items[name], own) for name, own in fresh.results.items())))
    return plural(
        "With {count} drive that the search has not seen: {values}.",
        "With {count} drives that the search has not seen: {values}.",
        fresh.drives, values=values or Phrase("no result"),
    )  # fmt: skip


def _fresh(found: Designs, item: Goal | Limit, own: Interval) -> Phrase:
    """One value with its interval, at the operating point that is worst."""
    place = worst_point(item, own.values)
    ends = (float(part[place]) for part in (own.values, own.low, own.high))
    value, low, high = (
        (Amount(100.0 * end, "%", 3) if item.conditions else _amount(found, item.name, end)) for end in ends
    )
    if not np.isfinite(own.values[place]):
        return NOTHING
    name = Name(item.name, within=True)
    if not (np.isfinite(own.low[place]) and np.isfinite(own.high[place])):
        return joined(" ", (name, value))
    return Phrase("{name} {value} ({low} to {high})", name=name, value=value, low=low, high=high)


def _amount(found: Designs, name: str, value: float) -> Amount:
    return amount(found.infos[name], value)


def _goal(found: Designs, best: int, place: int) -> KeyNumber:
    name = found.plan.best[place].name
    info, value = found.infos[name], float(found.front.goals[best, place])
    known = value if np.isfinite(value) else None
    unit, case = info.unit, int(found.front.cases[best, 0])
    better: Better = "larger" if found.plan.best[place].max else "smaller"
    return KeyNumber(
        name, known, unit, digits(value), where=_points(found, found.plan.best[place]), case=case, better=better
    )


def _points(found: Designs, item: Goal | Limit) -> Phrase:
    """Over how many operating points a goal, or a limit that does not ask each, is taken."""
    places = item.at or range(len(found.plan.at))
    count, over = len(places), item.over or found.plan.over
    if len(found.plan.at) == 1:
        return NOTHING
    if count == 1:
        return Phrase("at {place}", place=_point(found, places[0]))
    if over == "mean":
        taken = plural("mean of {count} operating point", "mean of {count} operating points", count)
    elif over == "best":
        taken = plural("best of {count} operating point", "best of {count} operating points", count)
    else:
        taken = plural("worst of {count} operating point", "worst of {count} operating points", count)
    listed = joined("; ", (_point(found, place) for place in places)) if count <= _LISTED else NOTHING
    return joined(": ", filter(None, (taken, listed)))


def _point(found: Designs, place: int) -> Phrase:
    """An operating point: its name, or its parameters with their values."""
    if found.plan.names and found.plan.names[place]:
        return joined("", [found.plan.names[place]])
    values = found.plan.at[place].items()
    return joined(
        ", ",
        (
            Phrase("{name} = {value}", name=Name(path, within=True), value=Amount(value, unit_of(found.study, path), 4))
            for path, value in values
        ),
    )


def _dimensions(found: Designs, best: int) -> Iterator[KeyNumber]:
    """The parameters of the best design and those derived from them, each with its value in the base."""
    study, case = found.study, int(found.front.cases[best, 0])
    values = {one.paths[0]: float(found.front.variables[best, place]) for place, one in enumerate(found.plan.vary)}
    follows = {path: value for path, value in study.case_parameters(case).items() if path in study.derive}
    values |= {path: value for path, value in follows.items() if not math.isclose(value, study.base[path])}
    for path, value in values.items():
        unit, before = unit_of(study, path), study.base.get(path)
        note = NOTHING if before is None else Phrase("{value} before", value=Amount(before, unit, DIMENSION_DIGITS))
        yield KeyNumber(path, name_of(value, unit) or value, unit, DIMENSION_DIGITS, note=note, case=case)


def _limit(found: Designs, best: int, limit: Limit) -> KeyNumber:
    """A limit with the value that is nearest to it at any operating point, and what is left to it."""
    info, values = found.infos[limit.name], found.values[limit.name][best]
    counted = limit.judged(values[np.newaxis])[0, limit.counted(len(values))]
    case = int(found.front.cases[best, 0])
    cell = info.cell(limit.value)
    if info.kind != "real":
        met = bool(limit.holds(counted).all())
        own = info.cell(float(counted[0]))
        text = term(str(cell)) if info.kind == "category" else Amount(limit.value, info.unit)
        note = Phrase("as required") if met else Phrase("required: {value}", value=text)
        return KeyNumber(limit.name, str(term(own)) if isinstance(own, str) else own, info.unit, note=note, case=case)
    place = int(worst_places(limit, values[np.newaxis])[0])
    value, reserve = float(worst_of(limit, values[np.newaxis])[0]), reserve_of(found, best, limit)
    assert reserve is not None
    unit, bound = info.unit, _amount(found, limit.name, limit.value)
    note = _reserve(limit, bound, reserve)
    where = Phrase("at {place}", place=_point(found, place)) if len(found.plan.at) > 1 else NOTHING
    if limit.over:
        where = _points(found, limit)
    return KeyNumber(limit.name, value, unit, digits(value), where=where, note=note, case=case)


def _reserve(limit: Limit, bound: Amount, share: float) -> Phrase:
    if limit.kind == "is":
        return Phrase("as required: {value}", value=bound) if share >= 0.0 else Phrase("required: {value}", value=bound)
    texts = {
        "at_least": (
            Phrase("at least {value}: {share} % in reserve", value=bound, share=_percent(share)),
            Phrase("at least {value}: at the limit", value=bound),
            Phrase("at least {value}: missed by {share} %", value=bound, share=_percent(-share)),
        ),
        "at_most": (
            Phrase("at most {value}: {share} % in reserve", value=bound, share=_percent(share)),
            Phrase("at most {value}: at the limit", value=bound),
            Phrase("at most {value}: exceeded by {share} %", value=bound, share=_percent(-share)),
        ),
    }
    left, at, beyond = texts[limit.kind]
    return beyond if share < 0.0 else at if share < _NONE else left


def _percent(share: float) -> Amount:
    return Amount(100.0 * share, "1", 2)


def _bests(found: Designs) -> list[float]:
    """The best value of the first goal that was known before each round, from the first that has one."""
    known = [one.get("best") or [None] for one in history(found.rounds)]
    return [float(values[0]) for values in known if values and values[0] is not None]


def _generations(found: Designs) -> dict[int, float]:
    """The best value of the first goal after each generation: as the search knew it, without polish and finish."""
    bests: dict[int, float] = {}
    for one in history(found.rounds):
        values = one.get("best") or [None]
        if one["generation"] and values[0] is not None:
            bests.setdefault(one["generation"], float(values[0]))
    return bests


def unimproved(found: Designs) -> int:
    """How many of the last generations bettered the best value by less than 0.1 % together."""
    bests = _generations(found)
    if not bests:
        return 0
    last = max(bests)
    worse = [number for number, value in bests.items() if abs(value - bests[last]) > _BETTER * abs(bests[last])]
    return last - min(number for number in bests if number > max(worse, default=0))


def converged(found: Designs, *, over: bool) -> Phrase:
    """Whether more generations would help, of a search for one goal; ``over``: it runs no further."""
    bests = _generations(found)
    if len(bests) < _LEAST:
        return NOTHING
    if over and found.plan.least_gain and max(bests) < found.plan.generations and _ended(found):
        return Phrase(
            "The search has converged after {generations} of at most {most} generations: starting anew bettered the "
            "goal by at most {share} %.",
            generations=str(max(bests)), most=str(found.plan.generations), share=_percent(found.plan.least_gain),
        )  # fmt: skip
    same = unimproved(found)
    if same >= max(_LEAST, round(_WITHOUT * found.plan.generations)) and _after(found, bests) <= _BETTER:
        return plural(
            "The search has converged: the last generation bettered the goal by less than {share} %.",
            "The search has converged: the last {count} generations bettered the goal by less than {share} %.",
            same, share=_percent(_BETTER),
        )  # fmt: skip
    if not over:
        return NOTHING
    if found.rounds[-1].summary.get("finish"):
        return Phrase(
            "The search has not converged: its best design was brought to the optimum beside it, and more generations "
            "may come to another one."
        )
    return Phrase(
        "The search has not converged: its best value has not stood still long enough, and more generations may better "
        "it."
    )


def _after(found: Designs, bests: dict[int, float]) -> float:
    """The share by which the finish has bettered what the generations came to; 0 without one, or for the worse."""
    last = found.rounds[-1].summary
    if not last.get("finish") or last["best"][0] is None:
        return 0.0
    before, sign = bests[max(bests)], -1.0 if found.plan.best[0].max else 1.0
    return max(0.0, sign * (before - float(last["best"][0]))) / max(abs(before), 1e-300)


def _ended(found: Designs) -> bool:
    """Whether the search itself came to its end, and was not cancelled."""
    return any(record.summary.get("phase") == "ended" for record in found.rounds)


def _binding(found: Designs, best: int) -> Phrase:
    """Which limits bind, or the one that is nearest to it."""
    reserves = [
        (share, limit)
        for limit in found.plan.subject_to
        if limit.kind != "is" and (share := reserve_of(found, best, limit)) is not None
    ]
    if not reserves:
        return NOTHING
    bound = joined(", ", (_named(limit) for share, limit in reserves if share < _NONE))
    if bound:
        return Phrase("At the limit: {names}.", names=bound)
    share, limit = min(reserves, key=lambda one: one[0])
    return Phrase(
        "No limit binds: the nearest is that of {name}, with {share} % in reserve.",
        name=_named(limit), share=_percent(share),
    )  # fmt: skip


def _named(limit: Limit) -> Phrase | Name:
    """What a limit is about, within a sentence."""
    return Phrase("the yield") if limit.conditions else Name(limit.name, within=True)


def reserve_of(found: Designs, best: int, limit: Limit) -> float | None:
    """What is left to a limit at the worst of its points, as a share of it; None for a category or a count."""
    if found.infos[limit.name].kind != "real":
        return None
    off = float(worst_of(limit, found.values[limit.name][best][np.newaxis])[0]) - limit.value
    return {"is": limit.within - abs(off), "at_least": off, "at_most": -off}[limit.kind] / limit.scale


def _trace(found: Designs) -> Trace | None:
    bests = np.array(_bests(found))
    return trace_of(range(len(bests)), bests, len(bests) - 1)
